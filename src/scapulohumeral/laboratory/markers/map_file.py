"""Reading of the YAML maps that tell how a laboratory's recordings are meant."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from scapulohumeral.documents import check_schema, read_mapping

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
    check_schema(path, document, schema, "see the help of the command, which shows an example")
    return document


def kind_of_map(path: Path) -> str:
    """What a map says of itself under `schema`, such as "marker_map/1"; empty if nothing."""
    return str(_load(path).get("schema", ""))


def _load(path: Path) -> dict[str, Any]:
    remedy = "Check the name, and the line named."
    return read_mapping(path, "'schema: marker_map/1' and others", remedy)
