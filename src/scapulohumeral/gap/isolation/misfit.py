"""How far the likeliest explanation misses a difference, in units of what errors were assumed.

Where errors are larger than they were taken to be, log evidence for one cause over another is too
large by as much, whatever makes them so: scatter, the model, or a cause that is not known here. It
is divided by this (quasi-likelihood: Wedderburn 1974, Biometrika 61: 439-447).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from scapulohumeral.gap.isolation.hypothesis import Fit
from scapulohumeral.gap.labels import MOVED
from scapulohumeral.gap.residual.residual import Residual


def misfit(
    fits: Sequence[Fit], residuals: Mapping[float, Residual], relative_error: float
) -> float:
    """Mean square of what the explanation with most evidence leaves, whitened; one at least.

    Parameters
    ----------
    fits : of all labels, another movement included
    residuals : by the supposed size of another movement [deg]
    relative_error : of predicted changes
    """
    likeliest = max(fits, key=lambda f: f.log_evidence)
    residual = residuals[likeliest.moved_deg]
    if likeliest.label == MOVED:
        # Another movement is part of the covariance already.
        left = residual.whiten(residual.delta)
        squares = float(left @ left)
    else:
        # Errors of predictions are independent along these axes.
        left = residual.axes.whiten(residual.delta - likeliest.predicted)
        error = likeliest.hypothesis.error(likeliest.x, residual, relative_error)
        squares = error.squares(left)
    return max(squares / len(left), 1.0)
