"""Configuration files read, and refused with key, reason, meaning and a line that would do."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from scapulohumeral.configuration.benchmarks import BlindBenchmark, SolverBenchmark
from scapulohumeral.configuration.fields import Section
from scapulohumeral.configuration.real_cases import RealCases
from scapulohumeral.configuration.recovery import Recovery
from scapulohumeral.configuration.sections import StudyConfig
from scapulohumeral.configuration.sensitivity import Sensitivity
from scapulohumeral.configuration.simulator import Simulator
from scapulohumeral.documents import expected, read_yaml
from scapulohumeral.errors import ConfigError
from scapulohumeral.provenance import CONFIG_FOLDER

# The committed files: what is refused elsewhere is shown as it stands there.
STUDY = CONFIG_FOLDER / "config.yaml"
BLIND = CONFIG_FOLDER / "gap" / "blind.yaml"
BENCH = CONFIG_FOLDER / "bench.yaml"
SENSITIVITY = CONFIG_FOLDER / "sensitivity.yaml"
RECOVERY = CONFIG_FOLDER / "recovery.yaml"
REAL_CASES = CONFIG_FOLDER / "gap" / "real_cases.yaml"
SIMULATOR = CONFIG_FOLDER / "gap" / "simulators" / "study.yaml"

REMEDY = "Expected a YAML file of the configuration."

Kind = TypeVar("Kind", bound=Section)
Place = Sequence[str | int]
Schema = Mapping[str, Any]


def read_config(path: Path = STUDY) -> dict[str, Any]:
    """The configuration of the study in a file.

    Raises
    ------
    ConfigError                      it cannot be read, or a value is refused
    """
    content = read_yaml(path, REMEDY)
    check_config(content, f"{path}, ")
    return content


def check_config(content: Any, file: str = "") -> None:
    """Refuse a configuration of the study with an unknown, missing or impossible key.

    Raises
    ------
    ConfigError                      key, reason, meaning, and a line that would do
    """
    checked(StudyConfig, content, file, STUDY)


def read_blind(path: Path = BLIND) -> BlindBenchmark:
    """How blind cases are drawn."""
    return checked(BlindBenchmark, read_yaml(path, REMEDY), f"{path}, ", BLIND)


def read_bench(path: Path = BENCH) -> SolverBenchmark:
    """How the solver is measured."""
    return checked(SolverBenchmark, read_yaml(path, REMEDY), f"{path}, ", BENCH)


def read_sensitivity(path: Path = SENSITIVITY) -> Sensitivity:
    """What is changed in one prediction to see how far it depends on it."""
    return checked(Sensitivity, read_yaml(path, REMEDY), f"{path}, ", SENSITIVITY)


def read_recovery(path: Path = RECOVERY) -> Recovery:
    """To whose EMG a model is calibrated to see what it recovers."""
    return checked(Recovery, read_yaml(path, REMEDY), f"{path}, ", RECOVERY)


def read_real_cases(path: Path = REAL_CASES) -> RealCases:
    """Which cases of known cause are diagnosed.

    Raises
    ------
    ConfigError                      a key is refused, or a case names a person that is not there
    """
    found = checked(RealCases, read_yaml(path, REMEDY), f"{path}, ", REAL_CASES)
    for name, case in found.cases.items():
        if case.person not in found.people:
            raise ConfigError(
                f"Configuration, {path}, key 'cases.{name}.person': '{case.person}'; expected one "
                f"of {', '.join(found.people)}. Correct the name, or describe the person."
            )
        if (case.spoilt is None) == (case.kind == "artefact"):
            raise ConfigError(
                f"Configuration, {path}, key 'cases.{name}.spoilt': expected for kind artefact, "
                f"and for no other; found kind {case.kind}. Name the error, or correct the kind."
            )
        if case.simulator is not None and (case.kind, case.view) != ("simulation", "prediction"):
            raise ConfigError(
                f"Configuration, {path}, key 'cases.{name}.simulator': expected for kind "
                f"simulation and view prediction; found {case.kind} and {case.view}. Leave it out."
            )
    return found


def read_simulator(path: Path) -> Simulator:
    """What made simulations.

    Raises
    ------
    ConfigError                      it cannot be read, or a key is refused
    """
    return checked(Simulator, read_yaml(path, REMEDY), f"{path}, ", SIMULATOR)


def checked(kind: type[Kind], content: Any, file: str, example: Path) -> Kind:
    """Content of a configuration file as the sections that it should have.

    Parameters
    ----------
    kind : what the file holds
    content : of the file
    file : what a message starts with
    example : file of the same kind with values that are allowed

    Raises
    ------
    ConfigError                      key, reason, meaning, and a line that would do
    """
    try:
        return TypeAdapter(kind).validate_python(content)
    except ValidationError as errors:
        worst = min(errors.errors(include_url=False), key=_rank)
        raise ConfigError(_sentence(kind, worst, file, example)) from None


def schema(kind: type[Section]) -> dict[str, Any]:
    """JSON schema of a kind of file."""
    return TypeAdapter(kind).json_schema()


def _rank(error: ErrorDetails) -> int:
    """A misspelt key makes another one missing: the slip is said, not what follows from it."""
    if error["loc"][-1:] == ("[key]",):
        return 0
    return {"unexpected_keyword_argument": 0, "missing": 1}.get(error["type"], 2)


def _sentence(kind: type[Section], error: ErrorDetails, file: str, example: Path) -> str:
    place = [part for part in error["loc"] if part != "[key]"]
    whole = schema(kind)
    here, above = _described(whole, place), _described(whole, place[:-1])
    allowed = list(above.get("properties", {}))
    name = str(place[-1]) if place else ""
    where = f"Configuration, {file}" + (f"key '{'.'.join(map(str, place))}'" if place else "")
    if not place:
        return f"{where}no keys; expected {', '.join(whole['properties'])}, as in {example.name}."
    if error["type"] == "unexpected_keyword_argument":
        close = get_close_matches(name, allowed, 1)
        meant = f" Did you mean '{close[0]}'?" if close else ""
        fault = f"no such key.{meant} Keys there are: {', '.join(allowed)}."
        place = [*place[:-1], *(close or allowed[:1])]
        here = _described(whole, place)
    elif error["type"] == "missing":
        fault = "is missing; it is required."
    else:
        fault = f"{error['input']!r}; {expected(error)}."
    return f"{where}: {fault} {_remedy(here, place, example, error['input'])}".rstrip()


def _remedy(here: Schema, place: Place, example: Path, refused: Any) -> str:
    """Meaning of a key, and its line in the committed file, unless that is what was refused."""
    meaning = here.get("description")
    text = f"Meaning: {meaning}" if meaning else ""
    value = _value(read_yaml(example, REMEDY), place)
    if value is None or value == refused or (isinstance(value, list) and refused in value):
        return text
    line = yaml.safe_dump(
        {_name(place): value}, default_flow_style=True, width=10**6, sort_keys=False
    )
    shown = line.strip().removeprefix("{").removesuffix("}")
    return f"{text} Write for example: {shown}" if len(shown) < 200 else text


def _name(place: Place) -> str:
    """The last key of a place; places in lists have none."""
    return str(next(part for part in reversed(place) if isinstance(part, str)))


def _value(content: Any, place: Place) -> Any:
    """What stands at a place of a file, at the list that holds it, or None."""
    for part in place:
        if isinstance(part, int):
            return content
        if not isinstance(content, dict) or part not in content:
            return None
        content = content[part]
    return content


def _described(whole: Schema, place: Iterable[str | int]) -> Schema:
    """Part of a schema at a place, with its description where it is used."""
    here: Schema = whole
    for part in place:
        if isinstance(part, int):
            inside = here.get("items", {})
        else:
            patterns = list(here.get("patternProperties", {}).values())
            inside = here.get("properties", {}).get(part) or (patterns or [{}])[0]
        here = _resolved(whole, inside)
    return here


def _resolved(whole: Schema, here: Schema) -> Schema:
    if "$ref" not in here:
        return here
    target = whole["$defs"][here["$ref"].rpartition("/")[2]]
    return {**target, **here}
