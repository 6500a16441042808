# Cases whose cause is known from elsewhere: real recordings, their nulls, and published simulations.
# No part of the study: `make real RECORDINGS=folder`. The recordings stay where they are.


from scapulohumeral.configuration.check import read_real_cases
from scapulohumeral.gap.benchmark.real_trials import RealTrials
from scapulohumeral.gap.settings import VIEWS

REAL_FILE = Path("config/gap/real_cases.yaml")
REAL = read_real_cases(REAL_FILE)
REAL_PEOPLE = Path("results/gap/real/people")
REAL_TRIALS = RealTrials(REAL, REAL_FILE, config["recordings"], REAL_PEOPLE)


wildcard_constraints:
    person="[a-z0-9_]+",
    motion="|".join(name for one in REAL.simulated.values() for name in one.motions),
    kind="effect|no_effect|artefact|simulation",


# Recordings with a fault get no table, which the command says by its exit code.
rule convert_real_recordings:
    input:
        unpack(lambda wildcards: REAL_TRIALS.markers(wildcards.person)),
        tables=MODEL_TABLES,
    output:
        participant=f"{REAL_PEOPLE}/{{person}}/participant.yaml",
        page=f"{REAL_PEOPLE}/{{person}}/conversion.html",
    log:
        python="results/logs/convert_real_recordings/{person}.python.log",
    benchmark:
        "results/benchmarks/convert_real_recordings/{person}.jsonl"
    params:
        code=code_of("scapulohumeral.laboratory.commands.convert"),
        about=lambda wildcards: REAL.converted[wildcards.person],
    threads: 1
    resources:
        mem_mb=2000,
        runtime=20,
    message:
        "Real recordings: convert those of {wildcards.person}"
    shell:
        "(python -m scapulohumeral.cli convert {input.recordings} --map {input.map}"
        " --out $(dirname {output.page}) --id {wildcards.person}"
        " --body-mass {params.about.body_mass_kg} --height {params.about.height_m}"
        " --tasks {params.about.tasks:q} || [ $? -eq 2 ]) > {log.python} 2>&1"


rule cut_simulated_elevations:
    input:
        motion=lambda wildcards: REAL.simulated[wildcards.person].motions[wildcards.motion],
    output:
        trials=directory(f"{REAL_PEOPLE}/{{person}}/{{motion}}"),
    log:
        python="results/logs/cut_simulated_elevations/{person}_{motion}.python.log",
    params:
        code=code_of("cut_simulated_elevations"),
    threads: 1
    resources:
        runtime=5,
    message:
        "Simulated motion {wildcards.motion}: a trial of each elevation"
    script:
        "../scripts/cut_simulated_elevations.py"


rule add_real_emg:
    input:
        unpack(lambda wildcards: REAL_TRIALS.with_emg(wildcards.person)),
    output:
        trials=directory(f"{REAL_PEOPLE}/{{person}}/with_emg"),
    log:
        python="results/logs/add_real_emg/{person}.python.log",
    params:
        code=code_of("add_real_emg"),
    threads: 1
    resources:
        runtime=5,
    message:
        "Real trials with EMG: {wildcards.person}"
    script:
        "../scripts/add_real_emg.py"


rule spoil_real_trials:
    input:
        unpack(lambda wildcards: REAL_TRIALS.sources(wildcards.case)),
    output:
        trials=directory(f"{REAL_PEOPLE}/spoilt/{{case}}"),
    log:
        python="results/logs/spoil_real_trials/{case}.python.log",
    params:
        code=code_of("spoil_real_trials"),
        error=lambda wildcards: REAL.cases[wildcards.case].spoilt,
        patterns=lambda wildcards: REAL_TRIALS.unspoilt(wildcards.case),
    threads: 1
    resources:
        runtime=5,
    message:
        "Real trials with an error of measurement: {wildcards.case}"
    script:
        "../scripts/spoil_real_trials.py"


# The configuration as Snakemake has it, as for the diagnoses of the study.
use rule write_gap_config as write_real_config with:
    output:
        config="results/gap/real/study/config.yaml",
    log:
        python="results/logs/write_real_config.python.log",
    params:
        read=sections_read(with_settings(config, Path(GAP_SETTINGS)), *VIEWS),
    message:
        "Configuration of the diagnoses of real cases"


# A solve that fails is an answer too: exit code 3.
rule diagnose_real_case:
    input:
        unpack(lambda wildcards: REAL_TRIALS.inputs(wildcards.case)),
        tables=MODEL_TABLES,
        settings=GAP_SETTINGS,
        config=rules.write_real_config.output.config,
        records=GAP_RECORDS,
        channels="config/emg/channels.csv",
    output:
        result="results/gap/real/cases/{case}/result.json",
    log:
        python="results/logs/diagnose_real_case/{case}.python.log",
    benchmark:
        "results/benchmarks/diagnose_real_case/{case}.jsonl"
    params:
        code=code_of(
            "scapulohumeral.gap.pipeline",
            "scapulohumeral.gap.run",
            "scapulohumeral.gap.nominal.opensim_process",
        ),
        trials=lambda wildcards: REAL_TRIALS.patterns(wildcards.case),
        view=lambda wildcards: REAL.cases[wildcards.case].view,
        simulated=lambda wildcards: (
            "--simulated" if REAL.cases[wildcards.case].kind == "simulation" else ""
        ),
        simulator=lambda wildcards: (
            f"--simulator {REAL.cases[wildcards.case].simulator}"
            if REAL.cases[wildcards.case].simulator
            else ""
        ),
    threads: 1
    resources:
        mem_mb=4000,
        runtime=30,
    message:
        "Real case {wildcards.case}"
    shell:
        "(python -m scapulohumeral.gap.cli gap diagnose {params.trials[test]}"
        " --reference {params.trials[reference]} --participant {input.participant} --view {params.view} {params.simulated} {params.simulator}"
        " --config {input.config} --settings {input.settings} --threads {threads}"
        " --out $(dirname {output.result})"
        " || [ $? -eq 3 ]) > {log.python} 2>&1"


rule tabulate_real_cases:
    input:
        results=lambda wildcards: expand(
            "results/gap/real/cases/{case}/result.json", case=REAL.of_kind(wildcards.kind)
        ),
        cases=str(REAL_FILE),
    output:
        table="results/gap/real/{kind}.csv",
    log:
        python="results/logs/tabulate_real_cases/{kind}.python.log",
    params:
        code=code_of("tabulate_real_cases"),
        names=lambda wildcards: REAL.of_kind(wildcards.kind),
        times=lambda wildcards: expand(
            "results/benchmarks/diagnose_real_case/{case}.jsonl", case=REAL.of_kind(wildcards.kind)
        ),
    threads: 1
    resources:
        runtime=5,
    message:
        "Real cases: table of kind {wildcards.kind}"
    script:
        "../scripts/tabulate_real_cases.py"


rule real_cases:
    input:
        tables=expand(
            "results/gap/real/{kind}.csv", kind=["effect", "no_effect", "artefact", "simulation"]
        ),
    output:
        table="results/gap/real/cases.csv",
    log:
        python="results/logs/real_cases.log",
    localrule: True
    message:
        "Real cases: {output.table}"
    shell:
        "(head -n 1 {input.tables[0]} && tail -q -n +2 {input.tables}) > {output.table} 2> {log.python}"
