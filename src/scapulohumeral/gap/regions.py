"""Regions of both maps: phases of channels where a gap shows, and of forces where it enters.

A region holds a point that stands out from the whole map (family-wise error) and extends as far as
its neighbours would stand out by themselves: a threshold for the whole map leaves but the tips.

Letters: T tasks, N nodes, K channels, D coefficients, S disturbances.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scapulohumeral.gap.floor import Comparison
from scapulohumeral.gap.locate import DRAWS, Disturbances, Shows, most_probable, z_values
from scapulohumeral.gap.observe import channel_unit
from scapulohumeral.gap.result import Entered, Shown
from scapulohumeral.gap.signatures import SMOOTH

# Agreement of a half of the trials with the whole: one-sided 5 %.
REPEATED_SIGMA = 1.64
# Two-sided 5 % of a single point.
POINTWISE_SIGMA = 1.96


def shown_regions(
    found: Shows, comparison: Comparison, halves: Sequence[np.ndarray]
) -> tuple[Shown, ...]:
    """Phases in which channels stand out, the largest region first.

    A gap that is spread thinly may exceed it nowhere; then regions are those that would count if
    each point were the only one, and their p values say that they are less certain.

    Parameters
    ----------
    found, comparison : map and difference
    halves : (D,) differences of two halves of the test trials, fewer with one trial
    """
    split = [z_values(comparison, half)[0] / np.sqrt(2.0) for half in halves]
    threshold = found.threshold if found.standing_out else POINTWISE_SIGMA
    regions = []
    for k, channel in enumerate(comparison.channels):
        sigma = found.sigma[:, k]
        for run in _runs(sigma, threshold):
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


def entered_regions(
    comparison: Comparison,
    boxes: Disturbances,
    halves: Sequence[np.ndarray],
    alpha: float,
    seed: int,
) -> tuple[tuple[Entered, ...], list[tuple[str, str, np.ndarray, float, str]]]:
    """Generalised forces and EMG errors that explain the difference, and the map behind them.

    Parameters
    ----------
    comparison, halves : as for :func:`shown_regions`
    boxes : forces and errors
    alpha : family-wise error; seed : of what is simulated without any

    Returns
    -------
    regions
    rows : kind, name, curve (N,) [N m or fraction of MVC], threshold on it, unit
    """
    gain = most_probable(comparison, boxes.columns)
    estimate = gain @ comparison.whiten(comparison.delta)
    without = gain @ np.random.default_rng(seed).normal(size=(len(comparison.delta), DRAWS))
    tasks = len(comparison.tasks)
    curves = _mean_curves(estimate[:, None], boxes, tasks)[..., 0]
    null = _mean_curves(without, boxes, tasks)
    spread = null.std(axis=2)
    split = [
        _mean_curves((gain @ comparison.whiten(half))[:, None], boxes, tasks)[..., 0]
        / (np.sqrt(2.0) * spread)
        for half in halves
    ]
    largest = np.max(np.abs(null) / spread[..., None], axis=(0, 1))
    threshold = float(np.quantile(largest, 1.0 - alpha))
    regions, rows = [], []
    for i, (kind, name) in enumerate(boxes.names):
        unit = "N m" if kind == "dof" else "fraction_of_mvc"
        sigma = curves[i] / spread[i]
        rows.append((kind, name, curves[i], threshold * float(spread[i].mean()), unit))
        for run in _runs(sigma, threshold):
            peak = _peak(sigma, run)
            regions.append(
                Entered(
                    kind=kind,
                    name=name,
                    phase_percent=_percent(run, len(sigma)),
                    effect=float(curves[i][peak]),
                    unit=unit,
                    p_value=float((1 + np.sum(largest >= np.abs(sigma[peak]))) / (1 + DRAWS)),
                    share=float(np.sum(sigma[run] ** 2)),
                    repeated=_repeated(sigma[peak], [half[i, run] for half in split]),
                )
            )
    return _shared(regions), rows


def _mean_curves(values: np.ndarray, boxes: Disturbances, tasks: int) -> np.ndarray:
    """Curves (names, N, draws) of disturbances (S, draws), averaged over tasks."""
    mean = values.reshape(tasks, len(boxes.names), SMOOTH, -1).mean(axis=0)
    return np.stack([shape @ part for shape, part in zip(boxes.shapes, mean, strict=True)])


def _runs(sigma: np.ndarray, threshold: float) -> list[slice]:
    """Runs of nodes that stand out by themselves, those with one beyond the threshold."""
    size = np.abs(sigma)
    above = np.concatenate([[False], size > POINTWISE_SIGMA, [False]])
    edges = np.flatnonzero(np.diff(above.astype(int))).tolist()
    runs = [slice(low, end) for low, end in zip(edges[::2], edges[1::2], strict=True)]
    return [run for run in runs if size[run].max() > threshold]


def _peak(sigma: np.ndarray, run: slice) -> int:
    return run.start + int(np.argmax(np.abs(sigma[run])))


def _repeated(peak: float, halves: Sequence[np.ndarray]) -> bool:
    """Whether both halves of the trials have the sign of a peak over all of its run."""
    return len(halves) == 2 and all(np.sign(peak) * half.mean() > REPEATED_SIGMA for half in halves)


def _percent(run: slice, nodes: int) -> tuple[float, float]:
    return 100.0 * run.start / (nodes - 1), 100.0 * (run.stop - 1) / (nodes - 1)


def _shared(regions: list) -> tuple:
    """Regions with shares that add up to one, the largest first."""
    total = sum(region.share for region in regions)
    shared = [replace(region, share=region.share / total) for region in regions]
    return tuple(sorted(shared, key=lambda region: -region.share))
