"""Thresholds from effect-free cases: never lowered, refused when stale, honest about few cases."""

from dataclasses import replace

import pytest
from gap_movement import SETTINGS

from scapulohumeral.errors import ConfigError
from scapulohumeral.gap.bank import (
    UNCHECKED,
    NullBank,
    NullCase,
    inflation,
    instructions,
    read_bank,
    write_bank,
)

pytestmark = pytest.mark.unit


def bank(values, mode="reference", emg=False, contact=False):
    return NullBank("h", tuple(NullCase(mode, emg, contact, 0.1, value) for value in values))


def test_thresholds_are_never_lowered():
    assert inflation(bank([0.2, 0.3]), "reference", False, False, 0.05)[0] == 1.0


def test_few_cases_raise_thresholds_to_their_largest_and_say_so():
    factor, remark = inflation(bank([0.2, 1.3, 0.9, 0.4]), "reference", False, False, 0.05)
    assert factor == 1.3
    assert "4 effect-free cases" in remark
    assert "at most 20 %" in remark


def test_many_cases_allow_the_false_alarms_asked_for():
    values = [1.0 + i / 100.0 for i in range(99)]
    factor, remark = inflation(bank(values), "reference", False, False, 0.05)
    assert factor == pytest.approx(values[94])
    assert "at most 5 %" in remark


def test_cases_of_another_mode_vouch_for_nothing():
    for known in (None, bank([0.5], mode="no_reference")):
        factor, remark = inflation(known, "reference", True, False, 0.05)
        assert factor == UNCHECKED["reference"] > 1.0
        assert "no effect-free case" in remark


def test_cases_with_the_same_sensors_count_if_there_are_enough():
    few, many = bank([1.4]).cases, bank([1.1] * 19, contact=True).cases
    known = NullBank("h", (*few, *many))
    assert inflation(known, "reference", False, True, 0.05)[0] == 1.1
    factor, remark = inflation(known, "reference", False, False, 0.05)
    assert factor == 1.4
    assert "20 effect-free cases" in remark
    assert inflation(NullBank("h", (*few, *many[:5])), "reference", True, True, 0.05)[0] == 1.4


def test_bank_of_other_settings_is_refused(tmp_path):
    path = tmp_path / "null_bank.json"
    assert read_bank(path, SETTINGS) == (None, "no null bank of effect-free cases")
    rows = (
        NullCase("reference", True, False, 0.4, 0.7),
        NullCase("no_reference", False, True, 0.2, 1.1),
    )
    write_bank(path, rows, SETTINGS)
    found, reason = read_bank(path, SETTINGS)
    assert (found.cases, reason) == (rows, "")
    # What follows the tests does not matter.
    assert read_bank(path, replace(SETTINGS, temperature=7.0, refits=0))[0] == found
    found, reason = read_bank(path, replace(SETTINGS, alpha=0.01))
    assert found is None
    assert "other code or settings" in reason
    path.write_text("{}")
    with pytest.raises(ConfigError, match="expected a null bank"):
        read_bank(path, SETTINGS)


SOURCE = '"""Doc."""\n\nSHARE = 0.3  # why\n\n\ndef half(x):\n    """Half."""\n    return x / 2\n'


def test_other_words_make_no_bank_stale():
    reworded = SOURCE.replace("Doc.", "Text.").replace("  # why", "").replace("Half.", "Of x.")
    assert instructions(reworded) == instructions(SOURCE)
    assert instructions('def nothing():\n    """Doc."""\n') == "def nothing():\n    pass"


@pytest.mark.parametrize(("old", "new"), [("0.3", "0.4"), ("x / 2", "x / 3"), ("half", "double")])
def test_other_instructions_do(old, new):
    assert instructions(SOURCE.replace(old, new)) != instructions(SOURCE)
