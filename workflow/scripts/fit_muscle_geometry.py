"""Rule fit_muscle_geometry: muscle lengths as functions of the coordinates of one formulation."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.dynamics import compiled
from scapulohumeral.model.muscle_paths.fit import FitSettings
from scapulohumeral.model.muscle_paths.geometry import save_geometry
from scapulohumeral.stages.geometry import assess_muscle_geometry, fit_muscle_geometry

samples, model = Path(snakemake.input.samples), Path(snakemake.input.model)
settings = FitSettings(
    length_target_m=snakemake.params.length_target_m,
    arm_target_m=snakemake.params.arm_target_m,
    rmse_change=snakemake.params.rmse_change_stop,
)
fit = fit_muscle_geometry(samples, model, snakemake.wildcards.formulation, settings)
save_geometry(fit.geometry, Path(snakemake.output.geometry))

participant = Path(snakemake.input.participant)
dynamics = compiled.load(Path(snakemake.input.equations))
quality = assess_muscle_geometry(fit, samples, model, participant, dynamics)
quality.to_csv(snakemake.output.quality, index=False, float_format="%.6g")
