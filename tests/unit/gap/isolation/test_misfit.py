"""What the likeliest explanation leaves, in units of what errors were taken to be."""

from dataclasses import replace

import pytest
from made_up_hypotheses import DAMPING, GAIN, hypothesis, noise, residual

from scapulohumeral.gap.isolation.laplace import fit
from scapulohumeral.gap.isolation.misfit import misfit
from scapulohumeral.gap.isolation.movement import movement_fit

pytestmark = pytest.mark.unit
RIGHT, WRONG = hypothesis(DAMPING, 1), hypothesis(GAIN, 2)
FACTOR = 3.0


def explained(scatter: float) -> float:
    """Misfit of a difference that one of two effects explains but for scatter."""
    c = residual(RIGHT.slope @ [1.2] + scatter * noise(4))
    return misfit([fit(one, c, 0.0) for one in (WRONG, RIGHT)], {0.0: c}, 0.0)


def test_it_is_the_mean_square_that_the_likeliest_explanation_leaves() -> None:
    assert explained(1.0) == pytest.approx(1.0, abs=0.35)
    assert explained(FACTOR) == pytest.approx(FACTOR**2 * explained(1.0), rel=0.35)


def test_it_is_never_below_one() -> None:
    assert explained(0.1) == 1.0


def test_another_movement_is_part_of_what_errors_are_taken_to_be() -> None:
    same = residual(FACTOR * noise(5))
    other = replace(same, covariance=FACTOR**2 * same.covariance, moved_deg=6.0)
    both = {0.0: same, 6.0: other}
    moved = movement_fit(both, 1e6)
    assert misfit([fit(WRONG, same, 0.0), moved], both, 0.0) == pytest.approx(1.0, abs=0.35)
