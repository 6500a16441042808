"""The process that needs opensim makes the model of a case from its files."""

import json

import numpy as np
import pytest
import yaml
from places import REPOSITORY

from scapulohumeral.gap.nominal.opensim_process import build
from scapulohumeral.model.record import read_record
from scapulohumeral.model.tables import read_tables

pytestmark = pytest.mark.opensim


def test_a_case_gets_its_own_masses_and_samples(tmp_path):
    participants = REPOSITORY / "config" / "participants"
    tables = participants.parent / "model"
    document = yaml.safe_load((participants / "par2" / "participant.yaml").read_text())
    keep = ("schema", "side", "sex", "height_m", "body_mass_kg", "gravity_in_thorax_mps2")
    trial = {"file": "frontal.csv", "hand_load_kg": 0.0, "published": None}
    case = {key: document[key] for key in (*keep, "scale", "mass")}
    case |= {"id": "case", "trials": {"test0": trial}}
    (tmp_path / "case").mkdir()
    (tmp_path / "case" / "participant.yaml").write_text(yaml.safe_dump(case))
    recording = (participants / "par2" / "frontal.csv").read_text()
    (tmp_path / "case" / "frontal.csv").write_text(recording)
    settings = {
        "tables": str(tables),
        "choices": {"masses": "published", "girdle_stops": "wide"},
        "segment_mass_kg": {"humerus_r": 2.0},
        "shaping_trials": ["test0"],
        "geometry": {
            "poses": 6,
            "margin_deg": 5,
            "scapula_turn_deg": [-5, 5],
            "clearance": 0.05,
            "seed": 1,
        },
    }
    (tmp_path / "settings.json").write_text(json.dumps(settings))
    build(tmp_path, processes=2)
    record = read_record(tmp_path / "model.json")
    humerus, scapula = (record.segments[name] for name in ("humerus_r", "scapula_r"))
    assert humerus.mass_kg == 2.0
    assert scapula.mass_kg == pytest.approx(1.0504640207736304)
    # Inertia over mass is that of the base segment times its squared scale.
    base, scale = read_tables(tables).segments["humerus_r"], document["scale"]["humerus_r"][0]
    gyration = base.inertia_kgm2[1] / base.mass_kg * scale**2
    assert humerus.inertia_kgm2[1] / 2.0 == pytest.approx(gyration)
    with np.load(tmp_path / "samples.npz") as data:
        samples = dict(data)
    assert samples["length_m"].shape == (6, len(record.muscles))
    assert not samples["held_out"].any()
    # Samples are those of one process, to the last bit.
    build(tmp_path, processes=1)
    with np.load(tmp_path / "samples.npz") as alone:
        assert set(alone) == set(samples)
        for name, values in samples.items():
            np.testing.assert_array_equal(alone[name], values, err_msg=name)
