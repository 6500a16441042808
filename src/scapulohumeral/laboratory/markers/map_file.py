"""Reading of the YAML maps that tell how a laboratory's recordings are meant."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

from scapulohumeral.errors import ConfigError

AXES = ("+x", "-x", "+y", "-y", "+z", "-z")


def closed(properties: dict[str, Any], description: str, *required: str) -> dict[str, Any]:
    """Schema of a mapping with these keys and no others."""
    return {
        "type": "object",
        "properties": properties,
        "required": list(required),
        "additionalProperties": False,
        "description": description,
    }


def read_map(path: Path, schema: Mapping[str, Any]) -> dict[str, Any]:
    """Read and check a map.

    Raises
    ------
    ConfigError                      names file, key, what was expected, and the remedy
    """
    document = _load(path)
    fault = best_match(Draft202012Validator(schema).iter_errors(document))
    if fault is not None:
        place = ".".join(str(part) for part in fault.absolute_path) or "top level"
        hint = fault.schema.get("description", "see the README, section on own recordings")
        raise ConfigError(f"{path}, {place}: {fault.message}; expected: {hint}. Correct the entry.")
    return document


def kind_of_map(path: Path) -> str:
    """What a map says of itself under `schema`, such as "marker_map/1"; empty if nothing."""
    return str(_load(path).get("schema", ""))


def _load(path: Path) -> dict[str, Any]:
    try:
        document = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, yaml.YAMLError) as error:
        raise ConfigError(f"{path}: {error}. Check the name, and the line named.") from error
    if not isinstance(document, dict):
        raise ConfigError(f"{path}: no keys; expected 'schema: marker_map/1' and others.")
    return document
