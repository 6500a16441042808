# The gap between recorded and predicted motion of scapula and clavicle: where it lies, which effect
# explains it.
#
# Recordings have no reference trials of the same person here, so the answers are given with lower
# confidence. `make gap` makes them alone.


rule diagnose_gap:
    input:
        participant="config/participants/{participant}/participant.yaml",
        recordings=elevations,
        tables=MODEL_TABLES,
        bank="config/gap/null_bank.json",
        channels="config/emg/channels.csv",
        code=code_of("scapulohumeral.gap.cli", "scapulohumeral.gap.diagnosis"),
    output:
        result="results/gap/{participant}/result.json",
        page="results/gap/{participant}/report.html",
    log:
        python="results/logs/diagnose_gap/{participant}.python.log",
    benchmark:
        "results/benchmarks/diagnose_gap/{participant}.jsonl"
    params:
        settings=lookup(within=config, dpath="gap"),
    threads: 1
    resources:
        mem_mb=4000,
        runtime=30,
    message:
        "Gap between recorded and predicted elevations of participant {wildcards.participant}"
    shell:
        "python -m scapulohumeral.gap.cli gap diagnose {input.recordings}"
        " --participant {input.participant} --view prediction --threads {threads}"
        " --out $(dirname {output.result}) > {log.python} 2>&1"


rule gap:
    input:
        results=expand(
            "results/gap/{participant}/result.json",
            participant=lookup(within=config, dpath="diagnose"),
        ),
    localrule: True
    message:
        "Diagnoses: {input.results}"
