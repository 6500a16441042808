"""Tests on results read the participants of the study, wherever these are."""

import runpy
from pathlib import Path

import pytest
from places import REPOSITORY

pytestmark = pytest.mark.unit


def test_what_was_measured_is_said_by_the_participants_of_the_study(tmp_path: Path) -> None:
    tests = runpy.run_path(str(REPOSITORY / "tests/results/test_coordination_results.py"))
    person = tmp_path / "people" / "ann" / "participant.yaml"
    envelope = tmp_path / "emg" / "ann" / "raise_envelope.csv"
    for path in (person, envelope):
        path.parent.mkdir(parents=True)
    person.write_text("emg: {trials: {raise: raise_emg.csv}}\n", encoding="utf-8")
    files = {"participants": str(person), "envelopes": [str(envelope)]}
    envelope.write_text("time,simulated\n0.0,False\n", encoding="utf-8")
    tests["test_simulated_envelopes_say_so"](files)
    envelope.write_text("time,simulated\n0.0,True\n", encoding="utf-8")
    with pytest.raises(AssertionError):
        tests["test_simulated_envelopes_say_so"](files)
