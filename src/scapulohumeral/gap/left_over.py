"""Whether the first cause leaves a gap, and where: two causes at once often look like the larger.

What it leaves is tested as the gap was, with all that its prediction may be off by beside what
differs without a cause.

Letters: D coefficients, P parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.detection.presence import Presence, surest, tested
from scapulohumeral.gap.detection.regions import shown_regions
from scapulohumeral.gap.detection.shaped import each_shaped
from scapulohumeral.gap.isolation.empirical_bayes import Evidence
from scapulohumeral.gap.isolation.hypothesis import Fit
from scapulohumeral.gap.labels import JOIN, MOVED
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.result import Shown

# How the remark starts that the first cause is not all.
SOMETHING_LEFT = "something is left"
# Places that it names.
PLACES = 2


@dataclass(frozen=True, eq=False)
class LeftOver:
    """What a cause leaves of a difference.

    Attributes
    ----------
    presence : whether that is a gap, by the surest of the tests
    regions : where it shows, the largest first
    nearest : effect that looks most like it
    """

    presence: Presence
    regions: tuple[Shown, ...]
    nearest: str


def left_over(best: Fit, evidence: Evidence, inflation: float, seed: int) -> LeftOver:
    """Test what the first cause leaves.

    Parameters
    ----------
    best : the cause
    evidence : difference, effects and their errors
    inflation, seed : as for `presence.difference_map`
    """
    left = unexplained(best, evidence)
    parts = best.label.split(JOIN)
    shapes, alpha = evidence.shapes(without=parts), evidence.settings.alpha
    found, tests = tested(left, shapes, alpha, inflation, seed)
    others = [f for f in evidence.screened if f.label not in parts and np.any(f.hypothesis.slope)]
    likeness = each_shaped(left, left.delta[:, None], [f.hypothesis.slope for f in others])
    return LeftOver(
        presence=surest(tests),
        regions=shown_regions(found, left, ()),
        nearest=others[int(np.argmax(likeness))].label,
    )


def left_in_words(label: str, left: LeftOver) -> str:
    """What a cause leaves, where, and what would look like it."""
    places = [
        f"{region.channel} at {region.phase_percent[0]:.0f} to {region.phase_percent[1]:.0f} %"
        for region in left.regions[:PLACES]
    ]
    where = f", most in {' and '.join(places)} of the movement" if places else ""
    return (
        f"{SOMETHING_LEFT} that {label} does not explain (p {left.presence.p_value:.1g}){where}; "
        f"{left.nearest} is most like it"
    )


def said_to_be_left(remarks: Sequence[str]) -> str | None:
    """The remark among those of an answer that something is left; None without one."""
    return next((remark for remark in remarks if remark.startswith(SOMETHING_LEFT)), None)


def unexplained(best: Fit, evidence: Evidence) -> Residual:
    """What a cause leaves, with what it may leave by errors of its prediction."""
    movement = evidence.residuals[best.moved_deg].covariance - evidence.residual.covariance
    whole = evidence.cautious
    base = replace(whole, covariance=whole.covariance + movement)
    if best.label == MOVED:
        return base
    error = best.hypothesis.error(best.x, base, evidence.settings.signature_error)
    # Whitened, without an error of the prediction, it would be one.
    whitened = np.linalg.inv(error.solve(np.eye(len(base.delta))))
    back = np.linalg.inv(base.axes.matrix)
    return replace(base, delta=base.delta - best.predicted, covariance=back @ whitened @ back.T)
