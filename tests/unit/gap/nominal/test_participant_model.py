"""Muscle geometry, which takes most of the time of a model, is made once for what it depends on."""

import logging
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from gap_files import elevation, write_csv
from places import REPOSITORY

from scapulohumeral.gap.nominal import participant_model as nominal
from scapulohumeral.gap.nominal.participant_model import ModelSettings, participant_model
from scapulohumeral.gap.recording.case import (
    DEFAULT_THREADS,
    GapParticipant,
    ScaledModel,
    make_case,
)
from scapulohumeral.gap.recording.trials import TrialEntry, read_trial
from scapulohumeral.model.participant_schema import SCALED_SEGMENTS

pytestmark = pytest.mark.unit
GEOMETRY = {"poses": 200, "length_target_m": 2e-4, "arm_target_m": 1e-3, "rmse_change_stop": 0.005}
CHOICES = {"serratus_path": "flattened", "fibres": "suspended"}
SETTINGS = ModelSettings(REPOSITORY / "config" / "model", CHOICES, GEOMETRY)


@pytest.fixture
def runs(monkeypatch):
    """Whether each run of the process of opensim had to sample; what it writes is nonsense."""
    asked = []

    def run(folder, processes):
        assert processes in (0, DEFAULT_THREADS)
        sampled = processes > 0
        asked.append(sampled)
        (folder / "model.json").write_text("{}")
        if sampled:
            (folder / "samples.npz").write_bytes(b"")

    def save(geometry, path):
        np.savez(path, geometry=geometry)

    def load(path):
        with np.load(path) as data:
            return data["geometry"].item()

    fits = iter(range(100))
    monkeypatch.setattr(nominal, "_run_opensim", run)
    monkeypatch.setattr(nominal, "read_record", lambda path: path)
    monkeypatch.setattr(
        nominal, "fit_muscle_geometry", lambda *_: SimpleNamespace(geometry=next(fits))
    )
    monkeypatch.setattr(nominal, "save_geometry", save)
    monkeypatch.setattr(nominal, "load_geometry", load)
    monkeypatch.setattr(nominal, "fit_thorax", lambda *files: files[-1].write_text("{}"))
    monkeypatch.setattr(nominal, "cached_equations", lambda cache: cache)
    monkeypatch.setattr(nominal.compiled, "load", lambda _: None)
    monkeypatch.setattr(nominal, "MuscleForces", lambda _, geometry: geometry)
    monkeypatch.setattr(nominal, "muscle_parameters", lambda _: None)
    return asked


@pytest.fixture
def case(tmp_path):
    """One test and one reference trial, of different height."""
    files = []
    for name, share in (("lift_r1", 1.0), ("lift_r2", 0.9)):
        table = elevation()
        table["GH_z"] *= share
        files.append(write_csv(table, tmp_path / f"{name}.csv"))
    test, reference = (read_trial(file, TrialEntry())[0] for file in files)
    model = ScaledModel(dict.fromkeys(SCALED_SEGMENTS, (0.9,) * 3), 36.0, {}, "published")
    person = GapParticipant("ann", "right", model, (0.0, -9.80665, 0.0), {}, "", ())
    return make_case(person, [test], [reference])


def of(case, **changes):
    """The case of another person; keys of the model are told apart from those of the person."""
    own = {k: v for k, v in changes.items() if k in ScaledModel.__dataclass_fields__}
    rest = {k: v for k, v in changes.items() if k not in own}
    model = replace(case.participant.model, **own)
    return replace(case, participant=replace(case.participant, model=model, **rest))


def test_a_model_is_made_once(runs, case, tmp_path):
    first = participant_model(case, SETTINGS, tmp_path / "cache")
    again = participant_model(case, SETTINGS, tmp_path / "cache")
    assert runs == [True]
    assert first.hash == again.hash
    assert first.forces == again.forces == 0


@pytest.mark.parametrize(
    "change",
    [
        {"total_mass_kg": 40.0},
        {"segment_mass_kg": {"humerus_r": 2.5}},
        {"masses": "anthropometric"},
        {"body_mass_kg": 90.0},
        {"gravity_mps2": (0.5, -9.79, 0.0)},
    ],
    ids=lambda change: next(iter(change)),
)
def test_masses_and_gravity_find_the_same_geometry(runs, case, tmp_path, caplog, change):
    caplog.set_level(logging.INFO)
    first = participant_model(case, SETTINGS, tmp_path / "cache")
    other = participant_model(of(case, **change), SETTINGS, tmp_path / "cache")
    assert runs == [True, False]
    assert first.hash != other.hash
    assert first.forces == other.forces
    assert "sampled and fitted" in caplog.messages[0]
    assert "known" in caplog.messages[1]


def test_names_and_electrodes_find_the_same_model(runs, case, tmp_path):
    first = participant_model(case, SETTINGS, tmp_path / "cache")
    wired = of(case, id="bob", emg_channels={"EMG_infra": ("infra",)}, emg_unit="fraction_of_mvc")
    other = participant_model(wired, SETTINGS, tmp_path / "cache")
    assert runs == [True]
    assert first.hash == other.hash


def test_another_size_gets_its_own_geometry(runs, case, tmp_path):
    scale = {**case.participant.model.scale, "scapula_r": (0.9, 0.9, 0.91)}
    first = participant_model(case, SETTINGS, tmp_path / "cache")
    other = participant_model(of(case, scale=scale), SETTINGS, tmp_path / "cache")
    assert runs == [True, True]
    assert (first.forces, other.forces) == (0, 1)


@pytest.mark.parametrize(
    "other",
    [
        lambda case: replace(case, reference=()),
        lambda case: replace(case, test=case.reference, reference=case.test),
    ],
    ids=["without reference", "exchanged"],
)
def test_other_movements_or_roles_are_fitted_anew(runs, case, tmp_path, other):
    participant_model(case, SETTINGS, tmp_path / "cache")
    participant_model(other(case), SETTINGS, tmp_path / "cache")
    assert runs == [True, True]


def test_other_settings_of_the_fit_are_fitted_anew(runs, case, tmp_path):
    participant_model(case, SETTINGS, tmp_path / "cache")
    finer = replace(SETTINGS, geometry={**GEOMETRY, "poses": 300})
    participant_model(case, finer, tmp_path / "cache")
    assert runs == [True, True]


@pytest.mark.parametrize(
    ("choice", "sampled"),
    [
        ({"serratus_path": "as_scaled"}, True),
        ({"paths": "published"}, True),
        ({"fibres": "published"}, False),
    ],
)
def test_another_model_of_the_study_is_another_model_of_a_case(
    runs, case, tmp_path, choice, sampled
):
    """Paths run over the surface of the thorax or are others; fibres change none of them."""
    first = participant_model(case, SETTINGS, tmp_path / "cache")
    other = replace(SETTINGS, choices={**CHOICES, **choice})
    assert participant_model(case, other, tmp_path / "cache").hash != first.hash
    assert runs == [True, sampled]


def test_a_fit_that_fails_leaves_no_geometry_behind(runs, case, tmp_path, monkeypatch):
    def refuse(*_):
        raise ValueError("no fit")

    with monkeypatch.context() as patch:
        patch.setattr(nominal, "fit_muscle_geometry", refuse)
        with pytest.raises(ValueError, match="no fit"):
            participant_model(case, SETTINGS, tmp_path / "cache")
    assert not list((tmp_path / "cache").iterdir())
    participant_model(case, SETTINGS, tmp_path / "cache")
    assert runs == [True, True]
