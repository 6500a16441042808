"""Run-time parameters of the equations of motion.

One table names every number that the equations leave open; the symbolic side takes its symbols
from it and the numeric side packs its values in the same order, so one build serves all
participants, conditions and hypotheses.

Letters: P number of scalar parameters.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from scapulohumeral.errors import ModelError

SEGMENTS = ("clavicle", "scapula", "humerus", "forearm")
BALL_JOINTS = ("SC", "AC", "GH")
GIRDLE_JOINTS = ("SC", "AC")


@dataclass(frozen=True)
class ParameterSpec:
    """One named block of parameters: its size, unit and meaning."""

    name: str
    size: int
    unit: str
    description: str


def _segment_specs(segment: str) -> tuple[ParameterSpec, ...]:
    return (
        ParameterSpec(f"mass_{segment}", 1, "kg", f"mass of the {segment}"),
        ParameterSpec(f"com_{segment}", 3, "m", f"mass centre of the {segment}, own frame"),
        ParameterSpec(
            f"inertia_{segment}",
            6,
            "kg m^2",
            f"inertia of the {segment} about its mass centre: xx yy zz xy xz yz, own frame",
        ),
    )


SPECS: tuple[ParameterSpec, ...] = (
    ParameterSpec("gravity", 3, "m/s^2", "gravity, thorax frame"),
    ParameterSpec("offset_SC", 3, "m", "sternoclavicular joint, thorax frame"),
    ParameterSpec("offset_AC", 3, "m", "acromioclavicular joint, clavicle frame"),
    ParameterSpec("offset_GH", 3, "m", "glenohumeral joint centre, scapula frame"),
    ParameterSpec("offset_EL", 3, "m", "elbow joint, humerus frame"),
    ParameterSpec("axis_EL", 3, "1", "unit axis of elbow flexion, humerus frame"),
    *(spec for segment in SEGMENTS for spec in _segment_specs(segment)),
    ParameterSpec("mass_load", 1, "kg", "point mass held in the hand"),
    ParameterSpec("com_load", 3, "m", "position of the hand load, forearm frame"),
    ParameterSpec("conoid_origin", 3, "m", "conoid ligament origin, clavicle frame"),
    ParameterSpec("conoid_insertion", 3, "m", "conoid ligament insertion, scapula frame"),
    ParameterSpec("conoid_length", 1, "m", "slack length of the conoid ligament"),
    ParameterSpec("conoid_stiffness", 1, "N/m", "stiffness of the conoid ligament"),
    ParameterSpec("conoid_eps", 1, "m", "smoothing length of the conoid force"),
    ParameterSpec("contact_TS", 3, "m", "contact point near trigonum spinae, scapula frame"),
    ParameterSpec("contact_AI", 3, "m", "contact point near angulus inferior, scapula frame"),
    ParameterSpec("thorax_centre", 3, "m", "centre of the thorax ellipsoid, thorax frame"),
    ParameterSpec("thorax_radii", 3, "m", "radii of the thorax ellipsoid along thorax axes"),
    ParameterSpec("contact_stiffness", 1, "N/m", "scapulothoracic contact stiffness"),
    ParameterSpec("contact_eps", 1, "1", "smoothing of the ellipsoid level-set value"),
    ParameterSpec("joint_stiffness", 4, "N m/rad", "passive stiffness of SC, AC, GH, EL"),
    ParameterSpec("spring_torque", 4, "N m", "torque of exponential springs of SC, AC, GH, EL"),
    ParameterSpec("joint_damping", 4, "N m s/rad", "viscous damping of SC, AC, GH, EL"),
    ParameterSpec("stop_stiffness", 1, "N m/rad^2", "stiffness of SC and AC beyond their range"),
    ParameterSpec("stop_eps", 1, "rad", "smoothing of the angle beyond the range"),
    *(
        ParameterSpec(f"range_{end}_{joint}", 3, "rad", f"{end} Y-Z-X angles of {joint}")
        for joint in GIRDLE_JOINTS
        for end in ("least", "largest")
    ),
    *(
        ParameterSpec(f"rest_{joint}", 9, "1", f"rotation matrix of {joint} at rest, row-major")
        for joint in BALL_JOINTS
    ),
    ParameterSpec("rest_EL", 1, "rad", "elbow flexion at rest"),
)

SIZE = sum(spec.size for spec in SPECS)


def scalar_names() -> tuple[str, ...]:
    """Names of the P scalar parameters in packing order; blocks get a numeric suffix."""
    names: list[str] = []
    for spec in SPECS:
        if spec.size == 1:
            names.append(spec.name)
        else:
            names.extend(f"{spec.name}_{i}" for i in range(spec.size))
    return tuple(names)


def pack(values: Mapping[str, object]) -> np.ndarray:
    """Vector of all parameters, shape (P,), from a mapping block name -> value(s).

    Raises
    ------
    ModelError
        If a block is missing, unknown, of the wrong size or not finite.
    """
    unknown = sorted(set(values) - {spec.name for spec in SPECS})
    if unknown:
        raise ModelError(f"unknown dynamics parameter(s) {', '.join(unknown)}")
    blocks = []
    for spec in SPECS:
        if spec.name not in values:
            raise ModelError(f"dynamics parameter {spec.name!r} [{spec.unit}] is missing")
        block = np.ravel(np.asarray(values[spec.name], dtype=float))
        if block.shape != (spec.size,) or not np.all(np.isfinite(block)):
            raise ModelError(
                f"dynamics parameter {spec.name!r}: expected {spec.size} finite number(s) "
                f"[{spec.unit}], got {values[spec.name]!r}"
            )
        blocks.append(block)
    return np.concatenate(blocks)


def unpack(vector: np.ndarray) -> dict[str, np.ndarray]:
    """Inverse of :func:`pack`: block name -> array, shape (size,)."""
    vector = np.asarray(vector, dtype=float)
    if vector.shape != (SIZE,):
        raise ModelError(f"dynamics parameter vector has shape {vector.shape}, expected ({SIZE},)")
    stops = np.cumsum([spec.size for spec in SPECS])[:-1]
    return {spec.name: part for spec, part in zip(SPECS, np.split(vector, stops), strict=True)}
