"""Rule tabulate_tried: variants of the study's model against the recordings of all participants."""

from _log import log_to_file

log_to_file(snakemake)

from _against import against_files, fitted_region, task_files

from scapulohumeral.stages.distances.against import distances_to_recordings
from scapulohumeral.stages.distances.daily_tasks import task_distances
from scapulohumeral.stages.distances.tried import tried_table

given, region = snakemake.input, fitted_region(snakemake)
tasks = task_files(
    given.task_solutions, given.task_summaries, given.tracked_tasks, given.participants
)
table = tried_table(
    distances_to_recordings(against_files(snakemake), region), task_distances(tasks, region)
)
table.to_csv(snakemake.output.table, index=False, float_format="%.4g")
