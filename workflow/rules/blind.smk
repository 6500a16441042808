# Blind benchmark of the diagnosis: draw and seal, answer, score. The large one is `make blind`, the
# small one a first look, and `make blind_opensim` has persons of a second plant, OpenSim. Keys and
# seed lie in a folder that config/gap/blind.yaml names, outside the checkout, in one folder per draw;
# scoring takes the latest, and refuses it if it does not fit.
# No rule has code as an input: cases are drawn once, and scored again only on demand.


from scapulohumeral.configuration.check import read_blind


wildcard_constraints:
    benchmark="blind|blind_small|blind_opensim|open",


BLIND = read_blind(Path("config/gap/blind.yaml"))


# Open cases without any effect: what they make of the tests becomes the bank of thresholds; the first
# of them are its probes. Their keys tell nothing and are not kept.
rule draw_null_cases:
    input:
        models=expand("results/models/{participant}.json", participant=BLIND.participants),
        geometry=expand(
            "results/muscle_geometry/{participant}/quaternion.npz",
            participant=BLIND.participants,
        ),
        equations="results/equations/quaternion",
    output:
        cases=directory("results/gap/bank/{nulls}"),
    log:
        python="results/logs/draw_null_cases/{nulls}.python.log",
    benchmark:
        "results/benchmarks/draw_null_cases/{nulls}.jsonl"
    wildcard_constraints:
        nulls="cases|probes",
    params:
        cases=branch(
            evaluate("{nulls} == 'cases'"),
            then=BLIND.nulls,
            otherwise=BLIND.probes,
        ),
        seed=BLIND.nulls_seed,
        participants=BLIND.participants,
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    message:
        "Null bank: simulate {params.cases} cases without any effect"
    shell:
        "python -m simulated_persons.generate --kind null --cases {params.cases}"
        " --seed {params.seed} --results results --participants config/participants"
        " --names {params.participants}"
        " --out {output.cases} --keys $(mktemp -d)/keys > {log.python} 2>&1"


# Copy the bank to config/gap/null_bank.json to use it.
rule build_null_bank:
    input:
        cases="results/gap/bank/cases",
        probes="results/gap/bank/probes",
    output:
        bank="results/gap/null_bank.json",
    log:
        python="results/logs/build_null_bank.python.log",
    benchmark:
        "results/benchmarks/build_null_bank.jsonl"
    threads: 1
    resources:
        mem_mb=4000,
        runtime=120,
    message:
        "Null bank: test all cases without any effect"
    shell:
        "python -m scapulohumeral.gap.cli gap bank build --cases {input.cases}"
        " --probes {input.probes} --out {output.bank} > {log.python} 2>&1"


# A bank without probes gets them by `gap bank probe --cases results/gap/bank/probes` while it fits.
# After code of the diagnosis has changed: does the committed bank still say what the code says? With
# `--stamp` at the end of its command the hash of the bank is renewed, if it does.
rule check_null_bank:
    input:
        probes="results/gap/bank/probes",
    log:
        python="results/logs/check_null_bank.python.log",
    params:
        probes=BLIND.probes,
    threads: 1
    resources:
        mem_mb=4000,
        runtime=30,
    message:
        "Null bank: test its {params.probes} probes again"
    shell:
        "python -m scapulohumeral.gap.cli gap bank check --recompute {params.probes}"
        " --cases {input.probes} > {log.python} 2>&1"


rule draw_blind_cases:
    input:
        # Ancient: cases are drawn once, and answers to them kept, whatever is made anew afterwards.
        # The second plant reads the model for OpenSim.
        models=ancient(
            expand(
                "results/models/{participant}.{kind}",
                participant=BLIND.participants,
                kind=("json", "osim"),
            )
        ),
        geometry=ancient(
            expand(
                "results/muscle_geometry/{participant}/quaternion.npz",
                participant=BLIND.participants,
            )
        ),
        equations=ancient("results/equations/quaternion"),
    output:
        cases=directory("results/gap/{benchmark}/cases"),
        published="results/gap/{benchmark}/published.json",
    log:
        python="results/logs/draw_blind_cases/{benchmark}.python.log",
    benchmark:
        "results/benchmarks/draw_blind_cases/{benchmark}.jsonl"
    params:
        vault=Path(BLIND.keys).expanduser(),
        # Answers to other cases of these names must not pass for answers to these.
        answers="results/gap/{benchmark}/answers",
        cases=lambda wildcards: getattr(BLIND.cases, wildcards.benchmark),
        # The seed of a blind draw is drawn, and nobody knows it.
        seed=branch(
            evaluate("{benchmark} == 'open'"), then=f"--seed {BLIND.open_seed}", otherwise=""
        ),
        known=branch(evaluate("{benchmark} == 'open'"), then="--open", otherwise=""),
        plant=branch(evaluate("{benchmark} == 'blind_opensim'"), then="P2", otherwise="P1"),
        participants=BLIND.participants,
    threads: 1
    resources:
        mem_mb=3000,
        runtime=60,
    message:
        "Blind cases ({wildcards.benchmark}): simulate {params.cases} cases and seal their keys"
    shell:
        "rm -rf {params.answers}"
        " && keys={params.vault}/{wildcards.benchmark}-$(date +%s)"
        " && (python -m simulated_persons.generate --cases {params.cases} {params.seed}"
        " --plant {params.plant} --results results --participants config/participants"
        " --names {params.participants} --out {output.cases} --keys $keys"
        " && python -m scapulohumeral.gap.cli gap blind seal --cases {output.cases}"
        " --keys $keys --published {output.published} {params.known}) > {log.python} 2>&1"


