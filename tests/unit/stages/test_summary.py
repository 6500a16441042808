"""The table of all tracking solves: a failed one keeps its row and has no results."""

import json
from pathlib import Path

import pytest

from scapulohumeral.stages.summary import COLUMNS, summarise

pytestmark = pytest.mark.unit


def test_failed_solves_have_no_results_in_the_table(tmp_path: Path) -> None:
    paths = []
    for status in ("optimal", "failed"):
        summary = dict.fromkeys(COLUMNS, 1.0) | {"status": status, "iterations": 7}
        paths.append(tmp_path / f"{status}.json")
        paths[-1].write_text(json.dumps(summary), encoding="utf-8")
    good, bad = summarise(paths).to_dict("records")
    assert good["rmse_clavicle_deg"] == good["objective"] == 1.0
    assert bad["iterations"] == 7
    assert bad["constraint_violation"] == 1.0
    unknown = [name for name, value in bad.items() if value != value]
    assert {"objective", "rmse_thoracohumeral_deg", "angle_scapula_deg", "norm_rmse"} <= set(
        unknown
    )
