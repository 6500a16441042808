"""Rule benchmark_solver: ratios to a limited-memory Hessian and to plain opty."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.stages.benchmark import benchmark_solver
from scapulohumeral.stages.model_files import ModelFiles
from scapulohumeral.stages.posed_problem import SolveSettings

settings = dict(snakemake.params.items())
opty_muscles = settings.pop("opty_muscles")
benchmark_solver(
    trial="frontal",
    files=ModelFiles(
        participant=Path(snakemake.input.participant),
        model=Path(snakemake.input.model),
        thorax=Path(snakemake.input.thorax),
        geometry=Path(snakemake.input.geometry),
        equations=Path(snakemake.input.equations),
    ),
    settings=SolveSettings(**settings),
    opty_muscles=opty_muscles,
    output=Path(snakemake.output.record),
)
