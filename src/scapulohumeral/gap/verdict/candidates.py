"""Hypotheses as rows of the answer: amplitudes with intervals, level, classes in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum

import numpy as np

from scapulohumeral.gap.isolation.channel_gains import freed_of_prior
from scapulohumeral.gap.isolation.hypothesis import Fit
from scapulohumeral.gap.labels import JOIN, MOVED
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.result import (
    Amplitude,
    Candidate,
    EffectClass,
    Entered,
    explained_by_any,
)
from scapulohumeral.gap.verdict.posterior import Posterior

# Effects and places that a hint names.
PLACES = 2
# Internal parameters as near to a bound as this lie on it.
AT_BOUND = 1e-6


def amplitudes(fitted: Fit, temperature: float) -> tuple[Amplitude, ...]:
    """Parameters with 95 % intervals, in their units, as the data alone have them.

    Intervals are tempered like probabilities: a likelihood to the power of 1 / temperature is wider
    by its square root.
    """
    params = [p for effect in fitted.hypothesis.effects for p in effect.params]
    low, high = fitted.hypothesis.bounds
    values, variance = freed_of_prior(fitted)
    halves = 1.96 * np.sqrt(temperature * variance)
    bound = _on_bound(fitted, values)
    rows = []
    for i, param in enumerate(params):
        x = float(values[i])
        ends = sorted(
            param.physical(float(np.clip(x + sign * halves[i], low[i], high[i])))
            for sign in (-1.0, 1.0)
        )
        value = param.physical(x)
        rows.append(Amplitude(param.name, value, (ends[0], ends[1]), param.unit, bool(bound[i])))
    return tuple(rows)


def hint(rows: Sequence[Candidate], found: Posterior, enters: Sequence[Entered]) -> str | None:
    """What none of the known effects resembles most, and where it enters; no verdict.

    What another movement leaves is not said: it explains itself, whatever it is.
    """
    if found.none < max(found.labels.values()):
        return None
    near = " and ".join(
        f"{row.label} (leaves {100.0 * row.unexplained_share:.0f} % unexplained)"
        if explained_by_any(rows) and row.label != MOVED
        else row.label
        for row in rows[:PLACES]
    )
    largest = sorted(enters, key=lambda region: -region.share)[:PLACES]
    where = f"; it enters most at {', '.join(r.name for r in largest)}" if largest else ""
    return f"the closest known effects are {near}{where}"


def candidates(
    fits: Sequence[Fit],
    found: Posterior,
    groups: Sequence[Sequence[str]],
    agreement: Mapping[str, float | None],
    left: Mapping[str, float],
    temperature: float,
) -> tuple[Candidate, ...]:
    """All hypotheses as candidates, the most probable first.

    `left` says which share each of them leaves, as from :func:`share_left`.
    """
    home = {label: i + 1 for i, group in enumerate(groups) for label in group}
    rows = [
        Candidate(
            label=f.label,
            level=_level(f.label, groups),
            p=found.labels[f.label],
            class_id=home.get(f.label),
            unexplained_share=left[f.label],
            task_agreement_p=agreement.get(f.label),
            parameters=amplitudes(f, temperature),
        )
        for f in fits
    ]
    return tuple(sorted(rows, key=lambda row: -row.p))


def _level(label: str, groups: Sequence[Sequence[str]]) -> str:
    """How deep side/family/member is resolved: as far as the mates in the class agree.

    A pair that holds the label too does not contradict it.
    """
    group = next((group for group in groups if label in group), [label])
    mates = [mate for mate in group if mate == label or label not in mate.split(JOIN)]
    for depth, name in ((3, "member"), (2, "family")):
        if len({_cut(mate, depth) for mate in mates}) == 1:
            return name
    return "side"


def _cut(label: str, depth: int) -> tuple[str, ...]:
    """The effects of a label, each without what lies deeper than `depth`."""
    return tuple(sorted("/".join(part.split("/")[:depth]) for part in label.split(JOIN)))


class Doubt(Enum):
    """Why the first cause is not named: motion cannot tell it, or something else speaks against."""

    NONE, UNTOLD, UNDECIDED = range(3)

    @classmethod
    def of(cls, untold: str | None, why: str | None) -> Doubt:
        """By the reason that motion alone gives, and by that of the answer's status."""
        if untold:
            return cls.UNTOLD
        return cls.UNDECIDED if why else cls.NONE


def effect_classes(
    groups: Sequence[Sequence[str]],
    found: Posterior,
    splitting: Mapping[str, str],
    present: bool,
    doubt: Doubt,
) -> tuple[EffectClass, ...]:
    """Classes in words, with what would split them.

    `present` says whether there is a gap, `doubt` why the first cause is not named.
    """
    rows = []
    for i, group in enumerate(groups):
        p = [found.labels[label] for label in group]
        text = f"{group[0]} stands alone: these trials tell it from the others."
        if len(groups) == 1:
            text = f"{group[0]}: no other cause is probable enough to be compared with it."
        if i == 0 and doubt is Doubt.UNTOLD:
            text = f"{group[0]}, as far as the person did not move otherwise: motion cannot tell."
        elif i == 0 and doubt is Doubt.UNDECIDED:
            text = f"{group[0]} comes nearest, and is not named (see status_reason)."
        if not present:
            text = f"{' or '.join(group)}: no gap shows that would ask for {_all_of(group)}."
        elif len(group) > 1:
            text = (
                f"{' or '.join(group)}; these trials cannot tell. "
                f"What would: {splitting.get(group[0], 'each effect alone')}."
            )
        rows.append(EffectClass(i + 1, tuple(group), float(sum(p)), max(p) / sum(p), text))
    return tuple(rows)


def _all_of(group: Sequence[str]) -> str:
    return "it" if len(group) == 1 else "one of them"


def _on_bound(fitted: Fit, values: np.ndarray) -> np.ndarray:
    """Which internal parameters (P,) lie on bounds that data run into.

    The value at which an effect is absent is none.
    """
    ends = np.array(fitted.hypothesis.bounds)
    near = AT_BOUND + 1e-3 * (ends[1] - ends[0])
    return ((np.abs(values - ends) < near) & (np.abs(ends) > near)).any(axis=0)


def share_left(residual: Residual, change: np.ndarray, least: float) -> float:
    """Share that a cause leaves of what smooth ones can explain; all, where there is nothing of it.

    Parameters
    ----------
    residual : difference as the cause supposes it
    change : (D,) that the cause makes in this person
    least : sum of squares that no smooth cause explains of the difference, whitened
    """
    whole, left = (_squares(residual, one) for one in (residual.delta, residual.delta - change))
    return min(max(left - least, 0.0) / (whole - least), 1.0) if whole > least else 1.0


def _squares(residual: Residual, vector: np.ndarray) -> float:
    """Sum of squares of a difference (D,), whitened."""
    white = residual.whiten(vector)
    return float(white @ white)
