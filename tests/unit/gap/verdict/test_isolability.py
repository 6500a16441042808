"""Classes of labels that trials cannot tell apart."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_up_hypotheses import LOAD, MASS, SIZE, residual
from support.open_cases import START

from scapulohumeral.gap.labels import MOVED
from scapulohumeral.gap.verdict.isolability import APART, FAR_BEHIND, classes, explaining
from scapulohumeral.gap.verdict.posterior import Score

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


@pytest.mark.parametrize(
    ("behind", "change", "label", "stays"),
    [
        (0.9, 2.0, MASS.label, True),
        (1.1, 2.0, MASS.label, False),
        (0.0, 0.9, MASS.label, False),
        (1.1, 0.9, MOVED, True),
    ],
)
def test_what_explains_nothing_is_in_no_class(behind, change, label, stays) -> None:
    """Whatever is predicted, the first cause comes as near to hardly any change."""
    there = residual(np.zeros(SIZE))
    one = np.eye(SIZE)[0]
    first = SimpleNamespace(label=LOAD.label, predicted=9.0 * one)
    other = SimpleNamespace(label=label, predicted=change * one)
    weights = replace(START, evidence=0.4, held_out=0.1)
    lost = behind * FAR_BEHIND / weights.whole
    scores = {
        first.label: Score(log_prior=-9.0, log_evidence=50.0, log_predictive=None),
        label: Score(log_prior=0.0, log_evidence=50.0 - lost, log_predictive=None),
    }
    found = explaining([first, other], first.label, scores, weights, there)
    assert [f.label for f in found] == [first.label, *[label] * stays]
    # Without a gap no cause may be likely, the first among them.
    assert len(explaining([other], first.label, scores, weights, there)) == stays
