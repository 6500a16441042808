"""Glenohumeral load, muscle groups and the rows of the tables."""

from dataclasses import replace

import numpy as np
import pytest
import synthetic_study
from scipy.spatial.transform import Rotation
from skeleton import CONSTANTS, skeleton_record

from scapulohumeral.errors import ModelError
from scapulohumeral.model.constants import Glenoid
from scapulohumeral.ocp.cost_terms import stability_errors
from scapulohumeral.quantities.joint_loading import (
    ANTERIOR_POSTERIOR_LIMIT,
    glenohumeral_load,
    glenoid_angles,
    superior_inferior_limit,
    superior_inferior_share,
)
from scapulohumeral.quantities.muscle_groups import group_force
from scapulohumeral.quantities.prediction_rows import PredictionCase, plane_rows, rhythm_rows

pytestmark = pytest.mark.unit

GLENOID = (np.deg2rad(6.5), np.deg2rad(13.0))
# Outward normal, superior and posterior axis: about y by the version, then about the new z.
AXES = Rotation.from_euler("YZ", [13.0, -6.5], degrees=True).as_matrix()
MASS_KG = 80.0
RECORD = replace(
    skeleton_record(),
    body_mass_kg=MASS_KG,
    constants=replace(CONSTANTS, glenoid=Glenoid(6.5, 13.0, 0.4)),
)


def reaction(compression: float, superior: float, posterior: float) -> np.ndarray:
    """Reaction on the humeral head (1, 3), scapula axes, to a load of the glenoid [N]."""
    return (AXES @ [compression, -superior, -posterior])[None]


def test_pure_compression_is_central() -> None:
    load = glenohumeral_load(reaction(400.0, 0.0, 0.0), RECORD)
    np.testing.assert_allclose(load.force, [[400.0, 0.0, 0.0]], atol=1e-10)
    np.testing.assert_allclose(load.percent_body_weight, 100 * 400 / (80 * 9.80665))
    np.testing.assert_allclose(load.eccentricity, 0.0, atol=1e-12)


def test_normal_points_outwards_down_and_forwards() -> None:
    """Scapula axes of a right shoulder: x lateral, y up, z back."""
    x, y, z = reaction(1.0, 0.0, 0.0)[0]
    assert x > 0.9
    assert y < 0
    assert z < 0
    load = glenohumeral_load(np.array([[1.0, 0.0, 0.0]]), RECORD)
    # Pressed straight inwards, the head slides the way the glenoid faces: down and forward.
    assert load.path[0, 0] < 0
    assert load.path[0, 1] < 0


@pytest.mark.parametrize(
    ("superior", "posterior"),
    [(superior_inferior_limit(RECORD), 0.0), (0.0, -ANTERIOR_POSTERIOR_LIMIT)],
)
def test_rim_is_at_eccentricity_one_for_any_size_of_force(
    superior: float, posterior: float
) -> None:
    for size in (10.0, 900.0):
        load = glenohumeral_load(size * reaction(1.0, superior, posterior), RECORD)
        np.testing.assert_allclose(load.path, [[superior, posterior]], atol=1e-12)
        np.testing.assert_allclose(load.eccentricity, 1.0)
        np.testing.assert_allclose(load.magnitude, size * np.sqrt(1 + superior**2 + posterior**2))


def test_eccentricity_is_what_the_objective_penalises() -> None:
    forces = np.array([[500.0, 120.0, -90.0], [300.0, -200.0, 40.0]])
    ratio, _ = stability_errors().first(forces, np.tile(GLENOID, (2, 1)))
    penalty = superior_inferior_share(RECORD) * ratio[:, 0] ** 2 + ratio[:, 1] ** 2
    load = glenohumeral_load(forces, RECORD)
    np.testing.assert_allclose((ANTERIOR_POSTERIOR_LIMIT * load.eccentricity) ** 2, penalty)


def test_joint_pulled_apart_is_outside() -> None:
    load = glenohumeral_load(reaction(-5.0, 1.0, 0.0), RECORD)
    assert np.isinf(load.eccentricity).all()
    assert np.isnan(load.path).all()


def test_group_sums() -> None:
    groups = np.array(["delt", "supra", "delt"])
    force = np.array([[10.0, 1.0, 30.0], [20.0, 2.0, 0.0]])
    sums = group_force(force, groups)
    np.testing.assert_allclose(sums["delt"], [40.0, 20.0])
    np.testing.assert_allclose(sums["supra"], [1.0, 2.0])


def test_groups_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ModelError, match="2 group names for 3 muscles"):
        group_force(np.ones((4, 3)), np.array(["a", "b"]))


def test_rows_of_a_stored_solution() -> None:
    solution = synthetic_study.solution("par2", "sagittal", "quaternion")
    constants = replace(CONSTANTS, glenoid=Glenoid(0.0, 0.0, 0.31))
    record = replace(skeleton_record(), body_mass_kg=MASS_KG, constants=constants)
    assert glenoid_angles(record) == (0.0, 0.0)
    case = PredictionCase("par2", "cuff-limited", 10.0, 0.25)
    nodes = {"early": (0, 10), "whole": (0, len(solution.time_s))}
    early, whole = plane_rows(case, solution, record, nodes)
    assert whole["condition"] == "cuff-limited"
    assert whole["plane"] == "whole"
    # The synthetic reaction is lateral, 300 to 350 N.
    heaviest = np.linalg.norm(solution.reaction_N, axis=1).max()
    assert whole["peak_gh_force_bw"] == pytest.approx(100 * heaviest / (MASS_KG * 9.80665))
    assert (whole["max_eccentricity"], whole["fraction_outside"]) == (0.0, 0.0)
    assert early["peak_upward_rotation_deg"] < whole["peak_upward_rotation_deg"]
    rows = rhythm_rows(case, solution.pose, {"sagittal": nodes["whole"]})
    assert len(rows) == 4
    assert rows[0].keys() >= {
        "participant",
        "plane",
        "condition",
        "w_gh",
        "capacity",
        "phase",
        "shr",
    }
