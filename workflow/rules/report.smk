# The report, and rules to look at the study or to remove its results.


rule render_report:
    input:
        summary="results/tracking/summary.csv",
        solutions=tracking_results("results/tracking/{participant}/{trial}_{formulation}.npz"),
        summaries=tracking_results(
            "results/tracking/{participant}/{trial}_{formulation}.summary.json"
        ),
        motions=tracking_results("results/tracking/{participant}/{trial}_{formulation}.mot"),
        geometry_quality=expand(
            "results/muscle_geometry/{participant}/{formulation}_quality.csv",
            participant=config["participants"],
            formulation=config["formulations"],
        ),
        code=code_of("scapulohumeral.report.render"),
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
    threads: 1
    message:
        "Report: reports/{wildcards.report}.html"
    script:
        "../scripts/render_report.py"


rule dag:
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
