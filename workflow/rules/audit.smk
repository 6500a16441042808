# Muscle geometry along predictions against OpenSim: is a free scapula still where paths were fitted?


rule choose_audited_poses:
    input:
        solution="results/prediction/{participant}/{condition}.npz",
    output:
        poses=temp("results/prediction/{participant}/{condition}_audited.npz"),
    log:
        python="results/logs/choose_audited_poses/{participant}_{condition}.python.log",
    benchmark:
        "results/benchmarks/choose_audited_poses/{participant}_{condition}.jsonl"
    params:
        code=code_of("choose_audited_poses"),
        every=lookup(within=config, dpath="prediction/audit_every"),
    threads: 1
    message:
        "Poses to audit: participant {wildcards.participant}, {wildcards.condition}"
    script:
        "../scripts/choose_audited_poses.py"


rule sample_solution_geometry:
    # Runs opensim.
    input:
        poses="results/prediction/{participant}/{condition}_audited.npz",
        model="results/models/{participant}.json",
        osim="results/models/{participant}.osim",
    output:
        samples=temp("results/prediction/{participant}/{condition}_opensim.npz"),
    log:
        python="results/logs/sample_solution_geometry/{participant}_{condition}.python.log",
    benchmark:
        "results/benchmarks/sample_solution_geometry/{participant}_{condition}.jsonl"
    params:
        code=code_of("sample_solution_geometry"),
    threads: 1
    message:
        "OpenSim's muscle lengths: participant {wildcards.participant}, {wildcards.condition}"
    script:
        "../scripts/sample_solution_geometry.py"


rule audit_geometry:
    input:
        samples="results/prediction/{participant}/{condition}_opensim.npz",
        geometry="results/muscle_geometry/{participant}/quaternion.npz",
        equations="results/equations/quaternion",
    output:
        audit="results/prediction/{participant}/{condition}_geometry.csv",
    log:
        python="results/logs/audit_geometry/{participant}_{condition}.python.log",
    benchmark:
        "results/benchmarks/audit_geometry/{participant}_{condition}.jsonl"
    params:
        code=code_of("audit_geometry"),
    threads: 1
    message:
        "Muscle geometry against OpenSim: participant {wildcards.participant},"
        " {wildcards.condition}"
    script:
        "../scripts/audit_geometry.py"


rule tabulate_geometry_audit:
    input:
        audits=prediction_results("results/prediction/{participant}/{condition}_geometry.csv"),
    output:
        table="results/prediction/geometry_audit.csv",
    log:
        python="results/logs/tabulate_geometry_audit.python.log",
    benchmark:
        "results/benchmarks/tabulate_geometry_audit.jsonl"
    params:
        code=code_of("tabulate_geometry_audit"),
    threads: 1
    message:
        "Muscle geometry against OpenSim: table of all predictions"
    script:
        "../scripts/tabulate_geometry_audit.py"
