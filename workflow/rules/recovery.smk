# What calibration makes of EMG from arms of other structure. Not part of the study: the table is
# copied to reports/, and no rule makes it there. Otherwise a fresh checkout would calibrate again.


use rule simulate_contractions as simulate_recovery_contractions with:
    output:
        mvc="results/recovery/{plant}/{participant}/mvc_raw.csv",
    log:
        python="results/logs/simulate_recovery_contractions/{plant}_{participant}.python.log",
    benchmark:
        "results/benchmarks/simulate_recovery_contractions/{plant}_{participant}.jsonl"
    params:
        electrodes=recovery_electrodes,
    message:
        "Simulated maximal contractions of arm {wildcards.plant}: participant {wildcards.participant}"


use rule simulate_elevations as simulate_recovery_elevations with:
    input:
        unpack(recovery_model),
        participant=PARTICIPANT_FILE,
        thorax="results/models/{participant}_thorax.json",
        equations="results/equations/quaternion",
        plant=branch(
            has_own_factors,
            then="config/plant/{participant}.yaml",
            otherwise="config/plant/unchanged.yaml",
        ),
        channels="config/emg/channels.csv",
        tracked=tracked_elevations,
    output:
        raw=expand(
            "results/recovery/{{plant}}/{{participant}}/{plane}_raw.csv", plane=config["planes"]
        ),
        solution="results/recovery/{plant}/{participant}/composite_plant.npz",
        summary="results/recovery/{plant}/{participant}/composite_plant.summary.json",
    log:
        solver="results/logs/simulate_recovery_elevations/{plant}_{participant}.solver.log",
        python="results/logs/simulate_recovery_elevations/{plant}_{participant}.python.log",
    benchmark:
        "results/benchmarks/simulate_recovery_elevations/{plant}_{participant}.jsonl"
    params:
        weights=recovery_weights,
        electrodes=recovery_electrodes,
        tendon_strain=lambda wildcards: RECOVERY.plants[wildcards.plant].tendon_strain,
    message:
        "Simulated EMG of arm {wildcards.plant}: participant {wildcards.participant}"


use rule process_emg as process_recovery_emg with:
    input:
        raw="results/recovery/{plant}/{participant}/{trial}_raw.csv",
        mvc="results/recovery/{plant}/{participant}/mvc_raw.csv",
        participant=PARTICIPANT_FILE,
        recordings=recordings,
        channels="config/emg/channels.csv",
    output:
        envelope="results/recovery/{plant}/{participant}/{trial}_envelope.csv",
        quality="results/recovery/{plant}/{participant}/{trial}_quality.json",
    log:
        python="results/logs/process_recovery_emg/{plant}_{participant}_{trial}.python.log",
    benchmark:
        "results/benchmarks/process_recovery_emg/{plant}_{participant}_{trial}.jsonl"
    message:
        "EMG envelopes of arm {wildcards.plant}: participant {wildcards.participant},"
        " {wildcards.trial}"


use rule calibrate as calibrate_recovery with:
    input:
        participant=PARTICIPANT_FILE,
        model="results/models/{participant}.json",
        thorax="results/models/{participant}_thorax.json",
        geometry="results/muscle_geometry/{participant}/quaternion.npz",
        equations="results/equations/quaternion",
        channels="config/emg/channels.csv",
        tracked=tracked_elevations,
        envelopes=expand(
            "results/recovery/{{plant}}/{{participant}}/{plane}_envelope.csv",
            plane=config["planes"],
        ),
    output:
        scalers="results/recovery/{plant}/{participant}_scalers.json",
        solution="results/recovery/{plant}/{participant}_paper.npz",
        summary="results/recovery/{plant}/{participant}_paper.summary.json",
    log:
        solver="results/logs/calibrate_recovery/{plant}_{participant}.solver.log",
        python="results/logs/calibrate_recovery/{plant}_{participant}.python.log",
    benchmark:
        "results/benchmarks/calibrate_recovery/{plant}_{participant}.jsonl"
    message:
        "Calibration to arm {wildcards.plant}: participant {wildcards.participant}"


use rule score_calibration as score_recovery with:
    input:
        scalers="results/recovery/{plant}/{participant}_scalers.json",
        plant=branch(
            has_own_factors,
            then="config/plant/{participant}.yaml",
            otherwise="config/plant/unchanged.yaml",
        ),
        channels="config/emg/channels.csv",
    output:
        scored="results/recovery/{plant}/{participant}.json",
    log:
        python="results/logs/score_recovery/{plant}_{participant}.python.log",
    benchmark:
        "results/benchmarks/score_recovery/{plant}_{participant}.jsonl"
    message:
        "Calibration against arm {wildcards.plant}: participant {wildcards.participant}"


rule tabulate_recovery:
    input:
        scored=expand(
            "results/recovery/{plant}/{participant}.json",
            plant=RECOVERY.plants,
            participant=RECOVERY.participant,
        ),
    output:
        table="results/recovery/recovery.csv",
    log:
        python="results/logs/tabulate_recovery.python.log",
    benchmark:
        "results/benchmarks/tabulate_recovery.jsonl"
    params:
        code=code_of("tabulate_recovery"),
    threads: 1
    message:
        "What calibration recovers of simulated arms"
    script:
        "../scripts/tabulate_recovery.py"


rule recovery:
    # Not part of the study: one calibration for each arm.
    input:
        rules.tabulate_recovery.output,
    log:
        python="results/logs/recovery.log",
    localrule: True
    message:
        "The recovery is complete: reports/recovery.csv"
    shell:
        "cp {input} reports 2> {log.python}"
