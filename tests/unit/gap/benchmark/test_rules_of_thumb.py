"""The rules that a diagnosis has to beat, on trials with plain causes."""

from pathlib import Path

import numpy as np
import pytest

from scapulohumeral.gap.benchmark.rules_of_thumb import (
    MOST_COMMON,
    baseline_families,
    control_shares,
    rule_based,
)
from scapulohumeral.gap.recording.case import (
    Case,
    EmgSeries,
    GapParticipant,
    GapTrial,
    ScaledModel,
    make_case,
)
from scapulohumeral.gap.recording.movement_window import smoothed
from scapulohumeral.model.motion import Motion

pytestmark = pytest.mark.unit

CHANNELS = ("EMG_a", "EMG_b", "EMG_c")
TIME = np.linspace(0.0, 3.0, 301)


def trial(
    number: int, turn: np.ndarray | None = None, gain: np.ndarray | None = None, lead: float = 0.0
) -> GapTrial:
    """An elevation with three envelopes and a little noise; ``turn`` is added to AC_x [rad]."""
    rng = np.random.default_rng(number)
    lift = np.sin(np.pi * TIME / 3.0) ** 2
    angles = np.tile([-0.4, 0.1, 0.0, 0.8, 0.1, 0.0, 0.2, 0.3, 0.3, 0.4], (301, 1))
    angles[:, 7] += lift + 0.003 * rng.normal()
    angles[:, 5] += 0.0 if turn is None else turn
    burst = np.exp(-(((TIME + lead - 1.5) / 0.5) ** 2))[:, None] * [0.3, 0.2, 0.4]
    values = (1.0 if gain is None else gain) * burst + 0.002 * rng.normal()
    emg = EmgSeries(TIME, CHANNELS, np.abs(values))
    window = (0.0, 3.0)
    smooth = smoothed(Motion(TIME, angles))
    return GapTrial(
        f"t{number}", "frontal", number, TIME, angles, smooth, emg, None, window, Path("t")
    )


def case(channels: bool = True, reference: bool = True, **changes) -> Case:
    model = ScaledModel({}, 36.0, {}, "published")
    mapped = dict.fromkeys(CHANNELS, ("infra",)) if channels else {}
    who = GapParticipant("x", "right", model, (0.0, -9.81, 0.0), mapped, "fraction_of_mvc", ())
    without = [trial(n) for n in (1, 2, 3)] if reference else []
    return make_case(who, [trial(n, **changes) for n in (4, 5, 6)], without)


def test_nothing_changed() -> None:
    assert rule_based(case()) == "no_gap"


def test_one_louder_channel_is_a_gain() -> None:
    assert rule_based(case(gain=np.array([1.0, 2.0, 1.0]))) == "measurement/emg_gain"


def test_earlier_envelopes_are_a_delay() -> None:
    assert rule_based(case(lead=0.15)) == "measurement/emd"


def test_a_steady_turn_is_a_frame_and_a_growing_one_skin() -> None:
    assert rule_based(case(turn=np.full(301, 0.15))) == "input/frame_misalignment"
    growing = 0.2 * np.sin(np.pi * TIME / 3.0) ** 4
    assert rule_based(case(turn=growing)) == "measurement/scapula_sta"
    assert rule_based(case(channels=False, turn=growing)) == "measurement/scapula_sta"


def test_everything_louder_and_moved_is_a_load() -> None:
    louder = np.array([1.5, 1.9, 2.6])
    assert rule_based(case(turn=np.full(301, 0.1), gain=louder)) == "body/hand_load"


def test_without_reference_the_prior_is_all_there_is() -> None:
    assert rule_based(case(reference=False, turn=np.full(301, 0.15))) == MOST_COMMON


def test_methods_of_the_diagnosis_are_read_from_its_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "scapulohumeral.gap.benchmark.rules_of_thumb.read_trial_folders", lambda _: case()
    )
    (tmp_path / "curves").mkdir()
    table = "method,label\ncosine,body/strength_loss/infra\n"
    (tmp_path / "curves" / "baselines.csv").write_text(table)
    named = baseline_families(tmp_path, tmp_path)
    assert named == {
        "prior_only": MOST_COMMON,
        "rule_based": "no_gap",
        "cosine": "body/strength_loss",
    }


def test_controls_are_read_where_a_gap_was_found(tmp_path: Path) -> None:
    assert control_shares(tmp_path) == (None, None)
    (tmp_path / "curves").mkdir()
    table = "name,shrinkage\nblack box,0.9\nplacebo 1,0.1\nplacebo 2,0.2\n"
    (tmp_path / "curves" / "controls.csv").write_text(table)
    assert control_shares(tmp_path) == (0.9, 0.2)
