"""Static postures along a recording: which poses are taken, what is said of them."""

import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from skeleton import CONSTANTS, muscle, skeleton_record
from small_posed import small_model
from synthetic_study import PARTICIPANTS, solution

from scapulohumeral.dynamics.parameters import unpack
from scapulohumeral.errors import SolveError
from scapulohumeral.model.constants import Glenoid
from scapulohumeral.ocp.solution import write_solution
from scapulohumeral.problems.model_files import ModelFiles
from scapulohumeral.problems.static_posture import StaticSolution
from scapulohumeral.quantities.rhythm import NEAR_DEG
from scapulohumeral.quantities.segment_angles import ELEVATION_COLUMN, thorax_angles
from scapulohumeral.stages.checks import static_postures as stage

pytestmark = pytest.mark.unit

RECORD = replace(
    skeleton_record(),
    muscles=(
        muscle("serr_1", group="serr_ant"),
        *(muscle(f"supra_{k}", group="supra") for k in (1, 2)),
    ),
    body_mass_kg=50.0,
    constants=replace(CONSTANTS, glenoid=Glenoid(0.0, 0.0, 0.31)),
)
POSTURE = SimpleNamespace(effort=np.array([2.0, 1.0, 1.0]), stability=(0.5, 2.0))
HELD_BY = 200.0


def test_poses_are_those_at_fixed_elevations_of_the_rise():
    poses = solution("par2", "frontal", "quaternion").reference_pose
    taken = list(stage._recorded(poses))
    assert len(taken) >= 3
    for level, pose in taken:
        angles = thorax_angles(pose[None])[0]
        assert angles[ELEVATION_COLUMN] == pytest.approx(level, abs=NEAR_DEG)
        assert (pose[[0, 4, 8]] >= 0).all()
    peak = thorax_angles(poses)[:, ELEVATION_COLUMN].max()
    assert max(level for level, _ in taken) <= peak + NEAR_DEG


def found(activation, reaction=(100.0, 0.0, 0.0)) -> StaticSolution:
    pose = solution("par2", "frontal", "quaternion").reference_pose[3]
    return StaticSolution(pose, np.array(reaction), np.array(activation), 0.0)


def test_groups_that_pay_are_named_by_their_weighed_effort():
    words = stage._paying(POSTURE, found([0.1, 0.2, 0.3]), found([0.5, 0.1, 0.3]), RECORD)
    assert words == "serr_ant +0.480, supra -0.030"


def test_costs_leave_out_what_holds_the_girdle():
    costs = stage._costs("held", POSTURE, found([0.5, 0.1, 0.0]), RECORD)
    assert costs["held_effort"] == pytest.approx(0.51)
    assert costs["held_stability"] == pytest.approx(0.0, abs=1e-12)
    assert costs["held_force_bw"] == pytest.approx(100.0 * 100.0 / (50.0 * 9.80665))
    tilted = stage._costs("held", POSTURE, found([0, 0, 0], (100.0, 20.0, 10.0)), RECORD)
    assert tilted["held_stability"] == pytest.approx(0.5 * 0.2**2 + 2.0 * 0.1**2)


def test_hand_holds_what_it_held_when_the_motion_was_recorded(
    quaternion_equations, tmp_path, monkeypatch
):
    person = Path(shutil.copytree(PARTICIPANTS / "par2", tmp_path / "par2")) / "participant.yaml"
    text = person.read_text(encoding="utf-8")
    loaded = "frontal.csv, hand_load_kg: 1.5"
    person.write_text(text.replace("frontal.csv, hand_load_kg: 0.0", loaded), encoding="utf-8")
    tracked = [tmp_path / f"{plane}.npz" for plane in ("frontal", "sagittal")]
    for path in tracked:
        write_solution(solution("par2", path.stem, "quaternion"), path)

    def row(posture, pose, record, held_by):
        assert (posture.clavicle_point_m, held_by) == (0.4, 150.0), "as configured"
        return {"status": unpack(posture.parameters)["mass_load"].item()}

    monkeypatch.setattr(stage, "_row", row)
    monkeypatch.setattr(stage, "load_model", lambda _: small_model(quaternion_equations))
    files = stage.PostureFiles(
        ModelFiles(person, *[Path("unread")] * 4), Path("unread"), None, tracked
    )
    weights = {
        "activation": 1.0,
        "strength_exponent": 1.0,
        "clavicle_point_m": 0.4,
        "trajectory_quaternion": 150.0,
    }
    table = stage.static_postures(files, weights, 2.0)
    # The status of a row is the load that it was solved with.
    assert table.groupby("plane").status.unique().to_dict() == {"frontal": [1.5], "sagittal": [0.0]}


def test_failed_posture_keeps_its_reason(monkeypatch):
    def fails(*_):
        raise SolveError("static posture: too many iterations")

    monkeypatch.setattr(stage, "static_posture", fails)
    row = stage._row(POSTURE, found([0, 0, 0]).pose, RECORD, HELD_BY)
    assert row == {"status": "static posture: too many iterations"}


def test_least_force_is_said_in_body_weight(monkeypatch):
    monkeypatch.setattr(stage, "static_posture", lambda *_: found([0.1, 0, 0]))
    monkeypatch.setattr(stage, "least_joint_force", lambda *_: 9.80665 * 5.0)
    row = stage._row(POSTURE, found([0, 0, 0]).pose, RECORD, HELD_BY)
    assert row["least_force_bw"] == pytest.approx(10.0)
    assert set(row) | {"participant", "plane", "arm_deg"} == set(stage.COLUMNS)


def test_joint_that_is_pulled_apart_is_no_posture(monkeypatch):
    reactions = iter([(100.0, 0.0, 0.0), (-100.0, 0.0, 0.0)])
    monkeypatch.setattr(stage, "static_posture", lambda *_: found([0, 0, 0], next(reactions)))
    row = stage._row(POSTURE, found([0, 0, 0]).pose, RECORD, HELD_BY)
    assert row == {"status": "static posture: the glenohumeral joint is pulled apart"}
