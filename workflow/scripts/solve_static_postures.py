"""Rule solve_static_postures: the girdle of least effort under a still arm, and the recorded."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from _files import model_files

from scapulohumeral.stages.checks.static_postures import PostureFiles, static_postures

scalers = snakemake.input.get("calibration")
table = static_postures(
    PostureFiles(
        model=model_files(snakemake),
        channels=Path(snakemake.input.channels),
        calibration=Path(scalers) if scalers else None,
        tracked=[Path(path) for path in snakemake.input.tracked],
    ),
    snakemake.params.weights,
    snakemake.params.w_gh,
)
table.to_csv(snakemake.output.table, index=False, float_format="%.4g")
