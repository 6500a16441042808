"""The part of a participant's model that needs opensim, run as a process of its own.

``python -m scapulohumeral.gap.nominal.opensim_process FOLDER PROCESSES`` reads
``FOLDER/case/participant.yaml`` with its recordings and ``FOLDER/settings.json``, and writes
``model.json`` there by the functions of the study, and ``samples.npz``, which so many processes
sample side by side, if any do. opensim and casadi cannot share a process. The trials that shape the
model (fibre lengths, thorax surfaces) are named in the settings; muscles are sampled near all.
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
from scapulohumeral.gap.parallel import side_by_side
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


def build(folder: Path, processes: int) -> None:
    """Scale the model, record it as ``model.json``, and sample its muscles into ``samples.npz``.

    Parameters
    ----------
    folder : with the files named at the top of this module
    processes : that sample muscles side by side, which takes most of the time; 0 samples nothing

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
    if processes:
        arrays = sample_muscles(model, record, participant, settings["geometry"], processes)
        np.savez(folder / "samples.npz", **arrays)


def sample_muscles(
    model: opensim.Model,
    record: ModelRecord,
    participant: Participant,
    geometry: Mapping[str, Any],
    processes: int,
) -> dict[str, Any]:
    """Paths of all muscles near the trials of a participant, as ``stages.geometry`` reads them.

    All poses are for the fit: nobody looks at how good the fit of a case is. Each is sampled as if
    it were alone, so samples do not depend on the number of processes.

    Parameters
    ----------
    model, record : of the participant
    participant : whose trials the poses are near
    geometry : keys of section ``geometry`` of the configuration
    processes : see :func:`build`
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
    parts = np.array_split(trial_to_pose(angles), processes)
    found = side_by_side(sample_geometry, [(model, part, names) for part in parts], processes)
    samples = {key: np.concatenate([part[key] for part in found]) for key in found[0]}
    held_out = np.zeros(len(angles), dtype=bool)
    return {"muscles": np.array(names), "angles": angles, "held_out": held_out, **samples}


if __name__ == "__main__":
    try:
        build(Path(sys.argv[1]), int(sys.argv[2]))
    except (ConfigError, DataError, ModelError) as error:
        print(error, file=sys.stderr)
        sys.exit(REFUSED)
