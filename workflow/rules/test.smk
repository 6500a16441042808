# Tests that read the results. They run inside the study, so that no result passes unseen.


rule test_results:
    input:
        summary="results/tracking/summary.csv",
        solutions=tracking_results("results/tracking/{participant}/{trial}_{formulation}.npz"),
        summaries=tracking_results(
            "results/tracking/{participant}/{trial}_{formulation}.summary.json"
        ),
        report=f"reports/{config['report']}.html",
        tests=sorted(str(path) for path in Path("tests/results").glob("*.py")),
    output:
        success=touch("results/tests.success"),
    log:
        pytest="results/logs/test_results.log",
    benchmark:
        "results/benchmarks/test_results.jsonl"
    threads: 1
    message:
        "Tests on the results"
    shell:
        "pytest -m results {input.tests} > {log.pytest} 2>&1"
