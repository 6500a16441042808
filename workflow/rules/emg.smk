# Electromyography: from raw recordings to envelopes. A trial whose participant.yaml names measured
# EMG is processed from that, any other from the recording that simulate_emg makes.


rule process_emg:
    input:
        unpack(raw_emg),
        participant="config/participants/{participant}/participant.yaml",
        recordings=recordings,
        channels="config/emg/channels.csv",
        code=code_of("scapulohumeral.stages.emg_processing"),
    output:
        envelope="results/emg/{participant}/{trial}_envelope.csv",
        quality="results/emg/{participant}/{trial}_quality.json",
    log:
        python="results/logs/process_emg/{participant}_{trial}.python.log",
    benchmark:
        "results/benchmarks/process_emg/{participant}_{trial}.jsonl"
    params:
        envelope=lookup(within=config, dpath="emg/envelope"),
        quality=lookup(within=config, dpath="emg/quality"),
    threads: 1
    message:
        "EMG envelopes: participant {wildcards.participant}, {wildcards.trial}"
    script:
        "../scripts/process_emg.py"
