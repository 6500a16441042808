"""Short gaps of markers filled and reported, long ones refused.

Letters: T frames.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import make_smoothing_spline

from scapulohumeral.errors import DataError
from scapulohumeral.model.rotations import Array

# A gap as long as this holds less than a swing of the fastest arm motions, about 2 Hz.
LONGEST_S = 0.2
# The curve over a gap follows the frames of this time on both sides of it.
BESIDE_S = 0.1
# Faster motion than this is noise to the curve, which lets half of it through at this frequency:
# a curve through every frame leaves them in the direction of the noise, the more so the closer
# they stand.
CORNER_HZ = 20.0
# Fewest frames that such a curve is fitted to.
FEWEST_FRAMES = 5


@dataclass(frozen=True)
class Gap:
    """Frames `first` to `last` of the file (both included) in which a marker was not seen."""

    marker: str
    first: int
    last: int


def fill_gaps(
    source: Path, marker: str, points: Array, rate_hz: float, first_frame: int = 1
) -> tuple[Array, tuple[Gap, ...]]:
    """Fill gaps of at most `LONGEST_S` by a smooth cubic spline along the frames beside them.

    A gap at the start or end of the recording is not filled: nothing holds the curve on its other
    side.

    Parameters
    ----------
    source, marker : named in errors
    points : array, shape (T, 3)     NaN where the marker was not seen
    rate_hz : frames per second
    first_frame : its number in the file

    Returns
    -------
    points : array, shape (T, 3)     finite
    gaps : those that were filled

    Raises
    ------
    DataError                        a gap too long, at an end, or alone; names marker and frames
    """
    seen = np.isfinite(points).all(axis=1)
    if seen.all():
        return points, ()
    frames = first_frame + np.arange(len(points))
    gaps = find_gaps(marker, np.asarray(seen), first_frame)
    for gap in gaps:
        _refuse_long(source, gap, rate_hz, frames)
    filled = points.copy()
    reach = max(FEWEST_FRAMES, round(BESIDE_S * rate_hz))
    # Weight of smoothness with which a smoothing spline halves a wave of the corner frequency.
    weight = (rate_hz / (2.0 * np.pi * CORNER_HZ)) ** 4
    for gap in gaps:
        near = seen & (frames >= gap.first - reach) & (frames <= gap.last + reach)
        if near.sum() < FEWEST_FRAMES:
            raise DataError(
                f"{_place(source, gap)}, and in only {near.sum()} of the frames beside them; "
                f"expected {FEWEST_FRAMES} or more. Fill it in the software that recorded it."
            )
        inside = (frames >= gap.first) & (frames <= gap.last)
        curve = make_smoothing_spline(frames[near], points[near], lam=weight)
        filled[inside] = curve(frames[inside])
    return filled, gaps


def find_gaps(marker: str, seen: np.ndarray, first_frame: int = 1) -> tuple[Gap, ...]:
    """Runs of frames in which a marker was not seen, of `seen` (T,) from `first_frame` on."""
    edges = np.diff(np.concatenate([[1], seen.astype(int), [1]]))
    starts, ends = np.flatnonzero(edges == -1), np.flatnonzero(edges == 1)
    return tuple(
        Gap(marker, int(a) + first_frame, int(b) + first_frame - 1)
        for a, b in zip(starts, ends, strict=True)
    )


def _place(source: Path, gap: Gap) -> str:
    return f"{source}, marker {gap.marker}, frames {gap.first} to {gap.last}: not seen"


def _refuse_long(source: Path, gap: Gap, rate_hz: float, frames: np.ndarray) -> None:
    length = (gap.last - gap.first + 1) / rate_hz
    place = _place(source, gap)
    if gap.first == frames[0] or gap.last == frames[-1]:
        end = "start" if gap.first == frames[0] else "end"
        raise DataError(
            f"{place} at the {end} of the recording, where a gap cannot be filled. Cut the "
            "recording to the frames in which the marker is seen."
        )
    if length > LONGEST_S + 1e-9:
        raise DataError(
            f"{place} for {length:.2f} s; gaps up to {LONGEST_S} s are filled. Fill it in the "
            "software that recorded it, cut the recording, or map the landmark to a cluster."
        )
