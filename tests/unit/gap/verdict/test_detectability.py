"""The smallest amplitude that is promised to be found is found as often as promised."""

from dataclasses import replace

import numpy as np
import pytest
from gap_movement import SETUP

from scapulohumeral.gap.detection.presence import effect_shaped
from scapulohumeral.gap.effects.library import library
from scapulohumeral.gap.isolation.hypothesis import Hypothesis
from scapulohumeral.gap.recording.observables import KINEMATIC_CHANNELS, phase_functions
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.verdict.detectability import POWER, smallest_detectable

pytestmark = pytest.mark.unit
FUNCTIONS = phase_functions(20, 4)
SIZE = len(KINEMATIC_CHANNELS) * FUNCTIONS.shape[1]
TRIES = 200


def residual(rng: np.random.Generator) -> Residual:
    """One task whose noise has a random covariance; degrees so many that its scale is known."""
    root = rng.normal(size=(SIZE, SIZE)) / np.sqrt(SIZE) + np.eye(SIZE)
    covariance = root @ root.T
    return Residual(
        np.zeros(SIZE), covariance, 0.5 * covariance, FUNCTIONS, ("t",), KINEMATIC_CHANNELS, (1e6,)
    )


@pytest.mark.parametrize("label", ["body/hand_load", "input/frame_misalignment/humerus"])
def test_promised_amplitude_is_found_as_often_as_promised(label: str) -> None:
    rng = np.random.default_rng(3)
    effect = next(e for e in library(SETUP) if e.label == label)
    slope = rng.normal(size=(SIZE, len(effect.params)))
    noise = residual(rng)
    # So large that the amplitude lies inside the bounds of the parameter.
    slope *= 100.0 / np.linalg.norm(noise.whiten(slope[:, 0]))
    one = Hypothesis((effect,), np.zeros(len(effect.params)), np.zeros((SIZE, 1)), slope, 1.0)
    _, null = effect_shaped(noise, [slope], 1)
    threshold = float(np.quantile(null, 0.975))
    [promised] = smallest_detectable([one], noise, threshold)
    change = effect.params[0].internal(promised.value) * slope[:, 0]
    draws = np.linalg.cholesky(noise.covariance) @ rng.normal(size=(SIZE, TRIES))
    found = [
        effect_shaped(replace(noise, delta=change + draw), [slope], 1)[0] > threshold
        for draw in draws.T
    ]
    assert np.mean(found) == pytest.approx(POWER, abs=0.09)
