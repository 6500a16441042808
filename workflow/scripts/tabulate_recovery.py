"""Rule tabulate_recovery: calibrated muscle parameters beside those of the simulated arms."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.stages.calibration_score import recovery_table

scored = {Path(path).parent.name: Path(path) for path in snakemake.input.scored}
recovery_table(scored).to_csv(snakemake.output.table, index=False, float_format="%.4g")
