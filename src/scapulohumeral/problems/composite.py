"""The composite motion of calibration and prediction: elevations joined by pauses.

The dynamically consistent motions of tracking are joined, not the recordings, as in the paper
(section on EMG-informed parameter adjustment).

Letters: N nodes, M muscles, Nq coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scapulohumeral.errors import DataError
from scapulohumeral.model.rotations import make_continuous, pose_to_trial, unit_pose, with_girdle
from scapulohumeral.ocp.emg_term import EmgTerm
from scapulohumeral.ocp.objective import SEGMENTS, Trajectory
from scapulohumeral.ocp.solution import Solution
from scapulohumeral.problems.posed_problem import Target

KINDS = ("q", "u", "a", "e", "reaction")


@dataclass(frozen=True, eq=False)
class Composite:
    """Several tracked motions in one, on the mesh of the solutions they come from.

    Attributes
    ----------
    time_s : (N,), from zero
    trajectory : states, excitations and reactions to start a solve from
    reference : (N, Nq) coordinates to follow
    activity : (N,) 1 while a motion lasts, 0 in the pauses, where nothing is known
    nodes : first node and node after the last of each motion, by trial name
    """

    time_s: np.ndarray
    trajectory: Trajectory
    reference: np.ndarray
    activity: np.ndarray
    nodes: Mapping[str, tuple[int, int]]


def compose(solutions: Sequence[Solution], step: float, pause_s: float) -> Composite:
    """Join quaternion solutions in the order given.

    In a pause the coordinates go from the end of one motion to the start of the next along a
    minimum-jerk course (quaternions along the chord, normalised), at rest at both ends.

    Parameters
    ----------
    solutions : tracked motions with mesh interval ``step`` [s]
    pause_s : time between the last node of a motion and the first of the next [s]

    Raises
    ------
    DataError
        If a solution has another formulation or mesh interval, or the pause is shorter than two
        intervals.
    """
    intervals = round(pause_s / step)
    if intervals < 2:
        raise DataError(f"pause of {pause_s} s: expected two mesh intervals ({2 * step} s) or more")
    parts, activity, nodes, count = [], [], {}, 0
    for previous, solution in zip([None, *solutions], solutions, strict=False):
        _check(solution, step)
        own = _trajectory(solution)
        if previous is not None:
            parts.append(_pause(_trajectory(previous), own, intervals))
            activity.append(np.zeros(intervals - 1))
            count += intervals - 1
        parts.append(own)
        activity.append(np.ones(len(own.q)))
        nodes[solution.header["trial"]] = (count, count + len(own.q))
        count += len(own.q)
    joined = {kind: np.concatenate([getattr(part, kind) for part in parts]) for kind in KINDS}
    joined["q"] = _continuous(joined["q"])
    return Composite(
        time_s=step * np.arange(count),
        trajectory=Trajectory(**joined),
        reference=joined["q"],
        activity=np.concatenate(activity),
        nodes=nodes,
    )


def with_recorded_girdle(composite: Composite, motions: Sequence[Solution]) -> np.ndarray:
    """Reference (N, 13) of a composite motion with the girdle as it was recorded.

    Tracked motions give way to what costs less effort: their girdle is degrees from the recorded
    one. Humerus and elbow stay those of the composite motion.

    Parameters
    ----------
    motions : that it was composed from, in quaternions
    """
    nodes = [np.arange(*composite.nodes[motion.header["trial"]]) for motion in motions]
    girdle = [motion.reference_pose[:, :8] for motion in motions]
    return with_girdle(composite.reference, np.concatenate(nodes), np.concatenate(girdle))


def composite_target(
    composite: Composite,
    tracked: tuple[str, ...] = SEGMENTS,
    guidance: float = 0.0,
    emg: EmgTerm | None = None,
) -> Target:
    """The composite motion as what a problem follows, see :class:`Target`."""
    return Target(
        time_s=composite.time_s,
        reference_rad=pose_to_trial(composite.reference),
        activity=composite.activity,
        tracked=tracked,
        guidance=guidance,
        emg=emg,
    )


def _check(solution: Solution, step: float) -> None:
    trial = solution.header["trial"]
    if solution.header["formulation"] != "quaternion":
        raise DataError(f"{trial}: formulation {solution.header['formulation']}; need quaternion")
    own = float(np.diff(solution.time_s).mean())
    if abs(own - step) > 1e-9:
        raise DataError(
            f"{trial}: mesh interval {own:.4g} s; expected {step} s. Track the trial again"
        )


def _trajectory(solution: Solution) -> Trajectory:
    return Trajectory(
        q=solution.q,
        u=solution.u,
        a=solution.activation,
        e=solution.excitation,
        reaction=solution.reaction_N,
    )


def _pause(before: Trajectory, after: Trajectory, intervals: int) -> Trajectory:
    """Nodes between two motions."""
    tau = np.arange(1, intervals) / intervals
    course = (10 * tau**3 - 15 * tau**4 + 6 * tau**5)[:, None]

    def between(kind: str) -> np.ndarray:
        start, end = getattr(before, kind)[-1], getattr(after, kind)[0].copy()
        if kind == "q":
            end = _continuous(np.stack([start, end]))[1]
        return start + course * (end - start)

    return Trajectory(
        q=unit_pose(between("q")),
        u=np.zeros((len(tau), before.u.shape[1])),
        a=between("a"),
        e=between("e"),
        reaction=between("reaction"),
    )


def _continuous(q: np.ndarray) -> np.ndarray:
    """Coordinates (N, 13) with quaternion signs that do not jump."""
    joints = [make_continuous(q[:, first : first + 4]) for first in (0, 4, 8)]
    return np.hstack([*joints, q[:, 12:]])
