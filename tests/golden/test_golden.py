"""Whole diagnoses on the model, from files to files, against the answers that were accepted.

What is allowed to change them is said in ``README.md``.
"""

import copy
import json
from collections.abc import Iterator
from pathlib import Path
from shutil import copytree
from types import SimpleNamespace

import pytest
from cached_equations import built_equations
from golden.answers import CASES, NAMES, RESULT, answer, differences

from scapulohumeral.gap.labels import matches
from scapulohumeral.gap.nominal import participant_model
from scapulohumeral.gap.nominal.participant_model import FORMULATION
from scapulohumeral.gap.result import read_result
from scapulohumeral.provenance import user_cache

pytestmark = pytest.mark.unit


@pytest.fixture(scope="session")
def model_cache(pytestconfig: pytest.Config) -> Iterator[Path]:
    """Where models are kept between test runs, under the hash of all they are made from.

    Equations there, as if it was the user's, are those of the other tests: building them takes a
    minute.
    """
    cache = pytestconfig.cache.mkdir("gap_models")
    built = built_equations(FORMULATION, pytestconfig.cache.mkdir("equations"))
    copied = SimpleNamespace(save=lambda target: copytree(built, target, dirs_exist_ok=True))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(cache))
        with patch.context() as building:
            building.setattr(participant_model.compiled, "build", lambda name: copied)
            participant_model.cached_equations(user_cache())
        yield cache


@pytest.mark.parametrize("name", NAMES)
def test_the_command_answers_as_accepted(name: str, tmp_path: Path, model_cache: Path) -> None:
    done = answer(CASES / name, tmp_path, model_cache)
    assert done.returncode == 0, done.stderr
    found = read_result(tmp_path / "out" / RESULT)
    assert differences(found, read_result(CASES / name / RESULT)) == []
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert found["candidates"][0]["label"] in page
    assert (tmp_path / "out" / "curves" / "shows.csv").stat().st_size > 0


@pytest.mark.parametrize("name", NAMES)
def test_answers_hold_the_truth_as_far_as_they_claim_one(name: str) -> None:
    """The named cause is the injected one, whose interval holds the amplitude, or of all members.

    An amplitude of all muscles is another than that of some.
    """
    truth = json.loads((CASES / name / "truth.json").read_text(encoding="utf-8"))["effects"]
    found = read_result(CASES / name / RESULT)
    assert found["gap"]["present"] == bool(truth)
    for effect in truth:
        [first, *_] = found["candidates"]
        assert matches(first["label"], effect["label"])
        if first["label"] == effect["label"]:
            [named] = [p for p in first["parameters"] if p["name"] == effect["parameter"]]
            assert named["ci95"][0] <= effect["amplitude"] <= named["ci95"][1]


def changed(document: dict, place: tuple, factor: float) -> dict:
    """A copy with one number multiplied."""
    document = copy.deepcopy(document)
    node = document
    for key in place[:-1]:
        node = node[key]
    node[place[-1]] *= factor
    return document


@pytest.mark.parametrize(
    "place",
    [
        ("gap", "value"),
        ("gap", "threshold"),
        ("gap", "smallest_detectable", 0, "value"),
        ("candidates", 0, "p"),
        ("candidates", 0, "unexplained_share"),
        ("candidates", 0, "parameters", 0, "value"),
        ("regions", "shows", 0, "effect"),
        ("shrinkage", "in_sample", "value"),
    ],
    ids=lambda place: ".".join(map(str, place)),
)
def test_a_change_of_a_tenth_is_seen(place: tuple) -> None:
    accepted = read_result(CASES / "reference_and_emg" / RESULT)
    assert differences(accepted, accepted) == []
    assert differences(changed(accepted, place, 1.001), accepted) == []
    assert len(differences(changed(accepted, place, 1.1), accepted)) == 1


def test_another_name_or_verdict_is_seen() -> None:
    accepted = read_result(CASES / "motion_alone" / RESULT)
    renamed = copy.deepcopy(accepted)
    renamed["candidates"][0]["label"] = "body/hand_load"
    assert differences(renamed, accepted)
    absent = copy.deepcopy(accepted)
    absent["gap"]["present"] = False
    assert differences(absent, accepted) == ["gap.present: False; expected True +- 0"]
