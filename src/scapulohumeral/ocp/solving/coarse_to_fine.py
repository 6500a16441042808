"""Solve on a coarse mesh first: most iterations then cost a fraction of one on the fine mesh.

Every mesh is solved down to the same barrier per time, at which slacks are large enough for the
next mesh to start from; the last one goes on to the tolerance. Whatever fails on the way, the
problem is solved on its own mesh alone, and the result says so.

Of a start only the unknowns are taken, also where it has multipliers: they belong to a neighbour,
and with them the exact Hessian is corrected for its inertia again and again, where Gauss-Newton
needs no correction (par2 without the cuff from the healthy one: 35 iterations on the coarse mesh at
twice the price, against 21). Nor does the fine solution of a near neighbour help (par2 at 75 % of
the cuff): 19 to 27 iterations on the fine mesh from it alone, 9 to 11 from it and the difference of
two coarse solutions, which cost more than the one or two iterations saved, against 10 as it is.

Letters: N nodes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from scapulohumeral.ocp.problem import Problem
from scapulohumeral.ocp.solving.checkpoint import Checkpoint
from scapulohumeral.ocp.solving.mesh_transfer import transfer
from scapulohumeral.ocp.solving.solver import Recorder, Result, SolverSettings, Start, run_phases

# Problems of one family by number of nodes and Hessian mode.
Family = Callable[[int, str], Problem]

# How much coarser the mesh on the way may be, the best first, and the fewest intervals that it may
# have: with fewer an elevation is no longer the same movement. Over a mesh of 18 to 20 intervals
# recorded elevations took 17 to 50 s where one of 32 to 41 takes 5 to 22. A second mesh between the
# two saves one iteration of eleven on the fine mesh and costs as much as three.
COARSENING = (4, 2)
FEWEST_INTERVALS = 30
# Barrier parameter, per time, at which a solution goes to the next mesh.
BARRIER = 1e-5
# Tolerance of a solution that is only a start; looser ones stop at saddle points.
LOOSE = 1e-6
# Most Gauss-Newton iterations: after about ten they find no lower objective. Of 10, 15 and 25, with
# three elevations of par2. On all 18 recordings, 15 and 25 take the same time, and so does a first
# barrier ten times higher.
GAUSS_NEWTON_ITERATIONS = 15
# The same from the solution of a neighbour: 15 end in the same optimum half a second later.
FROM_NEIGHBOUR = 10
# Gauss-Newton iterations on the last mesh. From the solution of the coarse one they go as far as
# exact ones at a third of their price, and need no correction; after three or four they go no
# further (of 0, 3, 4, 6, 9 and 10, with four predictions of par2, of 17 to 23 s without them and
# with the exact Hessian: 0 takes 5 to 13 % less, 3 takes 7 to 22 % less, 6 and more gain less).
CLOSING_IN = 3
# Fewest nodes for that. On smaller meshes, two more solvers cost more to set up than they save: six
# recordings of 73 to 81 nodes take 40 to 78 iterations in place of 32 to 64, and a quarter longer.
LARGE = 120
# The tolerance over the last barrier: IPOPT itself goes no lower. At 3.2, where its own schedule
# ends from 1e-5, objectives are higher by up to 8e-5: activations that should be nothing stand
# further off their bounds.
LAST_BARRIER_SHARE = 11.0


def coarse_nodes(nodes: int) -> tuple[int, ...]:
    """Nodes of the mesh on the way to a mesh; none if that would be too coarse."""
    intervals = [round((nodes - 1) / share) for share in COARSENING]
    return tuple(n + 1 for n in intervals if n >= FEWEST_INTERVALS)[:1]


def solve_coarse_to_fine(
    family: Family,
    nodes: int,
    start: Start,
    settings: SolverSettings,
    log: Path | None = None,
    checkpoint: Checkpoint | None = None,
) -> Result:
    """Solve a problem of N nodes over the meshes of ``settings.coarse``.

    Parameters
    ----------
    family : problems of any number of nodes
    start : starting point on the mesh of N nodes; see :func:`solver.solve`
    checkpoint : of this problem and start; a solve that was interrupted goes on from there
    """
    with Recorder.to(log, checkpoint) as recorder:
        result = _over_meshes(family, nodes, start, settings, recorder)
    if checkpoint is not None:
        checkpoint.remove()
    return result


def _over_meshes(
    family: Family, nodes: int, start: Start, settings: SolverSettings, recorder: Recorder
) -> Result:
    point = Start(start.free) if settings.coarse else start
    # Only solutions have multipliers.
    of_neighbour = start.multipliers is not None
    before, meshes = nodes, (*settings.coarse, nodes)
    found = _interrupted(recorder, meshes)
    if found is not None:
        point, before = found
        meshes = meshes[meshes.index(before) :]
    for mesh in meshes:
        point = _carried(family, point, before, mesh)
        result = _solve(
            family, mesh, point, _on_the_way(settings, nodes, mesh, of_neighbour), recorder
        )
        if not result.optimal:
            if not settings.coarse and found is None:
                return result  # there was no way to it that another start could avoid
            return _fallen_back(family, nodes, start, settings, recorder, result)
        point, before = result.point, mesh
    return replace(result, meshes=meshes, remark=_resumed(recorder))


def _interrupted(recorder: Recorder, meshes: tuple[int, ...]) -> tuple[Start, int] | None:
    """Where an earlier solve was interrupted: point and nodes of its mesh."""
    found = recorder.checkpoint.read() if recorder.checkpoint else None
    if found is None or found.nodes not in meshes:
        return None
    recorder.resumed = found
    recorder.say(_resumed(recorder))
    if found.phase == "gauss-newton" and found.nodes == meshes[0]:
        return Start(found.free), found.nodes
    return Start(found.free, found.multipliers, found.lower, found.upper), found.nodes


def _resumed(recorder: Recorder) -> str:
    """Where an interrupted solve was taken up; empty if there was none."""
    found = recorder.resumed
    if found is None:
        return ""
    return (
        f"Goes on from the checkpoint of an interrupted solve: {found.phase}, {found.nodes} nodes, "
        f"barrier {found.barrier:.1e}, after {found.iterations} iterations and "
        f"{found.seconds:.0f} s."
    )


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
    said = f"{_resumed(recorder)} {remark}".strip()
    return replace(_solve(family, nodes, start, settings, recorder), remark=said)


def _carried(family: Family, point: Start, before: int, after: int) -> Start:
    if before == after:
        return point
    return transfer(point, family(before, "gauss-newton"), family(after, "gauss-newton"))


def _on_the_way(
    settings: SolverSettings, nodes: int, mesh: int, of_neighbour: bool
) -> SolverSettings:
    """Settings on one of the meshes: at the same barrier per time on all but the last.

    `of_neighbour`: whether the start is a solution, near which the one that is wanted lies.
    """
    if not settings.coarse:
        return settings
    last = settings.tolerance / LAST_BARRIER_SHARE
    if mesh == nodes and settings.barrier_target > 0:
        # Slacks of the coarse solution are large enough to go to the last barrier at once.
        return replace(settings, barrier_exact=last)
    if mesh == nodes:
        # From the barrier of the coarse solution down to the last one, as fast as steps stay long.
        # At the last one from the start, bounds cut the first steps short, and the Hessian is
        # corrected more often: a frontal elevation of Euler angles then takes 30 s instead of 12.
        # Without the upper end the barrier rises at first, which costs up to eight iterations.
        return replace(
            settings,
            barrier_exact=BARRIER,
            barrier_least=last,
            closing_in=CLOSING_IN if nodes >= LARGE else 0,
        )
    longer = (nodes - 1) / (mesh - 1)
    barrier = BARRIER * longer
    most = FROM_NEIGHBOUR if of_neighbour else GAUSS_NEWTON_ITERATIONS
    return replace(
        settings,
        tolerance=LOOSE,
        # One barrier throughout: a higher one to start with costs iterations on the way down.
        barrier_start=barrier,
        gauss_newton_iterations=min(settings.gauss_newton_iterations, most),
        barrier_exact=barrier,
        barrier_target=max(barrier, settings.barrier_target * longer),
        # From a healthy shoulder to 75 % of the cuff, in the authors' problem, the coarse mesh once
        # strayed into an optimum 14 deg away; on another processor it did not.
        stays_near=of_neighbour,
    )
