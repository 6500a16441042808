# The gap between recorded and predicted motion of scapula and clavicle: where it lies, which effect
# explains it.
#
# Recordings have no reference trials of the same person here, so the answers are given with lower
# confidence. `make gap` makes them alone.


from scapulohumeral.gap.settings import sections_read, with_settings

GAP_SETTINGS = "config/gap/settings.yaml"
# What the nominal model does in the study: scapula and clavicle follow from the humerus.
VIEW = "prediction"
# Weights of evidence, and how far simulated thresholds are raised.
GAP_RECORDS = ["config/gap/calibration.json", "config/gap/null_bank.json"]
# What a diagnosis reads of both: the file written below holds the configuration only.
GAP_READ = sections_read(with_settings(config, Path(GAP_SETTINGS)), VIEW)


rule write_gap_config:
    # The configuration as Snakemake has it, with all that the command line changed. Written again
    # only if something changes that a diagnosis reads.
    output:
        config="results/gap/{participant}/config.yaml",
    log:
        python="results/logs/write_gap_config/{participant}.python.log",
    localrule: True
    params:
        read=GAP_READ,
    message:
        "Configuration of the diagnosis of participant {wildcards.participant}"
    run:
        Path(output.config).write_text(yaml.safe_dump(config, sort_keys=False), encoding="utf-8")


rule diagnose_gap:
    input:
        participant=PARTICIPANT_FILE,
        recordings=elevations,
        tables=MODEL_TABLES,
        config=rules.write_gap_config.output.config,
        records=GAP_RECORDS,
        templates=sorted(map(str, Path("src/scapulohumeral/gap/output").glob("*.j2"))),
    output:
        result="results/gap/{participant}/result.json",
        page="results/gap/{participant}/report.html",
    log:
        python="results/logs/diagnose_gap/{participant}.python.log",
    benchmark:
        "results/benchmarks/diagnose_gap/{participant}.jsonl"
    params:
        code=code_of("scapulohumeral.gap.cli", "scapulohumeral.gap.nominal.opensim_process"),
        read=GAP_READ,
        view=VIEW,
        settings=GAP_SETTINGS,
    threads: 1
    resources:
        mem_mb=4000,
        runtime=30,
    message:
        "Gap between recorded and predicted elevations of participant {wildcards.participant}"
    shell:
        # A diagnosis whose solves fail has no verdict, and the report says so.
        "(python -m scapulohumeral.gap.cli gap diagnose {input.recordings}"
        " --participant {input.participant} --config {input.config}"
        " --settings {params.settings} --view {params.view} --threads {threads}"
        " --out $(dirname {output.result})"
        " || [ $? -eq 3 ]) > {log.python} 2>&1"


rule gap:
    input:
        results=expand(
            "results/gap/{participant}/result.json",
            participant=lookup(within=config, dpath="diagnose"),
        ),
    localrule: True
    message:
        "Diagnoses: {input.results}"
