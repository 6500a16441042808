"""The smallest amplitude of each effect that these trials would find.

A person may answer to an effect in another way than the model does, as errors of predictions say
(:mod:`model_error`). What would be found if he answered just as predicted would be promised to
nobody.

Letters: D coefficients, T tasks, d = D / T, P parameters, M draws of scatter and answer.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2, norm

from scapulohumeral.gap.detection.shaped import P_RANGE, directions, scales, white_by_task
from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.isolation.hypothesis import Hypothesis
from scapulohumeral.gap.isolation.model_error import change_error, own_error
from scapulohumeral.gap.labels import GLR, ON_RECORD, family
from scapulohumeral.gap.residual.noise import draws
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.result import (
    Detectable,
)

POWER = 0.8
# Draws by which power is judged: it is off by 0.02.
TRIES = 500
# Beyond any signal of these trials: a whitened length.
LONGEST = 1e3


def smallest_detectable(
    effects: Sequence[Hypothesis],
    residual: Residual,
    thresholds: Mapping[str, float],
    signature_error: float,
    seed: int,
) -> tuple[Detectable, ...]:
    """Amplitudes of each parameter alone that the test for a gap would find with power 0.8.

    Parameters
    ----------
    effects : of a person who keeps the movement and pays with effort, for who yields is found
        sooner; without reference trials of one who answers as the model does
    residual : what is tested, with all that sessions may change
    thresholds : z values from which on a difference of the shape of an effect is a gap, by test
    signature_error : relative error of predicted changes
    seed : of the scatter in which effects are looked for, and of how persons answer

    Notes
    -----
    Where trials are so many that permuting them is a test of its own, that one has to agree.
    """
    scatter = _Scatter.of(residual, seed)
    rows = []
    for one in effects:
        [effect] = one.effects
        looking = [GLR, ON_RECORD] if effect.spoils_motion else [GLR]
        threshold = min(thresholds[name] for name in looking if name in thresholds)
        for i, param in enumerate(effect.params):
            signs = [sign for sign in (1.0, -1.0) if _varies_alone(effect, i, sign)]
            if not signs:
                continue
            changes = scatter.answers(one, i, signature_error)
            size = scatter.amplitude(one.slope, i, changes, threshold)
            low, high = param.bounds
            # Bounds may reach further to one side; what shows does so either way.
            inside = [sign * size for sign in signs if low <= sign * size <= high]
            if inside:
                value = param.physical(inside[0])
                rows.append(Detectable(one.label, param.name, value, param.unit, POWER))
    return tuple(rows)


def _varies_alone(effect: Effect, i: int, sign: float) -> bool:
    """Whether a parameter may leave its absent value in a direction while all others keep it."""
    above, below = sign > 0.0, sign < 0.0
    return not any(
        (above and i == first) or (below and i == second) for first, second in effect.order
    )


def silence_tells(effects: Iterable[str], detectable: Iterable[str]) -> bool:
    """Whether at least half of the families of effects would have shown inside their bounds.

    No gap in trials that could show less is no evidence against causes. Both are given by label.
    """
    return 2 * len(set(map(family, detectable))) >= len(set(map(family, effects)))


@dataclass(frozen=True, eq=False)
class _Scatter:
    """Differences without any effect, prepared for effects to be added.

    Attributes
    ----------
    residual : covariance of the difference
    vectors : (D, M) draws; white : (T, d, M) the same, whitened task by task
    unwhitened : (D, D) from the axes of errors back to coefficients
    seed : of the persons' answers
    """

    residual: Residual
    vectors: np.ndarray
    white: np.ndarray
    unwhitened: np.ndarray
    seed: int

    @staticmethod
    def of(residual: Residual, seed: int) -> _Scatter:
        """Scatter as the thresholds of the test take it to be."""
        vectors = draws(residual, TRIES, seed)
        unwhitened = np.linalg.inv(residual.axes.matrix)
        return _Scatter(residual, vectors, white_by_task(residual, vectors), unwhitened, seed)

    def answers(self, one: Hypothesis, i: int, signature_error: float) -> np.ndarray:
        """Changes (D, M) by a unit of parameter `i`, in persons who differ."""
        slope, effect = one.slope[:, i], one.effects[0]
        relative = own_error(effect, signature_error)
        error = change_error(self.residual, slope, relative, effect.changes_body)
        # A stream of its own, so that answers do not follow the scatter.
        rng = np.random.default_rng([self.seed, 1])
        return slope[:, None] + self.unwhitened @ error.draw(rng, TRIES)

    def amplitude(self, slope: np.ndarray, i: int, changes: np.ndarray, threshold: float) -> float:
        """Size of internal parameter `i` whose z value is found with :data:`POWER`.

        Infinite if none is: the scatter is told from the same difference, and grows with it.

        Parameters
        ----------
        slope : (D, P) as predicted, which is looked for
        changes : (D, M) by a unit of that parameter, of each person
        threshold : z value
        """
        size = float(np.linalg.norm(self.residual.whiten(slope[:, i])))
        if size == 0.0:
            return np.inf
        basis, _ = directions(self.residual, slope)
        least = float(chi2.isf(max(norm.sf(threshold), P_RANGE[0]), basis.shape[1]))
        white = white_by_task(self.residual, changes)
        across = np.sum(self.white * white, axis=1)
        own, alone = np.sum(white**2, axis=1), np.sum(self.white**2, axis=1)
        signal, noise = (self._seen(basis, vectors) for vectors in (changes, self.vectors))

        def lacking(amplitude: float) -> float:
            whole = alone + 2.0 * amplitude * across + amplitude**2 * own
            over = scales(self.residual, whole)[:, None]
            told = np.sum((noise + amplitude * signal) / over, axis=0)
            return POWER - float(np.mean(np.sum(told**2, axis=0) > least))

        highest = LONGEST / size
        return np.inf if lacking(highest) > 0.0 else float(brentq(lacking, 0.0, highest))

    def _seen(self, basis: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """What each task of differences (D, M) adds along a whitened basis (D, P), (T, P, M)."""
        reading = self.residual.unturned(basis)
        tasks = [self.residual.rows([task]) for task in self.residual.tasks]
        return np.array([reading[rows].T @ vectors[rows] for rows in tasks])
