"""What the participant file of a diagnosis may say, as JSON Schema (draft 2020-12)."""

from __future__ import annotations

from typing import Any

from scapulohumeral.emg.channels import neighbours_of

_NAME = {"type": "string", "pattern": "^EMG_[^/+ >]+$", "description": "a column EMG_<channel>"}
_SIZE = {
    "generic": {"const": True},
    "body_mass_kg": {"type": "number", "minimum": 20, "maximum": 300},
    "height_m": {"type": "number", "minimum": 1, "maximum": 2.5},
    "sex": {"enum": ["male", "female"]},
}


def _closed(properties: dict[str, Any], *required: str, **more: Any) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": properties,
        "required": list(required),
        "additionalProperties": False,
        **more,
    }


_EMG = _closed(
    {
        "channels": {
            "type": "object",
            "minProperties": 1,
            "propertyNames": _NAME,
            "additionalProperties": {
                "type": "array",
                "items": {"type": "string"},
                "minItems": 1,
                "description": "muscle groups of the model under this electrode",
            },
        },
        "unit": {"enum": ["fraction_of_mvc", "fraction_of_shared_max", "fraction_of_max"]},
        "neighbours": neighbours_of(_NAME),
    },
    "channels",
    "unit",
    description="EMG set-up; leave out if there is none",
)

_TRIAL = _closed(
    {
        "task": {"type": "string", "minLength": 1},
        "repeat": {"type": "integer", "minimum": 1},
        "window_s": {
            "type": "array",
            "items": {"type": "number"},
            "minItems": 2,
            "maxItems": 2,
            "description": "start and end of the movement [s], on the clock of the trial",
        },
    },
    description="of the trial file with this stem",
)

DIAGNOSIS_SCHEMA = _closed(
    {
        "schema": {"const": "participant/1"},
        "id": {"type": "string", "minLength": 1},
        "side": {"enum": ["right"], "description": "the model is a right arm; mirror left ones"},
        "model": {
            "description": "{file: scaled_....yaml} or {generic: true, body_mass_kg, height_m}",
            "oneOf": [
                _closed({"file": {"type": "string", "minLength": 1}}, "file"),
                _closed(_SIZE, "generic", "body_mass_kg", "height_m"),
            ],
        },
        "gravity_in_thorax_mps2": {
            "type": "array",
            "items": {"type": "number", "minimum": -20, "maximum": 20},
            "minItems": 3,
            "maxItems": 3,
            "description": "gravity in thorax axes, y up [m/s^2]",
        },
        "emg": _EMG,
        "trials": {
            "type": "object",
            "additionalProperties": _TRIAL,
            "description": "stems of trial files",
        },
    },
    "schema",
    "id",
    "side",
    "model",
    "gravity_in_thorax_mps2",
    description="keys schema, id, side, model, gravity_in_thorax_mps2, optionally emg and trials",
)

# Only what scaling needs; the tables hold more.
SCALED_FILE_SCHEMA: dict[str, Any] = {
    "type": "object",
    "required": ["bodies", "segment_scale"],
    "description": "a table of scaled segments with the keys bodies and segment_scale",
    "properties": {
        "bodies": {
            "type": "array",
            "items": {
                "type": "object",
                "required": ["name", "mass_kg"],
                "description": "name and mass_kg of a segment",
                "properties": {
                    "name": {"type": "string"},
                    # The heaviest person that is believed, as in the short file.
                    "mass_kg": {"type": "number", "exclusiveMinimum": 0, "maximum": 300},
                },
            },
        },
        "segment_scale": {
            "type": "array",
            "items": {
                "type": "object",
                "required": ["segment", "scale_xyz"],
                "description": "segment and its scale_xyz",
                "properties": {
                    "segment": {"type": "string"},
                    "scale_xyz": {
                        "type": "array",
                        "items": {"type": "number", "minimum": 0.5, "maximum": 2},
                        "minItems": 3,
                        "maxItems": 3,
                        "description": "size over base model along x, y, z",
                    },
                },
            },
        },
    },
}
