"""Names of result files as a reader meets them."""

import re
from pathlib import Path

import pandas as pd
import pytest
import yaml
from places import REPOSITORY

from scapulohumeral.gap.detection.presence import GLR, MAX_T, ON_RECORD
from scapulohumeral.gap.detection.single_trials import ALONE, STATISTIC
from scapulohumeral.gap.effects import library, movement_strategy
from scapulohumeral.report.chapters import glossary
from scapulohumeral.report.gap.words import FAMILIES, TESTS, WORDS
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


def test_every_family_of_effects_and_every_test_of_a_gap_is_explained() -> None:
    modules = [*library.FAMILIES, movement_strategy]
    assert {module.__name__.rpartition(".")[2] for module in modules} == set(FAMILIES)
    assert {MAX_T, GLR, ON_RECORD, STATISTIC, ALONE} < set(TESTS)
    assert not set(WORDS) & set(GLOSSARY)
    meanings = [row[0] for row in glossary().rows]
    assert {"floor", "null bank", "placebo", "hand_load (family of effects)"} <= set(meanings)


def test_every_step_of_the_ladder_and_every_variant_is_explained() -> None:
    assert set(CONFIG["variants"]["ladder"]["steps"]) == set(STEPS)
    assert step_in_words("of_others") == "of others"
    explained = {name for entry in GLOSSARY for name in entry.split(", ")}
    assert set(map(variant_in_words, CONFIG["variants"]["named"])) <= explained
