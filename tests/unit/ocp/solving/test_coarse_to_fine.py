"""Meshes on the way: what is carried over, the same solution as on one mesh, and the way back."""

import json
from dataclasses import replace

import numpy as np
import pytest
from small_arm import (
    small_objective,
)
from small_problem import cold_guess, small_problem

from scapulohumeral.ocp.solving import coarse_to_fine
from scapulohumeral.ocp.solving.coarse_to_fine import coarse_nodes, solve_coarse_to_fine
from scapulohumeral.ocp.solving.mesh_transfer import transfer
from scapulohumeral.ocp.solving.solver import SolverSettings, Start, solve

pytestmark = pytest.mark.unit

NODES = 17
SETTINGS = SolverSettings(tolerance=1e-8, coarse=(5, 9))


@pytest.fixture
def family(equations):
    """Problems of one movement by number of nodes and Hessian mode."""
    objective = small_objective(equations.name, NODES, 0.0)

    def family(nodes, hessian):
        return small_problem(equations, objective.on_nodes(nodes), hessian)

    return family


@pytest.fixture
def start(family):
    problem = family(NODES, "gauss-newton")
    return Start(problem.layout.join(cold_guess(problem, NODES)))


def test_the_mesh_on_the_way_has_a_quarter_or_a_half_of_the_intervals():
    assert coarse_nodes(121) == (31,)
    assert coarse_nodes(81) == (41,)
    assert coarse_nodes(41) == ()


def test_straight_lines_and_constant_densities_are_carried_over_exactly(family):
    before, after = family(9, "gauss-newton"), family(17, "gauss-newton")

    def along_time(problem):
        lay = problem.layout
        rows = 1.0 + np.arange(lay.trajectory_size // lay.nodes)[:, None]
        free = (rows + np.linspace(0, 1, lay.nodes)).ravel()
        intervals = lay.nodes - 1
        count = problem.collocation.number_of_equations
        middle = (np.arange(intervals) + 0.5) / intervals
        density = (np.arange(count)[:, None] + middle) / intervals
        own = np.zeros(problem.num_constraints - density.size) + 3.0
        share = np.full(lay.nodes, 1.0 / intervals)
        share[[0, -1]] /= 2
        bound = (rows * share).ravel()
        return Start(free, np.concatenate([density.ravel(), own]), bound, 2 * bound)

    carried, expected = transfer(along_time(before), before, after), along_time(after)
    for kind in ("free", "multipliers", "lower", "upper"):
        np.testing.assert_allclose(getattr(carried, kind), getattr(expected, kind), rtol=1e-12)


def test_a_cold_start_stays_cold(family, start):
    carried = transfer(start, family(NODES, "exact"), family(5, "exact"))
    assert carried.multipliers is None


def test_objective_on_another_mesh_spans_the_same_time(family):
    fine, coarse = (family(n, "exact").objective_function for n in (NODES, 5))
    assert coarse.step * 4 == pytest.approx(fine.step * (NODES - 1))
    np.testing.assert_allclose(coarse.reference[[0, -1]], fine.reference[[0, -1]], atol=1e-12)


@pytest.mark.parametrize(
    ("large", "last"), [(NODES, ("gauss-newton", "lumped", "exact")), (NODES + 1, ("exact",))]
)
def test_same_solution_as_on_one_mesh(family, start, tmp_path, monkeypatch, large, last):
    monkeypatch.setattr(coarse_to_fine, "LARGE", large)
    log = tmp_path / "solver.log"
    alone = solve(lambda mode: family(NODES, mode), start, replace(SETTINGS, coarse=()))
    result = solve_coarse_to_fine(family, NODES, start, SETTINGS, log)
    assert result.optimal
    assert (result.meshes, result.remark) == ((5, 9, NODES), "")
    assert result.objective == pytest.approx(alone.objective, rel=1e-5)
    steps = [json.loads(line) for line in log.read_text().splitlines()]
    phases = [(5, "gauss-newton"), (5, "exact"), (9, "exact")]
    phases += [(NODES, mode) for mode in last]
    assert list(dict.fromkeys((step["nodes"], step["phase"]) for step in steps)) == phases
    assert result.iterations == len(steps) - len(phases)


def test_multipliers_of_a_neighbour_are_not_taken(family, start):
    neighbour = solve(lambda mode: family(NODES, mode), start, replace(SETTINGS, coarse=()))
    result = solve_coarse_to_fine(family, NODES, neighbour.point, SETTINGS)
    assert result.history[0]["phase"] == "gauss-newton"
    assert result.objective == pytest.approx(neighbour.objective, rel=1e-5)


def test_a_coarse_mesh_that_fails_leaves_the_problem_to_its_own_mesh(family, start, tmp_path):
    def broken(nodes, hessian):
        problem = family(nodes, hessian)
        if nodes < NODES:
            problem.add_option("max_iter", 1)
            problem.add_option = lambda key, value: None
        return problem

    log = tmp_path / "solver.log"
    result = solve_coarse_to_fine(broken, NODES, start, SETTINGS, log)
    assert result.optimal
    assert result.meshes == (NODES,)
    assert "mesh of 5 nodes on the way" in result.remark
    assert result.remark in log.read_text()


def test_a_mesh_that_fails_alone_is_not_solved_again(family, start):
    built = []

    def counted(nodes, hessian):
        built.append(nodes)
        return family(nodes, hessian)

    few = replace(SETTINGS, coarse=(), max_iterations=1)
    failed = solve_coarse_to_fine(counted, NODES, start, few)
    assert not failed.optimal
    assert not failed.remark
    again = len(built)
    built.clear()
    solve(lambda mode: counted(NODES, mode), start, few)
    assert again == len(built)


@pytest.mark.parametrize("of_neighbour", [True, False])
def test_a_coarse_mesh_that_strays_from_a_neighbour_is_not_used(family, start, of_neighbour):
    """From no solution, IPOPT may look for a feasible point wherever it likes."""

    def straying(nodes, hessian):
        problem = family(nodes, hessian)
        if nodes < NODES:
            problem.add_option("start_with_resto", "yes")
        return problem

    alone = solve(lambda mode: family(NODES, mode), start, replace(SETTINGS, coarse=()))
    begun = alone.point if of_neighbour else start
    result = solve_coarse_to_fine(straying, NODES, begun, SETTINGS)
    assert result.optimal
    assert result.objective == pytest.approx(alone.objective, rel=1e-5)
    assert ("restoration" in result.remark) == of_neighbour
    assert result.meshes == ((NODES,) if of_neighbour else (5, 9, NODES))
