"""Classes of labels that trials cannot tell apart."""

from types import SimpleNamespace

import numpy as np
import pytest

from scapulohumeral.gap.verdict.isolability import APART, classes

pytestmark = pytest.mark.unit
NAMES = ("one", "two", "three", "four")
FITS = [SimpleNamespace(label=name) for name in NAMES]
FAR, NEAR = APART + 0.01, APART - 0.01


def apart(*near: tuple[int, int]) -> np.ndarray:
    """How well each two are told apart: all of them well, but for some."""
    result = np.full((len(FITS), len(FITS)), FAR)
    for i, k in near:
        result[i, k] = result[k, i] = NEAR
    return result


def test_a_class_holds_what_is_told_from_none_of_its_members() -> None:
    assert classes(FITS, apart((0, 2), (2, 3))) == [["one", "three"], ["two"], ["four"]]


def test_labels_that_belong_together_come_first_whatever_the_data_say_of_their_mates() -> None:
    """`one` looks like `two`, which is told from `three`."""
    found = classes(FITS, apart((0, 1)), together=("one", "three"))
    assert found == [["one", "three"], ["two"], ["four"]]
    both = classes(FITS, apart((0, 1), (1, 2)), together=("three", "one"))
    assert both == [["one", "three", "two"], ["four"]]
