"""What motion alone cannot tell is not named, and says what would tell it."""

from types import SimpleNamespace

import pytest

from scapulohumeral.gap.judgement import NO_POSTURE_TOLD, NOT_TOLD, _movements, _untold
from scapulohumeral.gap.labels import MOVED
from scapulohumeral.gap.verdict.posterior import Posterior

pytestmark = pytest.mark.unit
LOAD, FRAME, SKIN = "body/hand_load", "input/frame_misalignment/humerus", "measurement/scapula_sta"


def of_person(*recorded: str, one: bool = True) -> SimpleNamespace:
    """What the question needs of the evidence of a case."""
    effects = [SimpleNamespace(label=LOAD, changes_body=True)]
    effects += [SimpleNamespace(label=label, changes_body=False) for label in (FRAME, SKIN)]
    kinds = [SimpleNamespace(name=name) for name in ("kinematics", *recorded)]
    return SimpleNamespace(
        of_one_person=one, effects=effects, residual=SimpleNamespace(kinds=kinds)
    )


@pytest.mark.parametrize(
    ("first", "why"),
    [
        (LOAD, NOT_TOLD),
        (MOVED, NOT_TOLD),
        (FRAME, NO_POSTURE_TOLD),
        (f"{FRAME} + {SKIN}", NO_POSTURE_TOLD),
        (f"{LOAD} + {FRAME}", NOT_TOLD),
        (SKIN, ""),
    ],
)
def test_motion_alone_does_not_name_what_a_person_may_have_done(first: str, why: str) -> None:
    p = Posterior({first: 0.9}, none=0.1, no_gap=0.0)
    assert _untold(of_person(), p) == why
    assert _untold(of_person("emg"), p) == ""
    assert _untold(of_person(one=False), p) == ""


def test_another_movement_may_be_an_answer_to_whatever_acts_on_the_body() -> None:
    labels = [LOAD, FRAME, SKIN, MOVED, f"{LOAD} + {SKIN}", f"{FRAME} + {SKIN}"]
    p = Posterior(dict.fromkeys(labels, 0.1), none=0.4, no_gap=0.0)
    assert _movements(of_person(), p) == [LOAD, MOVED, f"{LOAD} + {SKIN}"]
