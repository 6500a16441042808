"""The smallest amplitude that is promised to be found is found as often as promised."""

import numpy as np
import pytest
from gap_movement import SETUP
from scipy.linalg import block_diag

from scapulohumeral.gap.detection.presence import DRAWS, effect_shaped
from scapulohumeral.gap.detection.shaped import shaped
from scapulohumeral.gap.effects.library import library
from scapulohumeral.gap.isolation.hypothesis import Hypothesis
from scapulohumeral.gap.isolation.model_error import change_error, own_error
from scapulohumeral.gap.recording.observables import KINEMATIC_CHANNELS, phase_functions
from scapulohumeral.gap.residual.noise import draws
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.verdict.detectability import POWER, silence_tells, smallest_detectable

pytestmark = pytest.mark.unit
FUNCTIONS = phase_functions(20, 4)
SIZE = len(KINEMATIC_CHANNELS) * FUNCTIONS.shape[1]
TRIES = 1000


def residual(rng: np.random.Generator, degrees: float) -> Residual:
    """Three tasks whose noise has a random covariance, known by so many degrees of freedom."""
    root = rng.normal(size=(SIZE, SIZE)) / np.sqrt(SIZE) + np.eye(SIZE)
    covariance = block_diag(*3 * [root @ root.T])
    tasks = ("a", "b", "c")
    return Residual(
        np.zeros(3 * SIZE), covariance, 0.8 * covariance, FUNCTIONS, tasks, KINEMATIC_CHANNELS,
        (degrees,) * 3,
    )  # fmt: skip


def answers(one: Hypothesis, i: int, noise: Residual, relative: float) -> np.ndarray:
    """Changes (D, TRIES) by a unit of parameter `i`, of persons who answer in their ways."""
    slope, effect = one.slope[:, i], one.effects[0]
    error = change_error(noise, slope, own_error(effect, relative), effect.changes_body)
    back = np.linalg.inv(noise.axes.matrix)
    covariance = back @ (np.diag(error.variance) + error.rows.T @ error.rows) @ back.T
    return np.random.default_rng(6).multivariate_normal(slope, covariance, TRIES).T


@pytest.mark.parametrize("relative", [0.0, 0.3])
@pytest.mark.parametrize("degrees", [1e6, 4.0])
@pytest.mark.parametrize(
    ("label", "test"),
    [("body/hand_load", "glr"), ("input/frame_misalignment/humerus", "on_record")],
)
def test_promised_amplitude_is_found_as_often_as_promised(
    label: str, test: str, degrees: float, relative: float
) -> None:
    rng = np.random.default_rng(3)
    effect = next(e for e in library(SETUP) if e.label == label)
    slope = rng.normal(size=(3 * SIZE, len(effect.params)))
    noise = residual(rng, degrees)
    # So large that the amplitude lies inside the bounds of the parameter.
    slope *= 100.0 / np.linalg.norm(noise.whiten(slope[:, 0]))
    slope[:, 1:] *= 3.0
    one = Hypothesis((effect,), np.zeros(len(effect.params)), np.zeros((3 * SIZE, 1)), slope, 1.0)
    _, null = effect_shaped(noise, [slope], draws(noise, DRAWS, 1))
    threshold = float(np.quantile(null, 0.975))
    others = {"glr": 2.0 * threshold, "on_record": 2.0 * threshold}
    promised = smallest_detectable([one], noise, {**others, test: threshold}, relative, 1)
    assert [row.parameter for row in promised] == [param.name for param in effect.params]
    for i, (param, row) in enumerate(zip(effect.params, promised, strict=True)):
        amplitude = param.internal(row.value)
        changed = amplitude * answers(one, i, noise, relative) + draws(noise, TRIES, 5)
        found = shaped(noise, changed, [slope]) > threshold
        assert np.mean(found) == pytest.approx(POWER, abs=0.05)


def test_no_amplitude_is_promised_that_its_effect_cannot_have() -> None:
    """Fewer fibres without less strength would be stronger fibres."""
    effect = next(e for e in library(SETUP) if e.label == "body/strength_loss/biceps")
    noise = residual(np.random.default_rng(3), 1e6)
    slope = 1e3 * np.random.default_rng(5).normal(size=(3 * SIZE, 2))
    one = Hypothesis((effect,), np.zeros(2), np.zeros((3 * SIZE, 1)), slope, 1.0)
    [promised] = smallest_detectable([one], noise, {"glr": 4.0}, 0.0, 1)
    assert promised.parameter == "f0_factor"


def test_what_scatter_hides_at_any_size_is_not_promised() -> None:
    """A change in one task is told from its scatter up to a length that no amplitude exceeds."""
    rng = np.random.default_rng(4)
    effect = next(e for e in library(SETUP) if e.label == "input/frame_misalignment/humerus")
    noise = residual(rng, 4.0)
    slope = np.zeros((3 * SIZE, 3))
    slope[:SIZE] = 1e3 * rng.normal(size=(SIZE, 3))
    one = Hypothesis((effect,), np.zeros(3), np.zeros((3 * SIZE, 1)), slope, 1.0)
    reached = np.sqrt(4.0 + SIZE)
    assert smallest_detectable([one], noise, {"glr": 0.5 * reached, "on_record": 9.0}, 0.0, 1)
    assert not smallest_detectable([one], noise, {"glr": 1.2 * reached, "on_record": 9.0}, 0.0, 1)


def test_silence_tells_where_half_of_the_families_would_have_shown() -> None:
    every = ["body/a/1", "body/a/2", "body/b", "control/c", "input/d"]
    assert silence_tells(every, ["body/a/1", "body/b"])
    assert not silence_tells(every, ["body/a/1", "body/a/2"])


def test_an_amplitude_that_only_the_longer_bound_holds_is_promised_to_that_side() -> None:
    """Bounds of a mass reach further down than up, and what shows does so either way."""
    rng = np.random.default_rng(3)
    effect = next(e for e in library(SETUP) if e.label == "body/segment_mass/forearm")
    [param] = effect.params
    low, high = param.bounds
    assert -low > high
    noise = residual(rng, 1e6)
    slope = rng.normal(size=(3 * SIZE, 1))
    slope *= 1.0 / np.linalg.norm(noise.whiten(slope[:, 0]))

    def promised(scale: float) -> list[float]:
        one = Hypothesis((effect,), np.zeros(1), np.zeros((3 * SIZE, 1)), scale * slope, 1.0)
        found = smallest_detectable([one], noise, {"glr": 4.0}, 0.0, 1)
        return [param.internal(row.value) for row in found]

    [needed] = promised(1e2)
    assert 0.0 < needed < high
    # Seen less well, the same effect has to be as much larger.
    between = 0.5 * (high - low)
    [found] = promised(1e2 * needed / between)
    assert found == pytest.approx(-between, rel=0.05)
    assert promised(1e2 * needed / (-2.0 * low)) == []
