"""Rule compare_tasks: predictions on the arm of daily tasks against their recordings."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from _against import fitted_region

from scapulohumeral.report.prediction.daily_tasks import TaskFiles, task_distances

names = ("solutions", "summaries", "tracked", "participants")
files = TaskFiles(**{name: [Path(path) for path in snakemake.input[name]] for name in names})
table = task_distances(files, fitted_region(snakemake))
table.to_csv(snakemake.output.table, index=False, float_format="%.4g")
