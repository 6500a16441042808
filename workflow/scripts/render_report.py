"""Rule render_report: the study as one HTML file."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.report.render import render_report

html = render_report(
    summary=Path(snakemake.input.summary),
    solutions=[Path(path) for path in snakemake.input.solutions],
    summaries=[Path(path) for path in snakemake.input.summaries],
    geometry_quality=[Path(path) for path in snakemake.input.geometry_quality],
)
Path(snakemake.output.html).write_text(html, encoding="utf-8")
