"""An effect, or a pair of them, as an explanation of a difference; and its fit.

Letters: D coefficients, P parameters, E effects.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.isolation.model_error import SignatureError, own_error, sum_error
from scapulohumeral.gap.labels import JOIN
from scapulohumeral.gap.residual.residual import Residual

# Data tell at least so many times as much as the prior: less is rounding.
LEAST_TOLD = 1e-6


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """An effect, or a pair of them, linearised.

    Attributes
    ----------
    effects : one, or the two of a pair
    at : (P,) internal parameters of the linearisation
    value : (D, E) change that each effect makes there; slope : (D, P) per unit of a parameter
    stiffness : with which the person keeps the movement against the effects
    """

    effects: tuple[Effect, ...]
    at: np.ndarray
    value: np.ndarray
    slope: np.ndarray
    stiffness: float

    @property
    def label(self) -> str:
        """Label in answers."""
        return JOIN.join(sorted(effect.label for effect in self.effects))

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper internal bounds (P,)."""
        ends = np.array([p.bounds for effect in self.effects for p in effect.params])
        return ends[:, 0], ends[:, 1]

    @cached_property
    def prior_sd(self) -> np.ndarray:
        """Prior spread of the internal parameters, (P,)."""
        return np.array([p.prior_sd for effect in self.effects for p in effect.params])

    @cached_property
    def order(self) -> list[tuple[int, int]]:
        """Pairs of parameters of which the first is never above the second."""
        return [
            (part.start + i, part.start + j)
            for part, effect in zip(self._parts, self.effects, strict=True)
            for i, j in effect.order
        ]

    @cached_property
    def _parts(self) -> list[slice]:
        """Which parameters belong to each effect."""
        ends = np.cumsum([0, *(len(effect.params) for effect in self.effects)]).tolist()
        return [slice(*pair) for pair in pairwise(ends)]

    def predict(self, x: np.ndarray) -> np.ndarray:
        """Change (D,) at internal parameters (P,)."""
        return self.changes(x).sum(axis=1)

    def changes(self, x: np.ndarray) -> np.ndarray:
        """Change (D, E) by each effect at internal parameters (P,)."""
        moved = x - self.at
        parts = [self.slope[:, part] @ moved[part] for part in self._parts]
        return self.value + np.stack(parts, axis=1)

    def error(self, x: np.ndarray, residual: Residual, relative: float) -> SignatureError:
        """Error of the change predicted at internal parameters (P,), of each effect by itself."""
        return self.errors(residual, relative)(x)

    def errors(self, residual: Residual, relative: float) -> Callable[[np.ndarray], SignatureError]:
        """The same at any internal parameters."""
        every = [
            sum_error(
                residual,
                np.column_stack([value, self.slope[:, part]]),
                own_error(effect, relative),
                effect.changes_body,
            )
            for effect, value, part in zip(self.effects, self.value.T, self._parts, strict=True)
        ]

        def at(x: np.ndarray) -> SignatureError:
            moved = x - self.at
            weights = [np.concatenate([[1.0], moved[part]]) for part in self._parts]
            return SignatureError([one.at(w) for one, w in zip(every, weights, strict=True)])

        return at

    def part(self, rows: np.ndarray) -> Hypothesis:
        """The same for some coefficients."""
        return replace(self, value=self.value[rows], slope=self.slope[rows])


class Direction(NamedTuple):
    """A direction of the parameters of a cause.

    `told`: how many times as much data tell of it as its prior [1]; `asked`: how many prior spreads
    from zero they ask for.
    """

    told: float
    asked: float


@dataclass(frozen=True, eq=False)
class Fit:
    """A hypothesis fitted to a difference.

    Attributes
    ----------
    hypothesis : that was fitted
    x : (P,) internal parameters; covariance : (P, P) of them
    log_evidence : log density of the difference, whitened
    moved_deg : supposed size of another movement [deg], which is part of the noise
    unbounded : (P,) where the density is largest without bounds at zero, which x may be held at
    unconstrained : (P,) the same without any bound
    mimicked : what was taken off the log evidence of a pair, see `pairs.paired`
    """

    hypothesis: Hypothesis
    x: np.ndarray
    covariance: np.ndarray
    log_evidence: float
    moved_deg: float
    unbounded: np.ndarray
    unconstrained: np.ndarray
    mimicked: float = 0.0

    @property
    def label(self) -> str:
        """Label in answers."""
        return self.hypothesis.label

    @property
    def predicted(self) -> np.ndarray:
        """Change (D,) that the fit predicts."""
        return self.hypothesis.predict(self.x)

    @property
    def directions(self) -> tuple[Direction, ...]:
        """Principal directions of the parameters, in units of prior spreads."""
        sd = self.hypothesis.prior_sd
        curvature, axes = np.linalg.eigh(np.outer(sd, sd) * np.linalg.inv(self.covariance))
        told = np.maximum(curvature - 1.0, LEAST_TOLD)
        # The prior pulls what the data ask for toward zero.
        asked = (1.0 + told) / told * (axes.T @ (self.unbounded / sd))
        return tuple(map(Direction, told.tolist(), np.abs(asked).tolist()))

    def with_evidence(self, log_evidence: float) -> Fit:
        """The same with other log evidence."""
        return replace(self, log_evidence=log_evidence)


def pair(first: Fit, second: Fit) -> Hypothesis:
    """Both effects on the same person at once, their changes added, in the order of the label.

    The stiffness is that against the one which acts on the body.
    """
    one, two = (f.hypothesis for f in sorted((first, second), key=lambda f: f.label))
    return Hypothesis(
        effects=(*one.effects, *two.effects),
        at=np.concatenate([one.at, two.at]),
        value=np.hstack([one.value, two.value]),
        slope=np.hstack([one.slope, two.slope]),
        stiffness=max(one.stiffness, two.stiffness),
    )


def strongest(fits: Sequence[Fit], priors: Mapping[str, float], count: int) -> list[Fit]:
    """The fits with most evidence and prior, the best first."""
    return sorted(fits, key=lambda f: -(f.log_evidence + np.log(priors[f.label])))[:count]
