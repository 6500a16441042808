"""Simulated persons are made of the study's models: without any effect they do what was recorded.

Run by the rule test_results.
"""

from dataclasses import replace
from pathlib import Path

import pytest

from simulated_persons.drawing.study import load_study
from simulated_persons.drawing.trials import simulated
from simulated_persons.plan import KEEPS, draw_plans

pytestmark = pytest.mark.results

PERSONS, ABLE = 3, 2  # of each participant, of whom some may be weak


def test_persons_follow_and_keep_recorded_movements(files, repository: Path) -> None:
    given = files["models"]
    models = [Path(path) for path in ([given] if isinstance(given, str) else given)]
    names = [path.stem for path in models]
    study = load_study(models[0].parents[1], repository / "config" / "participants", names)
    for name in names:
        plans = [
            replace(plan, person=KEEPS, repeats=0)
            for plan in draw_plans(11, PERSONS, (name,), "null")
        ]
        found = simulated(study, plans)
        failures = [trials for trials in found.values() if isinstance(trials, str)]
        assert PERSONS - len(failures) >= ABLE, f"{name}: {', '.join(failures)}"
