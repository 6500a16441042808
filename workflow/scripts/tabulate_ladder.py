"""Rule tabulate_ladder: what every step from the authors' problem to the study's changes."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.report.prediction.ladder import ladder_figure, ladder_table
from scapulohumeral.stages.distances.against import read_predictions

predictions = read_predictions(
    [Path(path) for path in snakemake.input.solutions],
    [Path(path) for path in snakemake.input.summaries],
)
table = ladder_table(predictions)
table.to_csv(snakemake.output.table, index=False, float_format="%.4g")
Path(snakemake.output.figure).write_text(ladder_figure(table).svg, encoding="utf-8")
