"""The covariance of another movement is what simulated changes of motion have."""

import numpy as np
import pytest
from made_up_movement import NAMES, same_movement, signatures, simulated_movements

from scapulohumeral.gap.recording.observables import KINEMATIC_CHANNELS
from scapulohumeral.gap.residual.other_movement import other_movement

pytestmark = pytest.mark.unit

EMG = NAMES[10:]


def unit(relative_error, same=None):
    same = same or same_movement()
    return other_movement(same, signatures(), relative_error)


@pytest.mark.parametrize("relative_error", [0.0, 0.5])
def test_covariance_is_that_of_simulated_movements(relative_error):
    same = same_movement()
    drawn = simulated_movements(np.random.default_rng(1), 20000, relative_error=relative_error)
    expected, found = drawn @ drawn.T / drawn.shape[1], unit(relative_error)
    # In units in which all channels vary by one, within and across channels and tasks.
    scale = np.sqrt(np.diag(found))
    np.testing.assert_allclose(
        expected / np.outer(scale, scale), found / np.outer(scale, scale), atol=0.06
    )
    assert found.shape == same.covariance.shape


def test_each_joint_varies_by_one_degree():
    same = same_movement()
    angles = same.channel_rows(KINEMATIC_CHANNELS)
    variances = np.diag(unit(0.2))[angles].reshape(3, 10, -1).sum(axis=-1) / len(same.functions)
    np.testing.assert_allclose(variances, 1.0)


def test_tasks_share_half_of_it():
    found, same = unit(0.2), same_movement()
    a, b = same.rows(["a"]), same.rows(["b"])
    angles = same.part(["a"]).channel_rows(KINEMATIC_CHANNELS)
    np.testing.assert_allclose(
        found[np.ix_(a[angles], b[angles])], 0.5 * found[np.ix_(a[angles], a[angles])], atol=1e-12
    )


@pytest.mark.parametrize("relative_error", [0.0, 0.3])
def test_emg_follows_the_motion_within_its_error(relative_error):
    """Once the motion is known, all that is left of EMG is the error, by channel."""
    same = same_movement()
    angles, emg = (same.channel_rows(names) for names in (KINEMATIC_CHANNELS, EMG))
    found = unit(relative_error)
    across = found[np.ix_(emg, angles)]
    known = across @ np.linalg.pinv(found[np.ix_(angles, angles)], hermitian=True) @ across.T
    exact = unit(0.0)
    left = np.zeros((len(emg), len(emg)))
    for channel in EMG:
        own = same.channel_rows([channel])
        place = np.ix_(*2 * [np.searchsorted(emg, own)])
        left[place] = relative_error**2 * exact[np.ix_(own, own)]
    np.testing.assert_allclose(found[np.ix_(emg, emg)] - known, left, atol=1e-9)
    np.testing.assert_array_equal(found[np.ix_(angles, angles)], exact[np.ix_(angles, angles)])
