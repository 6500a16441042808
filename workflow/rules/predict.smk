# Prediction of scapula and clavicle from the motion of the humerus. Conditions are independent given
# the healthy prediction, so they run in parallel.


rule solve_prediction:
    input:
        unpack(prediction_inputs),
        participant=PARTICIPANT_FILE,
        model="results/models/{participant}.json",
        thorax="results/models/{participant}_thorax.json",
        geometry="results/muscle_geometry/{participant}/quaternion.npz",
        equations="results/equations/quaternion",
        channels="config/emg/channels.csv",
        tracked=tracked_elevations,
    output:
        solution="results/prediction/{participant}/{condition}.npz",
        summary="results/prediction/{participant}/{condition}.summary.json",
    log:
        solver="results/logs/solve_prediction/{participant}_{condition}.solver.log",
        python="results/logs/solve_prediction/{participant}_{condition}.python.log",
    benchmark:
        "results/benchmarks/solve_prediction/{participant}_{condition}.jsonl"
    params:
        **PREDICTION,
        code=code_of("solve_prediction"),
        # Snakemake compares files as a set; elevations are joined in this order.
        planes=STUDY.planes,
        problem={},
    threads: 1
    resources:
        mem_mb=4000,
        runtime=90,
    message:
        "Prediction: participant {wildcards.participant}, {wildcards.condition}"
    script:
        "../scripts/solve_prediction.py"


rule spread_scalers:
    input:
        unpack(prediction_inputs),
        participant=PARTICIPANT_FILE,
        model="results/models/{participant}.json",
        thorax="results/models/{participant}_thorax.json",
        geometry="results/muscle_geometry/{participant}/quaternion.npz",
        equations="results/equations/quaternion",
        channels="config/emg/channels.csv",
        tracked=tracked_elevations,
        solution="results/prediction/{participant}/{condition}.npz",
    output:
        table="results/prediction/{participant}/{condition}_spread.csv",
    log:
        python="results/logs/spread_scalers/{participant}_{condition}.python.log",
    benchmark:
        "results/benchmarks/spread_scalers/{participant}_{condition}.jsonl"
    params:
        **PREDICTION,
        code=code_of("spread_scalers"),
        # Snakemake compares files as a set; elevations are joined in this order.
        planes=STUDY.planes,
        problem={},
    threads: 1
    resources:
        mem_mb=3000,
        runtime=20,
    message:
        "Spread of a prediction by its scalers: participant {wildcards.participant},"
        " {wildcards.condition}"
    script:
        "../scripts/spread_scalers.py"


use rule solve_prediction as predict_task with:
    # The arm of one daily task in place of the elevations.
    input:
        unpack(healthy_scalers),
        participant=PARTICIPANT_FILE,
        model="results/models/{participant}.json",
        thorax="results/models/{participant}_thorax.json",
        geometry="results/muscle_geometry/{participant}/quaternion.npz",
        equations="results/equations/quaternion",
        channels="config/emg/channels.csv",
        tracked=[TRACKED_TASK],
    output:
        solution="results/prediction/{participant}/{trial}/{condition}.npz",
        summary="results/prediction/{participant}/{trial}/{condition}.summary.json",
    log:
        solver="results/logs/predict_task/{participant}_{trial}_{condition}.solver.log",
        python="results/logs/predict_task/{participant}_{trial}_{condition}.python.log",
    benchmark:
        "results/benchmarks/predict_task/{participant}_{trial}_{condition}.jsonl"
    wildcard_constraints:
        condition=HEALTHY,
    params:
        time_step_s=lookup(within=config, dpath="prediction/task_time_step_s"),
    message:
        "Prediction: participant {wildcards.participant}, {wildcards.condition}, {wildcards.trial}"


rule compare_tasks:
    input:
        solutions=task_results(".npz"),
        summaries=task_results(".summary.json"),
        tracked=paths_of(TRACKED_TASK, STUDY.predicted_tasks(), "trial"),
        participants=expand(PARTICIPANT_FILE, participant=config["participants"]),
    output:
        table="results/prediction/against_tasks.csv",
    log:
        python="results/logs/compare_tasks.python.log",
    benchmark:
        "results/benchmarks/compare_tasks.jsonl"
    params:
        **FIT_REGION,
        code=code_of("compare_tasks"),
    threads: 1
    message:
        "Predicted daily tasks against their recordings"
    script:
        "../scripts/compare_tasks.py"


rule summarise_predictions:
    input:
        solutions=prediction_results("results/prediction/{participant}/{condition}.npz"),
        summaries=prediction_results("results/prediction/{participant}/{condition}.summary.json"),
        models=expand("results/models/{participant}.json", participant=config["participants"]),
        tracked=expand(
            "results/tracking/{participant}/{plane}_quaternion.npz",
            participant=config["participants"],
            plane=config["planes"],
        ),
    output:
        summary="results/prediction/summary.csv",
        rhythm="results/prediction/shr.csv",
    log:
        python="results/logs/summarise_predictions.python.log",
    benchmark:
        "results/benchmarks/summarise_predictions.jsonl"
    params:
        code=code_of("summarise_predictions"),
    threads: 1
    message:
        "Tables of all predictions"
    script:
        "../scripts/summarise_predictions.py"
