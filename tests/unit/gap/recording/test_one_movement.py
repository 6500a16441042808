"""Two records of one movement are told from two movements, by what the trials hold."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from gap_files import elevation

from scapulohumeral.errors import DataError
from scapulohumeral.gap.effects.frames import turn_frame
from scapulohumeral.gap.recording.case import Case, EmgSeries, GapTrial, make_case
from scapulohumeral.gap.recording.one_movement import (
    SAME_RISE,
    aligned,
    perhaps,
    rise_apart,
    stated,
)
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import ANGLE_NAMES, pose_to_trial, trial_to_pose

pytestmark = pytest.mark.unit

# How far and how late the arm is lifted in each repeat.
REPEATS_DEG, LATE_S = (60.0, 66.0, 72.0), (0.0, 0.2, -0.2)


def trial(
    repeat: int, task: str = "lift", late_s: float = 0.0, skin: float = 0.0, **changes
) -> GapTrial:
    """A repeat; a late movement within the same times; a share of skin's errors."""
    table = elevation(peak_deg=REPEATS_DEG[repeat])
    angles = np.deg2rad(table[list(ANGLE_NAMES)].to_numpy())
    time = table["time"].to_numpy()
    moved = np.column_stack(
        [np.interp(time - late_s - LATE_S[repeat], time, column) for column in angles.T]
    )
    lifted = moved[:, 7] - moved[0, 7]
    moved[:, 7] -= 0.03 * skin * lifted
    slid = turn_frame(trial_to_pose(moved), "scapula", 0.15 * skin * lifted[:, None] * np.eye(3)[2])
    moved = pose_to_trial(slid)
    window = changes.pop("window_s", (0.5 + 0.01 * repeat, 2.5))
    motion = Motion(time, moved)
    name = f"{task}_r{repeat}{'_skin' if skin else ''}"
    return GapTrial(
        name, task, repeat, time, moved, motion, None, None, window, Path(name), **changes
    )


def case(test: list[GapTrial], reference: list[GapTrial]) -> Case:
    """A case of nobody."""
    return make_case(None, test, reference)


def test_skin_and_bone_of_the_same_movements_are_paired_whatever_their_order():
    skin = [trial(i, skin=1.0, window_s=(0.1, 0.2)) for i in range(3)]
    found = aligned(case(skin[::-1], [trial(i) for i in range(3)]))
    assert found.one_movement
    assert len(found.test) == len(found.reference) == 3
    for one, partner in zip(found.test, found.reference, strict=True):
        assert one.repeat == partner.repeat
        assert one.window_s == partner.window_s != (0.1, 0.2)


def test_repeats_that_last_as_long_are_other_movements():
    late = [trial(i, late_s=0.1) for i in range(2)]
    given = case(late, [trial(i) for i in range(2)])
    assert rise_apart(late, [trial(i) for i in range(2)]) > SAME_RISE
    assert aligned(given) is given


def test_every_test_trial_needs_a_partner_and_reference_trials_without_one_are_left_out():
    bone = [trial(i) for i in range(3)]
    found = aligned(case([trial(i, skin=1.0) for i in (0, 1)], bone))
    assert sorted(one.repeat for one in found.reference) == [0, 1]
    alone = case([*(trial(i, skin=1.0) for i in (0, 1)), trial(0, task="other", skin=1.0)], bone)
    assert aligned(alone) is alone


def test_movements_repeated_as_closely_are_not_one():
    """Whoever guides or simulates a movement may repeat it exactly, with the same times."""
    alike = [trial(0, skin=share) for share in (0.2, 0.4, 0.6)]
    given = case(alike, [trial(0, skin=share) for share in (0.3, 0.5, 0.7)])
    assert rise_apart(alike, given.reference) < SAME_RISE
    assert aligned(given) is given


def test_one_trial_of_each_task_does_not_tell():
    tasks = enumerate(("lift", "reach"))
    both = [(trial(i, task, skin=1.0), trial(i, task)) for i, task in tasks]
    given = case(*map(list, zip(*both, strict=True)))
    assert aligned(given) is given
    assert perhaps(given)
    assert stated(given).one_movement
    more = case([*given.test, trial(2, skin=1.0)], [*given.reference, trial(2)])
    assert aligned(more).one_movement
    # Repeats with other times are other movements, whatever they look like.
    for task, late_s in (("lift", 0.01), ("reach", 0.02)):
        other = trial(2, task)
        later = Motion(other.time_s + late_s, other.angles_rad)
        other = replace(other, time_s=later.time_s, smooth=later)
        given = case(given.test, [*given.reference, other])
    assert aligned(given).one_movement


