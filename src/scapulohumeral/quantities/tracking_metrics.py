"""How well a solution follows the recording, in the terms of the paper and as rotation angles."""

from __future__ import annotations

from typing import Literal

import numpy as np

from scapulohumeral.model.rotations import (
    quaternion_to_euler,
    quaternion_to_matrix,
    relative_angle,
    segment_orientations,
)
from scapulohumeral.ocp.solution import Solution


def tracking_metrics(solution: Solution) -> dict[str, float]:
    """Tracking errors [deg], unit-norm error [1] and largest activation step [1].

    RMSE over Euler angles: clavicle Y-Z (axial rotation left out), scapula Y-Z-X and humerus
    Y-Z-Y in the thorax, as in the paper. Angles: root mean square angle between the clavicle axes,
    and of the rotation between orientations of scapula and humerus.
    """
    ours = segment_orientations(solution.pose)
    recorded = segment_orientations(solution.reference_pose)
    direction = [quaternion_to_matrix(s["clavicle"])[:, :, 0] for s in (ours, recorded)]
    cosine = np.clip((direction[0] * direction[1]).sum(axis=1), -1.0, 1.0)
    return {
        "rmse_clavicle_deg": _euler_rmse(ours, recorded, "clavicle", "YZX", 2),
        "rmse_thoracoscapular_deg": _euler_rmse(ours, recorded, "scapula", "YZX", 3),
        "rmse_thoracohumeral_deg": _euler_rmse(ours, recorded, "humerus", "YZY", 3),
        "angle_clavicle_deg": _rms_deg(np.arccos(cosine)),
        "angle_scapula_deg": _rms_deg(relative_angle(ours["scapula"], recorded["scapula"])),
        "angle_humerus_deg": _rms_deg(relative_angle(ours["humerus"], recorded["humerus"])),
        "norm_rmse": _norm_rmse(solution.q),
        "max_activation_step": float(np.abs(np.diff(solution.activation, axis=0)).max()),
    }


def _euler_rmse(ours, recorded, segment: str, sequence: Literal["YZX", "YZY"], count: int) -> float:
    angles = [quaternion_to_euler(s[segment], sequence)[:, :count] for s in (ours, recorded)]
    difference = angles[0] - angles[1]
    return _rms_deg((difference + np.pi) % (2 * np.pi) - np.pi)


def _rms_deg(angles: np.ndarray) -> float:
    return float(np.rad2deg(np.sqrt(np.mean(angles**2))))


def _norm_rmse(q: np.ndarray) -> float:
    """Root mean square deviation of quaternion norms from one; 0 for Euler angles."""
    if q.shape[1] != 13:
        return 0.0
    norms = np.stack([np.linalg.norm(q[:, i : i + 4], axis=1) for i in (0, 4, 8)])
    return float(np.sqrt(np.mean((norms - 1.0) ** 2)))
