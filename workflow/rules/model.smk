# From the tables of the model to what a solver needs: scaled model, muscle lengths as smooth
# functions of the coordinates, thorax surface, equations of motion.
#
# opensim and casadi cannot be loaded into one process: the rules that need opensim say so and hand
# over files.


rule build_participant_model:
    # Runs opensim.
    input:
        tables=MODEL_TABLES,
        participant="config/participants/{participant}/participant.yaml",
        recordings=recordings,
        code=code_of(
            "scapulohumeral.model.opensim_model",
            "scapulohumeral.model.participant",
            "scapulohumeral.model.tables",
        ),
    output:
        model="results/models/{participant}.json",
        osim="results/models/{participant}.osim",
    log:
        python="results/logs/build_participant_model/{participant}.python.log",
    benchmark:
        "results/benchmarks/build_participant_model/{participant}.jsonl"
    params:
        masses=lookup(within=config, dpath="masses"),
    threads: 1
    message:
        "Scaled model of participant {wildcards.participant}"
    script:
        "../scripts/build_participant_model.py"


rule sample_muscle_geometry:
    # Runs opensim.
    input:
        tables=MODEL_TABLES,
        participant="config/participants/{participant}/participant.yaml",
        recordings=recordings,
        osim="results/models/{participant}.osim",
        code=code_of(
            "scapulohumeral.model.opensim_sampling",
            "scapulohumeral.model.participant",
            "scapulohumeral.model.pose_region",
            "scapulohumeral.model.tables",
        ),
    output:
        samples="results/muscle_geometry/{participant}/samples.npz",
    log:
        python="results/logs/sample_muscle_geometry/{participant}.python.log",
    benchmark:
        "results/benchmarks/sample_muscle_geometry/{participant}.jsonl"
    params:
        poses=lookup(within=config, dpath="geometry/poses"),
        held_out_poses=lookup(within=config, dpath="geometry/held_out_poses"),
        margin_deg=lookup(within=config, dpath="geometry/margin_deg"),
        seed=lookup(within=config, dpath="geometry/seed"),
    threads: 1
    message:
        "Muscle lengths of participant {wildcards.participant} at {params.poses} random poses"
    script:
        "../scripts/sample_muscle_geometry.py"


rule fit_muscle_geometry:
    input:
        samples="results/muscle_geometry/{participant}/samples.npz",
        model="results/models/{participant}.json",
        code=code_of("scapulohumeral.model.muscle_geometry", "scapulohumeral.stages.geometry"),
    output:
        geometry="results/muscle_geometry/{participant}/{formulation}.npz",
        quality="results/muscle_geometry/{participant}/{formulation}_quality.csv",
    log:
        python="results/logs/fit_muscle_geometry/{participant}_{formulation}.python.log",
    benchmark:
        "results/benchmarks/fit_muscle_geometry/{participant}_{formulation}.jsonl"
    params:
        rmse_change_stop=lookup(within=config, dpath="geometry/rmse_change_stop"),
    threads: 1
    message:
        "Muscle length functions: participant {wildcards.participant}, {wildcards.formulation}"
    script:
        "../scripts/fit_muscle_geometry.py"


rule fit_thorax:
    input:
        model="results/models/{participant}.json",
        recordings=recordings,
        code=code_of("scapulohumeral.stages.thorax"),
    output:
        thorax="results/models/{participant}_thorax.json",
    log:
        python="results/logs/fit_thorax/{participant}.python.log",
    benchmark:
        "results/benchmarks/fit_thorax/{participant}.jsonl"
    threads: 1
    message:
        "Thorax surface of participant {wildcards.participant}"
    script:
        "../scripts/fit_thorax.py"


rule build_equations:
    input:
        code=code_of("scapulohumeral.dynamics.compiled"),
    output:
        equations=directory("results/equations/{formulation}"),
    log:
        python="results/logs/build_equations/{formulation}.python.log",
    benchmark:
        "results/benchmarks/build_equations/{formulation}.jsonl"
    threads: 1
    message:
        "Equations of motion with {wildcards.formulation} coordinates"
    script:
        "../scripts/build_equations.py"
