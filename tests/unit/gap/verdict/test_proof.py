"""What motion alone cannot tell is not named, and says what would tell it."""

from types import SimpleNamespace

import pytest
from support.open_cases import START

from scapulohumeral.gap.curve_files import LeftOutRow
from scapulohumeral.gap.explained import Explained
from scapulohumeral.gap.labels import MOVED, NO_GAP, NONE
from scapulohumeral.gap.result import Share, Shrinkage
from scapulohumeral.gap.verdict.posterior import Posterior, Score
from scapulohumeral.gap.verdict.proof import (
    BETTER_UNKNOWN,
    DISAGREEING,
    NO_POSTURE_TOLD,
    NOT_TOLD,
    NOTHING_HELD_OUT,
    NOTHING_TO_REMOVE,
    STRONG,
    is_either,
    motion_is_told,
    movements,
    predicted_gain,
    unknown,
    unproven,
    untold,
)

pytestmark = pytest.mark.unit
# Whether there is a trial or a task that a cause need not be fitted to.
LEFT_OUT = True
LOAD, FRAME, SKIN = "body/hand_load", "input/frame_misalignment/humerus", "measurement/scapula_sta"


def of_person(*recorded: str, one: bool = True, movement: bool = False) -> SimpleNamespace:
    """What the question needs of the evidence of a case."""
    effects = [SimpleNamespace(label=LOAD, changes_body=True)]
    effects += [SimpleNamespace(label=label, changes_body=False) for label in (FRAME, SKIN)]
    kinds = [SimpleNamespace(name=name) for name in ("kinematics", *recorded)]
    return SimpleNamespace(
        of_one_person=one,
        effects=effects,
        residual=SimpleNamespace(kinds=kinds),
        settings=SimpleNamespace(of_one_movement=movement),
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
    assert untold(of_person(), p) == why
    assert untold(of_person("emg"), p) == ""
    assert untold(of_person(one=False), p) == ""


def test_another_movement_may_be_an_answer_to_whatever_acts_on_the_body() -> None:
    labels = [LOAD, FRAME, SKIN, MOVED, f"{LOAD} + {SKIN}", f"{FRAME} + {SKIN}"]
    p = Posterior(dict.fromkeys(labels, 0.1), none=0.4, no_gap=0.0)
    assert movements(of_person(), p, FRAME) == [LOAD, MOVED, f"{LOAD} + {SKIN}"]
    assert movements(of_person(), p, LOAD) == [MOVED]


def test_a_frame_is_named_with_posture_only_if_one_of_both_is_likely() -> None:
    compared = [SimpleNamespace(label=label) for label in (FRAME, MOVED)]
    p = Posterior({FRAME: 0.4, MOVED: 0.2, LOAD: 0.3}, none=0.1, no_gap=0.0)
    assert is_either(p, FRAME, compared)
    assert not is_either(p, FRAME, compared[:1])
    unlikely = Posterior({FRAME: 0.3, MOVED: 0.2, LOAD: 0.4}, none=0.1, no_gap=0.0)
    assert not is_either(unlikely, FRAME, compared)


def removing(of_task: float | None, trial: float | None = None) -> Explained:
    """How far a cause shrinks the gap on what was left out of the fit."""
    of_trials = None if trial is None else Share(trial, None, 4)
    left_out = [] if of_task is None else [LeftOutRow("lift", 2.0, 2.0 - of_task)]
    return Explained(Shrinkage(None, of_trials, None, ()), left_out, [])


def test_a_cause_is_proven_by_what_it_removes_of_the_gap_on_tasks_left_out() -> None:
    assert unproven(LOAD, removing(0.4), 0.0, 0.5, LEFT_OUT) == ""
    assert "on a task left out of the fit" in unproven(
        LOAD, removing(-0.1, 0.4), 9.0 * STRONG, 0.5, LEFT_OUT
    )
    assert "on a trial left out" in unproven(
        LOAD, removing(None, -0.1), 9.0 * STRONG, 0.5, LEFT_OUT
    )
    assert "different amplitudes" in unproven(LOAD, removing(0.4), 0.0, 0.5 * DISAGREEING, LEFT_OUT)


def test_where_a_gap_is_in_few_channels_the_density_of_tasks_left_out_is_the_proof() -> None:
    assert unproven(LOAD, removing(None), 0.9 * STRONG, 0.5, LEFT_OUT) == NOTHING_TO_REMOVE
    assert unproven(LOAD, removing(None), 1.1 * STRONG, 0.5, LEFT_OUT) == ""
    assert "different amplitudes" in unproven(
        LOAD, removing(None), 1.1 * STRONG, 0.5 * DISAGREEING, LEFT_OUT
    )


def test_no_trial_to_leave_out_is_said_only_where_there_is_none() -> None:
    alone = Explained(Shrinkage(Share(0.8, None, 1), None, None, ()), [], [])
    assert unproven(LOAD, alone, 0.0, 0.5, not LEFT_OUT) == NOTHING_HELD_OUT
    assert unproven(LOAD, alone, 0.0, 0.5, LEFT_OUT) == NOTHING_TO_REMOVE
    no_share = Explained(Shrinkage(None, None, None, ()), [LeftOutRow("lift", 1.0, 0.9)], [])
    assert unproven(LOAD, no_share, 0.0, 0.5, LEFT_OUT) == NOTHING_TO_REMOVE


def test_what_a_cause_adds_on_tasks_left_out_counts_less_where_nothing_fits() -> None:
    scores = {LOAD: Score(0.0, 9.0, 4.0), NO_GAP: Score(0.0, 0.0, -6.0)}
    assert predicted_gain(scores, LOAD, 1.0) == pytest.approx(10.0)
    assert predicted_gain(scores, LOAD, 2.0) == pytest.approx(5.0)
    one_task = {LOAD: Score(0.0, 9.0, None), NO_GAP: Score(0.0, 0.0, None)}
    assert predicted_gain(one_task, LOAD, 1.0) == 0.0


def test_another_movement_needs_no_proof() -> None:
    """It may be another one in each trial: then it removes nothing on those left out."""
    assert unproven(MOVED, removing(-0.3, -0.1), 0.0, None, LEFT_OUT) == ""


def test_what_smooth_inputs_explain_better_counts_only_against_a_model() -> None:
    """A person answers to a known cause in other ways than predicted, which they follow as well."""
    better = {LOAD: Score(-3.0, 10.0, None), NONE: Score(-2.0, 30.0, None)}
    worse = {LOAD: Score(-3.0, 30.0, None), NONE: Score(-2.0, 10.0, None)}
    assert unknown(of_person(one=False), better, START) == BETTER_UNKNOWN
    assert unknown(of_person(one=False), worse, START) == ""
    assert unknown(of_person(), better, START) == ""
    # Skin slides in other ways than predicted, too.
    assert unknown(of_person(one=False, movement=True), better, START) == ""


def test_what_two_records_of_one_movement_differ_by_motion_tells() -> None:
    assert motion_is_told(of_person(one=False, movement=True))
    assert motion_is_told(of_person("emg"))
    assert not motion_is_told(of_person())
