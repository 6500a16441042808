"""The record of a whole arm in round numbers, with two muscles that can be computed by hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from places import REPOSITORY

from scapulohumeral.model.choices import ModelChoices
from scapulohumeral.model.constants import read_constants
from scapulohumeral.model.record import (
    ConoidRecord,
    CoordinateRecord,
    JointRecord,
    ModelRecord,
    MuscleRecord,
    PointRecord,
    SegmentRecord,
    WrapRecord,
)
from scapulohumeral.model.rotations import ANGLE_NAMES

CONSTANTS, _ = read_constants(REPOSITORY / "config/model/constants.yaml")
STRAIGHT = (0.0, 0.0, 0.0)
# A sphere in the thorax, far from the bones.
BALL = {"centre": [0.3, 0.2, 0.1], "radius": 0.05}
LANDMARKS = {
    "thorax": {
        "IJ": STRAIGHT, "PX": [0.0, -0.13, -0.03], "C7": [0.0, 0.05, 0.12],
        "T8": [0.0, -0.17, 0.15],
    },
    "clavicle_r": {"SC": STRAIGHT},
    "scapula_r": {
        "AC": STRAIGHT, "AA": [0.0, -0.02, 0.03], "TS": [-0.12, -0.02, 0.03],
        "AI": [-0.11, -0.14, 0.03],
    },
    "humerus_r": {
        "GH": STRAIGHT, "EL": [0.03, -0.3, 0.0], "EM": [-0.03, -0.3, 0.0],
        "Capitulum": [0.015, -0.3, 0.0],
    },
    "ulna_r": {"US": [-0.03, -0.25, 0.0]},
    "radius_r": {"RS": [0.0, -0.23, 0.01]},
    "hand_r": {"Wrist": STRAIGHT},
}  # fmt: skip


def joint(location: Sequence[float], orientation: Sequence[float] = STRAIGHT) -> JointRecord:
    """A joint of the chain."""
    return JointRecord("parent", "child", tuple(location), tuple(orientation))


def muscle(
    name: str,
    *points: tuple[str, Sequence[float]],
    wraps: tuple[str, ...] = (),
    group: str | None = None,
    size: float = 1.0,
) -> MuscleRecord:
    """A muscle element through points of bodies; all its numbers grow with `size`."""
    return MuscleRecord(
        name=name,
        group=name.rstrip("_1") if group is None else group,
        max_isometric_force_N=100.0 * size,
        optimal_fibre_length_m=0.1 * size,
        tendon_slack_length_m=0.05 * size,
        activation_time_s=0.01 * size,
        deactivation_time_s=0.04 * size,
        points=tuple(PointRecord(body, tuple(location)) for body, location in points),
        wraps=wraps,
    )


def surface(
    name: str, kind: str, body: str, centre: Sequence[float], *dimensions: float
) -> WrapRecord:
    """A surface along the axes of its body, not flattened."""
    scaled = dimensions if kind == "ellipsoid" else None
    return WrapRecord(
        name, kind, body, tuple(map(float, centre)), STRAIGHT, "all", dimensions, scaled
    )


def uneven_record() -> ModelRecord:
    """The same with joints that lie on no axis."""
    record = skeleton_record()
    places = {
        "sc1": [0.02, 0.01, 0.03],
        "ac1": [0.16, -0.02, 0.01],
        "gh1": [-0.01, -0.05, 0.02],
    }
    moved = {name: joint(place) for name, place in places.items()}
    return replace(record, joints={**record.joints, **moved})


def skeleton_record() -> ModelRecord:
    """A model record in round numbers."""
    offsets = {
        "sc1": [0.02, 0.01, 0.0], "ac1": [0.15, 0.0, 0.0], "gh1": [0.0, -0.05, 0.0],
        "hu": [0.0, -0.3, 0.0], "ur": [0.01, -0.02, 0.0], "rc": [0.0, -0.23, 0.0],
    }  # fmt: skip
    masses = {
        "clavicle_r": 0.2, "scapula_r": 0.7, "humerus_r": 2.0, "ulna_r": 0.6, "radius_r": 0.6,
        "hand_r": 0.5,
    }  # fmt: skip
    x, y, z = BALL["centre"]
    beside = 2.0 * BALL["radius"]
    return ModelRecord(
        schema="model/1",
        participant="par9",
        masses="published",
        choices=ModelChoices(),
        body_mass_kg=80.0,
        body_mass_source="participant",
        gravity_mps2=CONSTANTS.gravity.vector_mps2,
        segments={
            name: SegmentRecord(mass, (0.0, -0.08, 0.0), (4e-3, 1e-3, 4e-3, 0.0, 0.0, 0.0))
            for name, mass in masses.items()
        },
        joints={name: joint(offset) for name, offset in offsets.items()},
        axes={"EL_x": (1.0, 0.0, 0.0), "PS_y": (0.0, 1.0, 0.0)},
        coordinates={name: CoordinateRecord(-0.2, 0.6, 0.0) for name in ANGLE_NAMES},
        girdle_range_rad=dict.fromkeys(ANGLE_NAMES[:6], (-0.2, 0.6)),
        pronation_rad=0.0,
        markers={
            name: PointRecord(body, tuple(location))
            for body, markers in LANDMARKS.items()
            for name, location in markers.items()
        },
        conoid=ConoidRecord(
            "clavicle_r", (0.1, 0.0, 0.0), "scapula_r", (0.0, 0.0, 0.1), 1e4, 1e-3, 0.02
        ),
        muscles=(
            muscle("trapezius_1", ("thorax", [0.0, 0.05, 0.1]), ("scapula_r", [-0.1, 0.0, 0.02])),
            muscle("deltoid_1", ("scapula_r", [0.0, 0.0, 0.03]), ("humerus_r", [0.02, -0.15, 0])),
            muscle("biceps_1", ("scapula_r", [0.0, -0.04, 0.0]), ("humerus_r", [0.0, -0.1, -0.03]),
                   ("radius_r", [0.0, -0.04, 0.0]), wraps=("elbow",)),
            muscle("round_1", ("thorax", [x - beside, y + 0.001, z]),
                   ("thorax", [x + beside, y + 0.001, z]), wraps=("ball",)),
        ),
        wrap_objects=(
            surface("inf_sup_sub", "sphere", "humerus_r", STRAIGHT, 0.02),
            surface("ball", "sphere", "thorax", BALL["centre"], BALL["radius"]),
            surface("elbow", "cylinder", "ulna_r", STRAIGHT, 0.02, 0.05),
        ),
        published_thorax_ellipsoid=None,
        constants=CONSTANTS,
    )  # fmt: skip
