"""Rule render_report: the study as one HTML file."""

from dataclasses import fields
from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.report.render import render_report
from scapulohumeral.report.study import ReportFiles

names = [field.name for field in fields(ReportFiles) if field.name != "summary"]
files = {name: [Path(path) for path in snakemake.input[name]] for name in names}
html = render_report(ReportFiles(summary=Path(snakemake.input.summary), **files))
Path(snakemake.output.html).write_text(html, encoding="utf-8")
