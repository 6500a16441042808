"""How far rules for unmeasured girdles are from recorded ones, in the study's recordings."""

import made_recordings as made
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scapulohumeral.laboratory.girdle_rules import (
    clavicle_direction_angles,
    clavicle_rotation,
    regressed_girdle,
    rest_scapula_in_clavicle,
)
from scapulohumeral.laboratory.trial import REGRESSED_UNCERTAINTY_DEG
from scapulohumeral.model.motion import read_motion

pytestmark = pytest.mark.unit
PARTICIPANTS = made.TABLES_FOLDER.parent / "participants"
PLANES = ("frontal", "scapular", "sagittal")


def recorded_segments(name: str, plane: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Clavicle, scapula and humerus in the thorax, (T, 3, 3), of a recorded elevation."""
    angles = read_motion(PARTICIPANTS / name / f"{plane}.csv").angles_rad
    clavicle = Rotation.from_euler("YZX", angles[:, :3])
    scapula = clavicle * Rotation.from_euler("YZX", angles[:, 3:6])
    humerus = scapula * Rotation.from_euler("YZY", angles[:, 6:9])
    return clavicle.as_matrix(), scapula.as_matrix(), humerus.as_matrix()


def test_the_stated_uncertainty_is_what_the_regression_leaves() -> None:
    errors = []
    for name in ("par1", "par2", "par3"):
        for plane in PLANES:
            clavicle, scapula, humerus = recorded_segments(name, plane)
            direction, regressed = regressed_girdle(humerus)
            found = Rotation.from_matrix(regressed).as_euler("YZX", degrees=True)
            recorded = Rotation.from_matrix(scapula).as_euler("YZX", degrees=True)
            yz = clavicle_direction_angles(direction) - clavicle_direction_angles(clavicle[..., 0])
            errors.append(np.hstack([found - recorded, np.rad2deg(yz)]))
    spread = np.sqrt(np.mean(np.concatenate(errors) ** 2))
    assert pytest.approx(2.0 * spread, abs=1.0) == REGRESSED_UNCERTAINTY_DEG


def test_the_clavicle_turns_to_where_the_scapula_rests_best() -> None:
    """No other turn about its long axis brings the scapula closer to rest."""
    clavicle, scapula, _ = recorded_segments("par2", "frontal")
    found = clavicle_rotation(clavicle[..., 0], scapula)
    assert found[..., 0] == pytest.approx(clavicle[..., 0])

    def away(turn_deg: float) -> np.ndarray:
        turned = found @ Rotation.from_euler("X", turn_deg, degrees=True).as_matrix()
        relative = turned.swapaxes(1, 2) @ scapula @ rest_scapula_in_clavicle().T
        return Rotation.from_matrix(relative).magnitude()

    assert (away(0.0) < away(0.5)).all()
    assert (away(0.0) < away(-0.5)).all()
