"""The thorax ellipsoid passes through the recorded contact points and stays near the model's."""

import json
from dataclasses import replace

import numpy as np
import pytest
from one_recording import write_participant
from scipy.spatial.transform import Rotation
from skeleton import CONSTANTS, joint, skeleton_record, surface

from scapulohumeral.errors import ModelError
from scapulohumeral.model.muscle_paths.thorax_clearance import level_set
from scapulohumeral.model.record import PointRecord, write_record
from scapulohumeral.model.rotations import trial_to_pose
from scapulohumeral.stages import thorax

pytestmark = pytest.mark.unit

CENTRE, RADII = np.array([0.0, -0.2, 0.08]), np.array([0.16, 0.23, 0.1])


# An elevation in 50 frames [rad].
ANGLES = np.deg2rad(
    np.linspace([-40, 5, 0, 45, 5, 0, 20, 10, 0, 20], [-20, 15, 20, 55, 10, 5] + [50] * 4, 50)
)


def surface_points(centre, radii, count=400):
    """Points on the back right of an ellipsoid, where the scapula slides."""
    direction = np.abs(np.random.default_rng(1).normal(size=(count, 3)))
    direction[:, 1] -= 0.8
    return centre + radii * direction / np.linalg.norm(direction, axis=1, keepdims=True)


def test_level_set_is_zero_on_the_surface_and_minus_one_at_the_centre():
    points = surface_points(CENTRE, RADII)
    np.testing.assert_allclose(level_set(points, CENTRE, RADII), 0.0, atol=1e-14)
    assert level_set(CENTRE, CENTRE, RADII) == -1.0


def test_prior_that_fits_is_kept():
    centre, radii = thorax.fit_ellipsoid(surface_points(CENTRE, RADII), CENTRE, RADII, 1.0)
    np.testing.assert_allclose(centre, CENTRE, atol=1e-6)
    np.testing.assert_allclose(radii, RADII, atol=1e-6)


def test_fit_moves_to_the_points():
    points = surface_points(CENTRE + 0.01, RADII * 1.1)
    centre, radii = thorax.fit_ellipsoid(points, CENTRE, RADII, 1.0)
    level = level_set(points, centre, radii)
    assert np.sqrt(np.mean(level**2)) < 0.02
    assert np.sqrt(np.mean(level_set(points, CENTRE, RADII) ** 2)) > 0.2


def test_surface_goes_through_scattered_points_or_under_them():
    """Without bias on average; where points inside count more, it lies deeper."""
    points = surface_points(CENTRE, RADII)
    points += 0.01 * np.random.default_rng(2).normal(size=points.shape)
    mean, inside = [], []
    for factor in (1.0, 4.0):
        level = level_set(points, *thorax.fit_ellipsoid(points, CENTRE, RADII, factor))
        mean.append(level.mean())
        inside.append(np.mean(level < 0.0))
    assert abs(mean[0]) < 0.02
    assert 0.4 < inside[0] < 0.6
    assert mean[1] > 0.05
    assert inside[1] < 0.3


def test_number_of_frames_does_not_matter():
    points = surface_points(CENTRE + 0.02, RADII * 1.2)
    once = thorax.fit_ellipsoid(points, CENTRE, RADII, 1.0)
    twice = thorax.fit_ellipsoid(np.tile(points, (2, 1)), CENTRE, RADII, 1.0)
    np.testing.assert_allclose(np.concatenate(once), np.concatenate(twice), rtol=1e-5)


def test_radii_stay_plausible():
    _, radii = thorax.fit_ellipsoid(surface_points(CENTRE, 2.0 * RADII), CENTRE, RADII, 1.0)
    assert np.all(radii / RADII <= 1.3 + 1e-9)


def make_record():
    bones = skeleton_record()
    contact = replace(CONSTANTS.scapulothoracic_contact, points=("upper", "lower"))
    return replace(
        bones,
        joints={
            "sc1": joint([0.02, 0.0, -0.02]),
            "ac1": joint([0.16, 0.0, 0.0]),
            "gh1": joint([0.0, 0.0, 0.0]),
        },
        markers={
            "upper": PointRecord("scapula_r", (-0.12, -0.04, 0.0)),
            "lower": PointRecord("scapula_r", (-0.11, -0.13, 0.01)),
        },
        constants=replace(CONSTANTS, scapulothoracic_contact=contact),
        wrap_objects=(surface("serr_ant", "ellipsoid", "thorax", CENTRE, *RADII.tolist()),),
    )


def test_contact_points_move_with_the_scapula():
    """Against scipy's rotations, in a pose with every angle turned."""
    angles = np.deg2rad([[-20.0, 12.0, 7.0, 45.0, 4.0, 11.0, 30.0, 40.0, 20.0, 10.0]])
    clavicle = Rotation.from_euler("YZX", angles[0, :3])
    scapula = clavicle * Rotation.from_euler("YZX", angles[0, 3:6])
    record = make_record()
    origin = np.array([0.02, 0.0, -0.02]) + clavicle.apply([0.16, 0.0, 0.0])
    local = [record.markers[name].location_m for name in ("upper", "lower")]
    found = thorax.contact_points(record, trial_to_pose(angles))
    np.testing.assert_allclose(found, [origin + scapula.apply(local)], atol=1e-12)


def fitted(folder, angles, **entry):
    """What the stage writes for an elevation of these joint angles (T, 10) [rad]."""
    model, output = folder / "m.json", folder / "t.json"
    write_record(make_record(), model)
    thorax.fit_participant_thorax(model, write_participant(folder, angles, **entry), output)
    return json.loads(output.read_text())


def test_a_raw_recording_is_smoothed_where_the_participant_says_so(tmp_path):
    noise = 0.05 * np.random.default_rng(3).normal(size=ANGLES.shape)
    clean, raw = (fitted(tmp_path, angles) for angles in (ANGLES, ANGLES + noise))
    smooth = fitted(tmp_path, ANGLES + noise, smooth_cutoff_hz=3.0)
    apart = [abs(each["level_sd"] - clean["level_sd"]) for each in (raw, smooth)]
    assert apart[1] < 0.5 * apart[0]


def test_stage_writes_ellipsoid_misfit_and_prior(tmp_path):
    document = fitted(tmp_path, ANGLES)
    assert document["schema"] == "thorax/1"
    assert document["participant"] == "par9"
    assert document["level_min"] <= document["level_mean"] <= document["level_max"]
    assert document["level_sd"] < 0.2
    assert document["prior"]["radii_m"] == RADII.tolist()


def test_missing_surface_is_named():
    with pytest.raises(ModelError, match="par9.*serr_ant"):
        thorax.prior_ellipsoid(replace(make_record(), wrap_objects=()))
