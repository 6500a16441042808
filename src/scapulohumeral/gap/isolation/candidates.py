"""Hypotheses as rows of the answer: amplitudes with intervals, level, classes in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from scapulohumeral.gap.isolation.channel_gains import freed_of_prior
from scapulohumeral.gap.isolation.doubts import _on_bound, _share_left
from scapulohumeral.gap.isolation.hypothesis import Fit
from scapulohumeral.gap.isolation.posterior import Posterior
from scapulohumeral.gap.labels import JOIN
from scapulohumeral.gap.result import (
    Amplitude,
    Candidate,
    EffectClass,
    Entered,
)

# Effects and places that a hint names.
PLACES = 2


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
    """What none of the known effects resembles most, and where it enters; no verdict."""
    if found.none < max(found.labels.values()):
        return None
    near = " and ".join(
        f"{row.label} (leaves {100.0 * row.unexplained_share:.0f} % unexplained)"
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
    reducible: tuple[float, float],
    temperature: float,
) -> tuple[Candidate, ...]:
    """All hypotheses as candidates, the most probable first.

    `reducible` are sums of squares of the whitened difference, and of what no smooth cause explains
    of it.
    """
    home = {label: i + 1 for i, group in enumerate(groups) for label in group}
    rows = [
        Candidate(
            label=f.label,
            level=_level(f.label, groups),
            p=found.labels[f.label],
            class_id=home.get(f.label),
            unexplained_share=_share_left(f.left, *reducible),
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
        if len({"/".join(mate.split("/")[:depth]) for mate in mates}) == 1:
            return name
    return "side"


def effect_classes(
    groups: Sequence[Sequence[str]], found: Posterior, splitting: Mapping[str, str]
) -> tuple[EffectClass, ...]:
    """Classes in words, with what would split them."""
    rows = []
    for i, group in enumerate(groups):
        p = [found.labels[label] for label in group]
        text = f"{group[0]} stands alone: these trials tell it from the others."
        if len(group) > 1:
            text = (
                f"{' or '.join(group)}; these trials cannot tell. "
                f"What would: {splitting.get(group[0], 'each effect alone')}."
            )
        rows.append(EffectClass(i + 1, tuple(group), float(sum(p)), max(p) / sum(p), text))
    return tuple(rows)
