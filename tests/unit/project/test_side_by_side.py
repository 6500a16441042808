"""The comparison with a former commit: which solves there are, and in which order."""

import importlib.util
from types import ModuleType

import pytest
import yaml
from places import REPOSITORY

pytestmark = pytest.mark.unit


@pytest.fixture(scope="module")
def compare() -> ModuleType:
    """The script, which is no module of the package."""
    path = REPOSITORY / "tests/side_by_side/compare.py"
    spec = importlib.util.spec_from_file_location("compare", path)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def config() -> dict:
    return yaml.safe_load((REPOSITORY / "config/config.yaml").read_text(encoding="utf-8"))


def test_every_solve_of_the_study_comes_once_and_after_its_neighbour(compare, config):
    cases = compare.all_cases(config)
    assert len(cases) == len(set(cases))
    assert sum(case.startswith("tracking/") for case in cases) == 18
    seen: set[str] = set()
    for case in cases:
        assert compare.neighbour_of(case, config) in {None, *seen}
        seen.add(case)


def test_a_chosen_case_brings_those_that_it_starts_from(compare, config):
    chosen = compare.with_neighbours(["prediction/par2/cuff_w10"], config)
    assert chosen == [f"prediction/par2/{name}" for name in ("healthy", "cuff_w2", "cuff_w10")]


def test_a_start_that_is_not_predicted_is_refused(compare, config):
    chosen = {"predict": [], "predict_also": {"par2": ["cuff_w2"]}}
    other = {**config, "prediction": {**config["prediction"], **chosen}}
    with pytest.raises(SystemExit, match="cuff_w2"):
        compare.all_cases(other)
