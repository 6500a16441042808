"""Rule render_report: the study as one HTML file."""

from dataclasses import fields
from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.report.coordination import CoordinationFiles
from scapulohumeral.report.render import render_report
from scapulohumeral.report.study import ReportFiles


def inputs(kind: type, *others: str) -> dict[str, list[Path]]:
    """Input files by the name of the field that takes them, except other fields."""
    names = [field.name for field in fields(kind) if field.name not in others]
    return {name: [Path(path) for path in snakemake.input[name]] for name in names}


html = render_report(
    ReportFiles(
        summary=Path(snakemake.input.summary),
        coordination=CoordinationFiles(**inputs(CoordinationFiles)),
        targets=Path(snakemake.input.targets),
        config=snakemake.params.config,
        **inputs(ReportFiles, "summary", "coordination", "targets", "config"),
    )
)
Path(snakemake.output.html).write_text(html, encoding="utf-8")
