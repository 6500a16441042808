"""Solve on coarse meshes first: most iterations then cost a fraction of one on the fine mesh.

Every mesh is solved down to the same barrier per time, at which slacks are large enough for the
next mesh to start from; the last one goes on to the tolerance. Whatever fails on the way, the
problem is solved on its own mesh alone, and the result says so.

Letters: N nodes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from scapulohumeral.ocp.mesh_transfer import transfer
from scapulohumeral.ocp.problem import Problem
from scapulohumeral.ocp.solver import Recorder, Result, SolverSettings, Start, run_phases

# Problems of one family by number of nodes and Hessian mode.
Family = Callable[[int, str], Problem]

# Shares of the intervals of a mesh on the way to it, and the fewest that a mesh may have: with
# fewer an elevation is no longer the same movement.
COARSENING = (4, 2)
FEWEST_INTERVALS = 15
# Tolerance of a solution that is only a start; looser ones stop at saddle points.
LOOSE = 1e-6


def coarse_nodes(nodes: int) -> tuple[int, ...]:
    """Nodes of the meshes on the way to a mesh, coarsest first."""
    intervals = [round((nodes - 1) / share) for share in COARSENING]
    return tuple(n + 1 for n in intervals if n >= FEWEST_INTERVALS)


def solve_coarse_to_fine(
    family: Family, nodes: int, start: Start, settings: SolverSettings, log: Path | None = None
) -> Result:
    """Solve a problem of N nodes over the meshes of ``settings.coarse``.

    Parameters
    ----------
    family : problems of any number of nodes
    start : starting point on the mesh of N nodes; see :func:`solver.solve`
    """
    with Recorder.to(log) as recorder:
        if not settings.coarse:
            return _alone(family, nodes, start, settings, recorder)
        point, before = start, nodes
        for coarse in settings.coarse:
            point = _carried(family, point, before, coarse)
            result = _solve(family, coarse, point, _passing(settings, nodes, coarse), recorder)
            if not result.optimal:
                return _fallen_back(family, nodes, start, settings, recorder, result)
            point, before = result.point, coarse
        point = _carried(family, point, before, nodes)
        final = replace(settings, barrier_exact=settings.tolerance / 11)
        result = _solve(family, nodes, point, final, recorder)
        if not result.optimal:
            return _fallen_back(family, nodes, start, settings, recorder, result)
        return replace(result, meshes=(*settings.coarse, nodes))


def _alone(
    family: Family, nodes: int, start: Start, settings: SolverSettings, recorder: Recorder
) -> Result:
    return _solve(family, nodes, start, settings, recorder)


def _solve(
    family: Family, nodes: int, start: Start, settings: SolverSettings, recorder: Recorder
) -> Result:
    return run_phases(lambda mode: family(nodes, mode), start, settings, recorder)


def _fallen_back(
    family: Family,
    nodes: int,
    start: Start,
    settings: SolverSettings,
    recorder: Recorder,
    failed: Result,
) -> Result:
    remark = (
        f"mesh of {failed.meshes[0]} nodes on the way: {failed.message} "
        f"Solved on {nodes} nodes alone."
    )
    recorder.say(remark)
    return replace(_alone(family, nodes, start, settings, recorder), remark=remark)


def _carried(family: Family, point: Start, before: int, after: int) -> Start:
    if before == after:
        return point
    return transfer(point, family(before, "gauss-newton"), family(after, "gauss-newton"))


def _passing(settings: SolverSettings, nodes: int, coarse: int) -> SolverSettings:
    """Settings of a solve on the way: the same barrier per time as on the mesh of N nodes."""
    longer = (nodes - 1) / (coarse - 1)
    barrier = settings.barrier_coarse * longer
    return replace(
        settings,
        tolerance=LOOSE,
        barrier_start=settings.barrier_start * longer,
        barrier_exact=barrier,
        barrier_target=max(barrier, settings.barrier_target * longer),
    )
