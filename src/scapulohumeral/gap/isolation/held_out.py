"""How well each explanation predicts a task that it was not fitted to.

The log predictive density of a task given the others is the log evidence of all of them less that
of the others alone: priors of parameters count once only, and what the tasks disagree about counts
against a cause.

Letters: D coefficients, T tasks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from scapulohumeral.gap.isolation.empirical_bayes import others_of
from scapulohumeral.gap.isolation.hypothesis import Fit
from scapulohumeral.gap.isolation.laplace import fit
from scapulohumeral.gap.isolation.suppositions import Supposition, integrated, supposed
from scapulohumeral.gap.residual.residual import Residual

# Units of log evidence below the most probable supposition of a label from which another one does
# not change an integral by a hundredth.
NEGLIGIBLE = 5.0


def log_predictive(
    fits: Sequence[Fit],
    residuals: Mapping[float, Residual],
    every: Sequence[Supposition],
    relative_error: float,
) -> dict[str, float]:
    """Sum over tasks of the log predictive density given the other tasks, by label.

    Parameters
    ----------
    fits : of some labels, under any suppositions
    residuals : by the supposed size of another movement [deg]
    every : suppositions that count
    relative_error : of predicted changes
    """
    whole = {f.label: f.log_evidence for f in integrated(fits, every)}
    best: dict[str, float] = {}
    for f in fits:
        best[f.label] = max(f.log_evidence, best.get(f.label, -np.inf))
    counting = [f for f in fits if f.log_evidence > best[f.label] - NEGLIGIBLE]
    found = dict.fromkeys(whole, 0.0)
    for rest in left_out(residuals[0.0]):
        parts = {size: residual.part(rest) for size, residual in residuals.items()}
        rows = residuals[0.0].rows(rest)
        again = [
            fit(f.hypothesis.part(rows), parts[supposed(f).moved_deg], relative_error)
            for f in counting
        ]
        for one in integrated(again, every):
            found[one.label] += whole[one.label] - one.log_evidence
    return found


def log_predictive_of_others(
    residuals: Mapping[float, Residual], columns: np.ndarray
) -> dict[str, float]:
    """The same for another movement alone, none of these, and no gap.

    `columns` (D, S) are the smooth unknown inputs.
    """
    whole = others_of(residuals, columns)
    found = dict.fromkeys(whole, 0.0)
    for rest in left_out(residuals[0.0]):
        parts = {size: residual.part(rest) for size, residual in residuals.items()}
        own = others_of(parts, columns[residuals[0.0].rows(rest)])
        for label, log in own.items():
            found[label] += whole[label] - log
    return found


def left_out(residual: Residual) -> list[list[str]]:
    """The other tasks of each task; nothing if there is one task only."""
    if len(residual.tasks) < 2:
        return []
    return [[other for other in residual.tasks if other != task] for task in residual.tasks]
