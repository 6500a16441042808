"""Rule build_equations: derive, convert and differentiate the equations of one formulation."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.dynamics import compiled

equations = compiled.build(snakemake.wildcards.formulation)
equations.save(Path(snakemake.output.equations))
print(equations.header)
