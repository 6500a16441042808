"""Persons of the second plant as they are drawn, and how a load is shared, without OpenSim."""

from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest
from scipy.optimize import LinearConstraint, minimize

from scapulohumeral.errors import SolveError
from simulated_persons.drawing import attempts
from simulated_persons.drawing.trials import MISSED
from simulated_persons.observation import CHANNELS, perfect_measurement
from simulated_persons.opensim_plant import trials
from simulated_persons.opensim_plant.arm import OpenSimArm
from simulated_persons.opensim_plant.body import JOINTS, SEGMENTS, Body, read_body, write_body
from simulated_persons.opensim_plant.effects import ACTIONS, affected
from simulated_persons.opensim_plant.least_effort import QUADRATIC_SHARE, Demand, least_effort
from simulated_persons.opensim_plant.mechanics import Mechanics
from simulated_persons.plan import LIBRARY, OPENSIM, OUTSIDE, OWN, Draw, draw_plans

pytestmark = pytest.mark.unit

EVERY = (*LIBRARY[OPENSIM], *OUTSIDE[OPENSIM])
GROUPS = np.array(["infra", "delt_scap", "serr_ant", "trap_scap", "trap_clav", "bic"])
# From which body to which: muscles of all groups cross all joints of interest here.
SPAN = tuple(SimpleNamespace(body=body) for body in ("thorax", "ulna_r"))


@pytest.fixture(name="arm")
def plain_arm() -> OpenSimArm:
    """A body as the participant's own, with one muscle of each group."""
    ones, joints = np.ones(len(GROUPS)), np.zeros(len(JOINTS))
    none = np.array(0.0)
    body = Body(
        np.ones(len(SEGMENTS)), none, np.array([0.0, -9.8, 0.0]), ones, ones, ones, 0.04 * ones,
        0.02 * ones, 0.06 * ones, ones, 0.0 * ones, ones, np.zeros(2), np.zeros((2, 3)), joints,
        none, none, np.zeros(3), np.array(1.0),
    )  # fmt: skip
    record = SimpleNamespace(muscles=[SimpleNamespace(points=SPAN) for _ in GROUPS])
    anatomy = SimpleNamespace(groups=GROUPS, record=record)
    return OpenSimArm(anatomy, body, perfect_measurement(np.ones(len(CHANNELS))))


def changes(before: object, after: object) -> set[str]:
    """Names of the arrays that differ."""
    values = vars(after)
    return {k for k, v in vars(before).items() if not np.array_equal(v, values[k])}


@pytest.mark.parametrize("draw", EVERY, ids=lambda draw: draw.__name__)
def test_each_effect_changes_the_body_or_the_record(draw: Draw, arm: OpenSimArm) -> None:
    injection = draw(np.random.default_rng(3))
    found = affected(arm, injection)
    on_body = changes(arm.body, found.body)
    on_record = changes(arm.measurement, found.measurement)
    assert bool(on_body) == (injection.family in ACTIONS)
    assert bool(on_record) != bool(on_body)


def test_bodies_survive_the_way_to_the_other_process(arm: OpenSimArm, tmp_path) -> None:
    write_body(arm.body, tmp_path / "body.npz")
    assert not changes(arm.body, read_body(tmp_path / "body.npz"))


def test_the_second_plant_draws_only_what_it_can_be_given() -> None:
    plans = draw_plans(4, 80, ("par1",), plant=OPENSIM)
    assert {plan.plant for plan in plans} == {OPENSIM}
    assert {plan.kind for plan in plans} == {"null", "single", "pair", "unknown", "strategy"}
    families = {i.family for plan in plans if plan.kind != "strategy" for i in plan.injections}
    assert families <= {draw.__name__ for draw in EVERY}


def test_each_case_is_simulated_by_its_plant(monkeypatch: pytest.MonkeyPatch) -> None:
    plans = [draw_plans(4, 1, ("par1",), "null", plant)[0] for plant in (OWN, OPENSIM)]
    asked: dict[str, list[str]] = {}

    def by(name: str):
        def simulate(_, own):
            asked[name] = [plan.plant for plan in own]
            return {plan.id: MISSED for plan in own}

        return simulate

    monkeypatch.setattr(attempts, "simulated", by("own"))
    monkeypatch.setattr(attempts, "simulated_by_opensim", by("opensim"))
    assert set(attempts._simulated(SimpleNamespace(), plans)) == {plan.id for plan in plans}
    assert asked == {"own": [OWN], "opensim": [OPENSIM]}


@pytest.mark.parametrize("code", [0, trials.UNSHARED, 1])
def test_a_load_that_cannot_be_shared_out_is_no_failure_of_opensim(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, code: int
) -> None:
    ended = SimpleNamespace(returncode=code, stderr="a row is missed")
    monkeypatch.setattr(trials.subprocess, "run", lambda *_, **__: ended)
    if code == 1:
        with pytest.raises(SolveError, match="ended with 1: a row is missed"):
            trials._shared_out(tmp_path)
    else:
        assert trials._shared_out(tmp_path) is (code == 0)


def test_a_person_whose_load_cannot_be_shared_out_is_drawn_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    [plan] = draw_plans(4, 1, ("par1",), "null", OPENSIM)
    for name in ("draw_case", "recorded_ways", "trial_runs"):
        monkeypatch.setattr(trials, name, lambda *_: MagicMock())
    monkeypatch.setattr(trials, "_made", lambda *_: None)
    study = MagicMock()
    assert trials.simulated_by_opensim(study, [plan]) == {plan.id: trials.NOT_SHARED}


def test_sharing_is_the_least_effort_that_a_general_solver_finds() -> None:
    """Cubed activations, hard rows: SLSQP on activations against the dual."""
    rng = np.random.default_rng(2)
    matrix, wanted = rng.normal(size=(3, 8)), rng.uniform(0.1, 0.6, 8)
    cost = rng.uniform(0.5, 2.0, 8)
    target = matrix @ wanted
    demand = Demand(matrix, target, np.full(3, 1e6), cost, np.zeros(8), np.ones(8))
    found, _ = least_effort(demand, np.zeros(3))

    def effort(a: np.ndarray) -> float:
        return float(cost @ (a**3 / 3.0 + QUADRATIC_SHARE * a**2 / 2.0))

    held = LinearConstraint(matrix, target, target)
    best = minimize(effort, wanted, bounds=[(0.0, 1.0)] * 8, constraints=[held], method="SLSQP")
    np.testing.assert_allclose(matrix @ found, target, atol=1e-3)
    assert effort(found) == pytest.approx(best.fun, rel=1e-2)


def test_a_force_that_is_no_number_is_named_and_its_person_drawn_again() -> None:
    parts = {"torque": (4, 10), "arms": (4, 6, 10), "force": (4, 5, 6)}
    parts |= {"support": (4, 3, 10), "pull": (4, 6, 3), "burden": (4, 3)}
    whole = {name: np.ones(shape) for name, shape in parts.items()}
    assert Mechanics(**whole).at(2).force.shape == (1, 5, 6)
    whole["force"][2, 4, 1] = np.nan
    with pytest.raises(SolveError, match="no number for force in 1 frames, first in frame 2"):
        Mechanics(**whole)
