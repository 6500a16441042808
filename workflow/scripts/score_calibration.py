"""Rule score_calibration: how far calibrated scalers are from the plant."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.stages.calibration_score import score

plant = snakemake.input.get("plant")
score(
    calibration=Path(snakemake.input.scalers),
    plant=Path(plant) if plant else None,
    channels=Path(snakemake.input.channels),
    scored=Path(snakemake.output.scored),
)
