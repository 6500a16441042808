"""Rule simulate_task: the reference plant does a daily task."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from _files import model_files, solve_settings

from scapulohumeral.emg.synthesis import SimulationSettings
from scapulohumeral.stages.reference_plant import PlantFiles, PlantOutputs, simulate_task

trial = snakemake.wildcards.trial
simulate_task(
    trial=trial,
    files=PlantFiles(
        plant=Path(snakemake.input.plant),
        channels=Path(snakemake.input.channels),
        model=model_files(snakemake),
    ),
    settings=solve_settings(snakemake),
    electrodes=SimulationSettings(**snakemake.params.electrodes),
    outputs=PlantOutputs(
        raw={trial: Path(snakemake.output.raw)},
        solution=Path(snakemake.output.solution),
        summary=Path(snakemake.output.summary),
        solver_log=Path(snakemake.log.solver),
    ),
)
