"""What files that are sound one by one may not, or cannot, be compared by is refused, or said."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from scapulohumeral.errors import DataError
from scapulohumeral.gap.recording.case import Case, EmgSeries
from scapulohumeral.gap.recording.fit_together import (
    check_repeats,
    check_tasks,
    check_units,
    not_compared,
    unlike_envelopes,
    unlike_others,
)
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import ANGLE_NAMES

pytestmark = pytest.mark.unit

POSTURE_DEG = np.array([-20.0, 10.0, 5.0, 50.0, 0.0, 15.0, 40.0, -60.0, 30.0, 70.0])
TIMES_S = np.linspace(0.0, 3.0, 301)


def trial(name: str, *emg: str, force: bool = False, **changes) -> SimpleNamespace:
    """What the questions need of a trial, in which all channels reach 0.3."""
    values = np.tile([[0.1], [0.3]], (1, len(emg)))
    fields = {
        "name": name,
        "source": Path(f"{name}.csv"),
        "task": "lift",
        "repeat": None,
        "angles_rad": np.deg2rad(POSTURE_DEG)[None],
        "window_s": (0.5, 2.5),
        "time_s": TIMES_S,
        "smooth": Motion(TIMES_S, np.tile(np.deg2rad(POSTURE_DEG), (len(TIMES_S), 1))),
        "emg": EmgSeries(np.array([0.0, 3.0]), emg, values) if emg else None,
        "contact": object() if force else None,
        "sways": 1.0,
        "held": 0.0,
    }
    fields |= changes
    # A movement between the first and the last row, in which all joints sway, and which is held
    # at its end for a share of the time.
    ends = np.resize(fields["angles_rad"], (2, len(ANGLE_NAMES)))
    sway = np.deg2rad(0.1) * np.array([name != "EL_x" for name in ANGLE_NAMES])

    def moved(nodes: int):
        share = np.linspace(0.0, 1.0, nodes)[:, None]
        share = np.clip(share / (1.0 - fields["held"]), 0.0, 1.0)
        times = np.linspace(*fields["window_s"], nodes)
        return times, (1.0 - share) * ends[0] + share * ends[1] + share * fields["sways"] * sway

    return SimpleNamespace(**{"moved": moved, **fields})


def case(
    channels: tuple[str, ...], *test: SimpleNamespace, reference=(), unit: str = "fraction_of_mvc"
) -> Case:
    """A case whose participant file names some channels."""
    participant = SimpleNamespace(
        emg_channels=dict.fromkeys(channels, ("infra",)), emg_is_of_mvc=unit == "fraction_of_mvc"
    )
    return Case(participant, test, tuple(reference))


def test_emg_without_electrodes_in_the_participant_file_is_not_compared() -> None:
    [note] = not_compared(case((), trial("a", "EMG_1"), trial("b")))
    assert "EMG of 1 trials" in note
    assert "emg.channels" in note


def test_what_some_trials_lack_is_not_compared() -> None:
    some = case(("EMG_1", "EMG_2"), trial("a", "EMG_1", "EMG_2", force=True), trial("b", "EMG_1"))
    emg, force = not_compared(some)
    assert "EMG_2" in emg
    assert emg.endswith("in b")
    assert "joint force" in force
    assert force.endswith("in b")


def test_trials_of_both_sides_may_have_the_same_name() -> None:
    [note] = not_compared(case(("EMG_1",), trial("a", "EMG_1"), reference=[trial("a")]))
    assert note.endswith("in a (reference)")
    [note] = not_compared(case(("EMG_1",), trial("a"), reference=[trial("a", "EMG_1")]))
    assert note.endswith("in a (test)")


def test_trials_of_a_task_on_one_side_take_nothing_from_the_others() -> None:
    one = trial("b", "EMG_1", force=True)
    only = {"other": (trial("c", task="reach"), trial("d", "EMG_2", task="reach"))}
    for tests, references in (((), only["other"]), (only["other"], ())):
        there = case(
            ("EMG_1",), trial("a", "EMG_1", force=True), *tests, reference=[one, *references]
        )
        assert there.channels == ("EMG_1",)
        assert there.has_contact
        assert not [note for note in not_compared(there) if "not recorded in" in note]


def test_what_all_trials_have_needs_no_word() -> None:
    assert not_compared(case(("EMG_1",), trial("a", "EMG_1"), trial("b", "EMG_1"))) == []


def test_channels_that_are_only_named_are_told() -> None:
    [absent] = not_compared(case(("EMG_1", "EMG_2"), trial("a", "EMG_1")))
    assert "EMG_2" in absent
    assert "in no trial" in absent


def test_reference_trials_of_a_task_without_test_trials_are_told() -> None:
    references = [trial("b"), trial("c", task="reach")]
    [note] = not_compared(case((), trial("a"), reference=references))
    assert "task reach are not used" in note


def test_tasks_that_differ_by_capital_letters_are_refused() -> None:
    with pytest.raises(DataError, match="'lift' and 'Lift' differ by capital letters"):
        check_tasks(case((), trial("a"), reference=[trial("b", task="Lift"), trial("c")]))


def test_the_same_repeat_of_a_task_twice_on_one_side_is_refused() -> None:
    first, again = trial("a", repeat=2), trial("b", repeat=2)
    check_repeats(case((), first, trial("c", repeat=1), reference=[again]))
    check_repeats(case((), first, trial("b", repeat=2, task="reach")))
    check_repeats(case((), trial("a"), trial("b")))
    with pytest.raises(DataError, match=r"b.csv: repeat 2 of task 'lift', as is a.csv"):
        check_repeats(case((), first, again))


@pytest.mark.parametrize("joint", ["SC", "GH"])
def test_a_joint_in_radians_on_one_side_is_refused(joint: str) -> None:
    columns = [name.startswith(f"{joint}_") for name in ANGLE_NAMES]
    degrees = trial("a")
    radians = trial(
        "b", angles_rad=np.where(columns, np.deg2rad(degrees.angles_rad), degrees.angles_rad)
    )
    check_units(case((), degrees, reference=[degrees]))
    with pytest.raises(DataError, match=rf"b.csv, columns {joint}_\*: .* a.csv .* are radians"):
        check_units(case((), degrees, reference=[radians]))
    with pytest.raises(DataError, match=r"b.csv, .* are radians"):
        check_units(case((), radians, reference=[degrees]))
    # One file among others of its side, with or without reference trials.
    for references in ([degrees], []):
        with pytest.raises(DataError, match=r"b.csv, .* are radians"):
            check_units(case((), degrees, radians, reference=references))


def test_a_straight_elbow_is_no_fault_but_is_said() -> None:
    elbow = np.array(ANGLE_NAMES) == "EL_x"
    bent = trial("a")
    straight = trial("b", angles_rad=np.where(elbow, 0.01, bent.angles_rad))
    known = case((), bent, reference=[straight])
    check_units(known)
    assert any(
        "b.csv, columns EL_*" in note and "straight" in note for note in unlike_others(known)
    )
    assert not any("EL_*" in note for note in unlike_others(case((), bent, reference=[bent])))


def test_an_elbow_that_was_not_measured_is_no_other_unit() -> None:
    without = POSTURE_DEG.copy()
    without[-1] = 0.0
    check_units(case((), trial("a"), reference=[trial("b", angles_rad=np.deg2rad([without]))]))


def test_an_elbow_that_is_stretched_on_one_side_is_no_other_unit() -> None:
    stretched = POSTURE_DEG.copy()
    stretched[-1] = 8.0
    check_units(
        case((), trial("a", angles_rad=np.deg2rad(stretched)[None]), reference=[trial("b")])
    )


def test_a_fragment_of_a_movement_is_told() -> None:
    whole = [trial("b"), trial("c")]
    assert unlike_others(case((), trial("a", window_s=(0.0, 1.0)), reference=whole)) == []
    [note] = unlike_others(case((), trial("a", window_s=(0.0, 0.44)), reference=whole))
    assert note.startswith("a: the movement lasts 0.44 s, those of task lift 2.00 s")


def test_a_movement_that_ends_elsewhere_is_told() -> None:
    """A recording that stops at the top is laid on the same phase as rise and descent."""
    rise = np.deg2rad([POSTURE_DEG, POSTURE_DEG - 80.0 * np.eye(10)[ANGLE_NAMES.index("GH_z")]])
    [note] = unlike_others(case((), trial("a", angles_rad=rise), trial("b"), trial("c")))
    assert note.startswith("a: the movement ends with the arm raised by ")
    back = trial("a", angles_rad=rise[::-1])
    [note] = unlike_others(case((), back, trial("b"), reference=[trial("c")]))
    assert note.startswith("a: the movement begins with the arm raised by ")


def test_sides_that_differ_as_a_whole_are_told() -> None:
    """From the median of both each trial is half as far away as it is from the other side."""
    fast, slow = (
        [trial(name, window_s=(0.0, end)) for name in names]
        for names, end in ((("a", "b"), 2.0), (("c", "d"), 9.0))
    )
    [note] = unlike_others(case((), *fast, reference=slow))
    assert note.startswith("test trials of task lift last 2.00 s in the median, reference trials 9")
    raised = POSTURE_DEG - 60.0 * np.eye(10)[ANGLE_NAMES.index("GH_z")]
    late = [trial(name, angles_rad=np.deg2rad([raised, POSTURE_DEG])) for name in "ab"]
    [note] = unlike_others(case((), *late, reference=[trial("c"), trial("d")]))
    assert note.startswith("test trials of task lift begin with the arm raised by ")
    held = [trial(name, held=0.2) for name in "ab"]
    [note] = unlike_others(case((), *held, reference=[trial("c"), trial("d")]))
    assert note.startswith("the arm is still for 20 % of the movement in test trials of task lift")


def test_an_electrode_that_hardly_records_on_one_side_is_told() -> None:
    both = ("EMG_1", "EMG_2")
    tests, weak = trial("a", *both), trial("b", *both)
    weak.emg.values[:, 0] *= 0.02
    [note] = unlike_others(case(both, tests, reference=[weak]))
    assert note.startswith("EMG_1 reaches 0.3 in the tests and 0.006 in the references; look")


def test_an_arm_that_is_still_for_longer_is_told() -> None:
    others = trial("b"), trial("c")
    [note] = unlike_others(case((), trial("a", held=0.3), reference=others))
    assert note.startswith("a: the arm is still for 30 % of the movement, in those of task lift")
    assert unlike_others(case((), trial("a", held=0.1), reference=others)) == []


def test_a_girdle_that_is_held_elsewhere_or_never_turns_is_told() -> None:
    signs = np.where(np.array(ANGLE_NAMES) == "SC_y", -1.0, 1.0)
    flipped = trial("a", angles_rad=np.deg2rad(signs * POSTURE_DEG)[None])
    notes = unlike_others(case((), flipped, trial("b"), reference=[trial("c")]))
    [note] = [one for one in notes if "SC_*" in one]
    assert note.startswith("a, columns SC_*: 40 deg from b of task lift")
    [note] = unlike_others(case((), trial("a", sways=0.0), reference=[trial("b")]))[:1]
    assert note.startswith("a: SC never turns; look whether it was measured")


@pytest.mark.parametrize(("angle", "changed_deg"), [("GH_yy", -30.0), ("GH_z", 40.0)])
def test_a_humerus_with_another_sign_is_told(angle: str, changed_deg: float) -> None:
    """Axial rotation of the other sign, or elevation, would be called another movement."""
    column = ANGLE_NAMES.index(angle)
    other = POSTURE_DEG.copy()
    other[column] = -POSTURE_DEG[column]
    flipped = trial("a", angles_rad=np.deg2rad(other)[None])
    notes = unlike_others(case((), flipped, trial("b"), reference=[trial("c")]))
    assert any(note.startswith("a, columns GH_*: ") for note in notes)


def test_rows_that_are_missing_inside_a_movement_are_told() -> None:
    cut = trial("a", time_s=TIMES_S[(TIMES_S < 1.0) | (TIMES_S > 1.4)])
    [note] = unlike_others(case((), cut, reference=[trial("b")]))
    assert note.startswith("a: no rows from 0.99 to 1.40 s; a smooth curve stands there")
    before = trial("a", time_s=TIMES_S[(TIMES_S < 0.1) | (TIMES_S > 0.4)])
    assert unlike_others(case((), before, reference=[trial("b")])) == []


def test_one_window_of_two_trials_of_one_name_is_told() -> None:
    """Entries of a participant file above both sides are of both."""
    pair = trial("a"), trial("a")
    [note] = unlike_others(case((), pair[0], reference=pair[1:]))
    assert note.startswith("a: test and reference trial of this name have one window, 0.5 to 2.5 s")
    others = trial("b"), trial("a", window_s=(0.5, 2.6))
    assert unlike_others(case((), pair[0], reference=others)) == []
    # Windows that were found from the motion are of each trial.
    found = (trial("a", window_s=(0.0, 3.0)) for _ in range(2))
    assert unlike_others(case((), next(found), reference=[*found])) == []
    same_movement = replace(case((), pair[0], reference=pair[1:]), one_movement=True)
    assert unlike_others(same_movement) == []


def test_a_channel_that_never_changes_is_told() -> None:
    lost = trial("a", "EMG_1", "EMG_2")
    lost.emg.values[:, 1] = 0.0
    known = case(("EMG_1", "EMG_2"), lost, reference=[trial("b", "EMG_1")])
    [note] = unlike_others(known)
    assert note.startswith("a: EMG_2 never changes, so it is compared in no trial")
    assert unlike_others(case(("EMG_1",), lost, reference=[trial("b", "EMG_1")])) == []


def test_a_channel_that_never_changes_is_not_compared() -> None:
    """Without scatter it would seem to tell for certain that its muscle did nothing."""
    both = ("EMG_1", "EMG_2")
    lost, whole = trial("a", *both), trial("b", *both)
    assert case(both, whole, reference=[whole]).channels == both
    lost.emg.values[:, 1] = 0.2
    assert case(both, lost, reference=[whole]).channels == ("EMG_1",)
    assert case(both, whole, reference=[lost]).channels == ("EMG_1",)


def test_numbered_names_of_one_task_are_told() -> None:
    """Each would count as a task that was not repeated."""
    named = [trial(name, task=name, window_s=(0.5, 2.5)) for name in ("up_01", "up_02", "abd R1")]
    [note] = unlike_others(case((), *named))
    assert note.startswith("up_01, up_02 count as tasks of their own; if they are repeats of one")
    assert "up_r1, up_r2" in note
    assert unlike_others(case((), *named[1:])) == []


def test_other_units_of_all_channels_are_told() -> None:
    both = ("EMG_1", "EMG_2")
    tests, weak = trial("a", *both), trial("b", *both)
    assert unlike_others(case(both, tests, reference=[weak])) == []
    weak.emg.values[:] *= 0.02
    [note] = unlike_others(case(both, tests, reference=[weak]))
    assert "EMG reaches 0.3 in the tests and 0.006 in the references" in note


def enveloped(name: str, rate_hz: float, curve: np.ndarray) -> SimpleNamespace:
    """A trial with one channel."""
    times = np.arange(len(curve)) / rate_hz
    return trial(name, emg=EmgSeries(times, ("EMG_1",), curve[:, None]))


def with_emg(rate_hz: float, *curves: np.ndarray, unit: str = "fraction_of_mvc") -> Case:
    """A case of trials with one channel each."""
    trials = [enveloped(f"t{i}", rate_hz, curve) for i, curve in enumerate(curves)]
    return case(("EMG_1",), *trials, unit=unit)


BURST = np.sin(np.linspace(0.0, np.pi, 101)) ** 2


def test_trials_that_were_each_divided_by_their_own_maximum_are_told() -> None:
    [note] = unlike_envelopes(with_emg(50.0, BURST, 0.995 * BURST))
    assert "peaks at 1 in each trial" in note
    assert "emg.unit: fraction_of_max" in note
    assert unlike_envelopes(with_emg(50.0, BURST, 0.8 * BURST)) == []
    assert unlike_envelopes(with_emg(50.0, BURST, BURST, unit="fraction_of_max")) == []


def test_shares_of_a_largest_value_above_one_are_told() -> None:
    rise = np.linspace(0.0, 9.0, 300)
    notes = unlike_envelopes(with_emg(100.0, rise, unit="fraction_of_shared_max"))
    assert any("EMG reaches 9, and" in note and "divide by 100" in note for note in notes)
    notes = unlike_envelopes(with_emg(100.0, rise))
    assert any("EMG reaches 9 times the maximal contraction" in note for note in notes)
    notes = unlike_envelopes(with_emg(100.0, 0.16 * rise))
    assert not any("reaches" in note for note in notes)


def test_envelopes_of_both_sides_are_looked_at_though_their_names_are_equal() -> None:
    whole, less = enveloped("a", 50.0, BURST), enveloped("a", 50.0, 0.8 * BURST)
    for test, reference in ((whole, less), (less, whole)):
        assert unlike_envelopes(case(("EMG_1",), test, reference=[reference])) == []
    noise = 0.2 * np.abs(np.random.default_rng(1).normal(size=2000))
    rough = enveloped("a", 1000.0, noise)
    for test, reference in ((rough, less), (less, rough)):
        [note] = unlike_envelopes(case(("EMG_1",), test, reference=[reference]))
        assert note.startswith("EMG of a changes")


@pytest.mark.parametrize("rate_hz", [100.0, 1000.0])
def test_emg_that_was_not_smoothed_is_told(rate_hz: float) -> None:
    """Noise of an envelope at few samples per second is none."""
    noise = 0.2 * np.random.default_rng(1).normal(size=(2, 2000))
    [note] = unlike_envelopes(with_emg(rate_hz, np.abs(noise[0]), 0.4 * BURST))
    assert note.startswith("EMG of t0 changes from sample to sample")
    assert "send envelopes" in note
    level = 0.3 + 0.1 * noise
    assert unlike_envelopes(with_emg(50.0, *level)) == []
