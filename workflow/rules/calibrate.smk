# Strength and fibre length of muscle groups from EMG, and daily tasks that test them.
#
# Parameters of the reference plant enter the score only.
#
# Priorities, here and in earlier rules: calibrations are long and predictions wait for them, so
# whatever leads to one goes first. Otherwise the last of them would run alone at the end.


rule calibrate:
    input:
        participant=PARTICIPANT_FILE,
        model="results/models/{participant}.json",
        thorax="results/models/{participant}_thorax.json",
        geometry="results/muscle_geometry/{participant}/quaternion.npz",
        equations="results/equations/quaternion",
        channels="config/emg/channels.csv",
        tracked=tracked_elevations,
        envelopes=elevation_envelopes,
    output:
        scalers="results/calibration/{participant}_scalers.json",
        solution="results/calibration/{participant}_paper.npz",
        summary="results/calibration/{participant}_paper.summary.json",
    log:
        solver="results/logs/calibrate/{participant}.solver.log",
        python="results/logs/calibrate/{participant}.python.log",
    benchmark:
        "results/benchmarks/calibrate/{participant}.jsonl"
    priority: 5
    params:
        **SOLVER,
        code=code_of("calibrate"),
        # Snakemake compares files as a set; elevations are joined in this order.
        planes=STUDY.planes,
        weights=lookup(within=config, dpath="weights/calibration"),
        pause_s=lookup(within=config, dpath="composite/pause_s"),
        calibration=lookup(within=config, dpath="calibration"),
        envelope=lookup(within=config, dpath="emg/envelope"),
    threads: 1
    resources:
        mem_mb=4000,
        runtime=90,
    message:
        "Calibration: participant {wildcards.participant}"
    script:
        "../scripts/calibrate.py"


rule score_calibration:
    input:
        scalers="results/calibration/{participant}_scalers.json",
        plant=branch(
            calibrated_to_simulated_emg, then="config/plant/{participant}.yaml", otherwise=[]
        ),
        channels="config/emg/channels.csv",
    output:
        scored="results/calibration/{participant}.json",
    log:
        python="results/logs/score_calibration/{participant}.python.log",
    benchmark:
        "results/benchmarks/score_calibration/{participant}.jsonl"
    params:
        code=code_of("score_calibration"),
    threads: 1
    message:
        "Calibration against the reference plant: participant {wildcards.participant}"
    script:
        "../scripts/score_calibration.py"


rule solve_validation:
    input:
        participant=PARTICIPANT_FILE,
        model="results/models/{participant}.json",
        thorax="results/models/{participant}_thorax.json",
        geometry="results/muscle_geometry/{participant}/quaternion.npz",
        equations="results/equations/quaternion",
        recording=recording,
        channels="config/emg/channels.csv",
        calibration=validation_muscles,
        tracked=TRACKED_TASK,
    output:
        solution="results/validation/{participant}/{trial}_{muscles}.npz",
        summary="results/validation/{participant}/{trial}_{muscles}.summary.json",
    log:
        solver="results/logs/solve_validation/{participant}_{trial}_{muscles}.solver.log",
        python="results/logs/solve_validation/{participant}_{trial}_{muscles}.python.log",
    benchmark:
        "results/benchmarks/solve_validation/{participant}_{trial}_{muscles}.jsonl"
    params:
        **SOLVER,
        code=code_of("solve_validation"),
        weights=lookup(within=config, dpath="weights/calibration"),
    threads: 1
    resources:
        mem_mb=4000,
        runtime=60,
    message:
        "Daily task: participant {wildcards.participant}, {wildcards.trial},"
        " {wildcards.muscles} muscles"
    script:
        "../scripts/solve_validation.py"


rule summarise_validation:
    input:
        solutions=validation_results("results/validation/{participant}/{trial}_{muscles}.npz"),
        envelopes=validation_envelopes,
        channels="config/emg/channels.csv",
    output:
        summary="results/validation/summary.csv",
    log:
        python="results/logs/summarise_validation.python.log",
    benchmark:
        "results/benchmarks/summarise_validation.jsonl"
    params:
        code=code_of("summarise_validation"),
    threads: 1
    message:
        "Excitations of daily tasks against EMG"
    script:
        "../scripts/summarise_validation.py"
