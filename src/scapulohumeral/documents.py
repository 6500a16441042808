"""Documents in YAML and JSON read, or refused with file, key, reason and remedy."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import yaml
from jsonschema import Draft202012Validator
from jsonschema.exceptions import ValidationError as SchemaError
from jsonschema.exceptions import best_match
from pydantic_core import ErrorDetails, ValidationError

from scapulohumeral.errors import ConfigError, DataError, ModelError

if TYPE_CHECKING:
    from pydantic import TypeAdapter

Kind = TypeVar("Kind")
Refusal = type[ConfigError] | type[DataError] | type[ModelError]

# How the library begins to say what it expects.
SHOULD = re.compile(r"^(Input|Value|String|List|Dictionary) should( be| have)?")
LONGEST_VALUE = 80


class _OnceLoader(yaml.CSafeLoader):
    """Refuses a key that stands twice, of which the last would win silently.

    Parses in C, which is several times as fast: a plan of the study reads twenty such files.
    """

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """As inherited, but for keys that stand twice."""
        names = [key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode)]
        for name in names:
            if names.count(name) > 1:
                raise yaml.constructor.ConstructorError(
                    None, None, f"key '{name}' more than once", node.start_mark
                )
        return super().construct_mapping(node, deep)


def read_yaml(path: Path, remedy: str, refusal: Refusal = ConfigError) -> Any:
    """Content of a YAML file in which no key stands twice.

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
        # A loader that constructs nothing but plain data, as that of safe_load.
        return yaml.load(path.read_text(encoding="utf-8"), _OnceLoader)
    except UnicodeDecodeError as error:
        raise refusal(f"{path}: no text in UTF-8 ({error}). Save it as UTF-8.") from error
    except OSError as error:
        raise refusal(f"{path}: {error.strerror}. {remedy}") from error
    except yaml.YAMLError as error:
        raise refusal(f"{path}: cannot be read as YAML: {error}. {remedy}") from error


def read_mapping(
    path: Path, keys: str, remedy: str, refusal: Refusal = ConfigError
) -> dict[str, Any]:
    """Content of a YAML file with keys, of which `keys` names some; else as :func:`read_yaml`."""
    document = read_yaml(path, remedy, refusal)
    if not isinstance(document, dict):
        raise refusal(f"{path}: no keys; expected {keys}. Add them.")
    return document


def read_json(path: Path, remedy: str, refusal: Refusal = DataError) -> Any:
    """Content of a JSON file; as :func:`read_yaml`."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise refusal(f"{path}: {error.strerror}. {remedy}") from error
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise refusal(f"{path}: cannot be read as JSON: {error}. {remedy}") from error


def check_schema(path: Path, document: Any, schema: Mapping[str, Any], usual: str) -> None:
    """Refuse a document that a JSON Schema does not allow.

    Parameters
    ----------
    path : of the document
    document : its content
    schema : JSON Schema, draft 2020-12
    usual : what is expected where the schema has no description

    Raises
    ------
    ConfigError                      names file, key, and what was expected
    """
    faults = list(Draft202012Validator(schema).iter_errors(document))
    for one in faults:
        if one.validator == "additionalProperties" and "patternProperties" not in one.schema:
            _refuse_unknown(path, one)
    fault = best_match(faults)
    if fault is not None:
        place = ".".join(str(part) for part in fault.absolute_path) or "top level"
        hint = fault.schema.get("description", usual)
        raise ConfigError(f"{path}, {place}: {fault.message}; expected: {hint}. Correct the entry.")


def _refuse_unknown(path: Path, fault: SchemaError) -> None:
    """Refuse the first key that a schema does not know: mistyped, it looks like one that lacks."""
    known = list(fault.schema.get("properties", {}))
    for name in fault.instance:
        if name not in known:
            place = ".".join(map(str, (*fault.absolute_path, name)))
            near = get_close_matches(str(name), known, 1)
            remedy = f"Did you mean {near[0]}?" if near else f"Known are {', '.join(known)}."
            raise ConfigError(f"{path}, {place}: there is no such key. {remedy}")


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
