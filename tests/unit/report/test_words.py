"""Names of result files as a reader meets them."""

import re
from pathlib import Path

import pandas as pd
import pytest
import yaml
from places import REPOSITORY

from scapulohumeral.report.words import (
    GLOSSARY,
    STEPS,
    in_words,
    step_in_words,
    variant_in_words,
)

pytestmark = pytest.mark.unit

CONFIG = yaml.safe_load((REPOSITORY / "config/config.yaml").read_text(encoding="utf-8"))
TABLES = ("ladder", "sensitivity", "static_postures", "held_girdle", "tried")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("ur_15_deg", "upward rotation with the arm at 15 deg [deg]"),
        ("gh_force_rest_bw", "glenohumeral force rest [% body weight]"),
        ("in_band_share", "share in the healthy band [1]"),
        ("weight clavicle_point_m", "tracked point of the clavicle, from the sternum [m]"),
        ("status", "status"),
        ("s", "s"),
    ],
)
def test_names_become_words_with_their_unit(name: str, words: str) -> None:
    assert in_words(name) == words


def test_no_column_of_a_committed_table_stays_a_raw_name() -> None:
    for table in TABLES:
        columns = pd.read_csv(Path(REPOSITORY, f"reports/{table}.csv"), nrows=0).columns
        said = list(map(in_words, columns))
        assert not [name for name in said if "_" in name.replace("w_GH", "")]
        assert len(set(said)) == len(said)


def test_templates_name_no_participant_but_the_one_of_the_paper() -> None:
    """What is said of one of them is a result, and comes in from result files."""
    templates = sorted((REPOSITORY / "src/scapulohumeral/report").rglob("*.j2"))
    assert len(templates) >= 8
    assert not [path for path in templates if re.search(r"\bpar[13]\b", path.read_text("utf-8"))]


def test_every_step_of_the_ladder_and_every_variant_is_explained() -> None:
    assert set(CONFIG["variants"]["ladder"]["steps"]) == set(STEPS)
    assert step_in_words("of_others") == "of others"
    explained = {name for entry in GLOSSARY for name in entry.split(", ")}
    assert set(map(variant_in_words, CONFIG["variants"]["named"])) <= explained
