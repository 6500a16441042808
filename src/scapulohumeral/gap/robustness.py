"""Whether the answer stays with other errors, and without single tasks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from scapulohumeral.gap.curve_files import RobustnessRow
from scapulohumeral.gap.isolation.empirical_bayes import Evidence, others_of
from scapulohumeral.gap.isolation.hypothesis import Fit
from scapulohumeral.gap.isolation.laplace import fit
from scapulohumeral.gap.judgement import Judged
from scapulohumeral.gap.labels import MOVED, family
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.result import Robustness
from scapulohumeral.gap.verdict import posterior

# Effects among which variants choose.
COMPARED_VARIANTS = 15


def robustness(evidence: Evidence, judged: Judged) -> tuple[Robustness, list[RobustnessRow]]:
    """Whether the winning family stays, with other errors and without single tasks.

    The likeliest effects are fitted anew where they were linearised last, which costs no solve, and
    judged again with the evidence that this adds or takes.
    """
    error = evidence.settings.signature_error
    base = evidence.residuals
    cells = {}
    for factor in (0.5, 2.0):
        cells[f"signature error x {factor}"] = (base, factor * error)
        scaled = {s: replace(c, covariance=factor * c.covariance) for s, c in base.items()}
        cells[f"covariance x {factor}"] = (scaled, error)
    tasks = evidence.residual.tasks
    for task in tasks if len(tasks) > 1 else ():
        rest = [other for other in tasks if other != task]
        cells[f"without {task}"] = ({s: c.part(rest) for s, c in base.items()}, error)
    alone = [f for f in judged.fits if len(f.hypothesis.effects) == 1]
    rivals = sorted(alone, key=lambda f: -judged.p.labels[f.label])[:COMPARED_VARIANTS]
    families = {family(effect.label) for effect in judged.best.hypothesis.effects}
    before = _log_evidence(rivals, evidence, base, error)
    rows = []
    for name, (variant, relative) in cells.items():
        now = _log_evidence(rivals, evidence, variant, relative)
        scores = {
            label: judged.scores[label].with_more(now[label] - before[label]) for label in now
        }
        found = posterior.probabilities(scores, evidence.settings.weighing, judged.circumstances)
        rows.append(RobustnessRow(name, found.first, family(found.first) in families))
    return Robustness(len(rows), sum(row.agrees for row in rows)), rows


def _log_evidence(
    rivals: Sequence[Fit], evidence: Evidence, variant: Mapping[float, Residual], relative: float
) -> dict[str, float]:
    """Log evidence of some effects, and of no effect, in a variant.

    Each effect is taken under its most probable supposition: what others add to the fit to
    everything, they are taken to add here.
    """
    rows = evidence.residual.rows(variant[0.0].tasks)
    found = others_of(variant, evidence.unknown_inputs.columns[rows])
    for first in rivals:
        if first.label != MOVED:
            again = fit(first.hypothesis.part(rows), variant[first.moved_deg], relative)
            found[first.label] = again.log_evidence
    return found
