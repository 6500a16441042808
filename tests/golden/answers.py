"""Golden cases: answer them with the command as a user runs it, and compare answers.

Answers are compared where a reader looks, each quantity with a tolerance of its own; names of
files, hashes and wording are left out.
"""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

REPOSITORY = Path(__file__).resolve().parents[2]
CASES = Path(__file__).parent / "cases"
NAMES = tuple(sorted(path.name for path in CASES.iterdir()))
RESULT = "result.json"

# Of probabilities, p-values and shares of the gap [1].
PROBABILITY = 0.02
# Of test values, sizes and smallest detectable amplitudes, relative.
SIZE = 0.02
# Of amplitudes, in widths of their 95 % interval: what counts is small against the uncertainty.
AMPLITUDE = 0.02
# Candidates below this probability carry no message, and their order is chance.
NEGLIGIBLE = 0.02
# Regions below this share of the gap may come and go.
LEAST_SHARE = 0.05


def answer(case: Path, folder: Path, cache: Path) -> subprocess.CompletedProcess[str]:
    """Diagnose a case by the command, in a process of its own.

    Parameters
    ----------
    case : folder with ``participant.yaml``, ``test`` and, if there are any, ``reference``
    folder : for settings and answer, ``folder/out``
    cache : of participants' models; several processes may share it
    """
    command = [sys.executable, "-m", "scapulohumeral.gap.cli", "gap", "diagnose"]
    command += _tables(case / "test")
    references = _tables(case / "reference")
    command += ["--reference", *references] if references else []
    command += ["--participant", str(case / "participant.yaml"), "--out", str(folder / "out")]
    command += ["--settings", str(_settings(folder)), "--cache", str(cache), "--threads", "2"]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def _tables(folder: Path) -> list[str]:
    """Files of all trials, companions too: the command tells them apart."""
    return [str(path) for path in sorted(folder.glob("*.csv"))]


def _settings(folder: Path) -> Path:
    """The settings of diagnoses with what ``settings.yaml`` changes."""
    usual = REPOSITORY / "config" / "gap" / "settings.yaml"
    settings = yaml.safe_load(usual.read_text(encoding="utf-8"))
    changes = yaml.safe_load((Path(__file__).parent / "settings.yaml").read_text(encoding="utf-8"))
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "settings.yaml"
    path.write_text(yaml.safe_dump(_changed(settings, changes)), encoding="utf-8")
    return path


def _changed(config: Any, changes: Any) -> Any:
    """A configuration with some keys replaced, at any depth; every one must be there already."""
    if not isinstance(changes, Mapping):
        return changes
    unknown = changes.keys() - config.keys()
    if unknown:
        raise KeyError(
            f"settings.yaml: {', '.join(sorted(unknown))} not in config/gap/settings.yaml"
        )
    return {
        key: _changed(value, changes[key]) if key in changes else value
        for key, value in config.items()
    }


def differences(found: Mapping[str, Any], expected: Mapping[str, Any]) -> list[str]:
    """What a reader would take from one ``result.json`` and not from the other, by sentence."""
    wanted = dict(_quantities(expected))
    given = dict(_quantities(found))
    missing = [f"{place}: missing" for place in wanted.keys() - given.keys()]
    added = [f"{place}: not expected" for place in given.keys() - wanted.keys()]
    apart = [
        f"{place}: {given[place][0]}; expected {value} +- {tolerance:.2g}"
        for place, (value, tolerance) in wanted.items()
        if place in given and not _agree(given[place][0], value, tolerance)
    ]
    return sorted([*missing, *added, *apart])


def _agree(found: Any, expected: Any, tolerance: float) -> bool:
    if isinstance(expected, bool) or not isinstance(expected, int | float):
        return found == expected
    return isinstance(found, int | float) and math.isclose(
        found, expected, rel_tol=0.0, abs_tol=tolerance
    )


# Place in the answer, value, and absolute tolerance.
Quantities = Iterator[tuple[str, tuple[Any, float]]]


def _quantities(document: Mapping[str, Any]) -> Quantities:
    for name in ("status", "mode", "hint", "set90"):
        value = document[name]
        yield name, (sorted(value) if name == "set90" else value, 0.0)
    for name in ("none_p", "no_gap_p"):
        yield name, (document[name], PROBABILITY)
    yield from _gap(document["gap"])
    yield from _regions(document["regions"])
    yield from _candidates(document["candidates"])
    for name, value in _leaves("shrinkage", document["shrinkage"]):
        relative = SIZE * abs(value) if isinstance(value, float) else 0.0
        yield name, (value, PROBABILITY if name.endswith(".value") else relative)
    for i, group in enumerate(document["classes"][:1]):
        yield f"classes[{i}].labels", (sorted(group["labels"]), 0.0)
        yield f"classes[{i}].p", (group["p"], PROBABILITY)


def _gap(gap: Mapping[str, Any]) -> Quantities:
    for name in ("present", "statistic"):
        yield f"gap.{name}", (gap[name], 0.0)
    yield "gap.p_value", (gap["p_value"], PROBABILITY)
    for name in ("value", "threshold"):
        yield f"gap.{name}", (gap[name], SIZE * abs(gap[name]))
    for entry in gap["smallest_detectable"]:
        place = f"gap.smallest_detectable.{entry['label']}.{entry['parameter']}"
        yield place, (entry["value"], SIZE * abs(entry["value"]))


def _regions(regions: Mapping[str, Any]) -> Quantities:
    """Regions by name and start."""
    for place, key in (("shows", "channel"), ("enters", "name")):
        for region in regions[place]:
            if region["share"] < LEAST_SHARE:
                continue
            start = round(region["phase_percent"][0])
            name = f"regions.{place}.{region[key]} from {start} %"
            yield f"{name}.share", (region["share"], PROBABILITY)
            yield f"{name}.effect", (region["effect"], SIZE * abs(region["effect"]))


def _candidates(candidates: list[Mapping[str, Any]]) -> Quantities:
    for i, candidate in enumerate(candidates):
        if i and candidate["p"] < NEGLIGIBLE:
            continue
        place = f"candidates.{candidate['label']}"
        yield f"{place}.p", (candidate["p"], PROBABILITY)
        yield f"{place}.unexplained_share", (candidate["unexplained_share"], PROBABILITY)
        for parameter in candidate["parameters"]:
            low, high = parameter["ci95"]
            tolerance = AMPLITUDE * (high - low)
            yield f"{place}.{parameter['name']}", (parameter["value"], tolerance)
            yield f"{place}.{parameter['name']}.low", (low, tolerance)
            yield f"{place}.{parameter['name']}.high", (high, tolerance)


def _leaves(place: str, node: Any) -> Iterator[tuple[str, Any]]:
    """Places and values of everything below a node that is no mapping and no list."""
    if isinstance(node, Mapping):
        for key, value in node.items():
            yield from _leaves(f"{place}.{key}", value)
    elif isinstance(node, list):
        for i, value in enumerate(node):
            yield from _leaves(f"{place}[{i}]", value)
    else:
        yield place, node
