"""Documents in YAML and JSON read, or refused with file, key, reason and remedy."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import yaml
from pydantic_core import ErrorDetails, ValidationError

from scapulohumeral.errors import ConfigError, DataError, ModelError

if TYPE_CHECKING:
    from pydantic import TypeAdapter

Kind = TypeVar("Kind")
Refusal = type[ConfigError] | type[DataError] | type[ModelError]

# How the library begins to say what it expects.
SHOULD = re.compile(r"^(Input|Value|String|List|Dictionary) should( be| have)?")
LONGEST_VALUE = 80


def read_yaml(path: Path, remedy: str, refusal: Refusal = ConfigError) -> Any:
    """Content of a YAML file.

    Parameters
    ----------
    path : file
    remedy : what to do about a file that cannot be read, as a sentence
    refusal : kind of error that tells

    Raises
    ------
    ConfigError, DataError or ModelError, as `refusal` says: it cannot be read, or is no YAML
    """
    try:
        return yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, yaml.YAMLError, UnicodeDecodeError) as error:
        raise refusal(f"{path}: cannot be read as YAML: {error}. {remedy}") from error


def read_json(path: Path, remedy: str, refusal: Refusal = DataError) -> Any:
    """Content of a JSON file; as :func:`read_yaml`."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError, UnicodeDecodeError) as error:
        raise refusal(f"{path}: cannot be read as JSON: {error}. {remedy}") from error


def typed(
    kind: TypeAdapter[Kind], content: Any, path: Path, remedy: str, refusal: Refusal = ModelError
) -> Kind:
    """Content of a document as the type that it should have.

    Parameters
    ----------
    kind : of the document
    content : as read
    path : where it was read
    remedy, refusal : as in :func:`read_yaml`

    Raises
    ------
    ConfigError, DataError or ModelError, as `refusal` says: a key is unknown or missing, or its
    value is impossible
    """
    try:
        return kind.validate_python(content)
    except ValidationError as errors:
        fault = errors.errors(include_url=False)[0]
        key = ".".join(str(part) for part in fault["loc"]) or "top level"
        raise refusal(f"{path}, {key}: {reason(fault)} {remedy}") from None


def reason(fault: ErrorDetails) -> str:
    """Why a value was refused, as a sentence."""
    if fault["type"] == "unexpected_keyword_argument":
        return "there is no such key."
    if fault["type"] == "missing":
        return "is missing."
    shown = repr(fault["input"])
    shown = shown if len(shown) <= LONGEST_VALUE else f"{shown[:LONGEST_VALUE]} ..."
    return f"{shown}; {expected(fault)}."


def expected(fault: ErrorDetails) -> str:
    """What would be allowed, in plain words."""
    said = fault["msg"].removeprefix("Value error, ").replace(" after validation", "")
    return SHOULD.sub("expected", said)
