"""The file of weights is read as it was written, and refused with place and remedy otherwise."""

import json
from dataclasses import asdict, replace

import pytest
from gap_movement import SETTINGS

from scapulohumeral.errors import ConfigError
from scapulohumeral.gap.weighing import SCHEMA, Weighing, read_weighing

pytestmark = pytest.mark.unit

WEIGHTS = {
    "evidence": 0.2,
    "held_out": 0.3,
    "unknown": 0.4,
    "misled": 0.1,
    "foreign": 0.1,
    "moved": 0.1,
    "moving": 0.1,
    "fading": 0.2,
    "silent": 0.9,
    "silent_motion": 0.6,
    "silent_alone": 0.7,
    "silent_power": 0.5,
    "least": 0.02,
}


def written(folder, schema=SCHEMA, **changes):
    """A file of weights; None leaves one out."""
    weights = {k: v for k, v in {**WEIGHTS, **changes}.items() if v is not None}
    path = folder / "calibration.json"
    path.write_text(json.dumps({"schema": schema, "weights": weights}), encoding="utf-8")
    return path


def test_weights_are_those_of_the_file(tmp_path):
    assert asdict(read_weighing(written(tmp_path))) == WEIGHTS


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"misled": 1.2}, "misled: 1.2; expected 0 to 1"),
        ({"silent": -0.1}, "silent: -0.1; expected 0 to 1"),
        ({"unknown": float("nan")}, "unknown: nan; expected 0 to 1"),
        ({"evidence": 0.0, "held_out": 0.0}, "expected one above 0"),
    ],
)
def test_what_is_no_weight_is_refused(tmp_path, change, said):
    with pytest.raises(ConfigError, match=said) as error:
        read_weighing(written(tmp_path, **change))
    assert "Calibrate again" in str(error.value) or "calibrate again" in str(error.value)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"schema": "gap-calibration/0"}, "gap-calibration/0, expected gap-calibration/5"),
        ({"held_out": None}, "held_out"),
        ({"misled": "much"}, "much"),
        ({"misled": [0.1]}, "list"),
    ],
)
def test_bad_files_are_refused_with_place_and_remedy(tmp_path, change, said):
    path = written(tmp_path, **change)
    with pytest.raises(ConfigError, match=said) as error:
        read_weighing(path)
    assert str(path) in str(error.value)
    assert "gap calibrate" in str(error.value)


@pytest.mark.parametrize("text", ["", "[]", "{", '{"schema": "gap-calibration/1"}', "3"])
def test_files_that_hold_no_weights_are_refused(tmp_path, text):
    path = tmp_path / "calibration.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match="expected weights as"):
        read_weighing(path)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"no\.json.*Restore the file"):
        read_weighing(tmp_path / "no.json")
    with pytest.raises(ConfigError, match=r"gap/no\.json"):
        _ = replace(SETTINGS, calibration="gap/no.json").weighing


def test_the_committed_weights_can_be_read():
    assert isinstance(SETTINGS.weighing, Weighing)
