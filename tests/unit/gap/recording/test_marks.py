"""A diagnosis says which joint angles nobody has measured."""

import json
from dataclasses import asdict
from pathlib import Path

import pytest
from gap_files import elevation, write_csv

from scapulohumeral.errors import DataError
from scapulohumeral.gap.recording.case import Case, GapParticipant, ScaledModel
from scapulohumeral.gap.recording.marks import unmeasured
from scapulohumeral.gap.recording.trials import TrialEntry, read_trial
from scapulohumeral.laboratory.record import record_path
from scapulohumeral.laboratory.trial import Channel
from scapulohumeral.model.rotations import ANGLE_NAMES

pytestmark = pytest.mark.unit
TURN = Channel("estimated", "rule of the clavicle", 20.0)
ELBOW = Channel("assumed", "default of the model", 70.0)


def case_of(files: list[Path]) -> Case:
    """A case whose first trial is the test and whose others are references."""
    trials = [read_trial(file, TrialEntry())[0] for file in files]
    model = ScaledModel({}, 60.0, {}, "published")
    person = GapParticipant("ann", "right", model, (0.0, -9.8, 0.0), {}, "", ())
    return Case(person, tuple(trials[:1]), tuple(trials[1:]))


def mark(file: Path, **channels: Channel) -> None:
    """Write the record of a converted trial."""
    measured = dict.fromkeys(ANGLE_NAMES, Channel("measured"))
    marks = {name: asdict(channel) for name, channel in (measured | channels).items()}
    document = {"schema": "recording/1", "channels": marks}
    record_path(file).write_text(json.dumps(document), encoding="utf-8")


def test_marks_of_converted_trials_are_told(tmp_path: Path) -> None:
    files = [write_csv(elevation(), tmp_path / f"reach_r{i}.csv") for i in (1, 2, 3)]
    mark(files[0], SC_x=TURN, AC_x=TURN, EL_x=ELBOW)
    mark(files[1], SC_x=TURN, AC_x=TURN)
    turn, elbow = unmeasured(case_of(files))
    assert turn.startswith("SC_x, AC_x estimated, not measured, in 2 of 3 trials")
    assert "20 deg: an effect on them alone cannot be tested (rule of the clavicle)" in turn
    assert elbow.startswith("EL_x assumed, not measured, in 1 of 3 trials")


def test_trials_without_a_record_count_as_measured(tmp_path: Path) -> None:
    files = [write_csv(elevation(), tmp_path / f"reach_r{i}.csv") for i in (1, 2)]
    assert unmeasured(case_of(files)) == ()


def test_a_record_that_is_none_is_refused(tmp_path: Path) -> None:
    file = write_csv(elevation(), tmp_path / "reach_r1.csv")
    record_path(file).write_text('{"schema": "other"}', encoding="utf-8")
    with pytest.raises(DataError, match="expected schema recording/1"):
        unmeasured(case_of([file]))
