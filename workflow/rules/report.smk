# The report, the pictures of the README, and rules to look at the study or to remove its results.


rule render_report:
    input:
        summary="results/tracking/summary.csv",
        solutions=tracking_results("results/tracking/{participant}/{trial}_{formulation}.npz"),
        summaries=tracking_results(
            "results/tracking/{participant}/{trial}_{formulation}.summary.json"
        ),
        models=expand("results/models/{participant}.json", participant=config["participants"]),
        thoraxes=expand(
            "results/models/{participant}_thorax.json", participant=config["participants"]
        ),
        geometry_quality=expand(
            "results/muscle_geometry/{participant}/{formulation}_quality.csv",
            participant=config["participants"],
            formulation=config["formulations"],
        ),
        equations=expand("results/equations/{formulation}", formulation=config["formulations"]),
        benchmarks=tracking_results(
            "results/benchmarks/solve_tracking/{participant}_{trial}_{formulation}.jsonl"
        )
        + expand(
            "results/benchmarks/calibrate/{participant}.jsonl",
            participant=calibrated_participants(),
        )
        + validation_results(
            "results/benchmarks/solve_validation/{participant}_{trial}_{muscles}.jsonl"
        )
        + prediction_results("results/benchmarks/solve_prediction/{participant}_{condition}.jsonl"),
        participants=expand(PARTICIPANT_FILE, participant=config["participants"]),
        targets="config/targets.yaml",
        published=sorted(
            str(path)
            for participant in config["participants"]
            for path in (PARTICIPANTS / participant).glob("published/*.csv")
        ),
        # Chapters of EMG, calibration, validation and prediction; without results, they say so.
        channels=["config/emg/channels.csv"],
        envelopes=emg_results("results/emg/{participant}/{trial}_envelope.csv"),
        emg_quality=emg_results("results/emg/{participant}/{trial}_quality.json"),
        calibrations=expand(
            "results/calibration/{participant}.json", participant=calibrated_participants()
        ),
        validation=(
            ["results/validation/summary.csv"] if validation_results("{participant}") else []
        ),
        validation_solutions=validation_results(
            "results/validation/{participant}/{trial}_{muscles}.npz"
        ),
        predictions=prediction_results("results/prediction/{participant}/{condition}.npz"),
        prediction_summaries=prediction_results(
            "results/prediction/{participant}/{condition}.summary.json"
        ),
        prediction_summary=prediction_table("summary"),
        rhythm=prediction_table("shr"),
        spreads=paths_of(
            "results/prediction/{participant}/{condition}_spread.csv", STUDY.spread(), "condition"
        ),
        against_recording=prediction_table("against_recording"),
        against_published=prediction_table("against_published"),
        against_tasks=task_table(),
        geometry_audit=prediction_table("geometry_audit"),
        ladder=committed_table("ladder"),
        sensitivity=committed_table("sensitivity"),
        postures=committed_table("static_postures"),
        held=committed_table("held_girdle"),
        tried=committed_table("tried"),
        recovery=committed_table("recovery"),
        moment_arms=["config/literature/moment_arms.csv"],
        joint_force=["config/literature/joint_force.csv"],
        geometry=expand(
            "results/muscle_geometry/{participant}/quaternion.npz",
            participant=config["participants"],
        ),
        # The study's own gap, and the committed score card of blind cases.
        diagnoses=expand(
            "results/gap/{participant}/result.json",
            participant=lookup(within=config, dpath="diagnose"),
        ),
        blind_scores=blind_scores(),
        real_cases=real_case_tables(),
        speed=speed_records(),
        # The report lists the assumptions that comments and texts in these files mark.
        sources=sorted(
            str(path)
            for folder in ("src/scapulohumeral", "config")
            for path in Path(folder).rglob("*")
            if path.suffix in (".py", ".yaml")
        ),
        templates=sorted(
            str(path)
            for folder in ("report", "player")
            for path in Path("src/scapulohumeral", folder).rglob("*")
            if path.suffix in (".j2", ".js", ".css")
        ),
    output:
        html=report(
            "reports/{report}.html",
            caption="../report/report.rst",
            category="Report",
            labels={"study": "{report}"},
        ),
    log:
        python="results/logs/render_report/{report}.python.log",
    benchmark:
        "results/benchmarks/render_report/{report}.jsonl"
    params:
        code=code_of("render_report"),
        # Settings that texts of the report name.
        config={name: config[name] for name in ("solve", "weights", "emg")},
    threads: 1
    message:
        "Report: reports/{wildcards.report}.html"
    script:
        "../scripts/render_report.py"


rule draw_readme_pictures:
    # Not part of the study: the pictures of the README show par2 in the frontal plane.
    input:
        solutions=expand(
            "results/tracking/par2/frontal_{formulation}.npz",
            formulation=["quaternion", "euler"],
        ),
        summaries=expand(
            "results/tracking/par2/frontal_{formulation}.summary.json",
            formulation=["quaternion", "euler"],
        ),
        models=["results/models/par2.json"],
        participants=["config/participants/par2/participant.yaml"],
        published="config/participants/par2/published/frontal_tracking.csv",
    output:
        motion="reports/motion.svg",
        gimbal_lock="reports/gimbal_lock.svg",
    log:
        python="results/logs/draw_readme_pictures.python.log",
    params:
        code=code_of("draw_readme_pictures"),
    threads: 1
    message:
        "Pictures of the README: {output}"
    script:
        "../scripts/draw_readme_pictures.py"


rule dag:
    input:
        workflow=["Snakefile", *sorted(map(str, Path("workflow/rules").glob("*.smk")))],
        config="config/config.yaml",
    output:
        diagram="results/dag.mmd",
    log:
        python="results/logs/dag.log",
    localrule: True
    message:
        "Diagram of the rules: {output.diagram}"
    shell:
        "snakemake --rulegraph mermaid-js > {output.diagram} 2> {log.python}"


rule clean:
    log:
        python="results/logs/clean.log",
    localrule: True
    message:
        "Deleting all results; .venv and reports stay"
    shell:
        "find results -mindepth 1 -not -path results/README.md -not -path results/logs"
        " -not -path {log.python} -delete"
