"""The files of a case that a diagnosis may see.

A folder holds ``participant.yaml``, ``model.yaml``, ``test/TASK_rN.csv``, companions of EMG and
joint force, and ``reference/``, as far as the case has them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import yaml

from scapulohumeral.model.record import ModelRecord
from scapulohumeral.model.rotations import ANGLE_NAMES
from simulated_persons.drawing.study import Study
from simulated_persons.drawing.trials import Recordings
from simulated_persons.footprint import CONTACT
from simulated_persons.observation import CHANNELS, ELECTRODES, NEIGHBOURS, Recording
from simulated_persons.plan import Plan


def write_case(study: Study, plan: Plan, recordings: Recordings, folder: Path) -> None:
    """Write what the diagnosis may see."""
    for (side, task, repeat), trial in recordings.items():
        if repeat == 0 or (side == "reference" and not plan.reference):
            continue
        stem = folder / side / f"{task}_r{repeat + (plan.repeats if side == 'test' else 0)}"
        stem.parent.mkdir(parents=True, exist_ok=True)
        _write_table(stem.with_suffix(".csv"), ANGLE_NAMES, trial, np.rad2deg(trial.angles_rad))
        if plan.emg:
            _write_table(stem.parent / f"{stem.name}_emg.csv", CHANNELS, trial, trial.emg)
        if plan.contact:
            _write_table(stem.parent / f"{stem.name}_force.csv", CONTACT, trial, trial.force_N)
    model = study.anatomies[plan.participant].record
    _write_participant(plan, model, study.scale[plan.participant], folder)


def _write_table(path: Path, columns: Sequence[str], trial: Recording, values: np.ndarray) -> None:
    table = np.column_stack([trial.time_s, values])
    header = ",".join(("time", *columns))
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.5f")


def _write_participant(plan: Plan, model: ModelRecord, scale: Mapping, folder: Path) -> None:
    document = {
        "schema": "participant/1",
        "id": f"case-{plan.id}",
        "side": "right",
        "model": {"file": "model.yaml"},
        "gravity_in_thorax_mps2": [float(g) for g in model.gravity_mps2],
    }
    if plan.emg:
        document["emg"] = {
            "channels": {channel: [group] for channel, (group, _) in ELECTRODES.items()},
            "unit": "fraction_of_mvc",
            "neighbours": [list(pair) for pair in NEIGHBOURS],
        }
    bodies = [{"name": n, "mass_kg": float(part.mass_kg)} for n, part in model.segments.items()]
    factors = [{"segment": name, "scale_xyz": list(map(float, f))} for name, f in scale.items()]
    tables = {"participant.yaml": document}
    tables["model.yaml"] = {"bodies": bodies, "segment_scale": factors}
    for name, content in tables.items():
        (folder / name).write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
