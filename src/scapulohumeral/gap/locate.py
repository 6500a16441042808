"""Where a gap shows and where it enters.

*Shows*: the difference over its standard error, channel by channel. *Enters*: the smooth
generalised forces and EMG errors that would explain the difference best (a Gaussian process through
the optimal control problem), because optimal control spreads what happens at one joint over many
muscles. Both maps are judged by their largest value over the whole map (family-wise error).

Letters: T tasks, N nodes, K channels, D coefficients, S disturbances.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import linprog
from scipy.stats import chi2, norm

from scapulohumeral.gap.attribute import BLACK_BOX_SIZES, black_box_evidence
from scapulohumeral.gap.floor import Comparison, compress, draws
from scapulohumeral.gap.observe import channel_kind, channel_unit, phase_functions
from scapulohumeral.gap.result import Entered, NoCost, Shown
from scapulohumeral.gap.signatures import SMOOTH, Recorder, Response

DRAWS = 2000
DOF_NAMES = (*(f"{joint}_r{axis}" for joint in ("SC", "AC", "GH") for axis in "xyz"), "EL_rx")
# Agreement of a half of the trials with the whole: one-sided 5 %.
REPEATED_SIGMA = 1.64
# Two-sided 5 % of a single point.
POINTWISE_SIGMA = 1.96
# The no-cost test allows EMG this error, and this factor to either side for its gain.
EMG_ERROR, EMG_GAIN = 0.05, 1.6
# Generalised force below which a frame counts as balanced [N m].
BALANCED_NM = 0.5
FRAMES = 12


@dataclass(frozen=True, eq=False)
class Shows:
    """Map of where the gap shows.

    Attributes
    ----------
    sigma : (N, K) mean over tasks of the difference over its standard error, as one z value
    effect : (N, K) mean difference over tasks, in units of the channels
    value : largest of all z values, of single tasks as well; threshold, p_value : of it
    null : (draws,) largest z values without any effect, in order
    """

    sigma: np.ndarray
    effect: np.ndarray
    value: float
    threshold: float
    p_value: float
    null: np.ndarray

    def family_wise_p(self, sigma: float) -> float:
        """How often a map without any effect has a value as large anywhere."""
        return float((1 + np.sum(self.null >= abs(sigma))) / (1 + len(self.null)))

    @property
    def standing_out(self) -> bool:
        """Whether any point of the mean over tasks exceeds the threshold of the whole map."""
        return bool(np.abs(self.sigma).max() > self.threshold)


@dataclass(frozen=True)
class Presence:
    """Whether there is a gap above the floor.

    Attributes
    ----------
    p_value, statistic, value, threshold : of the test; "max_t" over channels and phases, or "glr"
        over effects, both as z values
    """

    present: bool
    p_value: float
    statistic: str
    value: float
    threshold: float


@dataclass(frozen=True, eq=False)
class Disturbances:
    """Smooth generalised forces of each task, and smooth errors of its EMG channels.

    Attributes
    ----------
    columns : (D, S) change of the record by one unit of each
    names : kind ("dof" or "channel") and name of each curve
    shapes : phase functions (N, F) of each curve, in its unit
    """

    columns: np.ndarray
    names: tuple[tuple[str, str], ...]
    shapes: tuple[np.ndarray, ...]


def shows(comparison: Comparison, alpha: float, inflation: float, seed: int) -> Shows:
    """Difference over standard error, with a family-wise threshold simulated from the noise.

    Parameters
    ----------
    comparison : difference and noise
    alpha : family-wise error
    inflation : factor on the simulated threshold, from effect-free cases
    seed : of the simulation
    """
    sigma, largest = _z(comparison, comparison.delta)
    null = inflation * np.array(
        [_z(comparison, one)[1] for one in draws(comparison, DRAWS, seed).T]
    )
    return Shows(
        sigma=sigma,
        effect=comparison.curves(comparison.delta).mean(axis=0),
        value=largest,
        threshold=float(np.quantile(null, 1.0 - alpha)),
        p_value=float((1 + np.sum(null >= largest)) / (1 + DRAWS)),
        null=np.sort(null),
    )


def presence(
    comparison: Comparison,
    found: Shows,
    slopes: Sequence[np.ndarray],
    alpha: float,
    inflation: float,
    seed: int,
) -> Presence:
    """Whether there is a gap, by the stronger of two tests with half of the false alarms each.

    One asks whether any channel stands out (`found`, at half of alpha); the other whether the whole
    difference has the shape of any effect, which may be spread thinly over many channels.

    Parameters
    ----------
    slopes : (D, P) of each effect
    alpha, inflation, seed : as for :func:`shows`
    """
    value, null = effect_shaped(comparison, slopes, seed)
    rest = inflation * null
    p_value = float((1 + np.sum(rest >= value)) / (1 + DRAWS))
    threshold = float(np.quantile(rest, 1.0 - 0.5 * alpha))
    if p_value < found.p_value:
        return Presence(2.0 * p_value <= alpha, min(2.0 * p_value, 1.0), "glr", value, threshold)
    p_value = min(2.0 * found.p_value, 1.0)
    return Presence(p_value <= alpha, p_value, "max_t", found.value, found.threshold)


def effect_shaped(
    comparison: Comparison, slopes: Sequence[np.ndarray], seed: int
) -> tuple[float, np.ndarray]:
    """Largest part of the difference that has the shape of any effect, as a z value.

    Returns
    -------
    value : of the difference; null : (draws,) without any effect
    """
    bases = [np.linalg.qr(comparison.whiten(slope))[0] for slope in slopes if np.any(slope)]
    null = comparison.whiten(draws(comparison, DRAWS, seed))
    columns = np.column_stack([comparison.whiten(comparison.delta), null])
    lengths = [
        norm.isf(np.maximum(chi2.sf(np.sum((b.T @ columns) ** 2, axis=0), b.shape[1]), 1e-300))
        for b in bases
    ]
    largest = np.max(lengths, axis=0)
    return float(largest[0]), largest[1:]


def _z(comparison: Comparison, vector: np.ndarray) -> tuple[np.ndarray, float]:
    """z values over all tasks (N, K), and the largest of these and of single tasks."""
    z = comparison.curves(vector) / comparison.spread
    joint = z.sum(axis=0) / np.sqrt(len(z))
    return joint, float(max(np.abs(z).max(), np.abs(joint).max()))


def shown_regions(
    found: Shows, comparison: Comparison, halves: Sequence[np.ndarray]
) -> tuple[Shown, ...]:
    """Phases in which channels exceed the threshold, the largest of each channel.

    A gap that is spread thinly may exceed it nowhere; then regions are those that would count if
    each point were the only one, and their p values say that they are less certain.

    Parameters
    ----------
    found, comparison : map and difference
    halves : (D,) differences of two halves of the test trials; empty with one trial
    """
    split = [_z(comparison, half)[0] / np.sqrt(2.0) for half in halves]
    threshold = found.threshold if found.standing_out else POINTWISE_SIGMA
    regions = []
    for k, channel in enumerate(comparison.channels):
        span = _largest_span(found.sigma[:, k], threshold)
        if span is None:
            continue
        low, high = span
        peak = low + int(np.argmax(np.abs(found.sigma[low : high + 1, k])))
        sign = int(np.sign(found.sigma[peak, k]))
        regions.append(
            Shown(
                channel=channel,
                phase_percent=_percent(span, len(found.sigma)),
                peak_percent=100.0 * peak / (len(found.sigma) - 1),
                sign=sign,
                effect_sigma=float(found.sigma[peak, k]),
                effect=float(found.effect[peak, k]),
                unit=channel_unit(channel),
                p_value=found.family_wise_p(found.sigma[peak, k]),
                share=float(np.sum(found.sigma[low : high + 1, k] ** 2)),
                repeated=len(split) == 2
                and all(sign * half[low : high + 1, k].mean() > REPEATED_SIGMA for half in split),
            )
        )
    return _shared(regions)


def disturbances(
    responses: Sequence[Response],
    functions: np.ndarray,
    channels: Sequence[str],
    emg_unit: float,
) -> Disturbances:
    """All disturbances of a case; EMG errors in units of `emg_unit` [fraction of MVC].

    `functions` (N, B) are those of the comparison, `channels` its (K,) names.
    """
    nodes = len(functions)
    shapes = phase_functions(nodes, SMOOTH) * np.sqrt(nodes)
    names = [("dof", name) for name in DOF_NAMES]
    emg = [name for name in channels if channel_kind(name) == "emg"]
    names += [("channel", name) for name in emg]
    blocks = []
    for response in responses:
        slack = response.slack.reshape(-1, *response.slack.shape[2:])
        columns = [compress([slack], functions)]
        for name in emg:
            curves = np.zeros((SMOOTH, nodes, len(channels)))
            curves[:, :, channels.index(name)] = emg_unit * shapes.T
            columns.append(compress([curves], functions))
        blocks.append(np.hstack(columns))
    units = [1.0] * len(DOF_NAMES) + [emg_unit] * len(emg)
    return Disturbances(block_diag(*blocks), tuple(names), tuple(unit * shapes for unit in units))


def most_probable(comparison: Comparison, columns: np.ndarray) -> np.ndarray:
    """Matrix (S, D) from a whitened difference to the most probable amounts of disturbances (D, S).

    They are independent, of the common size with most evidence for the difference compared.
    """
    size = max(BLACK_BOX_SIZES, key=lambda s: black_box_evidence(comparison, s * columns, (1.0,)))
    white = comparison.whiten(size * columns)
    inner = np.eye(white.shape[1]) + white.T @ white
    return size * np.linalg.solve(inner, white.T)


def entered_regions(
    comparison: Comparison, boxes: Disturbances, alpha: float, seed: int
) -> tuple[tuple[Entered, ...], list[tuple[str, str, np.ndarray, float, str]]]:
    """Generalised forces and EMG errors that explain the difference, and the map behind them.

    Returns
    -------
    regions
    rows : kind, name, curve (N,) [N m or fraction of MVC], threshold on it, unit
    """
    gain = most_probable(comparison, boxes.columns)
    estimate = gain @ comparison.whiten(comparison.delta)
    without = gain @ np.random.default_rng(seed).normal(size=(len(comparison.delta), DRAWS))
    curves = _mean_curves(estimate[:, None], boxes, len(comparison.tasks))[..., 0]
    null = _mean_curves(without, boxes, len(comparison.tasks))
    spread = null.std(axis=2)
    largest = np.max(np.abs(null) / spread[..., None], axis=(0, 1))
    threshold = float(np.quantile(largest, 1.0 - alpha))
    regions, rows = [], []
    for i, (kind, name) in enumerate(boxes.names):
        unit = "N m" if kind == "dof" else "fraction_of_mvc"
        sigma = curves[i] / spread[i]
        rows.append((kind, name, curves[i], threshold * float(spread[i].mean()), unit))
        span = _largest_span(sigma, threshold)
        if span is None:
            continue
        low, high = span
        peak = low + int(np.argmax(np.abs(sigma[low : high + 1])))
        regions.append(
            Entered(
                kind=kind,
                name=name,
                phase_percent=_percent(span, len(sigma)),
                effect=float(curves[i][peak]),
                unit=unit,
                p_value=float((1 + np.sum(largest >= np.abs(sigma[peak]))) / (1 + DRAWS)),
                share=float(np.sum(sigma[low : high + 1] ** 2)),
                repeated=len(comparison.tasks) > 1,
            )
        )
    return _shared(regions), rows


def _mean_curves(values: np.ndarray, boxes: Disturbances, tasks: int) -> np.ndarray:
    """Curves (names, N, draws) of disturbances (S, draws), averaged over tasks."""
    mean = values.reshape(tasks, len(boxes.names), SMOOTH, -1).mean(axis=0)
    return np.stack([shape @ part for shape, part in zip(boxes.shapes, mean, strict=True)])


def no_cost(
    responses: Sequence[Response], recorded: Sequence[np.ndarray], recorder: Recorder
) -> NoCost:
    """Whether any activations in [0, 1], whatever their cost, balance the motion and show this EMG.

    Parameters
    ----------
    responses : nominal solutions
    recorded : (N, C) mean EMG of the test trials of each task
    recorder : electrodes
    """
    if not recorder.channels:
        return NoCost(False, None)
    infeasible = []
    for response, emg in zip(responses, recorded, strict=True):
        middle = 0.5 * (emg[1:] + emg[:-1])
        for i in np.unique(np.linspace(0, len(middle) - 1, FRAMES).astype(int)):
            missing = _missing(response.levers[i], response.needed[i], recorder, middle[i])
            infeasible.append(missing > BALANCED_NM)
    return NoCost(True, float(100.0 * np.mean(infeasible)))


def _missing(levers: np.ndarray, needed: np.ndarray, recorder: Recorder, emg: np.ndarray) -> float:
    """Least sum of generalised forces [N m] that activations with this EMG leave unbalanced."""
    muscles = levers.shape[1]
    slack = np.hstack([np.eye(len(needed)), -np.eye(len(needed))])
    none = np.zeros((len(emg), slack.shape[1]))
    solved = linprog(
        np.concatenate([np.zeros(muscles), np.ones(slack.shape[1])]),
        A_ub=np.vstack(
            [np.hstack([recorder.electrodes, none]), np.hstack([-recorder.electrodes, none])]
        ),
        b_ub=np.concatenate(
            [np.clip(EMG_GAIN * emg + EMG_ERROR, 0.0, None), EMG_ERROR - emg / EMG_GAIN]
        ),
        A_eq=np.hstack([levers, slack]),
        b_eq=needed,
        bounds=[(0.0, 1.0)] * muscles + [(0.0, None)] * slack.shape[1],
    )
    return np.inf if solved.fun is None else float(solved.fun)


def _largest_span(sigma: np.ndarray, threshold: float) -> tuple[int, int] | None:
    """First and last node of the run above the threshold with the largest sum of squares."""
    above = np.concatenate([[False], np.abs(sigma) > threshold, [False]])
    edges = np.flatnonzero(np.diff(above.astype(int)))
    spans = [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return max(spans, key=lambda s: float(np.sum(sigma[s[0] : s[1] + 1] ** 2)), default=None)


def _percent(span: tuple[int, int], nodes: int) -> tuple[float, float]:
    return 100.0 * span[0] / (nodes - 1), 100.0 * span[1] / (nodes - 1)


def _shared(regions: list) -> tuple:
    """Regions with shares that add up to one, the largest first."""
    total = sum(region.share for region in regions)
    shared = [replace(region, share=region.share / total) for region in regions]
    return tuple(sorted(shared, key=lambda region: -region.share))
