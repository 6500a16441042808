"""All hypotheses judged: their probabilities, what can be told apart, how robust the verdict is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.curve_files import (
    RobustnessRow,
)
from scapulohumeral.gap.detection import null_bank as null_bank
from scapulohumeral.gap.isolation import doubts, isolability, posterior
from scapulohumeral.gap.isolation.empirical_bayes import Evidence
from scapulohumeral.gap.isolation.hypothesis import Fit
from scapulohumeral.gap.isolation.laplace import fit, no_gap_evidence, task_agreement
from scapulohumeral.gap.labels import NO_GAP, NONE
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.residual.unknown_input import unknown_input_evidence
from scapulohumeral.gap.result import (
    Robustness,
)

# Effects among which variants choose.
COMPARED_VARIANTS = 15


@dataclass(frozen=True, eq=False)
class Judged:
    """All hypotheses judged.

    Attributes
    ----------
    fits : of all hypotheses; squares : of the difference
    best : the most probable fit; likely : fits that are not negligible
    p : probabilities
    apart : how well these can be told apart; groups : labels that cannot
    agreement, by_task : whether all tasks ask for the amplitude of the best, and what they ask for
    """

    fits: Sequence[Fit]
    squares: doubts.Squares
    best: Fit
    p: posterior.Posterior
    likely: list[Fit]
    apart: np.ndarray
    groups: list[list[str]]
    agreement: float | None
    by_task: list[tuple[str, float, float]]


def judge(evidence: Evidence, fits: Sequence[Fit], present: bool, inflation: float) -> Judged:
    """Hypotheses with their probabilities; `inflation` is what effect-free cases ask for."""
    c, error = evidence.residual, evidence.settings.signature_error
    squares = squares_of(c, inflation)
    p = _posterior(evidence, fits, present, squares)
    likely = isolability.likely(fits, p)
    apart = isolability.separability(likely, c, error, evidence.settings.temperature)
    best = max(fits, key=lambda f: p.labels[f.label])
    agreement, by_task = task_agreement(best.hypothesis, c, error)
    groups = isolability.classes(likely, apart)
    return Judged(fits, squares, best, p, likely, apart, groups, agreement, by_task)


def squares_of(c: Residual, inflation: float) -> doubts.Squares:
    """Sums of squares of a residual, with the factor that effect-free cases ask for."""
    white = c.whiten(c.delta)
    return doubts.Squares(
        whole=float(white @ white),
        expected=float(len(white)),
        excess=inflation,
    )


def _posterior(
    evidence: Evidence, fits: Sequence[Fit], present: bool, squares: doubts.Squares
) -> posterior.Posterior:
    c, settings = evidence.residual, evidence.settings
    found = posterior.posterior(
        fits,
        {
            NONE: unknown_input_evidence(c, evidence.unknown_inputs.columns),
            NO_GAP: no_gap_evidence(c),
        },
        {**evidence.prior, NONE: settings.prior_none, NO_GAP: settings.prior_no_gap},
        settings.temperature,
        posterior.no_gap_range(present, evidence.referenced),
        squares if present else None,
    )
    return posterior.perhaps_misled(found, evidence.prior) if present else found


def robustness(evidence: Evidence, judged: Judged) -> tuple[Robustness, list[RobustnessRow]]:
    """Whether the winning family stays, with other errors and without single tasks.

    Every effect is fitted anew where it was linearised last, which costs no solve.
    """
    c, error = evidence.residual, evidence.settings.signature_error
    weighing = evidence.prior, evidence.settings.temperature
    cells = {f"signature error x {factor}": (c, factor * error) for factor in (0.5, 1.0, 2.0)}
    for factor in (0.5, 2.0):
        cells[f"noise x {factor}"] = (replace(c, covariance=factor * c.covariance), error)
    for task in c.tasks if len(c.tasks) > 1 else ():
        cells[f"without {task}"] = (c.part([other for other in c.tasks if other != task]), error)
    alone = [f for f in judged.fits if len(f.hypothesis.effects) == 1]
    less_probable = posterior.most_probable(alone, *weighing, judged.squares, COMPARED_VARIANTS)
    family = [(e.side, e.family) for e in judged.best.hypothesis.effects]
    rows = []
    for name, (variant, relative) in cells.items():
        kept = c.rows(variant.tasks)
        again = [fit(rival.hypothesis.part(kept), variant, relative) for rival in less_probable]
        squares = squares_of(variant, judged.squares.excess)
        [first] = posterior.most_probable(again, *weighing, squares, 1)
        [winner] = first.hypothesis.effects
        agrees = (winner.side, winner.family) in family
        rows.append(RobustnessRow(cell=name, verdict=winner.label, agrees=agrees))
    return Robustness(len(rows), sum(row.agrees for row in rows)), rows
