"""Axes along which errors of the shape are independent, on a covariance that is not diagonal."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_hypotheses import SIZE, noise, residual

from scapulohumeral.gap.recording.observables import CONTACT_CHANNELS, KINEMATIC_CHANNELS
from scapulohumeral.gap.residual.axes import SHAPE_SHARED, partly_alike

pytestmark = pytest.mark.unit

CHANNELS = (*KINEMATIC_CHANNELS[:4], "EMG_a", "EMG_b", "EMG_c", *CONTACT_CHANNELS)


@pytest.fixture(name="loud")
def _loud():
    root = np.random.default_rng(8).normal(size=(SIZE, SIZE))
    covariance = 0.05 * root @ root.T + 0.3 * np.eye(SIZE)
    there = residual(noise(9))
    return replace(there, covariance=covariance, noise=0.5 * covariance, channels=CHANNELS)


def test_noise_is_independent_along_the_axes(loud):
    whitened = loud.axes.matrix @ loud.covariance @ loud.axes.matrix.T
    np.testing.assert_allclose(whitened, np.eye(SIZE), atol=1e-10)


def test_channels_add_up_to_the_whole(loud):
    whole = loud.axes.whiten(loud.delta)
    np.testing.assert_allclose(loud.axes.channels(loud.delta).sum(axis=0), whole, atol=1e-12)
    np.testing.assert_allclose(
        loud.axes.channels_of_all_tasks(loud.delta).sum(axis=0), whole, atol=1e-12
    )


def test_errors_of_the_shape_are_changes_by_one_deviation_partly_alike_in_all_tasks(loud):
    """Those of the kind with most coefficients are independent, the others a product of rows."""
    axes = loud.axes
    alike = np.kron([[1.0, SHAPE_SHARED], [SHAPE_SHARED, 1.0]], np.eye(SIZE // 2))
    found = {name: np.diag(one) for name, one in axes.variances.items()}
    found |= {name: rows.T @ rows for name, rows in axes.rows.items()}
    assert set(axes.variances) == {"emg"}
    assert set(axes.rows) == {"contact_force"}
    for kind in loud.kinds[1:]:
        deviations = np.zeros(SIZE)
        deviations[kind.rows] = kind.deviations
        expected = axes.matrix @ (alike * np.outer(deviations, deviations)) @ axes.matrix.T
        np.testing.assert_allclose(found[kind.name], expected, atol=1e-10)


def test_rows_are_alike_as_far_as_is_asked():
    rows = np.random.default_rng(1).normal(size=(6, 5))
    sums = rows[:3] + rows[3:]
    found = partly_alike(rows, 2, 0.7, 1.7)
    expected = 0.7**2 * rows.T @ rows + 1.7**2 * sums.T @ sums
    np.testing.assert_allclose(found.T @ found, expected)
