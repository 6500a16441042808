"""The record of a whole arm in round numbers, with two muscles that can be computed by hand."""

from __future__ import annotations

from typing import Any

STRAIGHT = [0.0, 0.0, 0.0]
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


def muscle(name: str, *points: tuple[str, list[float]], wraps: tuple[str, ...] = ()) -> dict:
    """A muscle element through points of bodies."""
    path = [{"body": body, "location_m": location} for body, location in points]
    return {"name": name, "group": name.rstrip("_1"), "points": path, "wraps": list(wraps)}


def skeleton_record() -> dict[str, Any]:
    """The parts of a model record that say where bones and muscles are."""
    offsets = {
        "sc1": [0.02, 0.01, 0.0], "ac1": [0.15, 0.0, 0.0], "gh1": [0.0, -0.05, 0.0],
        "hu": [0.0, -0.3, 0.0], "ur": [0.01, -0.02, 0.0], "rc": [0.0, -0.23, 0.0],
    }  # fmt: skip
    x, y, z = BALL["centre"]
    beside, radius = 2.0 * BALL["radius"], BALL["radius"]
    return {
        "participant": "par9",
        "body_mass_kg": 80.0,
        "joints": {
            name: {"location_m": offset, "orientation_rad": STRAIGHT}
            for name, offset in offsets.items()
        },
        "axes": {"EL_x": [1.0, 0.0, 0.0], "PS_y": [0.0, 1.0, 0.0]},
        "pronation_rad": 0.0,
        "segments": {"hand_r": {"com_m": [0.0, -0.08, 0.0]}},
        "markers": {
            name: {"body": body, "location_m": location}
            for body, markers in LANDMARKS.items()
            for name, location in markers.items()
        },
        "constants": {
            "glenoid": {
                "inferior_inclination_deg": 6.5,
                "anterior_version_deg": 13.0,
                "superior_inferior_factor": 0.31,
            }
        },
        "wrap_objects": [
            {"name": "inf_sup_sub", "type": "sphere", "body": "humerus_r",
             "translation_m": STRAIGHT, "dimensions_m": [0.02]},
            {"name": "ball", "type": "sphere", "body": "thorax",
             "translation_m": BALL["centre"], "dimensions_m": [radius]},
            {"name": "elbow", "type": "cylinder", "body": "ulna_r",
             "translation_m": STRAIGHT, "dimensions_m": [0.02, 0.05]},
        ],
        "muscles": [
            muscle("trapezius_1", ("thorax", [0.0, 0.05, 0.1]), ("scapula_r", [-0.1, 0.0, 0.02])),
            muscle("deltoid_1", ("scapula_r", [0.0, 0.0, 0.03]), ("humerus_r", [0.02, -0.15, 0])),
            muscle("biceps_1", ("scapula_r", [0.0, -0.04, 0.0]), ("humerus_r", [0.0, -0.1, -0.03]),
                   ("radius_r", [0.0, -0.04, 0.0]), wraps=("elbow",)),
            muscle("round_1", ("thorax", [x - beside, y + 0.001, z]),
                   ("thorax", [x + beside, y + 0.001, z]), wraps=("ball",)),
        ],
    }  # fmt: skip
