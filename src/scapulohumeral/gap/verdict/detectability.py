"""The smallest amplitude of each effect that these trials would find."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2, ncx2, norm

from scapulohumeral.gap.isolation.hypothesis import Hypothesis
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.result import (
    Detectable,
)

POWER = 0.8
# Beyond any signal of these trials: a whitened length.
LONGEST = 1e3


def smallest_detectable(
    effects: Sequence[Hypothesis], residual: Residual, threshold: float
) -> tuple[Detectable, ...]:
    """Primary amplitudes that the test for a gap would find with power 0.8.

    Parameters
    ----------
    effects : of a person who keeps the movement and pays with effort: who yields is found sooner
    residual : what is tested, with all that sessions may change
    threshold : z value from which on a difference of the shape of an effect is a gap

    Notes
    -----
    Where trials are so many that permuting them is a test of its own, that one has to agree.
    """
    rows = []
    for one in effects:
        param = one.effects[0].params[0]
        size = float(np.linalg.norm(residual.whiten(one.slope[:, 0])))
        low, high = param.bounds
        needed = _needed_length(one.slope.shape[1], threshold)
        internal = needed / max(size, 1e-12) * (1.0 if high > 0.0 else -1.0)
        if low <= internal <= high:
            value = param.physical(float(internal))
            rows.append(Detectable(one.label, param.name, value, param.unit, POWER))
    return tuple(rows)


@cache
def _needed_length(parameters: int, threshold: float) -> float:
    """Whitened length of a difference whose z value exceeds a threshold with :data:`POWER`.

    The z value of an effect with P parameters is that of a chi-square variable with as many
    degrees of freedom.
    """
    least = float(chi2.isf(max(norm.sf(threshold), 1e-300), parameters))

    def lacking(length: float) -> float:
        return float(ncx2.sf(least, parameters, length**2)) - POWER

    return float(brentq(lacking, 0.0, LONGEST))
