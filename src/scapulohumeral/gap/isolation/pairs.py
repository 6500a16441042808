"""Pairs of effects: what the strongest ones leave, another may explain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from scapulohumeral.gap.isolation.hypothesis import Fit, Hypothesis, pair, strongest
from scapulohumeral.gap.isolation.laplace import fit, no_gap_evidence
from scapulohumeral.gap.isolation.model_error import SignatureError, own_error
from scapulohumeral.gap.residual.residual import Residual

# Effects that others join in pairs, and others tried with each.
LEADERS, PARTNERS = 3, 12
# Share of the error of a predicted change, in mean square, that may look like a second effect. In
# opened blind cases second effects that were not there gained 0.03 and 0.05 of the log evidence of
# large first ones, at an error of 0.3; ones that were there 0.3.
MIMICRY = 1.0 / 3.0


def paired(
    singles: Sequence[Fit],
    prior: Mapping[str, float],
    residual: Residual,
    relative_error: float,
) -> list[Fit]:
    """The most probable effects with those of other families that explain most of what they leave.

    Of the log evidence of a pair, what errors of its stronger effect may mimic is taken off: it
    grows with the square of that effect, as its own log evidence does.
    """
    found: dict[str, Fit] = {}
    nothing = no_gap_evidence(residual)
    for leader in strongest(singles, prior, LEADERS):
        error = leader.hypothesis.error(leader.x, residual, relative_error)
        left = residual.axes.whiten(residual.delta - leader.predicted)
        family = leader.hypothesis.effects[0].family
        others = [f for f in singles if f.hypothesis.effects[0].family != family]
        gains = {f.label: _gain(f.hypothesis, left, error, residual) for f in others}
        for other in sorted(others, key=lambda f: -gains[f.label])[:PARTNERS]:
            both = pair(leader, other)
            if both.label not in found:
                joint = fit(both, residual, relative_error)
                mimicked = max(_mimicked(f, nothing, relative_error) for f in (leader, other))
                found[both.label] = replace(
                    joint, log_evidence=joint.log_evidence - mimicked, mimicked=mimicked
                )
    return list(found.values())


def _mimicked(alone: Fit, nothing: float, relative_error: float) -> float:
    """Log evidence that a second effect may gain by errors of what one alone predicts."""
    [effect] = alone.hypothesis.effects
    share = own_error(effect, relative_error)
    return MIMICRY * share**2 * max(alone.log_evidence - nothing, 0.0)


def _gain(
    hypothesis: Hypothesis, left: np.ndarray, error: SignatureError, residual: Residual
) -> float:
    """Log density that an effect inside its bounds adds to whitened residuals (D,).

    The error of its own prediction is left out.
    """
    slope = residual.axes.whiten(hypothesis.slope)
    weighted = error.solve(slope)
    right = weighted.T @ left
    normal = slope.T @ weighted + np.diag(hypothesis.prior_sd**-2.0)
    x = np.clip(np.linalg.solve(normal, right), *hypothesis.bounds)
    return float(right @ x - 0.5 * x @ normal @ x)
