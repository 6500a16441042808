"""What the likeliest explanation leaves, in units of what errors were taken to be."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_hypotheses import DAMPING, GAIN, hypothesis, noise, residual

from scapulohumeral.gap.isolation.laplace import fit
from scapulohumeral.gap.isolation.misfit import misfit
from scapulohumeral.gap.isolation.model_error import change_error
from scapulohumeral.gap.isolation.movement import movement_fit
from scapulohumeral.gap.recording.observables import KINEMATIC_CHANNELS

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


@pytest.mark.parametrize("emg", [0, 4])
@pytest.mark.parametrize("size", [2.0, 8.0])
def test_errors_of_a_prediction_are_part_of_what_errors_are_taken_to_be(emg, size) -> None:
    """Whatever is recorded, and however much is predicted."""
    names = (*KINEMATIC_CHANNELS[: 10 - emg], *(f"EMG_{i}" for i in range(emg)))
    right, relative = hypothesis(DAMPING, 1, size), 0.3
    predicted = right.slope @ [1.2]
    found = []
    for seed in range(20):
        c = replace(residual(predicted), channels=names)
        error = change_error(c, predicted, relative, controlled=True)
        shared = np.random.default_rng(seed).normal(size=len(error.rows))
        along = np.sqrt(1.0 + error.variance) * noise(seed) + shared @ error.rows
        c = replace(c, delta=predicted + np.linalg.solve(c.axes.matrix, along))
        found.append(misfit([fit(right, c, relative)], {0.0: c}, relative))
    assert np.mean(found) < 1.2


def test_it_is_never_below_one() -> None:
    assert explained(0.1) == 1.0


def test_another_movement_is_part_of_what_errors_are_taken_to_be() -> None:
    same = residual(FACTOR * noise(5))
    other = replace(same, covariance=FACTOR**2 * same.covariance, moved_deg=6.0)
    both = {0.0: same, 6.0: other}
    moved = movement_fit(both, 1e6)
    assert misfit([fit(WRONG, same, 0.0), moved], both, 0.0) == pytest.approx(1.0, abs=0.35)
