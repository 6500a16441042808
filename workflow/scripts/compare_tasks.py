"""Rule compare_tasks: predictions on the arm of daily tasks against their recordings."""

from _log import log_to_file

log_to_file(snakemake)

from _against import fitted_region, task_files

from scapulohumeral.stages.distances.daily_tasks import task_distances

given = snakemake.input
files = task_files(given.solutions, given.summaries, given.tracked, given.participants)
table = task_distances(files, fitted_region(snakemake))
table.to_csv(snakemake.output.table, index=False, float_format="%.4g")
