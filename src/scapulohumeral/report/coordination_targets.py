"""Targets of calibration, validation and prediction, and whether the results meet them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.quantities.paper import (
    CUFF_MUSCLES,
    CUFF_STABILITY_WEIGHT,
    PREDICTED_PARTICIPANT,
)
from scapulohumeral.report.coordination import Coordination
from scapulohumeral.report.prediction.targets import prediction_verdicts
from scapulohumeral.report.tables import named_rows
from scapulohumeral.report.targets import Verdict
from scapulohumeral.report.words import BESIDE_OTHERS
from scapulohumeral.stages.validation import one_per_recording

KIND_NAMES = {"force": "maximum isometric force", "fibre": "optimal fibre length"}


def coordination_verdicts(coordination: Coordination) -> list[Verdict]:
    """Targets of the parts that this study has."""
    verdicts, limits = [], coordination.targets
    if coordination.calibrations or coordination.uncalibrated:
        verdicts.append(all_calibrated(coordination))
        verdicts += calibration_verdicts(coordination.calibrations, limits["calibration"])
    if not coordination.validation.empty:
        verdicts += validation_verdicts(coordination.validation, limits["validation"])
    if not coordination.prediction_table.empty:
        verdicts += solve_verdicts(coordination.prediction_table, limits["predictions"])
        if any(len(swept_weights(coordination, name)) > 1 for name in coordination.cases):
            verdicts.append(smallest_stable_weight(coordination))
    if coordination.judged is not None and coordination.judged.has_limits:
        verdicts += prediction_verdicts(coordination.judged)
    return verdicts


def all_calibrated(coordination: Coordination) -> Verdict:
    """Every calibration has a result."""
    found, failures = coordination.calibrations, coordination.uncalibrated
    value = f"{len(found)} of {len(found) + len(failures)} converged"
    worse = tuple(f"{name}: {failure}" for name, failure in failures.items())
    return Verdict("calibrations", value, "all converged", not failures, worse)


def calibration_verdicts(
    calibrations: Mapping[str, Mapping[str, Any]], limits: Mapping[str, Any]
) -> list[Verdict]:
    """Errors against the plant and coverage of the intervals, worst participant.

    Measured EMG has no known answer; its participants are left out.
    """
    scored = {name: c["scores"] for name, c in calibrations.items() if c["scores"]}
    if not scored:
        return []
    verdicts = []
    for kind, limit in limits["median_error"].items():
        name = (
            f"calibration to simulated EMG, {KIND_NAMES[kind]}: median error over the "
            "identifiable groups"
        )
        errors = {p: scores[kind]["median_error"] for p, scores in scored.items()}
        counts = ", ".join(
            f"{p} {s[kind]['identifiable']} of {s[kind]['groups']}" for p, s in scored.items()
        )
        verdicts.append(_at_most(name, errors, limit, f" (identifiable: {counts})"))
    coverage = {p: scores["coverage90"] for p, scores in scored.items()}
    name = "calibration to simulated EMG: 90 % intervals that cover the truth"
    return [*verdicts, _at_least(name, coverage, limits["coverage"])]


def _at_most(name: str, errors: Mapping[str, float | None], limit: float, note: str) -> Verdict:
    known = {p: e for p, e in errors.items() if e is not None}
    worse = tuple(f"{p} {100 * e:.1f} %" for p, e in known.items() if e > limit)
    worse += tuple(f"{p}: nothing identifiable" for p in errors if p not in known)
    value = f"at most {100 * max(known.values()):.1f} %{note}" if known else "nothing identifiable"
    return Verdict(name, value, f"≤ {100 * limit:g} %", not worse, worse)


def _at_least(name: str, shares: Mapping[str, float | None], limit: float) -> Verdict:
    known = {p: s for p, s in shares.items() if s is not None}
    worse = tuple(f"{p} {100 * s:.0f} %" for p, s in known.items() if s < limit)
    worse += tuple(f"{p}: nothing identifiable" for p in shares if p not in known)
    value = f"at least {100 * min(known.values()):.0f} %" if known else "nothing identifiable"
    return Verdict(name, value, f"≥ {100 * limit:g} %", not worse, worse)


def channel_reductions(validation: pd.DataFrame) -> pd.DataFrame:
    """Error of each participant and channel over all daily tasks, and its reduction.

    A recording that is solved with several loads in the hand counts once, with the first of them.

    Returns
    -------
    DataFrame                        columns participant, channel, generic, calibrated (root mean
                                     square over tasks [1]) and reduction [1]; not a number where a
                                     solve failed
    """
    once = one_per_recording(validation)
    squares = once.assign(generic=once.rmse_generic**2, calibrated=once.rmse_calibrated**2)
    groups = squares.groupby(["participant", "channel"], sort=False)[["generic", "calibrated"]]
    table = groups.agg(_root_mean).reset_index()
    return table.assign(reduction=1.0 - table.calibrated / table.generic)


def _root_mean(squares: pd.Series) -> float:
    """Not a number if one of them is none: a failed solve has no error."""
    return float(np.sqrt(squares.mean(skipna=False)))


def validation_verdicts(validation: pd.DataFrame, limits: Mapping[str, Any]) -> list[Verdict]:
    """Mean reduction over the channels, and channels that got worse."""
    least, increase = limits["mean_reduction"], limits["increase"]
    table = channel_reductions(validation)
    known = table[table.reduction.notna()]
    unknown = tuple(f"{r.participant} {r.channel}" for r in named_rows(table.drop(known.index)))
    worse = tuple(
        f"{r.participant} {r.channel} {100 * r.reduction:+.0f} %"
        for r in named_rows(known[known.reduction < -increase])
    )
    mean = float(table.reduction.mean(skipna=False))
    name = "validation on daily tasks: "
    return [
        Verdict(
            name + "mean reduction of the excitation-EMG RMSE over the channels",
            "not known: a solve has no result" if unknown else f"{100 * mean:.0f} %",
            f"≥ {100 * least:g} %",
            mean >= least,
        ),
        Verdict(
            name + "channels whose RMSE grows",
            f"{len(worse)} of {len(known)} by more than {100 * increase:g} %",
            f"none by more than {100 * increase:g} %",
            not (worse or unknown),
            worse + tuple(f"{channel} not known" for channel in unknown),
        ),
    ]


def solve_verdicts(table: pd.DataFrame, limits: Mapping[str, Any]) -> list[Verdict]:
    """Status, certificates and time of all predictions.

    Parameters
    ----------
    table : rows of results/prediction/summary.csv
    limits : section ``predictions`` of config/targets.yaml
    """
    longest = limits["seconds"]
    solves = table.drop_duplicates(["participant", "condition"])
    solved = solves[solves.status == "optimal"]
    # What had nothing to be solved from took no time.
    tried = solves[solves.iterations > 0]
    # Certificates are of the limit that the solver's code has; that of the file may be stricter.
    held = solved.certified.astype(bool) & (solved.kkt_error <= limits["kkt_error"])
    uncertified = _names(solved[~held])
    slow = _names(solves[solves.seconds > longest], "seconds", " s")
    failed = _names(solves[solves.status != "optimal"])
    return [
        Verdict(
            "predictions: solves",
            f"{len(solved)} of {len(solves)} optimal",
            "all optimal",
            not failed,
            failed,
        ),
        Verdict(
            "predictions: solutions with a certificate (KKT error with exact derivatives at most "
            f"{limits['kkt_error']:.0e}, positive definite reduced Hessian)",
            f"{len(solved) - len(uncertified)} of {len(solved)}",
            "all",
            not uncertified,
            uncertified,
        ),
        Verdict(
            f"predictions: time of a solve, which {BESIDE_OTHERS}",
            f"at most {tried.seconds.max():.0f} s, median {tried.seconds.median():.0f} s",
            f"≤ {longest:g} s",
            not slow,
            slow,
        ),
    ]


def _names(rows: pd.DataFrame, column: str = "", unit: str = "") -> tuple[str, ...]:
    return tuple(
        f"{r.participant} {r.condition}" + (f" {getattr(r, column):.0f}{unit}" if column else "")
        for r in named_rows(rows)
    )


def swept_weights(coordination: Coordination, participant: str) -> set[float]:
    """Weights of joint stability at which a lost cuff was to be predicted, solved or not."""
    return {
        p.condition.w_gh
        for p in coordination.predictions
        if p.participant == participant
        and p.limited == CUFF_MUSCLES
        and p.condition.capacity == 0.0
        # Stiffer joints of the girdle are another shoulder.
        and p.condition.girdle_stiffness_Nm_per_rad is None
    }


def stable_weight(coordination: Coordination, participant: str) -> float | None:
    """Smallest weight of the sweep from which on the force stays inside the glenoid.

    A prediction that failed keeps it nowhere.
    """
    smallest = None
    solved = {p.condition.w_gh: p for p in coordination.cases[participant].sweep}
    for weight in sorted(swept_weights(coordination, participant), reverse=True):
        found = solved.get(weight)
        if found is None or any(
            found.load.eccentricity[nodes].max() > 1.0 for nodes in found.planes.values()
        ):
            break
        smallest = weight
    return smallest


def smallest_stable_weight(coordination: Coordination) -> Verdict:
    """Whether some weight of the sweep keeps the joint force inside the glenoid."""
    name = "loss of the cuff: smallest w_GH of the sweep that keeps the force inside the glenoid"
    target = f"one exists (paper: {CUFF_STABILITY_WEIGHT:g}, {PREDICTED_PARTICIPANT})"
    swept = [p for p in coordination.cases if len(swept_weights(coordination, p)) > 1]
    weights = {p: stable_weight(coordination, p) for p in swept}
    words = [f"{p} {'none' if w is None else f'{w:g}'}" for p, w in weights.items()]
    words += [f"{p} no sweep" for p in coordination.cases if p not in swept]
    worse = tuple(p for p, w in weights.items() if w is None)
    return Verdict(name, ", ".join(words), target, bool(swept) and not worse, worse)
