"""What a participant.yaml may say, as JSON Schema (draft 2020-12)."""

from __future__ import annotations

from typing import Any

SCALED_SEGMENTS = (
    "thorax",
    "clavicle_r",
    "scapula_r",
    "humerus_r",
    "ulna_r",
    "radius_r",
    "hand_r",
)


def _vector(description: str, **limits: float) -> dict[str, Any]:
    item = {"type": "number", **limits}
    return {
        "description": description,
        "type": "array",
        "items": item,
        "minItems": 3,
        "maxItems": 3,
    }


def _object(description: str, properties: dict[str, Any], *optional: str) -> dict[str, Any]:
    return {
        "description": description,
        "type": "object",
        "properties": properties,
        "required": [name for name in properties if name not in optional],
        "additionalProperties": False,
    }


_FILE = {"type": "string", "minLength": 1, "description": "path relative to participant.yaml"}

_TRIAL = _object(
    "a recorded motion",
    {
        "file": _FILE,
        "hand_load_kg": {
            "type": "number",
            "minimum": 0,
            "maximum": 30,
            "description": "mass held in the hand [kg]",
        },
        "published": {**_FILE, "type": ["string", "null"]},
        "daily_task": {
            "type": "boolean",
            "description": "true if the trial validates the model: no muscle is adapted to it",
        },
        "smooth_cutoff_hz": {
            "type": "number",
            "exclusiveMinimum": 0,
            "maximum": 20,
            "description": "cut-off of the low-pass filter for a raw recording [Hz]",
        },
    },
    "daily_task",
    "smooth_cutoff_hz",
)

_EMG = _object(
    "measured EMG, used in place of simulated EMG",
    {
        "mvc": {**_FILE, "description": "recording of maximal voluntary contractions"},
        "trials": {
            "type": "object",
            "minProperties": 1,
            "additionalProperties": _FILE,
            "description": "raw recordings by name of the trial; .csv or .c3d",
        },
        "delay_s": {
            "type": "number",
            "minimum": -600,
            "maximum": 600,
            "description": "what the EMG clock shows when the kinematic clock shows zero [s]",
        },
        "labels": {
            "type": "object",
            "additionalProperties": {"type": "string", "minLength": 1},
            "description": "channel -> label in C3D files, where it differs",
        },
    },
    "labels",
)

PARTICIPANT_SCHEMA = _object(
    "a participant of the study",
    {
        "schema": {"const": "participant/1"},
        "id": {"type": "string", "description": "name of the folder"},
        "side": {"enum": ["right"], "description": "the model is a right arm; mirror left ones"},
        "sex": {"enum": ["male", "female", None]},
        "height_m": {"type": ["number", "null"], "minimum": 1, "maximum": 2.5},
        "body_mass_kg": {"type": ["number", "null"], "minimum": 20, "maximum": 300},
        "gravity_in_thorax_mps2": _vector("gravity in thorax axes", minimum=-20, maximum=20),
        "scale": _object(
            "segment size over base model, along x, y, z of the segment",
            {
                # Wider than any adult over the base model; the largest in the study is 1.42.
                segment: _vector(f"of {segment}", minimum=0.5, maximum=2)
                for segment in SCALED_SEGMENTS
            },
        ),
        "mass": _object(
            "of the published scaled model",
            {
                "published_total_kg": {
                    "type": "number",
                    "minimum": 10,
                    "maximum": 300,
                    "description": "all segments of the model: thorax and one arm [kg]",
                },
                "preserve_mass_distribution": {"type": "boolean"},
            },
        ),
        "published_thorax_ellipsoid": _object(
            "thoracic wall of the published model, thorax axes",
            {
                "centre_m": _vector("centre", minimum=-1, maximum=1),
                "radii_m": _vector("radii along x, y, z", exclusiveMinimum=0, maximum=1),
            },
        ),
        "trials": {
            "type": "object",
            "minProperties": 1,
            "additionalProperties": _TRIAL,
            "description": "recorded motions by name",
        },
        "published_predictions": {
            "type": "object",
            "additionalProperties": _FILE,
            "description": "files of published predicted motions by condition",
        },
        "emg": _EMG,
    },
    "published_thorax_ellipsoid",
    "published_predictions",
    "emg",
)
