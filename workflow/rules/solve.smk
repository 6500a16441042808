# Optimal control problems and what is derived from each solution.


rule solve_tracking:
    input:
        participant=PARTICIPANT_FILE,
        recording=recording,
        model="results/models/{participant}.json",
        thorax="results/models/{participant}_thorax.json",
        geometry="results/muscle_geometry/{participant}/{formulation}.npz",
        equations="results/equations/{formulation}",
    output:
        solution="results/tracking/{participant}/{trial}_{formulation}.npz",
        summary="results/tracking/{participant}/{trial}_{formulation}.summary.json",
    log:
        solver="results/logs/solve_tracking/{participant}_{trial}_{formulation}.solver.log",
        python="results/logs/solve_tracking/{participant}_{trial}_{formulation}.python.log",
    benchmark:
        "results/benchmarks/solve_tracking/{participant}_{trial}_{formulation}.jsonl"
    priority: 2
    params:
        **SOLVER,
        code=code_of("solve_tracking"),
        weights=lookup(within=config, dpath="weights/tracking"),
    threads: 1
    resources:
        mem_mb=4000,
        runtime=60,
    message:
        "Tracking: participant {wildcards.participant}, {wildcards.trial} plane,"
        " {wildcards.formulation}"
    script:
        "../scripts/solve_tracking.py"


rule export_opensim:
    input:
        solution="results/tracking/{participant}/{trial}_{formulation}.npz",
        model="results/models/{participant}.json",
    output:
        motion="results/tracking/{participant}/{trial}_{formulation}.mot",
        states="results/tracking/{participant}/{trial}_{formulation}.sto",
    log:
        python="results/logs/export_opensim/{participant}_{trial}_{formulation}.python.log",
    benchmark:
        "results/benchmarks/export_opensim/{participant}_{trial}_{formulation}.jsonl"
    params:
        code=code_of("export_opensim"),
    threads: 1
    message:
        "OpenSim files: participant {wildcards.participant}, {wildcards.trial} plane,"
        " {wildcards.formulation}"
    script:
        "../scripts/export_opensim.py"


rule summarise_tracking:
    input:
        summaries=tracking_results(
            "results/tracking/{participant}/{trial}_{formulation}.summary.json"
        ),
    output:
        summary="results/tracking/summary.csv",
    log:
        python="results/logs/summarise_tracking.python.log",
    benchmark:
        "results/benchmarks/summarise_tracking.jsonl"
    params:
        code=code_of("summarise_tracking"),
    threads: 1
    message:
        "Table of all tracking solves"
    script:
        "../scripts/summarise_tracking.py"
