"""Simulated persons are made of the study's models: without any effect they do what was recorded.

Run by the rule test_results.
"""

from dataclasses import replace

import pytest
from recorded_tasks import with_all_tasks
from result_files import paths

from simulated_persons.drawing.study import load_study
from simulated_persons.drawing.trials import simulated
from simulated_persons.plan import KEEPS, draw_plans

pytestmark = pytest.mark.results

PERSONS, ABLE = 3, 2  # of each participant, of whom some may be weak


def test_persons_follow_and_keep_recorded_movements(files) -> None:
    folders = with_all_tasks(paths(files, "recordings"))
    if not folders:
        pytest.skip("no participant has the elevations that simulated persons repeat")
    [participants], names = {folder.parent for folder in folders}, [f.name for f in folders]
    results = paths(files, "models")[0].parents[1]
    study = load_study(results, participants, names)
    for name in names:
        plans = [
            replace(plan, person=KEEPS, repeats=0)
            for plan in draw_plans(11, PERSONS, (name,), "null")
        ]
        found = simulated(study, plans)
        failures = [trials for trials in found.values() if isinstance(trials, str)]
        assert PERSONS - len(failures) >= ABLE, f"{name}: {', '.join(failures)}"
