"""What limits the answers to opened cases: noise, what is known of people, or the library itself.

The same inference, by derivatives alone, judges up to four differences of each case: the one that
was recorded; the one that the simulated person makes without noise; the same without what was moved
otherwise, if anything was; and the one that the diagnosis predicts for the injected effects. What
only the last gets right is lost to predictions, what only those without noise do to noise. Noise
counts in all of them as it does in the recorded one.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.errors import DataError
from scapulohumeral.gap.benchmark.by_derivatives.judging import (
    Inflation,
    evidence_of,
    inflation_of,
    judged,
    leaves_something,
    length,
    probability_of,
    with_difference,
)
from scapulohumeral.gap.benchmark.noise_free.trial import noise_free_trial
from scapulohumeral.gap.benchmark.open_keys import opened_keys
from scapulohumeral.gap.benchmark.scored_case import YIELDS, ScoredCase
from scapulohumeral.gap.isolation.empirical_bayes import Evidence
from scapulohumeral.gap.labels import JOIN, family
from scapulohumeral.gap.recording.case import Case
from scapulohumeral.gap.recording.observables import difference, phase_functions, recorded
from scapulohumeral.gap.residual.residual import compress

RECORDED, WITHOUT_NOISE = "recorded", "without_noise"
SAME_MOVEMENT, AS_PREDICTED = "same_movement", "as_predicted"
# Of one effect that shows, two, or an effect outside the library.
KINDS = ("single", "pair", "unknown")
# Side of a key that moved otherwise, without the cause.
OTHERWISE = "otherwise"


@dataclass(frozen=True)
class LimitsRow:
    """How one difference of a case is answered.

    Attributes
    ----------
    case, status, truth, person : of the key
    difference : which one, see this module
    length : in units of what differs without a cause
    present, p_value : whether it is a gap
    first, p : the most probable answer; right : whether its family, or one of two, is right
    right_p : probability of all right labels; none_p : of none of these
    left : whether the first is said to leave something
    """

    case: str
    status: str
    truth: str
    person: str
    difference: str
    length: float
    present: bool
    p_value: float
    first: str
    p: float
    right: bool
    right_p: float
    none_p: float
    left: bool


def limits(cases: Path, keys: Path, config_file: Path, cache: Path) -> pd.DataFrame:
    """A :class:`LimitsRow` for each difference of all opened cases whose cause shows.

    Only cases with reference trials count, where nothing but the cause and the movement differs.

    Parameters
    ----------
    cases : folder of case folders
    keys : folder of opened keys, with curves free of noise; the look at them is noted there
    config_file, cache : as for the diagnosis

    Raises
    ------
    DataError                        a key was drawn before keys held curves free of noise
    """
    rows = []
    for scored in _opened(cases, keys):
        evidence, case = evidence_of(scored.folder, config_file, cache)
        inflation = inflation_of(evidence, case)
        for name, delta in _differences(scored, evidence, case).items():
            rows.append(_row(scored, name, with_difference(evidence, delta), inflation))
    return pd.DataFrame([asdict(row) for row in rows])


def _opened(cases: Path, keys: Path) -> list[ScoredCase]:
    """Cases whose cause shows, without answers."""
    found = []
    names = sorted(path.name for path in cases.iterdir() if path.is_dir())
    for name, text in opened_keys(keys, names, "limits").items():
        key = json.loads(text)
        if "noise_free" not in key:
            raise DataError(
                f"{keys / name}.json: key 'noise_free' is missing; draw the cases from their seed."
            )
        scored = ScoredCase(cases / name, cases / name, key, None, 0.0)
        if key["mode"]["reference"] and scored.status in KINDS:
            found.append(scored)
    return found


def _differences(scored: ScoredCase, evidence: Evidence, case: Case) -> dict[str, np.ndarray]:
    """Differences (D,) by name."""
    key = scored.key
    found = {
        RECORDED: evidence.residual.delta,
        WITHOUT_NOISE: _without_noise(key, evidence, case, "reference"),
    }
    if any(OTHERWISE in sides for sides in key["noise_free"].values()):
        found[SAME_MOVEMENT] = _without_noise(key, evidence, case, OTHERWISE)
    known = _predicted(key, evidence)
    return found if known is None else {**found, AS_PREDICTED: known}


def _without_noise(
    key: Mapping[str, Any], evidence: Evidence, case: Case, before: str
) -> np.ndarray:
    """Difference (D,) of the test side to another one of a key."""
    settings, curves = evidence.settings, []
    for task in evidence.residual.tasks:
        test, base = (
            recorded(
                noise_free_trial(key["noise_free"][task][side], key["channels"], task, side),
                case.channels,
                case.has_contact,
                settings.nodes,
            )
            for side in ("test", before)
        )
        curves.append(difference(test, base))
    return compress(curves, phase_functions(settings.nodes, settings.phase_functions))


def _predicted(key: Mapping[str, Any], evidence: Evidence) -> np.ndarray | None:
    """Change (D,) that the injected effects are predicted to make.

    None for an effect outside the library, or of which a key gives no single parameter.
    """
    kept = list(evidence.known)[0 if key["person"] == YIELDS else -1]
    by_label = {one.label: one for one in evidence.known[kept]}
    change = np.zeros_like(evidence.residual.delta)
    for effect in key["effects"]:
        one = by_label.get(effect["label"])
        if one is None or effect["parameter"] is None:
            return None
        params = one.effects[0].params
        injected = [p.name for p in params].index(effect["parameter"])
        x = np.zeros(len(params))
        x[injected] = params[injected].internal(effect["amplitude"])
        change += one.predict(x)
    return change


def _row(scored: ScoredCase, name: str, evidence: Evidence, inflation: Inflation) -> LimitsRow:
    """Judge one difference."""
    there, found = judged(evidence, inflation)
    p = found.p
    right = {family(label) for label in scored.right}
    return LimitsRow(
        case=scored.folder.name,
        status=scored.status,
        truth=JOIN.join(scored.truth),
        person=scored.person,
        difference=name,
        length=round(length(evidence), 2),
        present=there.present,
        p_value=round(there.p_value, 4),
        first=p.first,
        p=round(p.labels[p.first], 3),
        right=any(family(part) in right for part in p.first.split(JOIN)),
        right_p=round(probability_of(p, right), 3),
        none_p=round(p.none, 3),
        left=leaves_something(found),
    )
