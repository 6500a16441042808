"""A diagnosis says which joint angles nobody has measured."""

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from gap_files import elevation, write_csv

from scapulohumeral.errors import DataError
from scapulohumeral.gap.recording.case import GapTrial
from scapulohumeral.gap.recording.marks import (
    unmeasured,
    unmeasured_angles,
    unmeasured_segments,
)
from scapulohumeral.gap.recording.trials import TrialEntry, read_trial
from scapulohumeral.laboratory.record import record_path
from scapulohumeral.laboratory.trial import Channel
from scapulohumeral.model.rotations import ANGLE_NAMES

pytestmark = pytest.mark.unit
TURN = Channel("estimated", "rule of the clavicle", 20.0)
ELBOW = Channel("assumed", "default of the model", 70.0)


def read(files: list[Path]) -> list[GapTrial]:
    """Trials of files."""
    return [read_trial(file, TrialEntry())[0] for file in files]


def mark(file: Path, **channels: Channel) -> None:
    """Write the record of a converted trial."""
    measured = dict.fromkeys(ANGLE_NAMES, Channel("measured"))
    marks = {name: asdict(channel) for name, channel in (measured | channels).items()}
    document = {"schema": "recording/1", "channels": marks}
    record_path(file).write_text(json.dumps(document), encoding="utf-8")


def test_marks_of_converted_trials_are_told(tmp_path: Path) -> None:
    files = [write_csv(all_moving(), tmp_path / f"reach_r{i}.csv") for i in (1, 2, 3)]
    mark(files[0], SC_x=TURN, AC_x=TURN, EL_x=ELBOW)
    mark(files[1], SC_x=TURN, AC_x=TURN)
    turn, elbow = unmeasured(read(files))
    assert turn.startswith("SC_x, AC_x estimated, not measured, in 2 of 3 trials")
    assert "20 deg: an effect on them alone cannot be tested (rule of the clavicle)" in turn
    assert elbow.startswith("EL_x assumed, not measured, in 1 of 3 trials")


def all_moving() -> pd.DataFrame:
    """An elevation in which no angle is a constant."""
    table = elevation()
    rises = np.linspace(0.0, 1.0, len(table))
    still = [name for name in table.columns if table[name].nunique() == 1]
    return table.assign(**{name: table[name] + 50.0 * rises for name in still})


def test_trials_without_a_record_count_as_measured(tmp_path: Path) -> None:
    files = [write_csv(all_moving(), tmp_path / f"reach_r{i}.csv") for i in (1, 2)]
    assert unmeasured(read(files)) == ()


def test_a_constant_angle_of_a_joint_that_turns_is_told(tmp_path: Path) -> None:
    """Axial rotation that nobody measured, for one: filled with zeros it looks like a rotation."""
    tables = (all_moving(), all_moving().assign(GH_yy=0.0))
    files = [write_csv(one, tmp_path / f"reach_r{i}.csv") for i, one in enumerate(tables, 1)]
    [note] = unmeasured(read(files))
    assert note.startswith(f"GH_yy is a constant in {files[1]}, so it was not measured there, and ")
    assert unmeasured_angles(read(files)) == {"GH_yy": 35.0}
    swept = all_moving().assign(AC_x=5.0)
    [note] = unmeasured(read([write_csv(swept, tmp_path / "reach_r3.csv")]))
    assert (
        note == f"AC_x is a constant in {tmp_path / 'reach_r3.csv'}, so it was not measured there"
    )


def test_segments_that_a_rule_stands_for_are_told_from_single_angles(tmp_path: Path) -> None:
    files = [write_csv(elevation(), tmp_path / f"reach_r{i}.csv") for i in (1, 2)]
    mark(files[0], SC_x=TURN, AC_x=TURN)
    assert unmeasured_segments(read(files)) == {}
    placed = Channel("estimated", "regression", 24.0)
    mark(files[1], SC_z=Channel("estimated", "ends", 6.0), GH_z=placed)
    assert unmeasured_segments(read(files)) == {"clavicle": 3.0, "scapula": 12.0}


def test_an_elbow_that_is_a_constant_was_not_measured(tmp_path: Path) -> None:
    """In one of the trials: what another session measured of it is no difference."""
    bends = all_moving()
    straight = bends.assign(EL_x=5.0)
    tables = (bends, straight)
    files = [write_csv(one, tmp_path / f"reach_r{i}.csv") for i, one in enumerate(tables, 1)]
    assert unmeasured_angles(read(files[:1])) == {}
    assert unmeasured_angles(read(files)) == {"EL_x": 35.0}
    [note] = unmeasured(read(files))
    assert note.startswith(f"EL_x is a constant in {files[1]}, so it was not measured there, and ")
    mark(files[0], EL_x=ELBOW)
    assert unmeasured_angles(read(files[:1])) == {"EL_x": 35.0}


def test_a_record_that_is_none_is_refused(tmp_path: Path) -> None:
    file = write_csv(elevation(), tmp_path / "reach_r1.csv")
    record_path(file).write_text('{"schema": "other"}', encoding="utf-8")
    with pytest.raises(DataError, match="expected schema recording/1"):
        read([file])
