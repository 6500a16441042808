# How far one prediction depends on weights, mesh and start. Not part of the study: the tables are
# copied to reports/, where the report finds them, and no rule makes them there. Otherwise a fresh
# checkout would solve everything again.


rule change_tracking:
    input:
        tracked="results/tracking/{participant}/{plane}_quaternion.npz",
    output:
        tracked="results/sensitivity/{participant}/{case}_{plane}.npz",
    log:
        python="results/logs/change_tracking/{participant}_{case}_{plane}.python.log",
    benchmark:
        "results/benchmarks/change_tracking/{participant}_{case}_{plane}.jsonl"
    wildcard_constraints:
        plane="|".join(SENSITIVITY.planes),
    params:
        code=code_of("change_tracking"),
        case=lambda wildcards: asdict(CASES[wildcards.case]),
        random_turn_deg=SENSITIVITY.random_turn_deg,
    threads: 1
    message:
        "Start of case {wildcards.case}: participant {wildcards.participant}, {wildcards.plane}"
    script:
        "../scripts/change_tracking.py"


use rule solve_prediction as solve_case with:
    input:
        unpack(case_inputs),
        participant=PARTICIPANT_FILE,
        model="results/models/{participant}.json",
        thorax="results/models/{participant}_thorax.json",
        geometry="results/muscle_geometry/{participant}/quaternion.npz",
        equations="results/equations/quaternion",
        channels="config/emg/channels.csv",
    output:
        solution="results/sensitivity/{participant}/{condition}/{case}.npz",
        summary="results/sensitivity/{participant}/{condition}/{case}.summary.json",
    log:
        solver="results/logs/solve_case/{participant}_{condition}_{case}.solver.log",
        python="results/logs/solve_case/{participant}_{condition}_{case}.python.log",
    benchmark:
        "results/benchmarks/solve_case/{participant}_{condition}_{case}.jsonl"
    params:
        # Of its own: elevations are joined in this order.
        planes=SENSITIVITY.planes,
        time_step_s=case_time_step,
        weights=case_weights,
        condition=case_condition,
    message:
        "Prediction {wildcards.condition} of participant {wildcards.participant}, case"
        " {wildcards.case}"


rule tabulate_sensitivity:
    input:
        solutions=case_results("results/sensitivity/{participant}/{condition}/{case}.npz"),
        summaries=case_results("results/sensitivity/{participant}/{condition}/{case}.summary.json"),
    output:
        table="results/sensitivity/sensitivity.csv",
    log:
        python="results/logs/tabulate_sensitivity.python.log",
    benchmark:
        "results/benchmarks/tabulate_sensitivity.jsonl"
    params:
        code=code_of("tabulate_sensitivity"),
        cases=[asdict(case) for case in CASES.values()],
    threads: 1
    message:
        "What weights, mesh and start change: table"
    script:
        "../scripts/tabulate_sensitivity.py"


rule sensitivity:
    input:
        table=rules.tabulate_sensitivity.output.table,
    log:
        python="results/logs/sensitivity.log",
    localrule: True
    message:
        "What weights, mesh and start change: reports/sensitivity.csv"
    shell:
        "cp {input.table} reports/sensitivity.csv 2> {log.python}"


rule solve_static_postures:
    input:
        unpack(healthy_scalers),
        participant=PARTICIPANT_FILE,
        model="results/models/{participant}.json",
        thorax="results/models/{participant}_thorax.json",
        geometry="results/muscle_geometry/{participant}/quaternion.npz",
        equations="results/equations/quaternion",
        channels="config/emg/channels.csv",
        tracked=tracked_elevations,
    output:
        table="results/sensitivity/{participant}_postures.csv",
    log:
        python="results/logs/solve_static_postures/{participant}.python.log",
    benchmark:
        "results/benchmarks/solve_static_postures/{participant}.jsonl"
    params:
        code=code_of("solve_static_postures"),
        weights=lookup(within=config, dpath="weights/prediction"),
        w_gh=lookup(within=config, dpath="prediction/conditions/healthy/w_gh"),
    threads: 1
    message:
        "Static postures of participant {wildcards.participant}"
    script:
        "../scripts/solve_static_postures.py"


rule static_postures:
    input:
        tables=expand(
            "results/sensitivity/{participant}_postures.csv",
            participant=config["participants"],
        ),
    log:
        python="results/logs/static_postures.log",
    localrule: True
    params:
        # No output: no rule makes tables in reports/.
        table="reports/static_postures.csv",
    message:
        "Static postures of all participants: reports/static_postures.csv"
    run:
        # As text, so that no digit changes; by name, because columns are those of own planes.
        tables = [pd.read_csv(path, dtype=str, keep_default_na=False) for path in input.tables]
        pd.concat(tables).fillna("").to_csv(params.table, index=False)


rule hold_girdle:
    input:
        unpack(variant_inputs),
        participant=PARTICIPANT_FILE,
        thorax="results/models/{participant}_thorax.json",
        equations="results/equations/quaternion",
        channels="config/emg/channels.csv",
        tracked=tracked_elevations,
        solution=prediction_of,
    output:
        table="results/sensitivity/held/{variant}/{participant}/{condition}.csv",
    log:
        python="results/logs/hold_girdle/{variant}_{participant}_{condition}.python.log",
    benchmark:
        "results/benchmarks/hold_girdle/{variant}_{participant}_{condition}.jsonl"
    params:
        **PREDICTION,
        code=code_of("hold_girdle"),
        problem=lambda wildcards: dict(VARIANTS[wildcards.variant].problem),
        shares=lookup(within=config, dpath="variants/held/shares"),
    threads: 1
    resources:
        mem_mb=4000,
        runtime=60,
    message:
        "Girdle held to a motion: variant {wildcards.variant}, participant {wildcards.participant}"
    script:
        "../scripts/hold_girdle.py"


use rule static_postures as held_girdle with:
    input:
        tables=held_results("results/sensitivity/held/{variant}/{participant}/{condition}.csv"),
    log:
        python="results/logs/held_girdle.log",
    params:
        table="reports/held_girdle.csv",
    message:
        "What a motion of the girdle costs its prediction: reports/held_girdle.csv"
