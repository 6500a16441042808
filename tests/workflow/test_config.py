"""Every key of the configuration is explained: where it is defined and beside its value."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from scapulohumeral.configuration.benchmarks import BlindBenchmark, SolverBenchmark
from scapulohumeral.configuration.check import schema
from scapulohumeral.configuration.recovery import Recovery
from scapulohumeral.configuration.sections import StudyConfig
from scapulohumeral.configuration.sensitivity import Sensitivity
from scapulohumeral.gap.settings import GapSection

pytestmark = pytest.mark.workflow

Schema = dict[str, Any]
FILES = {
    "config.yaml": StudyConfig,
    "gap/settings.yaml": GapSection,
    "gap/blind.yaml": BlindBenchmark,
    "bench.yaml": SolverBenchmark,
    "sensitivity.yaml": Sensitivity,
    "recovery.yaml": Recovery,
}


def keys(whole: Schema, here: Schema, path: str = "") -> Iterator[tuple[str, Schema]]:
    """Dotted name and schema of every key, nested ones too."""
    here = {**whole["$defs"][here["$ref"].rpartition("/")[2]], **here} if "$ref" in here else here
    for name, child in here.get("properties", {}).items():
        if "$ref" in child:
            child = {**whole["$defs"][child["$ref"].rpartition("/")[2]], **child}
        yield f"{path}{name}", child
        yield from keys(whole, child, f"{path}{name}.")
    for child in here.get("patternProperties", {}).values():
        yield from keys(whole, child, f"{path}*.")


@pytest.fixture(params=FILES)
def kind(request: pytest.FixtureRequest) -> type:
    return FILES[request.param]


def test_sections_are_closed_and_values_have_one_place(kind: type) -> None:
    """No key that nobody reads; no value that stands in code, too, but those that may be absent."""
    whole = schema(kind)
    absent = set()
    for section in (whole, *whole.get("$defs", {}).values()):
        assert section["additionalProperties"] is False
        assert section["description"]
        absent |= set(section["properties"]) - set(section["required"])
    assert absent <= {"girdle_stiffness_Nm_per_rad"}


def test_every_key_is_described_and_states_its_unit(kind: type) -> None:
    whole = schema(kind)
    described = dict(keys(whole, whole))
    assert len(described) >= 1
    for name, child in described.items():
        assert child["description"], name
        assert "$ref" in child or child["description"].rstrip(".").endswith("]"), name


def test_every_number_has_a_range(kind: type) -> None:
    """One that refuses something: no unit needs more than six decades above one."""
    whole = schema(kind)
    for name, child in keys(whole, whole):
        numbers = [one for one in (child, *child.get("anyOf", ())) if one.get("type") == "number"]
        for number in numbers:
            assert number.keys() & {"minimum", "exclusiveMinimum"}, name
            assert number.get("maximum", number.get("exclusiveMaximum")) <= 1.0e6, name


@pytest.mark.parametrize("name", [*FILES, "quick.yaml"])
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
    assert quick["prediction"].keys() <= {"predict", "predict_also", "tasks"}
    assert quick["variants"].keys() <= {"predict"}
    assert quick["validation"].keys() <= {"tasks"}
