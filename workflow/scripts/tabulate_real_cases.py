"""Rule tabulate_real_cases: what diagnoses said of cases of known cause."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.configuration.check import read_real_cases
from scapulohumeral.gap.benchmark.real_cases import case_table

case_table(
    read_real_cases(Path(snakemake.input.cases)),
    snakemake.params.names,
    [Path(path) for path in snakemake.input.results],
    [Path(path) for path in snakemake.params.times],
).to_csv(snakemake.output.table, index=False, float_format="%.4g", lineterminator="\n")
