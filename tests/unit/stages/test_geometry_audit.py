"""The audit of muscle geometry finds what a solution's lengths and arms miss, and where."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from small_arm import NAMES, small_forces, small_motion
from synthetic_study import solution

from scapulohumeral.errors import DataError
from scapulohumeral.model.rotations import trial_to_pose
from scapulohumeral.ocp.solution import write_solution
from scapulohumeral.stages.geometry_audit import audit_geometry, audit_table, audited_poses

pytestmark = pytest.mark.unit


@pytest.fixture
def forces(quaternion_equations):
    return small_forces(quaternion_equations)


def samples(forces):
    """What OpenSim would say if the fit were exact, at twelve poses."""
    q = trial_to_pose(small_motion(12))
    length, _ = forces.lengths(q, np.zeros((12, 10)))
    return {
        "muscles": np.array(NAMES),
        "q": q,
        "length_m": length.copy(),
        "rotation_gradient_m": forces.gradients(q)[..., :10].copy(),
        "smooth": np.ones(length.shape, bool),
    }


def audit(forces, values, folder):
    np.savez(folder / "samples.npz", **values)
    return audit_geometry(forces, folder / "samples.npz").set_index("muscle")


def test_exact_geometry_has_no_error(forces, tmp_path):
    table = audit(forces, samples(forces), tmp_path)
    assert list(table.index) == list(NAMES)
    assert table[["length_max_mm", "arm_max_mm"]].to_numpy().max() < 1e-9


def test_planted_errors_are_found_in_their_muscle(forces, tmp_path):
    values = samples(forces)
    values["length_m"][4, 1] += 0.007
    values["rotation_gradient_m"][7, 2, 9] -= 0.011
    table = audit(forces, values, tmp_path)
    assert table.length_max_mm["biceps"] == pytest.approx(7.0)
    assert table.length_rmse_mm["biceps"] == pytest.approx(7.0 / np.sqrt(12))
    assert table.arm_max_mm["brachialis"] == pytest.approx(11.0)
    others = table.loc["coracobrachialis", ["length_max_mm", "arm_max_mm"]]
    assert others.max() < 1e-9


def test_jumps_of_the_wrapping_are_counted_and_left_out(forces, tmp_path):
    values = samples(forces)
    values["length_m"][3, 0] += 0.05
    values["smooth"][3, 0] = False
    table = audit(forces, values, tmp_path)
    assert table.jumps.tolist() == [1, 0, 0]
    assert table.length_max_mm["coracobrachialis"] < 1e-9


def test_a_length_that_is_no_number_is_without_limit(forces, tmp_path):
    """The square of a length may fall below zero: no limit holds there, and the muscle is named."""
    values = samples(forces)

    def lengths(q, u):
        found, rest = forces.lengths(q, u)
        found[5, 2] = np.nan
        return found, rest

    broken = SimpleNamespace(geometry=forces.geometry, lengths=lengths, gradients=forces.gradients)
    audit(broken, values, tmp_path).to_csv(tmp_path / "healthy_geometry.csv")
    table = audit_table([tmp_path / "healthy_geometry.csv"], [("par2", "healthy")])
    assert table.length_muscle[0] == NAMES[2]
    assert not table.length_max_mm[0] <= 1e6


def test_samples_of_other_muscles_are_refused(forces, tmp_path):
    values = samples(forces) | {"muscles": np.array(NAMES[::-1])}
    with pytest.raises(DataError, match="other muscles"):
        audit(forces, values, tmp_path)


def test_table_names_the_worst_muscle_of_each_prediction(forces, tmp_path):
    values = samples(forces)
    values["length_m"][4, 1] += 0.007
    audit(forces, values, tmp_path).to_csv(tmp_path / "healthy_geometry.csv")
    table = audit_table([tmp_path / "healthy_geometry.csv"], [("par2", "healthy")])
    assert isinstance(table, pd.DataFrame)
    row = table.iloc[0]
    assert (row.participant, row.condition, row.length_muscle) == ("par2", "healthy", "biceps")
    assert row.length_max_mm == pytest.approx(7.0, rel=1e-5)


def test_failed_solve_has_a_row_without_numbers(forces, tmp_path):
    path = tmp_path / "failed.npz"
    for status, poses in (("optimal", 10), ("failed", 0)):
        write_solution(solution("par2", "frontal", "quaternion", status), path)
        assert audited_poses(path, 4).shape == (poses, 13)
    one = samples(forces)
    none = {name: one[name][:0] for name in one if name != "muscles"}
    audit(forces, none | {"muscles": one["muscles"]}, tmp_path).to_csv(tmp_path / "failed.csv")
    audit(forces, one, tmp_path).to_csv(tmp_path / "healthy.csv")
    names = [("par2", "failed"), ("par2", "healthy")]
    table = audit_table([tmp_path / "failed.csv", tmp_path / "healthy.csv"], names)
    assert table.poses.tolist() == [0, 12]
    assert table.length_muscle[0] == ""
    numbers = [name for name in table if name.endswith("_mm")]
    assert table.loc[0, numbers].isna().all()
    assert table.loc[1, numbers].notna().all()
