"""The report: whole, and readable without a network. Run by the rule test_results."""

import re
from pathlib import Path

import pandas as pd
import pytest

pytestmark = pytest.mark.results

LARGEST_BYTES = 20_000_000
REMOTE = re.compile(
    r"""(?:src|href|poster|data|action)\s*=\s*["']?\s*(?:https?:)?//|url\(\s*["']?(?:https?:)?//"""
    r"""|@import""",
    re.IGNORECASE,
)


@pytest.fixture(scope="module")
def html(files) -> str:
    """Text of the report."""
    return Path(files["report"]).read_text(encoding="utf-8")


def test_nothing_is_loaded_from_elsewhere(html: str) -> None:
    assert not REMOTE.search(html)
    assert "<link" not in html
    assert "<script src" not in html


def test_size(files) -> None:
    assert Path(files["report"]).stat().st_size < LARGEST_BYTES


def test_every_trial_is_shown(html: str, files) -> None:
    summary = pd.read_csv(files["summary"])
    for row in summary[["participant", "plane"]].drop_duplicates().itertuples():
        assert f'id="{row.participant}-{row.plane}"' in html
        assert f"Participant {row.participant}, {row.plane} plane" in html


def test_numbers_of_the_summary_are_shown(html: str, files) -> None:
    for objective in pd.read_csv(files["summary"]).objective:
        assert f"{objective:.5g}" in html
