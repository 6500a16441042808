"""Rule simulate_contractions: raw EMG of simulated maximal contractions."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.emg.synthesis import SimulationSettings
from scapulohumeral.stages.reference_plant import simulate_contractions

simulate_contractions(
    participant=snakemake.wildcards.participant,
    channels=Path(snakemake.input.channels),
    electrodes=SimulationSettings(**snakemake.params.electrodes),
    mvc=Path(snakemake.output.mvc),
)
