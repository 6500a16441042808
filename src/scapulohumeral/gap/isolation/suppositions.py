"""What is supposed of a person beside an effect, and evidence integrated over it.

How firmly a person keeps a movement against an effect, and whether the movement was done
differently anyway, is unknown. Every effect is fitted under each supposition; its evidence is the
mean over all of them, so that no effect is judged by the person that suits it best.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from scapulohumeral.gap.isolation.hypothesis import Fit

# Log odds beyond which nothing is doubted: fits under other suppositions were not even looked for.
UNDOUBTED = 30.0
# Prior probability that the movement was done differently as well. People answer what acts on
# their body by moving in another way about as often as not; what acts on the record, they do not
# know of. ASSUME, before any case.
OTHER_MOVEMENT = {True: 0.5, False: 0.2}


class Supposition(NamedTuple):
    """How firmly the movement is kept, over the nominal weight, and how far another was intended.

    The latter is a standard deviation [deg].
    """

    stiffness: float
    moved_deg: float


def supposed(fitted: Fit) -> Supposition:
    """The supposition that a fit was made under."""
    return Supposition(fitted.hypothesis.stiffness, fitted.moved_deg)


def integrated(fits: Iterable[Fit], every: Sequence[Supposition]) -> list[Fit]:
    """Of each label the fit under its most probable supposition, with evidence over all of them.

    Parameters
    ----------
    fits : under any of the suppositions, of one label at most once under each
    every : suppositions that count
    """
    return [_integrated(group, every) for group in _by_label(fits)]


def log_odds_of_moving(fits: Iterable[Fit], every: Sequence[Supposition]) -> dict[str, float]:
    """By label, log odds that the movement was done differently as well, if that is the cause.

    Parameters are those of :func:`integrated`.
    """
    return {group[0].label: _odds(group, every) for group in _by_label(fits)}


def _by_label(fits: Iterable[Fit]) -> list[list[Fit]]:
    groups: dict[str, list[Fit]] = defaultdict(list)
    for one in fits:
        groups[one.label].append(one)
    return list(groups.values())


def _integrated(group: Sequence[Fit], every: Sequence[Supposition]) -> Fit:
    logs = _logs(group, every)
    best = group[int(np.argmax(logs))]
    return best.with_evidence(float(logsumexp(logs)))


def _odds(group: Sequence[Fit], every: Sequence[Supposition]) -> float:
    logs = _logs(group, every)
    moved = np.array([f.moved_deg > 0.0 for f in group])
    if moved.all() or not moved.any():
        return UNDOUBTED if moved.all() else -UNDOUBTED
    odds = float(logsumexp(logs[moved]) - logsumexp(logs[~moved]))
    return float(np.clip(odds, -UNDOUBTED, UNDOUBTED))


def _logs(group: Sequence[Fit], every: Sequence[Supposition]) -> np.ndarray:
    """Log evidence of fits of one label, with the prior of their suppositions."""
    body = any(effect.changes_body for effect in group[0].hypothesis.effects)
    return np.array([f.log_evidence + log_weight(supposed(f), every, body) for f in group])


def log_weight(one: Supposition, every: Sequence[Supposition], body: bool) -> float:
    """Log prior probability of a supposition among those that count.

    Parameters
    ----------
    body : whether an effect acts on the body; on the record, all degrees of stiffness are one
    """
    stiffnesses = {s.stiffness for s in every}
    sizes = {s.moved_deg for s in every}
    log_stiffness = -np.log(len(stiffnesses)) if body else 0.0
    return float(log_stiffness + log_weight_of_size(one.moved_deg, sizes, body))


def log_weight_of_size(moved_deg: float, sizes: Iterable[float], body: bool) -> float:
    """Log prior probability of the size of another movement [deg] among those that count."""
    others = [size for size in sizes if size > 0.0]
    if not others:
        return 0.0
    share = OTHER_MOVEMENT[body]
    return float(np.log(share / len(others)) if moved_deg > 0.0 else np.log1p(-share))
