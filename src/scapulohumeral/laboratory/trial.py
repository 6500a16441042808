"""Landmarks or segment orientations of one trial to joint angles, with what was measured of them.

Letters: T frames.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scapulohumeral.errors import DataError
from scapulohumeral.laboratory.girdle_rules import (
    clavicle_rotation,
    humerus_elevation,
    regressed_girdle,
)
from scapulohumeral.laboratory.joint_angles import elbow_flexion, joint_angles
from scapulohumeral.laboratory.markers.frames import (
    SCAPULA,
    elbow_centre,
    humerus_frame,
    scapula_frame,
    thorax_frame,
    unit,
)
from scapulohumeral.laboratory.markers.landmarks import Landmarks
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import (
    ANGLE_NAMES,
    Array,
    quaternion_to_matrix,
    trial_to_pose,
)
from scapulohumeral.model.smoothing import smooth_recording
from scapulohumeral.model.tables import ModelTables

MEASURED, ESTIMATED, ASSUMED = "measured", "estimated", "assumed"
# The scapula turns against the clavicle during an elevation, in bone pins by up to 19 deg of tilt
# (Ludewig et al. 2009, J Bone Joint Surg Am 91:378); the rule gives that to the clavicle. In
# the recordings of this study, themselves from a model, it differs from the rule by 19 deg.
AXIAL_UNCERTAINTY_DEG = 20.0
AXIAL_RULE = (
    "axial rotation of the clavicle: the turn that keeps the scapula closest to its rest on the "
    "clavicle (rule of DAS3)"
)
# Ends of a clavicle placed by the offsets of the model are taken to be off by as much.
END_ERROR_M = 0.01
# Twice the root mean square error of the regression on the nine recorded elevations of this study,
# 11.8 deg over clavicle and scapula: persons differ as much at the same elevation of the arm.
REGRESSED_UNCERTAINTY_DEG = 24.0
REGRESSED_RULE = "regression on the elevation of the humerus (de Groot and Brand 2001)"


@dataclass(frozen=True)
class Channel:
    """What a joint angle rests on.

    Attributes
    ----------
    status : "measured", "estimated" (by a rule from what is measured) or "assumed" (a constant)
    rule : in words, empty if measured
    uncertainty_deg : about two standard deviations; None for measured angles, whose error nobody
        has measured here
    """

    status: str
    rule: str = ""
    uncertainty_deg: float | None = None


@dataclass(frozen=True, eq=False)
class Segments:
    """Segments of a right arm over time.

    Attributes
    ----------
    time_s : (T,)
    rate_hz : frames per second
    thorax : (T, 3, 3) in the laboratory
    clavicle : (T, 3) unit vectors SC to AC in the thorax, or None
    clavicle_turned : (T, 3, 3) clavicle in the thorax with a recorded axial rotation, or None
    scapula, humerus : (T, 3, 3) in the thorax; scapula None if not measured
    forearm : (T, 3) unit vectors from the elbow to US in the thorax, or None
    elbow : (T,) elbow flexion of the model [rad] where a recording gives the angle itself, or None
    clavicle_rule : how the clavicle was found if it carries no landmarks, else empty
    """

    time_s: Array
    rate_hz: float
    thorax: Array
    clavicle: Array | None
    clavicle_turned: Array | None
    scapula: Array | None
    humerus: Array
    forearm: Array | None
    elbow: Array | None = None
    clavicle_rule: str = ""


@dataclass(frozen=True, eq=False)
class Converted:
    """A trial in the study's conventions.

    Attributes
    ----------
    time_s : (T,), rate_hz
    angles_rad : (T, 10) in the order of ``ANGLE_NAMES``
    channels : joint angle -> what it rests on
    rotations : segment -> (T, 3, 3) in the thorax: clavicle_r, scapula_r, humerus_r
    segments : what it was made from
    smoothed_hz : cut-off of the low-pass filter that it went through; None if through none
    """

    time_s: Array
    rate_hz: float
    angles_rad: Array
    channels: Mapping[str, Channel]
    rotations: Mapping[str, Array]
    segments: Segments
    smoothed_hz: float | None = None

    @property
    def motion(self) -> Motion:
        """Its joint angles over time."""
        return Motion(self.time_s, self.angles_rad)

    @property
    def humeral_elevation_rad(self) -> Array:
        """Angle between the long axes of humerus and thorax, (T,)."""
        return humerus_elevation(self.rotations["humerus_r"])[1]

    @property
    def upward_rotation_rad(self) -> Array:
        """Elevation of the scapular spine over the thorax' horizontal plane, (T,)."""
        return np.arcsin(np.clip(self.rotations["scapula_r"][:, 1, 0], -1.0, 1.0))


