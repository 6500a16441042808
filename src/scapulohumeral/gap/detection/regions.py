"""Regions of both maps: phases of channels where a gap shows, and of forces where it enters.

A region holds a point that stands out from the whole map (family-wise error) and extends as far as
its neighbours would stand out by themselves: a threshold for the whole map leaves but the tips.

Letters: T tasks, N nodes, K channels, D coefficients, S disturbances.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from scapulohumeral.gap.detection.presence import (
    DRAWS,
    POINTWISE_ALPHA,
    DifferenceMap,
    threshold_of,
    z_values,
)
from scapulohumeral.gap.recording.observables import channel_unit
from scapulohumeral.gap.residual.noise import draws
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.residual.unknown_input import UnknownInputs, most_probable_gain
from scapulohumeral.gap.result import Entered, Shown
from scapulohumeral.gap.signatures.nuisances import SMOOTH

# Two-sided 5 % of a single point, and agreement of a half of the trials with the whole, one-sided.
POINTWISE_SIGMA = float(norm.isf(0.5 * POINTWISE_ALPHA))
REPEATED_SIGMA = float(norm.isf(POINTWISE_ALPHA))


class EnteringCurve(NamedTuple):
    """A curve (N,) of what may enter, in `unit` (N m, or that of a channel); thresholds (N,)."""

    kind: str
    name: str
    curve: np.ndarray
    threshold: np.ndarray
    unit: str


def shown_regions(
    found: DifferenceMap, residual: Residual, halves: Sequence[np.ndarray]
) -> tuple[Shown, ...]:
    """Phases in which channels stand out, the largest region first.

    A gap that is spread thinly may exceed it nowhere; then regions are those that would count if
    each point were the only one, and their p values say that they are less certain.

    Parameters
    ----------
    found, residual : map and difference
    halves : (D,) differences of two halves of the test trials, none with one trial
    """
    split = _split(found, residual, halves)
    regions = []
    for k, channel in enumerate(residual.channels):
        sigma = found.sigma[:, k]
        for run in _shown_runs(found, k):
            peak = _peak(sigma, run)
            regions.append(
                Shown(
                    channel=channel,
                    phase_percent=_percent(run, len(sigma)),
                    peak_percent=100.0 * peak / (len(sigma) - 1),
                    sign=int(np.sign(sigma[peak])),
                    effect_sigma=float(sigma[peak]),
                    effect=float(found.effect[peak, k]),
                    unit=channel_unit(channel),
                    p_value=found.family_wise_p(sigma[peak]),
                    share=float(np.sum(sigma[run] ** 2)),
                    repeated=_repeated(sigma[peak], [half[run, k] for half in split]),
                )
            )
    return _shared(regions)


def repeated_points(
    found: DifferenceMap, residual: Residual, halves: Sequence[np.ndarray]
) -> np.ndarray:
    """Whether the region that a point belongs to is found in both halves, (N, K) of objects.

    None outside of regions, and everywhere without two halves. Arguments are those of
    :func:`shown_regions`, whose regions they are.
    """
    split = _split(found, residual, halves)
    points = np.full(found.sigma.shape, None, dtype=object)
    for k in range(len(residual.channels)):
        sigma = found.sigma[:, k]
        for run in _shown_runs(found, k):
            peak = sigma[_peak(sigma, run)]
            points[run, k] = _repeated(peak, [half[run, k] for half in split])
    return points


def entered_regions(
    residual: Residual,
    unknown_inputs: UnknownInputs,
    halves: Sequence[np.ndarray],
    alpha: float,
    seed: int,
) -> tuple[tuple[Entered, ...], list[EnteringCurve]]:
    """Generalised forces and EMG errors that explain the difference, and the map behind them.

    Parameters
    ----------
    residual, halves : as for :func:`shown_regions`
    unknown_inputs : forces and errors
    alpha : family-wise error; seed : of what is simulated without any

    Returns
    -------
    regions
    rows : the map
    """
    gain = most_probable_gain(residual, unknown_inputs.columns)
    estimate = gain @ residual.whiten(residual.delta)
    without = gain @ residual.whiten(draws(residual, DRAWS, seed))
    tasks = len(residual.tasks)
    curves = _mean_curves(estimate[:, None], unknown_inputs, tasks)[..., 0]
    null = _mean_curves(without, unknown_inputs, tasks)
    spread = null.std(axis=2)
    split = [
        _mean_curves((gain @ residual.whiten(half))[:, None], unknown_inputs, tasks)[..., 0]
        / (np.sqrt(2.0) * spread)
        for half in halves
    ]
    largest = np.max(np.abs(null) / spread[..., None], axis=(0, 1))
    threshold = threshold_of(largest, alpha)
    rows = [
        EnteringCurve(
            kind=kind,
            name=name,
            curve=curves[i],
            threshold=threshold * spread[i],
            unit="N m" if kind == "dof" else channel_unit(name),
        )
        for i, (kind, name) in enumerate(unknown_inputs.names)
    ]
    regions = []
    for i, row in enumerate(rows):
        sigma = row.curve / spread[i]
        for run in _runs(sigma, np.full(len(sigma), POINTWISE_SIGMA), threshold):
            peak = _peak(sigma, run)
            regions.append(
                Entered(
                    kind=row.kind,
                    name=row.name,
                    phase_percent=_percent(run, len(sigma)),
                    effect=float(row.curve[peak]),
                    unit=row.unit,
                    p_value=float((1 + np.sum(largest >= np.abs(sigma[peak]))) / (1 + DRAWS)),
                    share=float(np.sum(sigma[run] ** 2)),
                    repeated=_repeated(sigma[peak], [half[i, run] for half in split]),
                )
            )
    return _shared(regions), rows


def _mean_curves(values: np.ndarray, unknown_inputs: UnknownInputs, tasks: int) -> np.ndarray:
    """Curves (names, N, draws) of disturbances (S, draws), averaged over tasks."""
    mean = values.reshape(tasks, len(unknown_inputs.names), SMOOTH, -1).mean(axis=0)
    return np.stack([shape @ part for shape, part in zip(unknown_inputs.shapes, mean, strict=True)])


def _split(
    found: DifferenceMap, residual: Residual, halves: Sequence[np.ndarray]
) -> list[np.ndarray]:
    """z values (N, K) of each half, whose mean over trials is less certain than that of all."""
    wider = np.sqrt(2.0) * found.single / POINTWISE_SIGMA
    return [z_values(residual, half)[0] / wider for half in halves]


def _shown_runs(found: DifferenceMap, channel: int) -> list[slice]:
    """Runs of nodes of a channel that are regions."""
    threshold = found.threshold if found.standing_out else 0.0
    return _runs(found.sigma[:, channel], found.single[:, channel], threshold)


def _runs(sigma: np.ndarray, single: np.ndarray, threshold: float) -> list[slice]:
    """Runs of nodes that stand out by themselves, those with one beyond the threshold.

    `single`: (N,) beyond which a point stands out by itself.
    """
    size = np.abs(sigma)
    above = np.concatenate([[False], size > single, [False]])
    edges = np.flatnonzero(np.diff(above.astype(int))).tolist()
    runs = [slice(low, end) for low, end in zip(edges[::2], edges[1::2], strict=True)]
    return [run for run in runs if size[run].max() > threshold]


def _peak(sigma: np.ndarray, run: slice) -> int:
    return run.start + int(np.argmax(np.abs(sigma[run])))


def _repeated(peak: float, halves: Sequence[np.ndarray]) -> bool | None:
    """Whether both halves of the trials have the sign of a peak over all of its run.

    None without two halves.
    """
    if len(halves) != 2:
        return None
    return all(bool(np.sign(peak) * half.mean() > REPEATED_SIGMA) for half in halves)


def _percent(run: slice, nodes: int) -> tuple[float, float]:
    return 100.0 * run.start / (nodes - 1), 100.0 * (run.stop - 1) / (nodes - 1)


def _shared(regions: list) -> tuple:
    """Regions with shares that add up to one, the largest first."""
    total = sum(region.share for region in regions)
    shared = [replace(region, share=region.share / total) for region in regions]
    return tuple(sorted(shared, key=lambda region: -region.share))
