"""Rule tabulate_geometry_audit: the worst muscle of every prediction in one table."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.stages.geometry_audit import audit_table

audits = [Path(path) for path in snakemake.input.audits]
names = [(path.parent.name, path.name.removesuffix("_geometry.csv")) for path in audits]
table = audit_table(audits, names)
table.to_csv(snakemake.output.table, index=False, float_format="%.6g")
