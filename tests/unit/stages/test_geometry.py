"""Samples of OpenSim become lengths and gradients in the coordinates of each formulation."""

from dataclasses import replace

import numpy as np
import pytest
from one_recording import write_participant
from skeleton import muscle, uneven_record

from scapulohumeral.model.muscle_paths.fit import FitSettings
from scapulohumeral.model.muscle_paths.thorax_clearance import segment_frames
from scapulohumeral.model.record import write_record
from scapulohumeral.model.rotations import (
    quaternion_multiply,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
    trial_to_pose,
)
from scapulohumeral.stages import geometry

pytestmark = pytest.mark.unit

RECORD = uneven_record()
ANGLES = np.random.default_rng(1).uniform(-0.9, 0.9, (12, 10))
STEP = 1e-6


def length(pose):
    """Distance [m] from a point on the thorax to one on the humerus, shape (P, 1)."""
    origin, matrix = segment_frames(RECORD, pose)["humerus_r"]
    return np.linalg.norm(origin + matrix @ [0.02, -0.1, 0.03] - [0.05, -0.2, 0.1], axis=1)[:, None]


def turned(pose, axis, sign):
    """Poses after a small rotation about one of the child axes, SC xyz, AC xyz, GH xyz, elbow."""
    pose = pose.copy()
    if axis == 9:
        pose[:, 12] += sign * STEP
        return pose
    start, vector = 4 * (axis // 3), sign * STEP * np.eye(3)[axis % 3]
    turn = rotation_vector_to_quaternion(vector)
    pose[:, start : start + 4] = quaternion_multiply(pose[:, start : start + 4], turn)
    return pose


def slope(change):
    """Central difference from a function of the sign."""
    return (length(change(1)) - length(change(-1))) / (2 * STEP)


@pytest.fixture
def child_axes_gradient():
    pose = trial_to_pose(ANGLES)
    return np.stack([slope(lambda sign, k=k: turned(pose, k, sign)) for k in range(10)], axis=2)


def test_euler_gradient_is_the_derivative_by_angle(child_axes_gradient):
    expected = [
        slope(lambda sign, k=k: trial_to_pose(ANGLES + sign * STEP * np.eye(10)[k]))
        for k in range(10)
    ]
    actual = geometry.euler_gradient(child_axes_gradient, ANGLES)
    np.testing.assert_allclose(actual, np.stack(expected, axis=2), atol=1e-8)


def test_quaternion_rate_map_turns_about_child_axes():
    pose = geometry.coordinates(ANGLES, "quaternion")
    rates = geometry.quaternion_rate_map(pose)
    for k in range(10):
        change = (turned(pose, k, 1) - turned(pose, k, -1)) / (2 * STEP)
        np.testing.assert_allclose(rates[:, :, k], change, atol=1e-8)


def test_coordinates_of_the_formulations():
    np.testing.assert_array_equal(geometry.coordinates(ANGLES, "euler"), ANGLES)
    far = ANGLES + [0, 0, 0, 0, 0, 0, 5.0, 0, 0, 0]
    pose = geometry.coordinates(far, "quaternion")
    assert pose[:, [0, 4, 8]].min() >= 0.0


@pytest.mark.parametrize("formulation", ["quaternion", "euler"])
def test_samples_are_split_and_expressed_in_the_coordinates(
    formulation, child_axes_gradient, tmp_path
):
    path = tmp_path / "samples.npz"
    held_out = np.arange(len(ANGLES)) >= 9
    np.savez(
        path,
        angles=ANGLES,
        held_out=held_out,
        length_m=length(trial_to_pose(ANGLES)),
        rotation_gradient_m=child_axes_gradient,
        gh_translation=np.zeros((12, 1, 3)),
        smooth=np.ones((12, 1), bool),
    )
    samples = geometry.read_samples(path, formulation)
    assert (len(samples.fit.length), len(samples.held_out.length)) == (9, 3)
    assert samples.held_out_q.shape == (3, 13 if formulation == "quaternion" else 10)
    speeds = np.random.default_rng(2).normal(size=10)
    moved = np.einsum("pvk,k->pv", samples.fit.rate_map, speeds)
    if formulation == "euler":
        np.testing.assert_allclose(moved, np.tile(speeds, (9, 1)))
    else:
        pose = geometry.coordinates(ANGLES[:9], formulation)
        rate = sum(
            speeds[k] * (turned(pose, k, 1) - turned(pose, k, -1)) / (2 * STEP) for k in range(10)
        )
        np.testing.assert_allclose(moved, rate[:, [1, 2, 3, 5, 6, 7, 9, 10, 11, 12]], atol=1e-7)


STRAIGHT_MUSCLE = replace(
    muscle("example", ("scapula_r", [-0.05, -0.1, 0.02]), ("humerus_r", [0.02, -0.1, 0.03])),
    optimal_fibre_length_m=0.04,
    tendon_slack_length_m=0.02,
)


def test_assessment_of_an_exact_path(equations, tmp_path):
    """Samples of a straight path from plain geometry; one held-out length is 20 mm off."""
    record = replace(RECORD, muscles=(STRAIGHT_MUSCLE,))
    origin, tip = (np.array(point.location_m) for point in STRAIGHT_MUSCLE.points)
    gh = quaternion_to_matrix(trial_to_pose(ANGLES)[:, 8:12])
    line = np.array(RECORD.joints["gh1"].location_m) + gh @ tip - origin
    distance = np.linalg.norm(line, axis=1)
    gradient = np.zeros((12, 1, 10))
    pull = np.einsum("pij,pi->pj", gh, line / distance[:, None])
    gradient[:, 0, 6:9] = np.cross(tip, pull)
    sampled_length = distance[:, None].copy()
    # Further than any pose that a fit leaves out: what is held out is judged even so.
    sampled_length[-1] += 0.02
    np.savez(
        tmp_path / "samples.npz",
        angles=ANGLES,
        held_out=np.arange(12) >= 8,
        length_m=sampled_length,
        rotation_gradient_m=gradient,
        gh_translation=(line / distance[:, None])[:, None],
        smooth=np.ones((12, 1), bool),
    )
    write_record(record, tmp_path / "model.json")
    files = (tmp_path / "samples.npz", tmp_path / "model.json")
    fit = geometry.fit_muscle_geometry(*files, equations.name, FitSettings())

    # The path depends on the humerus alone; a recorded girdle has to be one of a person.
    recorded = np.deg2rad(np.tile([-25.0, 5.0, 10.0, 45.0, 5.0, 0.0, 0.0, 0.0, 0.0, 20.0], (12, 1)))
    recorded[:, 6:9] = ANGLES[:, 6:9]

    def assessed(**entry):
        # So slowly that no segment jumps.
        participant = write_participant(tmp_path, recorded, step_s=0.15, **entry)
        table = geometry.assess_muscle_geometry(fit, *files, participant, equations)
        return table.iloc[0]

    quality = assessed()
    assert (quality.muscle, quality.path, quality.joints) == ("example", "straight", "GH")
    assert quality.length_max_mm == pytest.approx(20.0)
    assert quality.length_rmse_mm == pytest.approx(10.0)  # one of four
    assert quality.left_out_held_out == 0
    assert quality.arm_rmse_worst_mm == pytest.approx(0.0, abs=1e-9)
    assert quality.direction_rmse == pytest.approx(0.0, abs=1e-12)
    assert quality.fibre_max == pytest.approx((distance.max() - 0.02) / 0.04)
    assert bool(quality.fibre_outside) == (quality.fibre_max > 1.8)
    # These angles are all noise: smoothed as the participant asks for, fibres change less.
    smooth = assessed(smooth_cutoff_hz=0.5)
    assert smooth.fibre_max - smooth.fibre_min < 0.5 * (quality.fibre_max - quality.fibre_min)
