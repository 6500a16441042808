"""Rule solve_validation: track a daily task with generic or calibrated muscles."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from _files import model_files, solve_settings

from scapulohumeral.stages.validation import ValidationFiles, solve_validation

solve_validation(
    trial=snakemake.wildcards.trial,
    files=ValidationFiles(
        model=model_files(snakemake),
        channels=Path(snakemake.input.channels),
        calibration=next(map(Path, snakemake.input.calibration), None),
        tracked=Path(snakemake.input.tracked),
    ),
    settings=solve_settings(snakemake),
    solution=(Path(snakemake.output.solution), Path(snakemake.output.summary)),
    solver_log=Path(snakemake.log.solver),
)
