"""Large effects are not linear: their parameters are fitted by solving the movements again."""

from __future__ import annotations

import numpy as np

from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.isolation.hypothesis import Fit, Hypothesis
from scapulohumeral.gap.isolation.laplace import fit
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.signatures.resolve import Near, Resolving, recorded_change

# Steps of Gauss-Newton in units of the prior spread: the next linearisation decides again.
LARGEST_STEP = 1.5
# A fit that ends no further than this from where movements were solved needs no other solution.
ARRIVED = 0.1


def refit(first: Fit, residual: Residual, resolving: Resolving) -> Fit:
    """Gauss-Newton on the parameters of one effect, every step with new solutions of all tasks.

    A derivative that changes on the way makes steps turn back and forth. The secant through the
    last two says how much of a step to go (Barzilai and Borwein 1988, IMA J Numer Anal 8: 141-148).

    Parameters
    ----------
    first : fit to derivatives at the nominal solution
    residual : what is explained
    resolving : the movements, to be solved with the effect

    Raises
    ------
    SolveError                       a movement with the effect cannot be solved
    """
    [effect] = first.hypothesis.effects
    stiffness = first.hypothesis.stiffness
    solve = _Solving(effect, stiffness, resolving)
    sd, (low, high) = first.hypothesis.prior_sd, first.hypothesis.bounds
    current, share = first, 1.0
    for _ in range(resolving.settings.refits):
        wished = current.x - current.hypothesis.at
        step = np.clip(share * wished, -LARGEST_STEP * sd, LARGEST_STEP * sd)
        x = np.clip(current.hypothesis.at + step, low, high)
        values, slopes = solve.at(x)
        hypothesis = Hypothesis(
            (effect,),
            x,
            residual.compress(values)[:, None],
            residual.compress(slopes),
            stiffness,
        )
        went = (x - current.hypothesis.at) / sd
        current = fit(hypothesis, residual, resolving.settings.signature_error)
        left = (current.x - x) / sd
        if np.all(np.abs(left) < ARRIVED):
            break
        share = _share(went, wished / sd - left)
    return current


class _Solving:
    """One effect on all tasks, each solved from the solution before."""

    def __init__(self, effect: Effect, stiffness: float, resolving: Resolving) -> None:
        self.effect, self.resolving = effect, resolving
        self.tasks = resolving.kept(stiffness) if effect.changes_body else ()
        self.near: list[Near | None] = [None] * len(self.tasks)

    def at(self, x: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Changes (N, K) of all tasks at internal parameters (P,), and derivatives (P, N, K)."""
        if not self.effect.changes_body:
            every = [recorded_change(self.effect, x, t) for t in self.resolving.signatures]
            return [value for value, _ in every], [slope for _, slope in every]
        solved = [
            task.solved(self.effect, x, near)
            for task, near in zip(self.tasks, self.near, strict=True)
        ]
        self.near = [one.near for one in solved]
        return [one.change for one in solved], [one.slope for one in solved]


def _share(went: np.ndarray, shortened: np.ndarray) -> float:
    """Share of the next step to go, at most all of it.

    `went`: the last step (P,); `shortened`: how much less of a step is wished for after it.
    """
    squares = float(shortened @ shortened)
    secant = float(went @ shortened) / squares if squares > 0.0 else 1.0
    return min(secant, 1.0) if secant > 0.0 else 1.0
