"""Whether any activations could have done what was recorded: one muscle and one moment by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from scapulohumeral.gap.detection.feasibility import EMG_ERROR, EMG_GAIN, no_cost

pytestmark = pytest.mark.unit

LEVER_NM = 10.0
FRAMES = 7


def infeasible(needed_nm: float, emg: float) -> float:
    """Percent of frames in which a muscle of 10 N m cannot make a moment with its EMG."""
    of_task = SimpleNamespace(
        levers=np.full((FRAMES - 1, 1, 1), LEVER_NM), needed=np.full((FRAMES - 1, 1), needed_nm)
    )
    sensors = SimpleNamespace(electrodes=np.ones((1, 1)))
    return no_cost([of_task], [np.full((FRAMES, 1), emg)], sensors).infeasible_frames_percent


@pytest.mark.parametrize(
    ("needed_nm", "emg", "percent"),
    [
        (4.0, 0.4, 0.0),
        # As much and as little as gain and error of the electrode allow.
        (LEVER_NM * (EMG_GAIN * 0.4 + EMG_ERROR), 0.4, 0.0),
        (LEVER_NM * (0.4 / EMG_GAIN - EMG_ERROR), 0.4, 0.0),
        # One newton metre more, and less: beyond what counts as balanced.
        (LEVER_NM * (EMG_GAIN * 0.4 + EMG_ERROR) + 1.0, 0.4, 100.0),
        (LEVER_NM * (0.4 / EMG_GAIN - EMG_ERROR) - 1.0, 0.4, 100.0),
        # No activation above one, and none that pushes.
        (LEVER_NM + 1.0, 1.0, 100.0),
        (-1.0, 0.0, 100.0),
    ],
)
def test_what_a_muscle_can_do_with_its_emg(needed_nm, emg, percent):
    assert infeasible(needed_nm, emg) == percent
