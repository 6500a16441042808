# Variants of model and problem, and the ladder between the authors' and the study's own. They share
# recordings, tracked motions, thorax surface and scalers with the study. A rule that reuses another
# has its parameters, except for those that it names itself.


use rule build_participant_model as build_variant_model with:
    output:
        model="results/variants/models/{model}/{participant}.json",
        osim="results/variants/models/{model}/{participant}.osim",
    log:
        python="results/logs/build_variant_model/{model}_{participant}.python.log",
    benchmark:
        "results/benchmarks/build_variant_model/{model}_{participant}.jsonl"
    params:
        choices=lambda wildcards: variants.choices_of(config["model"], wildcards.model),
    message:
        "Model {wildcards.model} of participant {wildcards.participant}"


use rule sample_muscle_geometry as sample_variant_geometry with:
    input:
        participant=PARTICIPANT_FILE,
        recordings=recordings,
        model="results/variants/models/{model}/{participant}.json",
        osim="results/variants/models/{model}/{participant}.osim",
        published=lambda wildcards: published_motions(wildcards.participant),
    output:
        samples="results/variants/geometry/{model}/{participant}/{formulation}_samples.npz",
    log:
        python="results/logs/sample_variant_geometry/{model}_{participant}_{formulation}.python.log",
    benchmark:
        "results/benchmarks/sample_variant_geometry/{model}_{participant}_{formulation}.jsonl"
    params:
        # The published arm goes higher than the recorded one.
        published_arm=True,
    message:
        "Muscle lengths of model {wildcards.model} of participant {wildcards.participant}"


use rule fit_muscle_geometry as fit_variant_geometry with:
    input:
        participant=PARTICIPANT_FILE,
        samples="results/variants/geometry/{model}/{participant}/{formulation}_samples.npz",
        model="results/variants/models/{model}/{participant}.json",
        recordings=recordings,
        equations="results/equations/{formulation}",
    output:
        geometry="results/variants/geometry/{model}/{participant}/{formulation}.npz",
        quality="results/variants/geometry/{model}/{participant}/{formulation}_quality.csv",
    log:
        python="results/logs/fit_variant_geometry/{model}_{participant}_{formulation}.python.log",
    benchmark:
        "results/benchmarks/fit_variant_geometry/{model}_{participant}_{formulation}.jsonl"
    message:
        "Muscle length functions of model {wildcards.model} of participant {wildcards.participant}"


use rule solve_prediction as solve_variant with:
    input:
        unpack(variant_inputs),
        participant=PARTICIPANT_FILE,
        thorax="results/models/{participant}_thorax.json",
        equations="results/equations/quaternion",
        channels="config/emg/channels.csv",
        tracked=tracked_elevations,
    output:
        solution="results/variants/{variant}/{participant}/{condition}.npz",
        summary="results/variants/{variant}/{participant}/{condition}.summary.json",
    log:
        solver="results/logs/solve_variant/{variant}_{participant}_{condition}.solver.log",
        python="results/logs/solve_variant/{variant}_{participant}_{condition}.python.log",
    benchmark:
        "results/benchmarks/solve_variant/{variant}_{participant}_{condition}.jsonl"
    params:
        max_iterations=variant_iterations,
        problem=lambda wildcards: dict(VARIANTS[wildcards.variant].problem),
    message:
        "Prediction of variant {wildcards.variant}: participant {wildcards.participant},"
        " {wildcards.condition}"


use rule solve_variant as predict_variant_task with:
    # The arm of one daily task in place of the elevations.
    input:
        unpack(variant_inputs),
        participant=PARTICIPANT_FILE,
        thorax="results/models/{participant}_thorax.json",
        equations="results/equations/quaternion",
        channels="config/emg/channels.csv",
        tracked=[TRACKED_TASK],
    output:
        solution="results/variants/{variant}/{participant}/{trial}/{condition}.npz",
        summary="results/variants/{variant}/{participant}/{trial}/{condition}.summary.json",
    log:
        solver="results/logs/predict_variant_task/{variant}_{participant}_{trial}_{condition}.solver.log",
        python="results/logs/predict_variant_task/{variant}_{participant}_{trial}_{condition}.python.log",
    benchmark:
        "results/benchmarks/predict_variant_task/{variant}_{participant}_{trial}_{condition}.jsonl"
    wildcard_constraints:
        condition=HEALTHY,
    params:
        time_step_s=lookup(within=config, dpath="prediction/task_time_step_s"),
    message:
        "Prediction of variant {wildcards.variant}: participant {wildcards.participant},"
        " {wildcards.condition}, {wildcards.trial}"


