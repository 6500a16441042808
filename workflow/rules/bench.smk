# Benchmark of the solver: what else could be used, side by side in one run. Not part of the study.
from scapulohumeral.configuration.check import read_bench

BENCH = read_bench(Path("config/bench.yaml"))


rule benchmark_solver:
    input:
        participant="config/participants/par2/participant.yaml",
        recordings="config/participants/par2/frontal.csv",
        model="results/models/par2.json",
        thorax="results/models/par2_thorax.json",
        geometry="results/muscle_geometry/par2/quaternion.npz",
        equations="results/equations/quaternion",
    output:
        record="results/bench/solver.json",
    log:
        python="results/logs/benchmark_solver.python.log",
    benchmark:
        "results/benchmarks/benchmark_solver.jsonl"
    params:
        **SOLVER,
        code=code_of("benchmark_solver"),
        weights=lookup(within=config, dpath="weights/tracking"),
    threads: 1
    resources:
        mem_mb=6000,
        runtime=90,
    message:
        "Benchmark: par2, frontal plane, against limited memory"
    script:
        "../scripts/benchmark_solver.py"


rule benchmark_peer:
    input:
        participant="config/participants/par2/participant.yaml",
        recordings="config/participants/par2/frontal.csv",
        model="results/models/par2.json",
        thorax="results/models/par2_thorax.json",
        geometry="results/muscle_geometry/par2/quaternion.npz",
        equations="results/equations/quaternion",
    output:
        record="results/bench/peers/{peer}.json",
    log:
        python="results/logs/benchmark_peer/{peer}.python.log",
        peer="results/logs/benchmark_peer/{peer}.peer.log",
    benchmark:
        "results/benchmarks/benchmark_peer/{peer}.jsonl"
    wildcard_constraints:
        peer=r"casadi|opty_\d+",
    params:
        **SOLVER,
        code=code_of("benchmark_peer"),
        weights=lookup(within=config, dpath="weights/tracking"),
        limit_s=BENCH.peer_limit_s,
    threads: 1
    resources:
        mem_mb=6000,
        runtime=90,
    message:
        "Benchmark: par2, frontal plane, by {wildcards.peer}"
    script:
        "../scripts/benchmark_peer.py"


rule benchmark_moco:
    # Runs opensim.
    input:
        model="results/models/par2.osim",
        states="results/tracking/par2/frontal_quaternion.sto",
    output:
        record="results/bench/peers/moco_{tool}.json",
    log:
        python="results/logs/benchmark_moco/{tool}.python.log",
        peer="results/logs/benchmark_moco/{tool}.peer.log",
    benchmark:
        "results/benchmarks/benchmark_moco/{tool}.jsonl"
    wildcard_constraints:
        tool="inverse|track",
    params:
        code=code_of("benchmark_moco"),
        time_step_s=lookup(within=config, dpath="solve/time_step_s"),
        limit_s=BENCH.peer_limit_s,
    threads: 1
    resources:
        mem_mb=6000,
        runtime=90,
    message:
        "Benchmark: par2, frontal plane, by OpenSim Moco, {wildcards.tool}"
    script:
        "../scripts/benchmark_moco.py"


rule collect_peers:
    input:
        solver="results/bench/solver.json",
        peers=expand(
            "results/bench/peers/{peer}.json",
            peer=[
                "casadi",
                *(f"opty_{count}" for count in BENCH.opty_muscles),
                "moco_inverse",
                "moco_track",
            ],
        ),
    output:
        record="results/bench/peers.json",
    log:
        python="results/logs/collect_peers.python.log",
    params:
        code=code_of("collect_peers"),
    threads: 1
    message:
        "Benchmark: this solver and its peers in one record"
    script:
        "../scripts/collect_peers.py"
