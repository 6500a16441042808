"""Rule compare_predictions: predictions against recordings and against published predictions."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.model.muscle_paths.pose_region import Region
from scapulohumeral.report.prediction.against import AgainstFiles, compare

given = snakemake.input
compare(
    AgainstFiles(
        solutions=[Path(path) for path in given.solutions],
        summaries=[Path(path) for path in given.summaries],
        tracked=[Path(path) for path in given.tracked],
        participants=[Path(path) for path in given.participants],
        targets=Path(given.targets),
        audit=Path(given.audit),
    ),
    Region(snakemake.params.margin_deg, tuple(snakemake.params.scapula_turn_deg)),
    Path(snakemake.output.recording),
    Path(snakemake.output.published),
)
