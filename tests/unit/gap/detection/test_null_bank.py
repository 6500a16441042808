"""Thresholds from effect-free cases: never lowered, refused when stale, honest about few cases."""

import json
from dataclasses import replace

import pytest
from gap_movement import SETTINGS

from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.gap import cli
from scapulohumeral.gap.benchmark.null_bank_probe import recomputed
from scapulohumeral.gap.detection.null_bank import (
    UNCHECKED,
    NullBank,
    NullCase,
    Probe,
    bank_hash,
    inflation,
    load_bank,
    read_bank,
    write_bank,
)
from scapulohumeral.gap.settings import read_diagnosis_config, read_settings
from scapulohumeral.provenance import CONFIG_FOLDER

pytestmark = pytest.mark.unit


def bank(values, mode="reference", emg=False, contact=False):
    return NullBank("h", tuple(NullCase(mode, emg, contact, 0.1, value, 0.2) for value in values))


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
        assert factor == UNCHECKED >= 1.0
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
    assert read_bank(path, SETTINGS)[1].startswith("no null bank of effect-free cases")
    rows = (
        NullCase("reference", True, False, 0.4, 0.7, 0.6),
        NullCase("no_reference", False, True, 0.2, 1.1, 0.3),
    )
    write_bank(path, rows, SETTINGS, (STORED,))
    found, reason = read_bank(path, SETTINGS)
    assert (found.cases, found.probes, reason) == (rows, (STORED,), "")
    # What follows the tests does not matter.
    assert read_bank(path, replace(SETTINGS, calibration="gap/other.json", refits=0))[0] == found
    found, reason = read_bank(path, replace(SETTINGS, alpha=0.01))
    assert found is None
    assert "other code or settings" in reason
    path.write_text("{}")
    with pytest.raises(ConfigError, match="expected a null bank"):
        read_bank(path, SETTINGS)


def test_whole_numbers_and_tuples_are_the_same_settings():
    """As a configuration file may spell them."""
    spelled = replace(SETTINGS, nodes=float(SETTINGS.nodes), geometry={"scapula_turn_deg": (0, 1)})
    assert bank_hash(spelled) == bank_hash(
        replace(SETTINGS, geometry={"scapula_turn_deg": [0.0, 1.0]})
    )


def test_the_committed_bank_fits_code_and_configuration(capsys):
    """If it does not, thresholds are raised by a guess, and all who diagnose are warned."""
    assert cli.main(["gap", "bank", "check"]) == 0, capsys.readouterr().out


def probe(case, *ratios):
    kinds = (("reference", True), ("no_reference", False))
    rows = (
        NullCase(mode, emg, False, *three)
        for (mode, emg), three in zip(kinds, ratios, strict=False)
    )
    return Probe(case, tuple(rows))


STORED = probe("a1", (0.9, 1.2, 0.8), (0.4, 0.1, 0.6))


@pytest.mark.parametrize(
    ("now", "agrees"),
    [
        (STORED, [True, True]),
        (probe("a1", (0.9, 1.211, 0.8), (0.4, 0.104, 0.6)), [True, True]),
        (probe("a1", (0.9, 1.22, 0.8), (0.4, 0.1, 0.6)), [False, True]),
        (probe("a1", (0.9, 1.2, 0.82), (0.4, 0.1, 0.6)), [False, True]),
        (probe("a1", (0.9, 1.2, 0.8), (0.4, 0.107, 0.6)), [True, False]),
        (probe("a1", (0.9, 1.2, 0.8)), [True, False]),
    ],
)
def test_rows_of_a_probe_agree_within_the_tolerance(tmp_path, now, agrees):
    (tmp_path / "a1").mkdir()
    bank = NullBank("h", (), (STORED,))
    rows = recomputed(bank, 1, tmp_path, lambda folder: now, seed=1)
    assert [row.agrees for row in rows] == agrees
    assert [("DIFFERS" in str(row)) for row in rows] == [not one for one in agrees]


def test_probes_are_chosen_by_the_seed_and_must_be_there(tmp_path):
    bank = NullBank("h", (), tuple(probe(name, (1.0, 1.0, 1.0)) for name in "abcdefgh"))
    asked = []

    def computed(folder):
        asked.append(folder.name)
        return probe(folder.name, (1.0, 1.0, 1.0))

    with pytest.raises(DataError, match="no case"):
        recomputed(bank, 3, tmp_path, computed, seed=1)
    for name in "abcdefgh":
        (tmp_path / name).mkdir()
    draws = [recomputed(bank, 3, tmp_path, computed, seed) for seed in (1, 1, 2)]
    names = [[row.case for row in rows] for rows in draws]
    assert names[0] == names[1] != names[2]
    with pytest.raises(ConfigError, match="8 probes"):
        recomputed(bank, 9, tmp_path, computed, seed=1)


@pytest.fixture
def stale(tmp_path, monkeypatch):
    """A bank of two probes that other code has built, and its folder of cases."""
    file = tmp_path / "null_bank.json"
    monkeypatch.setattr("scapulohumeral.gap.detection.null_bank.bank_file", lambda settings: file)
    config = read_diagnosis_config(CONFIG_FOLDER / "config.yaml")
    write_bank(file, STORED.rows, read_settings(config), (STORED,))
    file.write_text(file.read_text().replace(json.loads(file.read_text())["hash"], "0" * 64))
    (tmp_path / "cases" / "a1").mkdir(parents=True)
    return tmp_path


def check(stale, *more):
    return cli.main(["gap", "bank", "check", *more, "--cases", str(stale / "cases")])


def test_rows_that_agree_renew_the_hash_and_no_others_do(stale, monkeypatch, capsys):
    before = (stale / "null_bank.json").read_text()
    assert cli.main(["gap", "bank", "check"]) == 2
    other = probe("a1", (0.9, 1.3, 0.8), (0.4, 0.1, 0.6))
    monkeypatch.setattr(
        "scapulohumeral.gap.benchmark.null_bank_build.probe", lambda *_, **__: other
    )
    assert check(stale, "--recompute", "1", "--stamp") == 2
    assert "DIFFERS" in capsys.readouterr().out
    assert (stale / "null_bank.json").read_text() == before
    monkeypatch.setattr(
        "scapulohumeral.gap.benchmark.null_bank_build.probe", lambda *_, **__: STORED
    )
    assert check(stale, "--recompute", "1") == 2, "rows agree, but nobody asked for a new hash"
    assert check(stale, "--recompute", "1", "--stamp") == 0
    assert load_bank(stale / "null_bank.json").probes == (STORED,)


def test_probes_are_added_to_a_bank_that_fits_only(stale, monkeypatch, capsys):
    added = probe("b2", (0.5, 0.6, 0.4), (0.7, 0.8, 0.3))
    monkeypatch.setattr(
        "scapulohumeral.gap.benchmark.null_bank_build.probe", lambda *_, **__: added
    )
    command = ["gap", "bank", "probe", "--cases", str(stale / "cases")]
    assert cli.main(command) == 2
    assert "would vouch for nothing" in capsys.readouterr().err
    settings = read_settings(read_diagnosis_config(CONFIG_FOLDER / "config.yaml"))
    write_bank(stale / "null_bank.json", STORED.rows, settings, (STORED,))
    assert cli.main(command) == 0
    assert load_bank(stale / "null_bank.json").probes == (STORED, added)


@pytest.mark.parametrize("options", [["--stamp"], ["--recompute", "1"]])
def test_half_a_request_is_refused(options, capsys):
    assert cli.main(["gap", "bank", "check", *options]) == 2
    assert "expected both" in capsys.readouterr().err or "--stamp" in options