def segments_of_landmarks(landmarks: Landmarks, tables: ModelTables) -> Segments:
    """Segment frames of a recording of landmarks.

    Raises
    ------
    DataError                        landmarks of a segment on a line, or no glenohumeral centre
    """
    points = landmarks.points
    try:
        thorax = thorax_frame(points, landmarks.first_frame)
        inside = {name: np.einsum("tji,tj->ti", thorax, p) for name, p in points.items()}
        has_scapula = all(name in points for name in SCAPULA)
        scapula = scapula_frame(inside, landmarks.first_frame) if has_scapula else None
        humerus = humerus_frame(inside, landmarks.first_frame)
    except DataError as error:
        raise DataError(f"{landmarks.source}, {error}") from error
    clavicle, rule = _clavicle(inside, scapula, tables)
    forearm = unit(inside["US"] - elbow_centre(inside)) if "US" in inside else None
    return Segments(
        time_s=landmarks.time_s,
        rate_hz=landmarks.rate_hz,
        thorax=thorax,
        clavicle=clavicle,
        clavicle_turned=None,
        scapula=scapula,
        humerus=humerus,
        forearm=forearm,
        clavicle_rule=rule,
    )


def _clavicle(
    points: Mapping[str, Array], scapula: Array | None, tables: ModelTables
) -> tuple[Array | None, str]:
    """Direction of the clavicle in the thorax (T, 3), and how it was found if not by landmarks."""
    if "AC" in points:
        ac, words = points["AC"], ""
    elif scapula is not None:
        ac, words = _model_ac(points, scapula, tables), "AC from the scapula"
    else:
        return None, ""
    if "SC" in points:
        return unit(ac - points["SC"]), words and f"{words} by the offsets of the model"
    words = " and ".join(part for part in ("SC from IJ", words) if part)
    return unit(ac - _model_sc(points, tables)), f"{words} by the offsets of the model"


def _model_sc(points: Mapping[str, Array], tables: ModelTables) -> Array:
    """SC at the model's place beside IJ, scaled to the depth of the thorax."""
    markers = {name: np.array(tables.markers[name].location_m) for name in ("IJ", "C7")}
    depth = np.median(np.linalg.norm(points["IJ"] - points["C7"], axis=1))
    scale = depth / np.linalg.norm(markers["IJ"] - markers["C7"])
    return points["IJ"] + scale * (np.array(tables.joints["sc1"].location_m) - markers["IJ"])


def _model_ac(points: Mapping[str, Array], scapula: Array, tables: ModelTables) -> Array:
    """AC at the model's place on the scapula, scaled to the length from TS to AA."""
    markers = {name: np.array(tables.markers[name].location_m) for name in ("AA", "TS")}
    length = np.median(np.linalg.norm(points["AA"] - points["TS"], axis=1))
    scale = length / np.linalg.norm(markers["AA"] - markers["TS"])
    # The scapula of the model has its origin in AC.
    return points["AA"] - scale * scapula @ markers["AA"]


