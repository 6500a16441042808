"""Rule tabulate_sensitivity: what every case changes in the prediction."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.problems.sensitivity import Case
from scapulohumeral.report.prediction.sensitivity import sensitivity_table
from scapulohumeral.stages.distances.against import read_predictions

predictions = read_predictions(
    [Path(path) for path in snakemake.input.solutions],
    [Path(path) for path in snakemake.input.summaries],
)
table = sensitivity_table([Case(**case) for case in snakemake.params.cases], predictions)
table.to_csv(snakemake.output.table, index=False, float_format="%.5g")
