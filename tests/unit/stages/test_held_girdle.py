"""The price of a girdle held to a motion: it grows with the hold, as the motion comes nearer."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from small_posed import small_posed, small_settings, small_target

from scapulohumeral.ocp.solving.solver import Start, solve
from scapulohumeral.stages.checks import held_girdle as stage
from scapulohumeral.stages.prediction import TRACKED

pytestmark = pytest.mark.unit

NODES = 21
SHARES = [1.0, 0.1, 0.01]
# Heavier rates than those of a prediction: three muscles leave a free girdle many optima.
SETTINGS = SimpleNamespace(solve=small_settings(stability=0.0, regularisation=0.1), variant="study")
FILES = SimpleNamespace(arm=None)


@pytest.fixture(scope="module")
def problems(quaternion_equations):
    """The free problem, the function that poses it held, and the free solution."""

    def posed(share: float):
        target = small_target(NODES, tracked=TRACKED, guidance=share)
        return small_posed(quaternion_equations, target, SETTINGS.solve)

    # Let go step by step, as it is held: from cold this arm ends in another optimum.
    point = Start(posed(1.0).layout().join(posed(1.0).cold_start()))
    for share in (*SHARES, 0.0):
        result = solve(posed(share).problem, Start(point.free), SETTINGS.solve.solver)
        assert result.optimal, result.message
        point = result.point
    return posed(0.0), posed, point


@pytest.fixture
def table(problems, monkeypatch):
    """Function that makes the table of shares."""
    free, posed, point = problems
    header = {"participant": "par2", "planes": {"frontal": (0, NODES)}}
    solution = SimpleNamespace(header=header, free=point.free)
    monkeypatch.setattr(stage, "read_solution", lambda _: solution)
    monkeypatch.setattr(stage, "girdle_held", lambda *_: (free, posed))
    return lambda shares: stage.held_girdle(None, FILES, SETTINGS, Path("free.npz"), shares)


def test_price_falls_with_the_hold_and_the_distance_grows(table):
    rows = table(SHARES).set_index("share")
    assert list(rows.status) == ["optimal"] * 4
    assert rows.loc[0.0, "price_percent"] == pytest.approx(0.0, abs=1e-12)
    firmest_first = rows.loc[[1.0, 0.1, 0.01, 0.0]]
    assert (np.diff(firmest_first.price_percent) < 0.0).all()
    # Of all that is followed this is one angle: hardly held, it need not be the nearer one.
    assert (np.diff(firmest_first.ur_frontal_deg[[1.0, 0.1, 0.0]]) > 0.0).all()


def test_parts_are_those_of_the_free_objective_and_muscles_pay_what_activation_adds(table):
    rows = table(SHARES).set_index("share")
    parts = rows[list(stage.TERMS)].sum(axis=1)
    np.testing.assert_allclose(parts, rows.objective, rtol=1e-12)
    added = rows.loc[1.0, "activation"] - rows.loc[0.0, "activation"]
    words = [entry.rsplit(" ", 1)[1] for entry in rows.loc[1.0, "paying"].split(", ")]
    assert len(words) == 3, "all muscles of the small arm"
    assert sum(map(float, words)) == pytest.approx(added, abs=2e-3)


def test_failed_solve_keeps_its_reason_and_no_numbers(table, monkeypatch):
    def fails_when_held(posed, start, settings, log):
        result = solve(posed.problem, start, settings.solver, log)
        return replace(result, optimal=False, message="too far")

    monkeypatch.setattr(stage, "solve_posed", fails_when_held)
    rows = table([1.0]).set_index("share")
    assert rows.loc[1.0, "status"] == "too far"
    assert np.isnan(rows.loc[1.0, "objective"])
    assert rows.loc[0.0, "status"] == "optimal"
