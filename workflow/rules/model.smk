# From the tables of the model to what a solver needs: scaled model, muscle lengths as smooth
# functions of the coordinates, thorax surface, equations of motion.
#
# opensim and casadi cannot be loaded into one process: the rules that need opensim say so and hand
# over files.


rule build_participant_model:
    # Runs opensim.
    input:
        tables=MODEL_TABLES,
        participant=PARTICIPANT_FILE,
        recordings=recordings,
    output:
        model="results/models/{participant}.json",
        osim="results/models/{participant}.osim",
    log:
        python="results/logs/build_participant_model/{participant}.python.log",
    benchmark:
        "results/benchmarks/build_participant_model/{participant}.jsonl"
    priority: 3
    params:
        code=code_of("build_participant_model"),
        choices=lookup(within=config, dpath="model"),
    threads: 1
    message:
        "Scaled model of participant {wildcards.participant}"
    script:
        "../scripts/build_participant_model.py"


rule sample_muscle_geometry:
    # Runs opensim. Each formulation has its own poses: functions of Euler angles need samples on the
    # branch of the recorded angles, also close to their singularity.
    input:
        participant=PARTICIPANT_FILE,
        recordings=recordings,
        model="results/models/{participant}.json",
        osim="results/models/{participant}.osim",
        published=lambda wildcards: published_motions(wildcards.participant),
    output:
        samples="results/muscle_geometry/{participant}/{formulation}_samples.npz",
    log:
        python="results/logs/sample_muscle_geometry/{participant}_{formulation}.python.log",
    benchmark:
        "results/benchmarks/sample_muscle_geometry/{participant}_{formulation}.jsonl"
    priority: 3
    params:
        **FIT_REGION,
        code=code_of("sample_muscle_geometry"),
        poses=lookup(within=config, dpath="geometry/poses"),
        held_out_poses=lookup(within=config, dpath="geometry/held_out_poses"),
        clearance=lookup(within=config, dpath="geometry/clearance"),
        seed=lookup(within=config, dpath="geometry/seed"),
        published_arm=False,
    threads: 1
    message:
        "Muscle lengths of participant {wildcards.participant} at {params.poses} random poses,"
        " {wildcards.formulation}"
    script:
        "../scripts/sample_muscle_geometry.py"


rule fit_muscle_geometry:
    input:
        participant=PARTICIPANT_FILE,
        samples="results/muscle_geometry/{participant}/{formulation}_samples.npz",
        model="results/models/{participant}.json",
        recordings=recordings,
        equations="results/equations/{formulation}",
    output:
        geometry="results/muscle_geometry/{participant}/{formulation}.npz",
        quality="results/muscle_geometry/{participant}/{formulation}_quality.csv",
    log:
        python="results/logs/fit_muscle_geometry/{participant}_{formulation}.python.log",
    benchmark:
        "results/benchmarks/fit_muscle_geometry/{participant}_{formulation}.jsonl"
    priority: 3
    params:
        code=code_of("fit_muscle_geometry"),
        length_target_m=lookup(within=config, dpath="geometry/length_target_m"),
        arm_target_m=lookup(within=config, dpath="geometry/arm_target_m"),
        rmse_change_stop=lookup(within=config, dpath="geometry/rmse_change_stop"),
    threads: 1
    message:
        "Muscle length functions: participant {wildcards.participant}, {wildcards.formulation}"
    script:
        "../scripts/fit_muscle_geometry.py"


rule fit_thorax:
    input:
        participant=PARTICIPANT_FILE,
        model="results/models/{participant}.json",
        recordings=elevations,
    output:
        thorax="results/models/{participant}_thorax.json",
    log:
        python="results/logs/fit_thorax/{participant}.python.log",
    benchmark:
        "results/benchmarks/fit_thorax/{participant}.jsonl"
    priority: 3
    params:
        code=code_of("fit_thorax"),
    threads: 1
    message:
        "Thorax surface of participant {wildcards.participant}"
    script:
        "../scripts/fit_thorax.py"


rule build_equations:
    output:
        equations=directory("results/equations/{formulation}"),
    log:
        python="results/logs/build_equations/{formulation}.python.log",
    benchmark:
        "results/benchmarks/build_equations/{formulation}.jsonl"
    priority: 3
    params:
        code=code_of("build_equations"),
    threads: 1
    message:
        "Equations of motion with {wildcards.formulation} coordinates"
    script:
        "../scripts/build_equations.py"
