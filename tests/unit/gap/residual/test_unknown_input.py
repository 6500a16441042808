"""What may act that no effect names: forces through the movement, or errors of the record alone."""

import numpy as np
import pytest
from gap_movement import SETTINGS
from made_up_movement import NAMES, same_movement, signatures

from scapulohumeral.gap.recording.observables import KINEMATIC_CHANNELS
from scapulohumeral.gap.residual.noise import deviation
from scapulohumeral.gap.residual.unknown_input import unknown_errors
from scapulohumeral.gap.signatures.nuisances import SMOOTH

pytestmark = pytest.mark.unit


def test_errors_of_two_records_stay_in_their_channel_and_task():
    same = same_movement()
    found = unknown_errors(signatures(), same.functions, NAMES, SETTINGS.noise)
    assert found.names == tuple(("channel", name) for name in NAMES)
    # Placebos are made of the first ones.
    assert tuple(name for _, name in found.names[:10]) == KINEMATIC_CHANNELS
    by_curve = found.columns.reshape(len(same.delta), len(same.tasks), len(NAMES), SMOOTH)
    for t, task in enumerate(same.tasks):
        for k, name in enumerate(NAMES):
            rows = np.intersect1d(same.rows([task]), same.channel_rows([name]))
            own = by_curve[:, t, k]
            np.testing.assert_allclose(np.delete(own, rows, axis=0), 0.0, atol=1e-12)
            curves = found.shapes[k]
            size = np.sqrt(np.mean(curves**2, axis=0))
            np.testing.assert_allclose(size, deviation(SETTINGS.noise, name))
            # As coefficients they are the curves.
            np.testing.assert_allclose(same.functions @ own[rows], curves, atol=1e-9)
