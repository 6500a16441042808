"""Rule change_tracking: the tracked motion that a case follows and starts from."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.ocp.solution import read_solution, write_solution
from scapulohumeral.problems.changed_tracking import changed_tracking
from scapulohumeral.problems.sensitivity import Case

tracked = read_solution(Path(snakemake.input.tracked))
changed = changed_tracking(tracked, Case(**snakemake.params.case), snakemake.params.random_turn_deg)
write_solution(changed, Path(snakemake.output.tracked))
