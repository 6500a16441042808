"""What is believed of effects before any data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.labels import JOIN

# Prior share of two effects at once, over all pairs: less than there are, because in opened blind
# cases of one effect a second one that was not there gained up to 14 units of log evidence.
PAIRS = 0.03


def priors(effects: Sequence[Effect], reserved: float) -> dict[str, float]:
    """Prior of each effect: families share what is not reserved, members share their family's."""
    families: dict[tuple[str, str], list[str]] = {}
    for effect in effects:
        families.setdefault((effect.side, effect.family), []).append(effect.label)
    each = (1.0 - reserved) / len(families)
    return {label: each / len(labels) for labels in families.values() for label in labels}


def pair_priors(single: Mapping[str, float], reserved: float) -> dict[str, float]:
    """Prior of two labels at once: all possible pairs share theirs, not only those looked at."""
    share = PAIRS * 2.0 / (1.0 - reserved) ** 2
    return {
        JOIN.join(sorted(both)): share * single[both[0]] * single[both[1]]
        for both in combinations(single, 2)
    }
