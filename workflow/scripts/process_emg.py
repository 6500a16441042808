"""Rule process_emg: envelopes and signal quality of one trial, from measured or simulated EMG."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.emg.quality import QualityLimits
from scapulohumeral.emg.settings import EnvelopeSettings
from scapulohumeral.stages.emg_processing import EmgFiles, EmgSettings, process_emg

process_emg(
    trial=snakemake.wildcards.trial,
    files=EmgFiles(
        participant=Path(snakemake.input.participant),
        channels=Path(snakemake.input.channels),
        raw=Path(snakemake.input.raw),
        mvc=Path(snakemake.input.mvc),
    ),
    settings=EmgSettings(
        envelope=EnvelopeSettings(**snakemake.params.envelope),
        quality=QualityLimits(**snakemake.params.quality),
    ),
    envelope=Path(snakemake.output.envelope),
    quality=Path(snakemake.output.quality),
)
