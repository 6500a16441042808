"""Simple ways to name a cause from signatures, which the whole diagnosis has to beat.

They see what the diagnosis sees and get the same signatures; `benchmark.rules_of_thumb`
compares them on blind cases with rules that need no model.

Letters: D coefficients, P parameters, T tasks, N nodes, K channels.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from scapulohumeral.gap.curve_files import BaselinesRow
from scapulohumeral.gap.isolation.hypothesis import Fit, strongest
from scapulohumeral.gap.residual.residual import Residual


def baseline_labels(
    residual: Residual, screened: Sequence[Fit], prior: Mapping[str, float]
) -> list[BaselinesRow]:
    """Method and label of each: cosine, BIC of single samples, screening without solving again.

    Parameters
    ----------
    residual : difference to explain
    screened : all effects fitted to derivatives at the nominal solutions
    prior : of their labels
    """
    named = {
        "cosine": max(screened, key=lambda f: _cosine(residual, f)),
        "per_sample_bic": min(screened, key=lambda f: _sample_bic(residual, f)),
        "screening": strongest(screened, dict(prior), 1)[0],
    }
    return [BaselinesRow(method=method, label=first.label) for method, first in named.items()]


def _samples(residual: Residual, vector: np.ndarray) -> np.ndarray:
    """Curves over their standard deviations, as if every sample (T N K,) stood for itself."""
    return (residual.curves(vector) / residual.spread).ravel()


def _cosine(residual: Residual, fitted: Fit) -> float:
    """Cosine of the difference and the signature of the primary amplitude."""
    one = _samples(residual, residual.delta)
    other = _samples(residual, fitted.hypothesis.slope[:, 0])
    return abs(float(one @ other)) / max(float(np.linalg.norm(one) * np.linalg.norm(other)), 1e-12)


def _sample_bic(residual: Residual, fitted: Fit) -> float:
    """Bayesian information criterion with as many observations as samples."""
    target = _samples(residual, residual.delta)
    columns = np.stack([_samples(residual, column) for column in fitted.hypothesis.slope.T], 1)
    left = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    return len(target) * np.log(float(left @ left)) + columns.shape[1] * np.log(len(target))
