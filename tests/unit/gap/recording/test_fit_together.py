"""What was recorded but cannot be compared is said, channel by channel."""

from types import SimpleNamespace

import pytest

from scapulohumeral.gap.recording.fit_together import not_compared

pytestmark = pytest.mark.unit


def trial(name: str, *emg: str, force: bool = False) -> SimpleNamespace:
    """What the question needs of a trial."""
    return SimpleNamespace(
        name=name,
        emg=SimpleNamespace(channels=emg) if emg else None,
        contact=object() if force else None,
    )


def case(channels: tuple[str, ...], *trials: SimpleNamespace) -> SimpleNamespace:
    """A case whose participant file names some channels."""
    participant = SimpleNamespace(emg_channels=dict.fromkeys(channels, ("infra",)))
    return SimpleNamespace(participant=participant, trials=trials)


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
    [note] = not_compared(case(("EMG_1",), trial("a", "EMG_1"), trial("a")))
    assert note.endswith("in a")


def test_what_all_trials_have_or_none_needs_no_word() -> None:
    assert not_compared(case(("EMG_1", "EMG_2"), trial("a", "EMG_1"), trial("b", "EMG_1"))) == []
