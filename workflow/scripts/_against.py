"""Files and region that rules name alike which compare predictions with recordings."""

from pathlib import Path
from typing import Any

from scapulohumeral.model.muscle_paths.pose_region import Region
from scapulohumeral.stages.distances.against import AgainstFiles
from scapulohumeral.stages.distances.daily_tasks import TaskFiles


def against_files(snakemake: Any) -> AgainstFiles:
    """Predictions and what they are compared with, from the inputs of a rule."""
    given = snakemake.input
    audit = given.get("audit")
    return AgainstFiles(
        solutions=[Path(path) for path in given.solutions],
        summaries=[Path(path) for path in given.summaries],
        tracked=[Path(path) for path in given.tracked],
        participants=[Path(path) for path in given.participants],
        targets=Path(given.targets),
        audit=None if audit is None else Path(audit),
        elsewhere=snakemake.params.elsewhere,
    )


def task_files(solutions: Any, summaries: Any, tracked: Any, participants: Any) -> TaskFiles:
    """Predicted daily tasks and what they are compared with, from inputs of a rule."""
    named = (solutions, summaries, tracked, participants)
    return TaskFiles(*([Path(path) for path in paths] for paths in named))


def fitted_region(snakemake: Any) -> Region:
    """Region that muscle paths were fitted to, from the parameters of a rule."""
    given = snakemake.params
    return Region(given.margin_deg, tuple(given.scapula_turn_deg), given.girdle_turn_deg)
