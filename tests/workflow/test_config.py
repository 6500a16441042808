"""Every key of the configuration is explained: in its schema and beside its value."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

pytestmark = pytest.mark.workflow

Schema = dict[str, Any]


@pytest.fixture(scope="module")
def schema(repository: Path) -> Schema:
    return yaml.safe_load((repository / "workflow/schemas/config.schema.yaml").read_text("utf-8"))


def properties(schema: Schema, path: str = "") -> Iterator[tuple[str, Schema]]:
    """Dotted name and schema of every key, nested ones too."""
    for name, child in schema.get("properties", {}).items():
        yield f"{path}{name}", child
        yield from properties(child, f"{path}{name}.")


def test_objects_are_closed_and_complete(schema: Schema) -> None:
    objects = [schema, *(child for _, child in properties(schema) if child.get("properties"))]
    for child in objects:
        assert child["additionalProperties"] is False
        assert set(child["required"]) == set(child["properties"])


def test_everything_is_described(schema: Schema) -> None:
    """The refusal of a value quotes the description of its schema."""
    children = [child for _, child in properties(schema)]
    items = [child["items"] for child in children if "items" in child]
    for child in [schema, *children, *items, *schema["$defs"].values()]:
        assert child["description"]


def test_every_key_states_its_unit(schema: Schema) -> None:
    for name, child in properties(schema):
        is_section = "properties" in child
        assert is_section or child["description"].rstrip(".").endswith("]"), name


@pytest.mark.parametrize("name", ["config.yaml", "quick.yaml"])
def test_every_key_has_a_comment(repository: Path, name: str) -> None:
    lines = (repository / "config" / name).read_text("utf-8").splitlines()
    for before, line in zip(["", *lines], lines, strict=False):
        is_key = line.strip() and not line.lstrip().startswith("#") and not line.endswith(":")
        assert not is_key or before.lstrip().startswith("#"), line


def test_quick_study_differs_in_selection_only(repository: Path) -> None:
    """So it shares all results with the full study and never makes them stale."""
    quick = yaml.safe_load((repository / "config/quick.yaml").read_text("utf-8"))
    selections = {
        "report",
        "participants",
        "planes",
        "formulations",
        "prediction",
        "variants",
        "validation",
        "diagnose",
    }
    assert quick.keys() <= selections
    assert quick["prediction"].keys() <= {"predict", "predict_also"}
    assert quick["variants"].keys() <= {"predict"}
    assert quick["validation"].keys() <= {"tasks"}
