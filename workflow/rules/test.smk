# Tests that read the results. They run inside the study, so that no result passes unseen.


rule test_solutions:
    # Minutes of integration that need no report, beside the last solves and diagnoses.
    input:
        solutions=tracking_results("results/tracking/{participant}/{trial}_{formulation}.npz"),
        summaries=tracking_results(
            "results/tracking/{participant}/{trial}_{formulation}.summary.json"
        ),
        models=expand("results/models/{participant}.json", participant=config["participants"]),
        recordings=[str(path) for name in config["participants"] for path in STUDY.recordings(name)],
        thorax=expand(
            "results/models/{participant}_thorax.json", participant=config["participants"]
        ),
        geometry=expand(
            "results/muscle_geometry/{participant}/{formulation}.npz",
            participant=config["participants"],
            formulation=sorted({"quaternion", *config["formulations"]}),
        ),
        equations=expand(
            "results/equations/{formulation}",
            formulation=sorted({"quaternion", *config["formulations"]}),
        ),
        predictions=prediction_results("results/prediction/{participant}/{condition}.npz"),
        task_predictions=task_results(".npz"),
        tests=[
            "tests/results/test_reintegration.py",
            "tests/results/test_simulated_persons.py",
            "tests/support/recorded_tasks.py",
            "tests/support/reintegration.py",
            "tests/support/result_files.py",
        ],
    output:
        success=touch("results/solution_tests.success"),
    log:
        python="results/logs/test_solutions.log",
    benchmark:
        "results/benchmarks/test_solutions.jsonl"
    params:
        code=code_of(
            "test_solutions",
            "scapulohumeral.errors",
            "scapulohumeral.ocp.solution",
            "scapulohumeral.problems.model_files",
            "simulated_persons.drawing.study",
            "simulated_persons.drawing.trials",
            "simulated_persons.plan",
        ),
    threads: 1
    message:
        "Tests on the solutions"
    script:
        "../scripts/test_solutions.py"


rule test_results:
    input:
        summary="results/tracking/summary.csv",
        solutions=tracking_results("results/tracking/{participant}/{trial}_{formulation}.npz"),
        summaries=tracking_results(
            "results/tracking/{participant}/{trial}_{formulation}.summary.json"
        ),
        motions=tracking_results("results/tracking/{participant}/{trial}_{formulation}.mot"),
        states=tracking_results("results/tracking/{participant}/{trial}_{formulation}.sto"),
        geometry_quality=expand(
            "results/muscle_geometry/{participant}/{formulation}_quality.csv",
            participant=config["participants"],
            formulation=config["formulations"],
        ),
        solved="results/solution_tests.success",
        participants=expand(PARTICIPANT_FILE, participant=config["participants"]),
        channels="config/emg/channels.csv",
        envelopes=emg_results("results/emg/{participant}/{trial}_envelope.csv"),
        calibrations=expand(
            "results/calibration/{participant}.json", participant=calibrated_participants()
        ),
        validation=(
            ["results/validation/summary.csv"] if validation_results("{participant}") else []
        ),
        predictions=prediction_results("results/prediction/{participant}/{condition}.npz"),
        prediction_summary=prediction_table("summary"),
        rhythm=prediction_table("shr"),
        task_predictions=task_results(".npz"),
        against_tasks=task_table(),
        targets="config/targets.yaml",
        report=f"reports/{config['report']}.html",
        tests=sorted(
            {str(path) for path in Path("tests/results").glob("*.py")}
            - set(rules.test_solutions.input.tests)
        )
        + ["tests/support/result_files.py"],
    output:
        success=touch("results/tests.success"),
    log:
        python="results/logs/test_results.log",
    benchmark:
        "results/benchmarks/test_results.jsonl"
    params:
        code=code_of(
            "test_results",
            "scapulohumeral.errors",
            "scapulohumeral.ocp.solution",
            "scapulohumeral.report.targets",
        ),
    threads: 1
    message:
        "Tests on the results"
    script:
        "../scripts/test_results.py"
