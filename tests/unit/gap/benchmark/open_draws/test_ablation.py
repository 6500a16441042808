"""Stages of the diagnosis side by side, on cases that each stage answers otherwise."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from open_cases import GAIN, START, TEAR, open_case

from scapulohumeral.gap.benchmark.open_draws import ablation
from scapulohumeral.gap.verdict.posterior import Score

pytestmark = pytest.mark.unit


class Case:
    """A scored case as far as ablation looks at it."""

    status = "single"
    right = (TEAR,)
    verdict_or_abstained = {  # noqa: RUF012 - never changed
        "candidates": [{"label": TEAR, "p": 0.6}, {"label": GAIN, "p": 0.3}],
        "none_p": 0.1,
        "no_gap_p": 0.0,
        "set90": [TEAR, GAIN],
    }
    baselines = {"screening": "body/strength_loss", "cosine": "x/y"}  # noqa: RUF012


def test_each_stage_is_judged_by_what_it_has_alone(tmp_path, monkeypatch) -> None:
    """Evidence speaks for the gain, tasks left out for the tear, by more."""
    known = open_case(-10.0)
    scores = {**known.scores, TEAR: Score(np.log(0.3), -10.0, 20.0)}
    pair = Case()
    pair.status = "pair"
    monkeypatch.setattr(ablation, "read_scored_cases", lambda _: [("one", Case()), ("one", pair)])
    monkeypatch.setattr(ablation, "open_case", lambda *_: replace(known, scores=scores))
    out = tmp_path / "ablation.csv"
    ablation.write_ablation({}, START, out)
    with out.open() as stream:
        rows = {row["stage"]: row for row in csv.DictReader(stream)}
    assert {row["cases"] for row in rows.values()} == {"1"}
    assert rows["screening"]["right"] == "1"
    assert rows["cosine"]["right"] == rows["prior_only"]["right"] == "0"
    assert rows["evidence of refitted effects"]["right"] == "0"
    assert rows["and tasks left out"]["right"] == "1"
    assert rows["the answer"]["set_size"] == "2.0"
    assert float(rows["the answer"]["log_score"]) == pytest.approx(np.log(0.6), abs=1e-3)


def test_stages_take_one_more_thing_into_account_each() -> None:
    found = list(ablation.stages(START).values())
    assert [w.held_out > 0 for w in found] == [False, True, True]
    for later in ("misled", "foreign", "moved"):
        assert [getattr(w, later) > 0 for w in found] == [False, False, getattr(START, later) > 0]
    assert found[-1] == START
