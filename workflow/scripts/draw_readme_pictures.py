"""Rule draw_readme_pictures: motion and gimbal lock of one trial, as SVG files."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.model.record import read_record
from scapulohumeral.report.study import by_trial, read_runs
from scapulohumeral.report.tracking.figures import gimbal_figure, motion_figure

files = {
    name: [Path(path) for path in snakemake.input[name]]
    for name in ("solutions", "summaries", "models", "participants")
}
runs = read_runs(files["summaries"], files["solutions"])
record = read_record(files["models"][0])
[trial] = by_trial(runs, {record.participant: record}, files["participants"])
for output, draw in (("motion", motion_figure), ("gimbal_lock", gimbal_figure)):
    Path(snakemake.output[output]).write_text(draw(trial).svg, encoding="utf-8")
