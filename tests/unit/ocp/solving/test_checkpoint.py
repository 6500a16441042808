"""Iterates that survive a killed process, and the clean end on SIGTERM."""

import os
import signal
from dataclasses import replace

import numpy as np
import pytest
from small_arm import (
    small_forces,
    small_muscles,
    small_objective,
    small_parameters,
)
from small_problem import cold_guess

from scapulohumeral.errors import StoppedError
from scapulohumeral.ocp.problem import Problem
from scapulohumeral.ocp.solving import checkpoint
from scapulohumeral.ocp.solving.checkpoint import ITERATE, Checkpoint, Iterate, content_hash
from scapulohumeral.ocp.solving.coarse_to_fine import solve_coarse_to_fine
from scapulohumeral.ocp.solving.solver import SolverSettings, Start

pytestmark = pytest.mark.unit

NODES = 17
SETTINGS = SolverSettings(tolerance=1e-8, coarse=(5, 9))


class Interrupting(Problem):
    """A problem on NODES nodes that ends in its third iteration, as a test says."""

    def intermediate(self, *args):
        go_on = super().intermediate(*args)
        if self.layout.nodes == NODES and args[1] == 3:
            self.end()
        return go_on


class KilledError(Exception):
    """Stands for a death of the process."""


def die():
    raise KilledError


def terminate():
    os.kill(os.getpid(), signal.SIGTERM)


@pytest.fixture
def solve(quaternion_equations, tmp_path, monkeypatch):
    """Function that solves with a checkpoint after every iteration, interrupted or not."""
    monkeypatch.setattr(checkpoint, "INTERVAL_S", 0.0)
    objective = small_objective("quaternion", NODES, 0.0)
    parts = small_forces(quaternion_equations), small_muscles(), small_parameters()

    def solve(end=None):
        def family(nodes, hessian):
            kind = Interrupting if end else Problem
            problem = kind(*parts, objective.on_nodes(nodes), hessian)
            problem.end = end
            return problem

        problem = family(NODES, "exact")
        start = Start(problem.layout.join(cold_guess(problem, NODES)))
        place = Checkpoint(tmp_path / "place")
        return solve_coarse_to_fine(family, NODES, start, SETTINGS, None, place)

    return solve


def iterate(seed=0):
    rng = np.random.default_rng(seed)
    return Iterate(5, "exact", 1e-5, 12, 3.5, *rng.normal(size=(4, 3)))


def test_an_iterate_comes_back_as_it_was(tmp_path):
    place = Checkpoint(tmp_path / "new" / "place")
    assert place.read() is None
    place.write(iterate(1))
    place.write(iterate(2))
    found = place.read()
    assert (found.nodes, found.phase, found.barrier) == (5, "exact", 1e-5)
    assert (found.iterations, found.seconds) == (12, 3.5)
    for name in ("free", "multipliers", "lower", "upper"):
        np.testing.assert_array_equal(getattr(found, name), getattr(iterate(2), name))
    assert [path.name for path in place.folder.iterdir()] == [ITERATE]
    place.remove()
    assert place.read() is None


def test_a_task_that_is_solved_forgets_older_problems_of_it_and_no_others(tmp_path):
    for name in ("tracking_par2_1a", "tracking_par2_2b", "tracking_par2_drinking_1a"):
        Checkpoint(tmp_path / name).write(iterate(1))
    Checkpoint(tmp_path / "tracking_par2_2b").remove()
    assert [path.name for path in tmp_path.iterdir()] == ["tracking_par2_drinking_1a"]


def test_death_while_writing_leaves_the_iterate_before(tmp_path, monkeypatch):
    place = Checkpoint(tmp_path)
    place.write(iterate(1))

    def half(path, **arrays):
        path.write_bytes(b"half of a file")
        die()

    monkeypatch.setattr(checkpoint.np, "savez", half)
    with pytest.raises(KilledError):
        place.write(iterate(2))
    np.testing.assert_array_equal(place.read().free, iterate(1).free)


def test_problems_that_differ_in_one_number_have_other_hashes():
    muscles = small_muscles()
    capacity = muscles.capacity.copy()
    capacity[1] += 1e-12
    hashes = {
        content_hash(muscles),
        content_hash(replace(muscles, capacity=capacity)),
        content_hash(muscles, small_parameters()),
        content_hash(SETTINGS),
        content_hash(replace(SETTINGS, tolerance=1e-7)),
    }
    assert len(hashes) == 5
    assert content_hash(small_muscles()) == content_hash(muscles)


def test_sigterm_ends_with_a_sentence_and_the_solve_goes_on(solve, capsys):
    whole = solve()
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(StoppedError, match="stopped by SIGTERM after .* run the same again"):
        solve(terminate)
    assert signal.getsignal(signal.SIGTERM) is before
    capsys.readouterr()
    resumed = solve()
    assert f"interrupted solve: exact, {NODES} nodes" in capsys.readouterr().out
    assert resumed.optimal
    # Its own iterations are few; beside them count those of the solve that was stopped.
    assert len(resumed.history) < whole.iterations / 2
    assert resumed.iterations > len(resumed.history)
    assert resumed.meshes == (NODES,)
    assert resumed.remark.startswith("Goes on from the checkpoint of an interrupted solve: exact")
    assert resumed.objective == pytest.approx(whole.objective, rel=1e-7)
    np.testing.assert_allclose(resumed.point.free, whole.point.free, atol=1e-5)


def test_nothing_is_left_of_a_solve_that_ended(solve, tmp_path):
    solve()
    assert not (tmp_path / "place").exists()
