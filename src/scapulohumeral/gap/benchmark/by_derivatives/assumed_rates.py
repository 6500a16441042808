"""How often answers to persons who are just as the diagnosis assumes are right.

What is missed here is out of reach of such trials, whoever weighs the evidence: persons who answer
otherwise than assumed can be told no better. Probabilities that do not hold here, by the evidence
as it stands, are a fault of the inference.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.gap.benchmark.by_derivatives.assumed_answers import KINDS
from scapulohumeral.gap.benchmark.by_derivatives.assumed_persons import (
    MOVEMENT,
    NOTHING,
    PAIR,
    SINGLE,
    UNKNOWN,
)
from scapulohumeral.gap.benchmark.metrics import rate, spread
from scapulohumeral.gap.benchmark.scored_case import LARGE_MULTIPLE
from scapulohumeral.gap.isolation.priors import PAIRS
from scapulohumeral.gap.labels import JOIN, family
from scapulohumeral.gap.settings import GapSettings

BINS = 5
# Answers that are at least so probable are sure.
SURE = 0.8
# A probability that was rounded to zero.
LEAST_P = 1e-5


def rates(table: pd.DataFrame, settings: GapSettings) -> dict[str, Any]:
    """Rates over all persons, as bars ask for them.

    Parameters
    ----------
    table : of `assumed_answers.assumed_answers`
    settings : of the diagnosis, with what it believes before any data
    """
    singles = table[(table["kind"] == SINGLE) & table["shown"]]
    large = singles[singles["multiple"] >= LARGE_MULTIPLE]
    pairs = table[(table["kind"] == PAIR) & table["shown"]]
    told = pairs["right"] | (_member(pairs) & pairs["left"])
    unknown = table[(table["kind"] == UNKNOWN) & table["shown"]]
    others = table.drop(singles.index).drop(pairs.index)
    nothing = table[table["kind"] == NOTHING]
    sure = table[table["p"] > SURE]
    rejects = singles["none_p"].quantile(0.9)
    return {
        "persons": {kind: int((table["kind"] == kind).sum()) for kind in KINDS},
        "false_alarms": rate(nothing["present"].tolist()),
        "gap_found": rate(singles["present"].tolist()),
        "family": rate((singles["right"] & singles["present"]).tolist()),
        "family_decided": rate((singles["right"] & singles["decided"]).tolist()),
        "class": rate((singles["class_right"] & singles["present"]).tolist()),
        "large_family": rate((large["right"] & large["present"]).tolist()),
        "large_class": rate((large["class_right"] & large["present"]).tolist()),
        "sets_single": rate(singles["covered"].tolist()),
        "sets_others": rate(others["covered"].tolist()),
        "labels": float(table["labels"].mean()),
        "sure_wrong": rate((~sure["right"]).tolist()),
        "amplitude_off": spread(singles["off"].dropna().tolist()),
        "pairs": rate((pairs["present"] & told).tolist()),
        "pairs_found": rate(pairs["present"].tolist()),
        "unknown_rejected": rate((unknown["none_p"] > rejects).tolist()),
        "exact_family": rate(singles["exact_right"].tolist()),
        "exact_calibration": _exact(table, settings),
    }


def _exact(table: pd.DataFrame, settings: GapSettings) -> dict[str, Any]:
    """Calibration of the evidence as it stands, each kind as probable as it is believed to be."""
    believed = {
        NOTHING: settings.prior_no_gap,
        MOVEMENT: settings.prior_moved,
        UNKNOWN: settings.prior_none,
        PAIR: PAIRS,
    }
    believed[SINGLE] = 1.0 - sum(believed.values())
    ordered = table.sort_values("exact_p")
    drawn = table.groupby("kind")["weight"].sum()
    weights = ordered["weight"] * ordered["kind"].map(believed) / ordered["kind"].map(drawn)
    weights = weights / weights.sum()
    bins = np.minimum((weights.cumsum() - 0.5 * weights) * BINS, BINS - 1).astype(int)
    rows, error = [], 0.0
    for _, part in ordered.groupby(np.asarray(bins)):
        own = weights[part.index]
        p, right = (float(np.average(part[c], weights=own)) for c in ("exact_p", "exact_right"))
        rows.append({"p": round(p, 4), "right": round(right, 4), "n": len(part)})
        error += float(own.sum()) * abs(p - right)
    told = np.log(ordered["exact_right_p"].clip(lower=LEAST_P))
    return {
        "error": round(error, 4),
        "mean_log_p": round(float(np.sum(weights * told)), 4),
        "bins": rows,
    }


def _member(pairs: pd.DataFrame) -> pd.Series:
    """Whether one of two effects comes first."""
    first = zip(pairs["first"], pairs["truth"], strict=True)
    named = [one in {family(part) for part in truth.split(JOIN)} for one, truth in first]
    return pd.Series(named, index=pairs.index, dtype=bool)
