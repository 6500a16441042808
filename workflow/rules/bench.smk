# Benchmark of the solver: ratios measured side by side in one run. Not part of the study.
from scapulohumeral.configuration.check import read_bench


rule benchmark_solver:
    input:
        participant="config/participants/par2/participant.yaml",
        recordings="config/participants/par2/frontal.csv",
        model="results/models/par2.json",
        thorax="results/models/par2_thorax.json",
        geometry="results/muscle_geometry/par2/quaternion.npz",
        equations="results/equations/quaternion",
        code=code_of("scapulohumeral.stages.benchmark"),
    output:
        record="results/bench/solver.json",
    log:
        python="results/logs/benchmark_solver.python.log",
    benchmark:
        "results/benchmarks/benchmark_solver.jsonl"
    params:
        opty_muscles=read_bench(Path("config/bench.yaml")).opty_muscles,
        time_step_s=lookup(within=config, dpath="solve/time_step_s"),
        tolerance=lookup(within=config, dpath="solve/tolerance"),
        max_iterations=lookup(within=config, dpath="solve/max_iterations"),
        hessian=lookup(within=config, dpath="solve/hessian"),
        weights=lookup(within=config, dpath="weights/tracking"),
    threads: 1
    resources:
        mem_mb=6000,
        runtime=90,
    message:
        "Benchmark: par2, frontal plane, against limited memory and plain opty"
    script:
        "../scripts/benchmark_solver.py"
