"""Scapulohumeral rhythm: how glenohumeral elevation and scapular upward rotation share a motion.

Rhythm = change of (TH - TS) / change of TS, with TH the thoracohumeral elevation and TS the
thoracoscapular upward rotation, over phases of TH (paper, section on rhythm prediction).

Letters: N nodes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.errors import DataError
from scapulohumeral.quantities.segment_angles import (
    ELEVATION_COLUMN,
    UPWARD_ROTATION_COLUMN,
    thorax_angles,
)

# Bounds of thoracohumeral elevation [deg]; a phase without lower bound begins where the arm rises.
PHASES = {
    "start-30": (-np.inf, 30.0),
    "30-60": (30.0, 60.0),
    "60-90": (60.0, 90.0),
    "start-90": (-np.inf, 90.0),
}
# Name of the interval that all compared rises pass.
SHARED = "shared"
# The rise begins at the last node this close to the lowest elevation [deg]: while the arm waits,
# the scapula may move, and that is no part of the elevation.
START_TOLERANCE_DEG = 0.1
# An arm this far from an elevation is not at it [deg].
NEAR_DEG = 2.0
# Over a smaller change of upward rotation the ratio says nothing [deg].
SMALLEST_UPWARD_ROTATION_DEG = 0.5


@dataclass(frozen=True)
class PhaseRhythm:
    """Rhythm of one phase of one elevation.

    Attributes
    ----------
    plane, phase : which elevation and which of `PHASES`
    from_deg, to_deg : elevation at which the phase begins and ends in this motion
    shr : rhythm [1]; not a number where `note` says why
    delta_th_deg, delta_ts_deg : changes of elevation and of upward rotation
    shr_range : the same by the paper's estimator, see `range_rhythm`
    note : what differs from the nominal phase, or empty
    """

    plane: str
    phase: str
    from_deg: float
    to_deg: float
    shr: float
    delta_th_deg: float
    delta_ts_deg: float
    note: str
    shr_range: float = np.nan


def rhythm_by_plane(
    pose: np.ndarray, nodes: Mapping[str, tuple[int, int]]
) -> tuple[PhaseRhythm, ...]:
    """Rhythm of every phase of every elevation of a motion.

    Parameters
    ----------
    pose : array, shape (N, 13)      unit quaternions SC, AC, GH and elbow angle [rad]
    nodes : first node and the node after the last one, by plane; one entry for a single elevation

    Raises
    ------
    DataError                        if a range of nodes is empty or leaves the motion
    """
    angles = thorax_angles(pose)
    rhythms: list[PhaseRhythm] = []
    for plane, (start, stop) in nodes.items():
        if not 0 <= start < stop <= len(pose):
            raise DataError(
                f"plane {plane}: nodes {start} to {stop} of a motion with {len(pose)} nodes; "
                "expected 0 <= start < stop <= nodes. Correct the ranges of the elevations"
            )
        part = angles[start:stop]
        phases = phase_rhythm(part[:, ELEVATION_COLUMN], part[:, UPWARD_ROTATION_COLUMN])
        rhythms += [replace(phase, plane=plane) for phase in phases]
    return tuple(rhythms)


def phase_rhythm(
    elevation_deg: np.ndarray, upward_rotation_deg: np.ndarray
) -> tuple[PhaseRhythm, ...]:
    """Rhythm of every phase of one elevation, without the name of a plane.

    Only the rise counts, from the lowest elevation before the peak to the peak. Upward rotation
    at the bounds is interpolated linearly where the elevation first reaches them.

    Parameters
    ----------
    elevation_deg, upward_rotation_deg : arrays, shape (N,)
    """
    rise = rising_part(elevation_deg)
    ranges = range_rhythm(elevation_deg[rise], upward_rotation_deg[rise])
    return tuple(
        replace(
            _phase(name, elevation_deg[rise], upward_rotation_deg[rise], bounds),
            shr_range=ranges[name],
        )
        for name, bounds in PHASES.items()
    )


def shared_rhythm(motions: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> dict[str, PhaseRhythm]:
    """Rhythm of several rises over the elevations that all of them pass, by name.

    Rhythms over unlike intervals say little about each other: an arm that stops at 70 deg has other
    ones than an arm that goes on to 93 deg.

    Parameters
    ----------
    motions : elevation and upward rotation [deg], (N,) each, of one plane
    """
    rises = {}
    for name, (elevation, upward) in motions.items():
        rise = rising_part(elevation)
        rises[name] = (elevation[rise], upward[rise])
    low = max(float(elevation[0]) for elevation, _ in rises.values())
    high = min(float(elevation[-1]) for elevation, _ in rises.values())
    return {name: _phase(SHARED, *rise, (low, high)) for name, rise in rises.items()}


def range_rhythm(elevation_deg: np.ndarray, upward_rotation_deg: np.ndarray) -> dict[str, float]:
    """Rhythm of every phase by the paper's estimator, for nodes of one rise.

    Range of (TH - TS) over range of TS at the nodes whose elevation lies in the phase: without
    interpolation and without signs, so a scapula that turns down has a rhythm, too. Infinite where
    the scapula stands still while the arm moves; not a number where both stand still or a phase has
    fewer than two nodes. It gives 19 of the 24 printed values to the last digit from the published
    motion (plot_results.m of the authors' program), where `phase_rhythm` finds none in two of them.

    Parameters
    ----------
    elevation_deg, upward_rotation_deg : arrays, shape (N,)
    """
    rhythms = {}
    for name, (lower, upper) in PHASES.items():
        inside = (elevation_deg >= lower) & (elevation_deg <= upper)
        rhythms[name] = np.nan
        if inside.sum() > 1:
            upward = upward_rotation_deg[inside]
            arm, scapula = np.ptp(elevation_deg[inside] - upward), np.ptp(upward)
            if scapula > 0.0:
                rhythms[name] = float(arm / scapula)
            elif arm > 0.0:
                rhythms[name] = np.inf
    return rhythms


def rising_part(elevation_deg: np.ndarray) -> slice:
    """Nodes of the rise, lowest elevation and peak included, of elevations (N,)."""
    peak = int(np.argmax(elevation_deg))
    before = elevation_deg[: peak + 1]
    start = int(np.flatnonzero(before <= before.min() + START_TOLERANCE_DEG)[-1])
    return slice(start, peak + 1)


def first_at(elevation_deg: np.ndarray, values: np.ndarray, level_deg: float) -> float:
    """Value where the rising arm first reaches an elevation, of the nodes (N,) of a rise.

    The level is one that the arm reaches; the first value, if it is no lower from the start.
    """
    after = int(np.argmax(elevation_deg >= level_deg))
    if after == 0:
        return float(values[0])
    before = after - 1
    share = (level_deg - elevation_deg[before]) / (elevation_deg[after] - elevation_deg[before])
    return float(values[before] + share * (values[after] - values[before]))


def node_near(elevation_deg: np.ndarray, level_deg: float) -> int | None:
    """Node of the rise nearest to an elevation, of elevations (N,); None if none is at it."""
    rise = rising_part(elevation_deg)
    node = rise.start + int(np.argmin(np.abs(elevation_deg[rise] - level_deg)))
    return node if abs(elevation_deg[node] - level_deg) <= NEAR_DEG else None


def _phase(
    name: str, elevation: np.ndarray, upward: np.ndarray, bounds: tuple[float, float]
) -> PhaseRhythm:
    lower, upper = bounds
    first, last = max(lower, float(elevation[0])), min(upper, float(elevation[-1]))
    if not first < last:
        note = f"not reached: the arm rises from {elevation[0]:.1f} to {elevation[-1]:.1f} deg"
        return PhaseRhythm("", name, np.nan, np.nan, np.nan, np.nan, np.nan, note)
    notes = []
    if first > lower > -np.inf:
        notes.append(f"begins with the motion at {first:.1f} deg")
    if last < upper:
        notes.append(f"ends at the peak of {last:.1f} deg")
    delta_th = last - first
    delta_ts = first_at(elevation, upward, last) - first_at(elevation, upward, first)
    shr = (delta_th - delta_ts) / delta_ts if delta_ts >= SMALLEST_UPWARD_ROTATION_DEG else np.nan
    if np.isnan(shr):
        notes.append(f"upward rotation changes by {delta_ts:.1f} deg: no ratio")
    return PhaseRhythm("", name, first, last, shr, delta_th, delta_ts, "; ".join(notes))