rule compare_predictions:
    input:
        solutions=prediction_results("results/prediction/{participant}/{condition}.npz")
        + variant_results("results/variants/{variant}/{participant}/{condition}.npz"),
        summaries=prediction_results("results/prediction/{participant}/{condition}.summary.json")
        + variant_results("results/variants/{variant}/{participant}/{condition}.summary.json"),
        tracked=expand(
            "results/tracking/{participant}/{plane}_quaternion.npz",
            participant=config["participants"],
            plane=config["planes"],
        ),
        participants=expand(PARTICIPANT_FILE, participant=config["participants"]),
        published=[
            file
            for participant in config["participants"]
            for file in published_motions(participant)
        ],
        targets="config/targets.yaml",
        audit="results/prediction/geometry_audit.csv",
    output:
        recording="results/prediction/against_recording.csv",
        published="results/prediction/against_published.csv",
    log:
        python="results/logs/compare_predictions.python.log",
    benchmark:
        "results/benchmarks/compare_predictions.jsonl"
    params:
        **AGAINST,
        code=code_of("compare_predictions"),
    threads: 1
    message:
        "Predictions against recordings and against the published ones"
    script:
        "../scripts/compare_predictions.py"


rule tabulate_ladder:
    input:
        solutions=ladder_results("results/variants/{variant}/{participant}/{condition}.npz"),
        summaries=ladder_results(
            "results/variants/{variant}/{participant}/{condition}.summary.json"
        ),
    output:
        table="results/variants/ladder.csv",
        figure="results/variants/ladder.svg",
    log:
        python="results/logs/tabulate_ladder.python.log",
    benchmark:
        "results/benchmarks/tabulate_ladder.jsonl"
    params:
        code=code_of("tabulate_ladder"),
    threads: 1
    message:
        "Ladder from the authors' problem to the study's own"
    script:
        "../scripts/tabulate_ladder.py"


rule ladder:
    # Not part of the study: 20 predictions. Kept with the report, where no rule makes it: otherwise a
    # fresh checkout would climb it again.
    input:
        rules.tabulate_ladder.output,
    log:
        python="results/logs/ladder.log",
    localrule: True
    message:
        "The ladder is complete: reports/ladder.csv and reports/ladder.svg"
    shell:
        "cp {input} reports 2> {log.python}"


rule tabulate_tried:
    input:
        solutions=tried_study("results/prediction/{participant}/{condition}.npz")
        + tried_results("results/variants/{variant}/{participant}/{condition}.npz"),
        summaries=tried_study("results/prediction/{participant}/{condition}.summary.json")
        + tried_results("results/variants/{variant}/{participant}/{condition}.summary.json"),
        task_solutions=tried_task_results(".npz"),
        task_summaries=tried_task_results(".summary.json"),
        tracked_tasks=tried_tracked_tasks(),
        tracked=expand(
            "results/tracking/{participant}/{plane}_quaternion.npz",
            participant=config["variants"]["tried"]["participants"],
            plane=config["planes"],
        ),
        participants=expand(
            PARTICIPANT_FILE, participant=config["variants"]["tried"]["participants"]
        ),
        targets="config/targets.yaml",
    output:
        table="results/variants/tried.csv",
    log:
        python="results/logs/tabulate_tried.python.log",
    benchmark:
        "results/benchmarks/tabulate_tried.jsonl"
    params:
        **AGAINST,
        code=code_of("tabulate_tried"),
    threads: 1
    message:
        "Variants against the recordings of all participants"
    script:
        "../scripts/tabulate_tried.py"


rule tried:
    # Not part of the study: further predictions. Kept with the report, as the ladder is.
    input:
        rules.tabulate_tried.output,
    log:
        python="results/logs/tried.log",
    localrule: True
    message:
        "Variants are tried: reports/tried.csv"
    shell:
        "cp {input} reports 2> {log.python}"
