"""Rule tabulate_tried: variants of the study's model against the recordings of all participants."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.model.muscle_paths.pose_region import Region
from scapulohumeral.report.prediction.against import AgainstFiles, distances_to_recordings
from scapulohumeral.report.prediction.tried import tried_table

given = snakemake.input
distances = distances_to_recordings(
    AgainstFiles(
        solutions=[Path(path) for path in given.solutions],
        summaries=[Path(path) for path in given.summaries],
        tracked=[Path(path) for path in given.tracked],
        participants=[Path(path) for path in given.participants],
        targets=Path(given.targets),
    ),
    Region(snakemake.params.margin_deg, tuple(snakemake.params.scapula_turn_deg)),
)
tried_table(distances).to_csv(snakemake.output.table, index=False, float_format="%.4g")
