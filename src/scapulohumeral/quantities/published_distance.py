"""Predictions on the published arm, quantity by quantity beside the published motion and table.

Both follow the same arm on the same mesh, so angles are compared node by node.

Letters: N nodes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from scapulohumeral.model.published_arm import PUBLISHED_PLANES, PUBLISHED_RISES
from scapulohumeral.quantities.population import INTERNAL_ROTATION, POSTERIOR_TILT
from scapulohumeral.quantities.rhythm import first_at, phase_rhythm, range_rhythm
from scapulohumeral.quantities.segment_angles import (
    ELEVATION_COLUMN,
    UPWARD_ROTATION_COLUMN,
    thorax_angles,
)

# Published motion by predicted condition; those at weight 0 are compared with nothing of the paper.
PUBLISHED_OF = {
    "healthy": "healthy",
    "cuff_w10": "rc_limited",
    "cuff_75": "rc_75",
    "cuff_50": "rc_50",
    "cuff_25": "rc_25",
    "healthy_w0": "healthy_w0",
    "generic_w0": "generic_w0",
    "cuff_w0": "rc_w0",
}
# Elevations of the rising arm at which angles are compared [deg].
LEVELS_DEG = (15.0, 45.0, 70.0, 90.0)
CLAVICLE = {"retraction": 0, "elevation": 1, "axial_rotation": 2}
ANGLES = {
    "upward_rotation": UPWARD_ROTATION_COLUMN,
    **{f"clavicle_{name}": column for name, column in CLAVICLE.items()},
}
# Angles whose distance over whole elevations is told: all of the girdle.
GIRDLE = {
    **ANGLES,
    "internal_rotation": INTERNAL_ROTATION,
    "posterior_tilt": POSTERIOR_TILT,
}
# Retraction is negative: the most of it is the lowest angle.
LARGEST_BELOW = ("clavicle_retraction",)


@dataclass(frozen=True)
class Compared:
    """One quantity of one elevation; `published` or `reproduced` may be no number."""

    plane: str
    phase: str
    quantity: str
    published: float
    reproduced: float


def published_distances(
    pose: np.ndarray, published: np.ndarray, printed: Mapping[str, Mapping[str, float]]
) -> Iterator[Compared]:
    """Every compared quantity of one condition.

    Distances of all angles of the girdle over whole elevations, published value 0; then angles at
    fixed elevations and peaks, that of retraction being the most retracted;
    rhythm by the paper's estimator (`rhythm_range`, beside the printed table), and by signed ends
    of phases (`rhythm_signed`, beside the published motion measured alike).

    Parameters
    ----------
    pose, published : (268, 13)
    printed : rhythm by plane and phase, empty where the paper prints none
    """
    ours, theirs = thorax_angles(pose), thorax_angles(published)
    for plane, (first, stop) in PUBLISHED_PLANES.items():
        part, known = ours[first:stop], theirs[first:stop]
        for name, column in GIRDLE.items():
            error = part[:, column] - known[:, column]
            rmse = float(np.sqrt(np.mean(error**2)))
            yield Compared(plane, "elevation", f"{name}_rmse_deg", 0.0, rmse)
        yield from _levels(plane, part, known)
        yield from _rhythms(plane, ours, theirs, printed.get(plane, {}))


def _levels(plane: str, ours: np.ndarray, theirs: np.ndarray) -> Iterator[Compared]:
    for name, column in ANGLES.items():
        for level in LEVELS_DEG:
            pair = (at_level(theirs, column, level), at_level(ours, column, level))
            yield Compared(plane, f"at {level:g} deg", f"{name}_deg", *pair)
        largest = np.min if name in LARGEST_BELOW else np.max
        peaks = float(largest(theirs[:, column])), float(largest(ours[:, column]))
        yield Compared(plane, "peak", f"{name}_deg", *peaks)


def at_level(angles: np.ndarray, column: int, level: float) -> float:
    """Angle where the rising arm first reaches an elevation, of angles (N, 10) in the thorax [deg].

    Not a number where it does not, or is higher from the start.
    """
    elevation = angles[: int(np.argmax(angles[:, ELEVATION_COLUMN])) + 1, ELEVATION_COLUMN]
    if not elevation.min() <= level <= elevation[-1]:
        return float("nan")
    start = int(np.argmin(elevation))
    return first_at(elevation[start:], angles[start : len(elevation), column], level)


def _rhythms(
    plane: str, ours: np.ndarray, theirs: np.ndarray, printed: Mapping[str, float]
) -> Iterator[Compared]:
    window = slice(*PUBLISHED_RISES[plane])
    columns = (ELEVATION_COLUMN, UPWARD_ROTATION_COLUMN)
    elevation, upward = ours[window][:, columns].T
    known_elevation, known_upward = theirs[window][:, columns].T
    measured = range_rhythm(known_elevation, known_upward)
    for phase, value in range_rhythm(elevation, upward).items():
        yield Compared(plane, phase, "rhythm_range", printed.get(phase, measured[phase]), value)
    signed = {p.phase: p.shr for p in phase_rhythm(known_elevation, known_upward)}
    for found in phase_rhythm(elevation, upward):
        yield Compared(plane, found.phase, "rhythm_signed", signed[found.phase], found.shr)
