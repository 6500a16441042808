"""Derivatives by central differences, to compare exact ones with."""

from collections.abc import Callable

import numpy as np
from scipy import sparse

Function = Callable[[np.ndarray], np.ndarray]


def differences(function: Function, x: np.ndarray, h: float = 1e-6) -> np.ndarray:
    """Central differences of function(x) by the last axis of x, on a new last axis."""
    steps = h * np.eye(x.shape[-1])
    return np.stack([(function(x + s) - function(x - s)) / (2 * h) for s in steps], axis=-1)


def dense(
    values: np.ndarray, structure: tuple[np.ndarray, np.ndarray], shape: tuple[int, int]
) -> np.ndarray:
    """A matrix from its nonzeros, of which those in one place add up."""
    return np.asarray(sparse.coo_matrix((values, structure), shape=shape).toarray())


def assert_close(actual: np.ndarray, expected: np.ndarray, share: float) -> None:
    """Equal to a share of the largest expected value."""
    np.testing.assert_allclose(actual, expected, rtol=0, atol=share * np.abs(expected).max())
