"""Rates with intervals, areas under curves, and probabilities of families."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from scapulohumeral.gap.labels import NO_GAP, NONE, family
from scapulohumeral.quantities.proportion import wilson95

# Repetitions by which chance is told, and the seed of their random numbers [1].
REPETITIONS = 2000
SEED = 1


def rate(hits: Sequence[bool]) -> dict[str, Any]:
    """Share of hits with Wilson 95 % interval; None without cases."""
    n, k = len(hits), sum(bool(hit) for hit in hits)
    if n == 0:
        return {"value": None, "hits": 0, "n": 0, "wilson95": None}
    low, high = wilson95(k, n)
    return {"value": k / n, "hits": k, "n": n, "wilson95": [round(low, 4), round(high, 4)]}


def probabilities(answer: Mapping[str, Any]) -> dict[str, float]:
    """Probability of each label, none and no_gap included."""
    found = {c["label"]: float(c["p"]) for c in answer["candidates"]}
    return {**found, NONE: float(answer["none_p"]), NO_GAP: float(answer["no_gap_p"])}


def family_probabilities(answer: Mapping[str, Any]) -> dict[str, float]:
    """The same summed over members, largest first."""
    return of_families(probabilities(answer))


def area_under_curve(high: Sequence[float], low: Sequence[float]) -> float | None:
    """Probability that a member of `high` exceeds one of `low` (ties count half)."""
    if not high or not low:
        return None
    gap = np.subtract.outer(np.array(high), np.array(low))
    return float(np.mean((gap > 0) + 0.5 * (gap == 0)))


def reliability(pairs: Sequence[tuple[float, bool]], bins: int) -> list[dict[str, float]]:
    """Mean probability and how often it was right, in bins of equal count.

    `pairs` are the probability of each answer, and whether it was right.
    """
    parts = np.array_split(np.array(sorted(pairs), dtype=float).reshape(-1, 2), bins)
    return [
        {"p": round(float(part[:, 0].mean()), 4), "right": round(float(part[:, 1].mean()), 4),
         "n": len(part)}
        for part in parts
        if len(part)
    ]  # fmt: skip


def calibration_error(bins: Sequence[Mapping[str, float]]) -> float:
    """Expected calibration error of the bins of :func:`reliability`."""
    off = sum(b["n"] * abs(b["p"] - b["right"]) for b in bins)
    return round(float(off / sum(b["n"] for b in bins)), 4)


def calibration_error_by_chance(probabilities: Sequence[float], bins: int) -> dict[str, float]:
    """Calibration error of answers that are right exactly as often as they say.

    Few answers in a bin are right more or less often than on average, so a perfect answerer has an
    error above zero too.

    Parameters
    ----------
    probabilities : of the answers
    bins : as for :func:`reliability`

    Returns
    -------
    dict
        Mean error, and what 95 % of the repetitions do not exceed.
    """
    p = np.sort(np.asarray(probabilities, dtype=float))
    right = np.random.default_rng(SEED).random((REPETITIONS, len(p))) < p
    parts = zip(np.array_split(p, bins), np.array_split(right, bins, axis=1), strict=True)
    off = sum(np.abs(hits.sum(axis=1) - own.sum()) for own, hits in parts) / len(p)
    return {
        "mean": round(float(np.mean(off)), 4),
        "p95": round(float(np.quantile(off, 0.95)), 4),
    }


def of_families(probabilities: Mapping[str, float]) -> dict[str, float]:
    """Probabilities of labels summed over members, largest first."""
    total: dict[str, float] = {}
    for label, p in probabilities.items():
        total[family(label)] = total.get(family(label), 0.0) + p
    return dict(sorted(total.items(), key=lambda item: -item[1]))


def mean(values: Sequence[float]) -> float | None:
    """Mean; None without values."""
    return float(np.mean(values)) if len(values) else None


def spread(values: Sequence[float | None]) -> dict[str, Any]:
    """Median, quartiles and largest of what is known."""
    known = [value for value in values if value is not None]
    if not known:
        return {"median": None, "quartiles": None, "largest": None, "n": 0}
    low, mid, high = np.quantile(known, [0.25, 0.5, 0.75])
    return {
        "median": round(float(mid), 4),
        "quartiles": [round(float(low), 4), round(float(high), 4)],
        "largest": round(float(max(known)), 4),
        "n": len(known),
    }
