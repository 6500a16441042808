"""The part of a participant's model that needs opensim, run as a process of its own.

``python -m scapulohumeral.gap.nominal.opensim_process FOLDER [sample]`` reads
``FOLDER/case/participant.yaml`` with its recordings and ``FOLDER/settings.json``, and writes
``model.json`` there, and ``samples.npz`` if asked to sample, by the functions of the study. opensim
and casadi cannot share a process. The trials that shape the model (fibre lengths, thorax surfaces)
are named in the settings; muscles are sampled near all.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import opensim

from scapulohumeral.errors import REFUSED, ConfigError, DataError, ModelError
from scapulohumeral.model.choices import read_choices
from scapulohumeral.model.muscle_paths.opensim_sampling import sample_geometry
from scapulohumeral.model.muscle_paths.pose_region import Region, draw_sample_angles
from scapulohumeral.model.muscle_paths.thorax_clearance import is_clear
from scapulohumeral.model.opensim_model import model_record, participant_model
from scapulohumeral.model.participant import Participant, read_participant
from scapulohumeral.model.record import ModelRecord, write_record
from scapulohumeral.model.rotations import trial_to_pose
from scapulohumeral.model.tables import read_tables

CASE = "case"
SAMPLE = "sample"


def build(folder: Path, sampled: bool) -> None:
    """Scale the model, record it as ``model.json``, and sample its muscles into ``samples.npz``.

    Parameters
    ----------
    folder : with the files named at the top of this module
    sampled : whether muscles are sampled, which takes most of the time

    Raises
    ------
    ConfigError, DataError, ModelError   see the functions of the study
    """
    settings = json.loads((folder / "settings.json").read_text(encoding="utf-8"))
    tables = read_tables(Path(settings["tables"]))
    participant = read_participant(folder, CASE)
    shaping = {name: participant.trial(name) for name in settings["shaping_trials"]}
    shaper = replace(participant, trials=shaping)
    choices = read_choices(settings["choices"])
    model = participant_model(tables, shaper, choices)
    record = model_record(model, shaper, tables, choices).with_masses(settings["segment_mass_kg"])
    write_record(record, folder / "model.json")
    if sampled:
        arrays = sample_muscles(model, record, participant, settings["geometry"])
        np.savez(folder / "samples.npz", **arrays)


def sample_muscles(
    model: opensim.Model,
    record: ModelRecord,
    participant: Participant,
    geometry: Mapping[str, Any],
) -> dict[str, Any]:
    """Paths of all muscles near the trials of a participant, as ``stages.geometry`` reads them.

    All poses are for the fit: nobody looks at how good the fit of a case is.

    Parameters
    ----------
    model, record : of the participant
    participant : whose trials the poses are near
    geometry : keys of section ``geometry`` of the configuration
    """
    angles = draw_sample_angles(
        participant,
        "quaternion",
        Region(geometry["margin_deg"], tuple(geometry["scapula_turn_deg"])),
        geometry["poses"],
        np.random.default_rng(geometry["seed"]),
        lambda poses: is_clear(record, poses, geometry["clearance"]),
    )
    names = list(record.muscle_names)
    samples = sample_geometry(model, trial_to_pose(angles), names)
    held_out = np.zeros(len(angles), dtype=bool)
    return {"muscles": np.array(names), "angles": angles, "held_out": held_out, **samples}


if __name__ == "__main__":
    try:
        build(Path(sys.argv[1]), SAMPLE in sys.argv[2:])
    except (ConfigError, DataError, ModelError) as error:
        print(error, file=sys.stderr)
        sys.exit(REFUSED)
