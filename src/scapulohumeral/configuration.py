"""The configuration of the study: read, and refused if its schema does not allow it."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import yaml
from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

from scapulohumeral.errors import ConfigError
from scapulohumeral.provenance import CONFIG_FOLDER

SCHEMA = CONFIG_FOLDER.parent / "workflow" / "schemas" / "config.schema.yaml"


def read_config(path: Path) -> dict[str, Any]:
    """The configuration in a file.

    Raises
    ------
    ConfigError                      it cannot be read, or the schema does not allow it
    """
    try:
        config = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, yaml.YAMLError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: {error}. Name the configuration with --config.") from error
    check_config(config, f"{path}, ")
    return config


def check_config(config: Any, place: str = "") -> None:
    """Refuse a configuration that its schema does not allow, naming key, reason and meaning.

    Parameters
    ----------
    config : content of a configuration file
    place : what the message starts with, such as the file

    Raises
    ------
    ConfigError                      with key, reason, keys that are allowed there, and meaning
    """
    error = best_match(_validator().iter_errors(config))
    if error is None:
        return
    key = ".".join(str(part) for part in error.absolute_path)
    allowed = ", ".join(error.schema.get("properties", {}))
    raise ConfigError(
        f"Configuration, {place}{f'key {key!r}' if key else 'top level'}: {error.message}. "
        + (f"Keys there are: {allowed}. " if allowed else "")
        + f"Meaning: {error.schema['description']}"
    )


@cache
def _validator() -> Draft202012Validator:
    return Draft202012Validator(yaml.safe_load(SCHEMA.read_text(encoding="utf-8")))
