"""Rule fit_muscle_geometry: muscle lengths as functions of the coordinates of one formulation."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.model.muscle_geometry import FitSettings
from scapulohumeral.stages.geometry import fit_muscle_geometry

fit_muscle_geometry(
    samples=Path(snakemake.input.samples),
    model=Path(snakemake.input.model),
    formulation=snakemake.wildcards.formulation,
    settings=FitSettings(rmse_change=snakemake.params.rmse_change_stop),
    geometry=Path(snakemake.output.geometry),
    quality=Path(snakemake.output.quality),
)
