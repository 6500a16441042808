"""Whether the reference trials may have what is looked for in the test trials.

Many effects have one sign: strength is lost, muscles co-contract, a hand holds something. In the
reference trials such an effect makes the opposite difference, which no effect in the test trials
explains. Letters: D coefficients.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scapulohumeral.gap.isolation.empirical_bayes import Evidence, of_person
from scapulohumeral.gap.isolation.hypothesis import Hypothesis
from scapulohumeral.gap.isolation.laplace import fit
from scapulohumeral.gap.isolation.suppositions import Supposition

# Log odds over every effect in the test trials, twenty to one.
CLEARLY = float(np.log(20.0))


def in_reference_instead(evidence: Evidence) -> str:
    """Label of the effect that would explain the difference best if the reference trials had it.

    Empty if one in the test trials, or none at all, explains it nearly as well. Effects are those
    at the nominal solutions, in a person who gives way as the model does and moved alike.
    """
    if not evidence.of_one_person:
        return ""
    same = Supposition(next(iter(evidence.known)), 0.0)
    residual, error = evidence.residuals[same.moved_deg], evidence.settings.signature_error
    tests = [
        f.log_evidence + np.log(evidence.prior[f.label]) for f in of_person(evidence.fits, same)
    ]
    fits = [
        fit(_opposite(hypothesis), residual, error)
        for hypothesis in evidence.known[same.stiffness]
        if _has_one_sign(hypothesis)
    ]
    if not fits:
        return ""
    scores = {f.label: f.log_evidence + np.log(evidence.prior[f.label]) for f in fits}
    best = max(scores, key=scores.__getitem__)
    # Without their priors, which are below one: a remark about the wrong side misleads.
    nothing = max(evidence.others().values())
    return best if scores[best] > max(*tests, nothing) + CLEARLY else ""


def in_words(label: str) -> str:
    """What to do about it."""
    return (
        f"{label} in the reference trials would explain the difference better than any cause in "
        "the test trials: if that may be, exchange tests and references"
    )


def _has_one_sign(hypothesis: Hypothesis) -> bool:
    low, high = hypothesis.bounds
    return bool(low[0] == 0.0 or high[0] == 0.0)


def _opposite(hypothesis: Hypothesis) -> Hypothesis:
    """The same effect in the other side's trials."""
    return replace(hypothesis, value=-hypothesis.value, slope=-hypothesis.slope)