def convert_segments(segments: Segments, tables: ModelTables) -> Converted:
    """Joint angles of segments, with rules for what was not measured.

    Parameters
    ----------
    segments : Segments
    tables : ModelTables             elbow of the model
    """
    channels = {name: Channel(MEASURED) for name in ANGLE_NAMES}
    direction, scapula = segments.clavicle, segments.scapula
    if direction is None or scapula is None:
        regressed = regressed_girdle(segments.humerus)
        direction = regressed[0] if direction is None else direction
        scapula = regressed[1] if scapula is None else scapula
    clavicle = segments.clavicle_turned
    if clavicle is None:
        clavicle = clavicle_rotation(direction, scapula)
    elbow = _elbow(segments, tables)
    channels |= _clavicle_channels(segments) | _scapula_channels(segments)
    channels["EL_x"] = _elbow_channel(segments)
    rotations = {"clavicle_r": clavicle, "scapula_r": scapula, "humerus_r": segments.humerus}
    angles = joint_angles(clavicle, scapula, segments.humerus, elbow)
    return Converted(segments.time_s, segments.rate_hz, angles, channels, rotations, segments)


def _elbow(segments: Segments, tables: ModelTables) -> Array:
    if segments.elbow is not None:
        return segments.elbow
    if segments.forearm is None:
        return np.full(len(segments.time_s), tables.coordinates["EL_x"].default_rad)
    return np.unwrap(elbow_flexion(tables, segments.humerus, segments.forearm))


def _elbow_channel(segments: Segments) -> Channel:
    if segments.elbow is not None or segments.forearm is not None:
        return Channel(MEASURED)
    # Half of the range of an elbow, 140 deg.
    return Channel(ASSUMED, "elbow not measured: default of the model", 70.0)


def _clavicle_channels(segments: Segments) -> dict[str, Channel]:
    """Channels of the clavicle, and of the scapula relative to it."""
    if segments.clavicle_turned is not None:
        return {}
    channels: dict[str, Channel] = {}
    turned = Channel(ESTIMATED, AXIAL_RULE, AXIAL_UNCERTAINTY_DEG)
    if segments.clavicle is None:
        channels |= dict.fromkeys(("SC_y", "SC_z"), _regressed())
    elif segments.clavicle_rule:
        # Of a clavicle 0.15 m long, both ends off independently.
        spread = float(np.rad2deg(np.sqrt(2.0) * END_ERROR_M / 0.15))
        placed = Channel(ESTIMATED, segments.clavicle_rule, round(spread, 1))
        channels |= dict.fromkeys(("SC_y", "SC_z"), placed)
    # What the clavicle turns too much the scapula turns too little on it.
    return channels | dict.fromkeys(("SC_x", "AC_y", "AC_z", "AC_x"), turned)


def _scapula_channels(segments: Segments) -> dict[str, Channel]:
    if segments.scapula is not None:
        return {}
    return dict.fromkeys(("AC_y", "AC_z", "AC_x", "GH_y", "GH_z", "GH_yy"), _regressed())


def _regressed() -> Channel:
    return Channel(ESTIMATED, REGRESSED_RULE, REGRESSED_UNCERTAINTY_DEG)


def smoothed(converted: Converted, cutoff_hz: float) -> Converted:
    """The same trial through a low-pass filter of its joint quaternions.

    Raises
    ------
    DataError, ConfigError           see `smoothing.smooth_recording`
    """
    motion = smooth_recording(converted.motion, cutoff_hz)
    pose = trial_to_pose(motion.angles_rad)
    clavicle, ac, gh = (quaternion_to_matrix(pose[:, k : k + 4]) for k in (0, 4, 8))
    scapula = clavicle @ ac
    rotations = {"clavicle_r": clavicle, "scapula_r": scapula, "humerus_r": scapula @ gh}
    angles = joint_angles(clavicle, scapula, scapula @ gh, pose[:, 12])
    return replace(converted, angles_rad=angles, rotations=rotations, smoothed_hz=cutoff_hz)


def provenance_of(channels: Mapping[str, Channel]) -> dict[str, Any]:
    """Channels as plain data for a provenance record."""
    return {
        name: {
            "status": channel.status,
            "rule": channel.rule,
            "uncertainty_deg": channel.uncertainty_deg,
        }
        for name, channel in channels.items()
    }
