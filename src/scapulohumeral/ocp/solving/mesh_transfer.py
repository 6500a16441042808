"""Carry a point with its multipliers from one mesh to another of the same duration.

Multipliers of constraints and bounds belong to one interval or node and stand for a density in
time, so they are divided by their share of the time before they are interpolated, and multiplied by
the new one afterwards.

Letters: N nodes, I = N - 1 intervals, n unknowns, m constraints.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from scapulohumeral.ocp.problem import Problem
from scapulohumeral.ocp.solving.solver import Start


def transfer(start: Start, before: Problem, after: Problem) -> Start:
    """A point of one problem as a start for the same problem on another mesh.

    Coordinates and speeds follow cubic splines; activations, excitations, reactions and all
    multipliers, which have kinks, go straight from node to node.

    Parameters
    ----------
    start : point of ``before``, with or without multipliers
    before, after : problems that differ in their mesh only
    """
    free = _nodes(start.free, before, after)
    smooth = before.layout.rows["x"]
    table = _table(start.free, before)
    spline = CubicSpline(_phase(before), table[smooth], axis=1)
    _table(free, after)[smooth] = spline(_phase(after))
    if start.multipliers is None or start.lower is None or start.upper is None:
        return Start(free)
    bounds = []
    for multipliers in (start.lower, start.upper):
        density = multipliers.copy()
        _table(density, before)[:] /= _node_share(before)
        carried = _nodes(density, before, after)
        _table(carried, after)[:] *= _node_share(after)
        bounds.append(carried)
    return Start(free, _intervals(start.multipliers, before, after), *bounds)


def _phase(problem: Problem) -> np.ndarray:
    return np.linspace(0.0, 1.0, problem.layout.nodes)


def _table(free: np.ndarray, problem: Problem) -> np.ndarray:
    """View of the trajectories of a free vector, one row each."""
    lay = problem.layout
    return free[: lay.trajectory_size].reshape(-1, lay.nodes)


def _node_share(problem: Problem) -> np.ndarray:
    """Time that belongs to each node, in units of the whole, (N,)."""
    share = np.full(problem.layout.nodes, 1.0 / (problem.layout.nodes - 1))
    share[[0, -1]] *= 0.5
    return share


def _nodes(free: np.ndarray, before: Problem, after: Problem) -> np.ndarray:
    """Free vector with all trajectories interpolated linearly; scalers stay."""
    carried = np.empty(after.layout.size)
    here, there = _phase(before), _phase(after)
    table = _table(carried, after)
    for row, values in enumerate(_table(free, before)):
        table[row] = np.interp(there, here, values)
    carried[after.layout.trajectory_size :] = free[before.layout.trajectory_size :]
    return carried


def _intervals(multipliers: np.ndarray, before: Problem, after: Problem) -> np.ndarray:
    """Multipliers of all equations, linear between the midpoints of intervals; others stay."""
    equations = before.collocation.number_of_equations
    old, new = before.layout.nodes - 1, after.layout.nodes - 1
    table = multipliers[: equations * old].reshape(equations, old)
    here, there = (np.arange(old) + 0.5) / old, (np.arange(new) + 0.5) / new
    # Beyond the first and last midpoint the outermost lines go on.
    left = np.clip(np.searchsorted(here, there) - 1, 0, old - 2)
    share = (there - here[left]) * old
    carried = (table[:, left] * (1.0 - share) + table[:, left + 1] * share) * (old / new)
    return np.concatenate([carried.ravel(), multipliers[equations * old :]])
