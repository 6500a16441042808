"""The smallest amplitude of each effect that these trials would find."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import norm

from scapulohumeral.gap.isolation.hypothesis import Hypothesis
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.result import (
    Detectable,
)

POWER = 0.8


DETECTION_ERROR = 0.05


def smallest_detectable(
    effects: Sequence[Hypothesis], residual: Residual, families: int
) -> tuple[Detectable, ...]:
    """Primary amplitudes that a test of each effect would find with power 0.8.

    Parameters
    ----------
    effects : of a person who keeps the movement and pays with effort: who yields is found sooner
    residual : what is compared; families : that are tested
    """
    needed = norm.isf(DETECTION_ERROR / (2.0 * families)) + norm.ppf(POWER)
    rows = []
    for one in effects:
        param = one.effects[0].params[0]
        size = float(np.linalg.norm(residual.whiten(one.slope[:, 0])))
        low, high = param.bounds
        internal = needed / max(size, 1e-12) * (1.0 if high > 0.0 else -1.0)
        if low <= internal <= high:
            value = param.physical(float(internal))
            rows.append(Detectable(one.label, param.name, value, param.unit, POWER))
    return tuple(rows)