rule answer_blind_cases:
    input:
        cases=rules.draw_blind_cases.output.cases,
        published=rules.draw_blind_cases.output.published,
    output:
        # Answers are no output: they would be removed when a run of hours is interrupted, and it
        # could not go on.
        answered=touch("results/gap/{benchmark}/answered"),
    log:
        python="results/logs/answer_blind_cases/{benchmark}.python.log",
    benchmark:
        "results/benchmarks/answer_blind_cases/{benchmark}.jsonl"
    params:
        answers="results/gap/{benchmark}/answers",
    threads: 2
    resources:
        mem_mb=8000,
        runtime=600,
    message:
        "Blind cases ({wildcards.benchmark}): diagnose every case"
    shell:
        "python -m scapulohumeral.gap.cli gap blind answer --cases {input.cases}"
        " --published {input.published} --answers {params.answers} --jobs {threads}"
        " > {log.python} 2>&1"


rule score_blind_answers:
    input:
        cases=rules.draw_blind_cases.output.cases,
        published=rules.draw_blind_cases.output.published,
        answered=rules.answer_blind_cases.output.answered,
    output:
        scores="results/gap/{benchmark}/scores.json",
    log:
        python="results/logs/score_blind_answers/{benchmark}.python.log",
    benchmark:
        "results/benchmarks/score_blind_answers/{benchmark}.jsonl"
    params:
        answers="results/gap/{benchmark}/answers",
        vault=Path(BLIND.keys).expanduser(),
    threads: 2
    # Solves the hidden task of every single effect, with a model that is fitted over it too.
    resources:
        mem_mb=8000,
        runtime=120,
    message:
        "Blind cases ({wildcards.benchmark}): open the keys and score"
    shell:
        "keys=$(ls -d {params.vault}/{wildcards.benchmark}-* | tail -n 1)"
        " && python -m scapulohumeral.gap.cli gap blind score --cases {input.cases}"
        " --published {input.published} --answers {params.answers} --keys $keys"
        " --out {output.scores} --jobs {threads} > {log.python} 2>&1"


# What limits the answers: the same inference without noise, and on what it predicts itself. Asked of
# cases that are scored, whose keys are open.
rule tell_limits:
    input:
        cases=rules.draw_blind_cases.output.cases,
        scores=rules.score_blind_answers.output.scores,
    output:
        limits="results/gap/{benchmark}/limits.csv",
    log:
        python="results/logs/tell_limits/{benchmark}.python.log",
    benchmark:
        "results/benchmarks/tell_limits/{benchmark}.jsonl"
    params:
        vault=Path(BLIND.keys).expanduser(),
    threads: 1
    resources:
        mem_mb=4000,
        runtime=120,
    message:
        "Blind cases ({wildcards.benchmark}): what limits the answers"
    shell:
        "keys=$(ls -d {params.vault}/{wildcards.benchmark}-* | tail -n 1)"
        " && python -m scapulohumeral.gap.cli gap blind limits --cases {input.cases}"
        " --keys $keys --out {output.limits} > {log.python} 2>&1"


# What trials like those of the open cases tell at most: the same inference on persons who are just as
# it assumes. What was recorded in them counts for nothing else, so no key is opened.
rule answer_assumed_persons:
    input:
        cases="results/gap/open/cases",
    output:
        answers="results/gap/open/assumed.csv",
        rates="results/gap/open/assumed.json",
    log:
        python="results/logs/answer_assumed_persons.python.log",
    benchmark:
        "results/benchmarks/answer_assumed_persons.jsonl"
    threads: 1
    resources:
        mem_mb=4000,
        runtime=180,
    message:
        "Open cases: answer persons who are just as the diagnosis assumes"
    shell:
        "python -m scapulohumeral.gap.cli gap blind assumed --cases {input.cases}"
        " --out {output.answers} > {log.python} 2>&1"


# Fit the weights of evidence to the open cases, beside those opened before, and tell what each stage
# of the diagnosis adds. Copy the former to config/gap/calibration.json to use them, and keep what
# they were fitted to: `scapulohumeral gap calibrate results/gap/open/draws.yaml --keep`.
rule calibrate_evidence:
    input:
        cases="results/gap/open/cases",
        published="results/gap/open/published.json",
        answered="results/gap/open/answered",
        opened=expand("config/gap/opened/{table}.csv", table=["cases", "hypotheses"]),
    output:
        draws="results/gap/open/draws.yaml",
        weights="results/gap/open/calibration.json",
        ablation="results/gap/open/ablation.csv",
    log:
        python="results/logs/calibrate_evidence.python.log",
    benchmark:
        "results/benchmarks/calibrate_evidence.jsonl"
    params:
        vault=Path(BLIND.keys).expanduser(),
        seed=BLIND.open_seed,
    threads: 1
    resources:
        mem_mb=3000,
        runtime=20,
    message:
        "Open cases: fit the weights of evidence"
    shell:
        "keys=$(ls -d {params.vault}/open-* | tail -n 1)"
        ' && echo "open_{params.seed}: {{cases: {input.cases}, published: {input.published},'
        ' answers: results/gap/open/answers, keys: $keys}}" > {output.draws}'
        " && (python -m scapulohumeral.gap.cli gap calibrate {output.draws} --out {output.weights}"
        " && python -m scapulohumeral.gap.cli gap ablation {output.draws} --out {output.ablation})"
        " > {log.python} 2>&1"