def with_emg(one: GapTrial, level: float) -> GapTrial:
    """The trial with an envelope."""
    values = np.full((len(one.time_s), 1), level)
    return replace(one, emg=EmgSeries(one.time_s, ("EMG_infra",), values))


@pytest.mark.parametrize(("skin_emg", "same"), [(0.2, True), (0.21, False)])
def test_muscles_of_one_movement_are_recorded_once(skin_emg: float, same: bool):
    test = [with_emg(trial(i, skin=1.0), skin_emg) for i in (0, 1)]
    reference = [with_emg(trial(i), 0.2) for i in (0, 1)]
    assert aligned(case(test, reference)).one_movement == same


def test_two_tests_of_one_reference_are_no_two_pairs():
    given = case([trial(1, skin=1.0), trial(1, skin=0.5)], [trial(1), trial(0)])
    assert aligned(given) is given


def test_other_times_are_another_movement():
    one = trial(1, skin=1.0)
    later = Motion(one.time_s + 0.6 * (one.time_s[1] - one.time_s[0]), one.angles_rad)
    test = [trial(0, skin=1.0), replace(one, time_s=later.time_s, smooth=later)]
    given = case(test, [trial(0), trial(1)])
    assert aligned(given) is given
    assert not perhaps(given)
    with pytest.raises(DataError, match="lift_r1_skin.*--one-movement"):
        stated(given)


def test_clocks_that_differ_by_less_than_half_a_frame_record_one_movement():
    def late(one: GapTrial) -> GapTrial:
        later = Motion(one.time_s + 0.2 * (one.time_s[1] - one.time_s[0]), one.angles_rad)
        return replace(one, time_s=later.time_s, smooth=later)

    given = case([late(trial(i, skin=1.0)) for i in (0, 1)], [trial(0), trial(1)])
    assert aligned(given).one_movement


def slower(one: GapTrial, every: int) -> GapTrial:
    """The trial as a system recorded it that took every so manieth frame, without the last ones."""
    kept = slice(None, -1, every)
    motion = Motion(one.time_s[kept], one.angles_rad[kept])
    return replace(one, time_s=motion.time_s, angles_rad=motion.angles_rad, smooth=motion)


def test_systems_of_other_rates_record_one_movement():
    """The slower one ends within a frame of the faster one: both are compared as far as it goes."""
    skin = [trial(i, skin=1.0, window_s=(0.1, 0.2)) for i in range(3)]
    whole = [trial(i) for i in range(3)]
    bone = [slower(replace(one, window_s=(0.5, float(one.time_s[-1]))), 2) for one in whole]
    found = aligned(case(skin, bone))
    assert found.one_movement
    assert [one.repeat for one in found.test] == [one.repeat for one in found.reference]
    turned = aligned(case(bone, [replace(one, window_s=(0.5, 9.0)) for one in whole]))
    assert {one.window_s for one in turned.trials} == {(0.5, float(bone[0].time_s[-1]))}
    assert perhaps(case(skin[:1], bone[:1]))


def test_repeats_of_people_at_other_rates_are_other_movements():
    late = [trial(i, late_s=0.1) for i in range(2)]
    given = case(late, [slower(trial(i), 2) for i in range(2)])
    assert aligned(given) is given
    assert not perhaps(given)


def test_a_record_that_ends_earlier_by_more_than_a_frame_is_of_another_movement():
    short = slower(trial(0), 2)
    cut = Motion(short.time_s[:-1], short.angles_rad[:-1])
    short = replace(short, time_s=cut.time_s, angles_rad=cut.angles_rad, smooth=cut)
    with pytest.raises(DataError, match="onto one time base"):
        stated(case([trial(0, skin=1.0)], [short]))


def test_muscles_at_other_rates_are_compared_at_shared_times():
    test = [with_emg(trial(i, skin=1.0), 0.2) for i in (0, 1)]
    for level, same in ((0.2, True), (0.21, False)):
        bone = [with_emg(slower(trial(i), 2), level) for i in (0, 1)]
        assert aligned(case(test, bone)).one_movement == same


def test_no_reference_no_pair():
    given = case([trial(1)], [])
    assert aligned(given) is given
