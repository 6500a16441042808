"""Rule simulate_elevations: the reference plant does the composite motion."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from _files import model_files, solve_settings

from scapulohumeral.emg.synthesis import SimulationSettings
from scapulohumeral.stages.reference_plant import PlantFiles, PlantOutputs, simulate_elevations

simulate_elevations(
    files=PlantFiles(
        plant=Path(snakemake.input.plant),
        channels=Path(snakemake.input.channels),
        model=model_files(snakemake),
        tendon_strain=snakemake.params.tendon_strain,
    ),
    tracked=[Path(path) for path in snakemake.input.tracked],
    settings=solve_settings(snakemake),
    pause_s=snakemake.params.pause_s,
    electrodes=SimulationSettings(**snakemake.params.electrodes),
    outputs=PlantOutputs(
        raw={Path(path).name.removesuffix("_raw.csv"): Path(path) for path in snakemake.output.raw},
        solution=Path(snakemake.output.solution),
        summary=Path(snakemake.output.summary),
        solver_log=Path(snakemake.log.solver),
    ),
)
