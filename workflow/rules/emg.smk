# Electromyography: from raw recordings to envelopes. A trial whose participant.yaml names measured
# EMG is processed from that, any other from the recording that simulate_emg makes.


rule simulate_contractions:
    input:
        channels="config/emg/channels.csv",
    output:
        mvc="results/emg/{participant}/mvc_raw.csv",
    log:
        python="results/logs/simulate_contractions/{participant}.python.log",
    benchmark:
        "results/benchmarks/simulate_contractions/{participant}.jsonl"
    priority: 4
    params:
        code=code_of("simulate_contractions"),
        electrodes=lookup(within=config, dpath="emg/simulation"),
    threads: 1
    message:
        "Simulated maximal contractions: participant {wildcards.participant}"
    script:
        "../scripts/simulate_contractions.py"


rule simulate_elevations:
    input:
        participant=PARTICIPANT_FILE,
        model="results/models/{participant}.json",
        thorax="results/models/{participant}_thorax.json",
        geometry="results/muscle_geometry/{participant}/quaternion.npz",
        equations="results/equations/quaternion",
        plant="config/plant/{participant}.yaml",
        channels="config/emg/channels.csv",
        tracked=tracked_elevations,
    output:
        raw=expand("results/emg/{{participant}}/{plane}_raw.csv", plane=config["planes"]),
        solution="results/emg/{participant}/composite_plant.npz",
        summary="results/emg/{participant}/composite_plant.summary.json",
    log:
        solver="results/logs/simulate_elevations/{participant}.solver.log",
        python="results/logs/simulate_elevations/{participant}.python.log",
    benchmark:
        "results/benchmarks/simulate_elevations/{participant}.jsonl"
    priority: 4
    params:
        **SOLVER,
        code=code_of("simulate_elevations"),
        # Snakemake compares files as a set; elevations are joined in this order.
        planes=STUDY.planes,
        weights=lookup(within=config, dpath="weights/calibration"),
        pause_s=lookup(within=config, dpath="composite/pause_s"),
        electrodes=lookup(within=config, dpath="emg/simulation"),
        # Rigid, as the model's.
        tendon_strain=0.0,
    threads: 1
    resources:
        mem_mb=4000,
        runtime=60,
    message:
        "Simulated EMG of the elevations: participant {wildcards.participant}"
    script:
        "../scripts/simulate_elevations.py"


rule simulate_task:
    input:
        participant=PARTICIPANT_FILE,
        model="results/models/{participant}.json",
        thorax="results/models/{participant}_thorax.json",
        geometry="results/muscle_geometry/{participant}/quaternion.npz",
        equations="results/equations/quaternion",
        recording=recording,
        plant="config/plant/{participant}.yaml",
        channels="config/emg/channels.csv",
    output:
        raw="results/emg/{participant}/{trial}_raw.csv",
        solution="results/emg/{participant}/{trial}_plant.npz",
        summary="results/emg/{participant}/{trial}_plant.summary.json",
    log:
        solver="results/logs/simulate_task/{participant}_{trial}.solver.log",
        python="results/logs/simulate_task/{participant}_{trial}.python.log",
    benchmark:
        "results/benchmarks/simulate_task/{participant}_{trial}.jsonl"
    wildcard_constraints:
        trial=f"(?!(?:{'|'.join([*WHOLE_RECORDINGS, *STUDY.planes])})_)[a-z0-9_]+",
    params:
        **SOLVER,
        code=code_of("simulate_task"),
        weights=lookup(within=config, dpath="weights/calibration"),
        electrodes=lookup(within=config, dpath="emg/simulation"),
    threads: 1
    resources:
        mem_mb=4000,
        runtime=60,
    message:
        "Simulated EMG: participant {wildcards.participant}, {wildcards.trial}"
    script:
        "../scripts/simulate_task.py"


rule process_emg:
    input:
        unpack(raw_emg),
        participant=PARTICIPANT_FILE,
        recordings=recordings,
        channels="config/emg/channels.csv",
    output:
        envelope="results/emg/{participant}/{trial}_envelope.csv",
        quality="results/emg/{participant}/{trial}_quality.json",
    log:
        python="results/logs/process_emg/{participant}_{trial}.python.log",
    benchmark:
        "results/benchmarks/process_emg/{participant}_{trial}.jsonl"
    priority: 4
    params:
        code=code_of("process_emg"),
        envelope=lookup(within=config, dpath="emg/envelope"),
        quality=lookup(within=config, dpath="emg/quality"),
    threads: 1
    message:
        "EMG envelopes: participant {wildcards.participant}, {wildcards.trial}"
    script:
        "../scripts/process_emg.py"
