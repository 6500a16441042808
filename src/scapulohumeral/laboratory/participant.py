"""Files that tell who recordings are of: for a diagnosis, and for the whole study.

Letters: T frames.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from scapulohumeral.documents import check_schema, read_mapping
from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.laboratory.body_size import Body, segment_masses, total_mass
from scapulohumeral.laboratory.checks import FAULT, check_motion
from scapulohumeral.laboratory.folders import make_folder
from scapulohumeral.laboratory.record import read_record, record_path
from scapulohumeral.model.motion import read_motion
from scapulohumeral.model.participant import read_participant
from scapulohumeral.model.participant_file import GRAVITY_MPS2
from scapulohumeral.model.participant_schema import PARTICIPANT_SCHEMA
from scapulohumeral.model.rotations import Array
from scapulohumeral.model.smoothing import smooth_recording
from scapulohumeral.model.tables import ModelTables

SCALED_FILE = "scaled.yaml"
PARTICIPANT_FILE = "participant.yaml"
# A repeat in the name of a trial: a number from 1 on, which may begin with zeros.
REPEAT = "0*[1-9][0-9]*"
# ASSUME: a trunk that leans otherwise by less than this changes joint moments of the arm by a tenth
# at most, its sine.
LEANING_DEG = 5.0
# Scale factors of one person that differ by less are the same [1].
SAME_SCALE = 1e-3
# Common for recordings of markers on skin.
SMOOTH_CUTOFF_HZ = 6.0


@dataclass(frozen=True)
class Person:
    """Who was recorded: id, size, scale factors by segment, mean gravity in thorax axes (3,)."""

    id: str
    body: Body
    scale: Mapping[str, float]
    gravity_mps2: tuple[float, ...]


def mean_gravity(thoraxes: Sequence[tuple[Array, Array | None]]) -> tuple[float, ...]:
    """Gravity in thorax axes [m/s^2], its direction the mean over recordings.

    Parameters
    ----------
    thoraxes : per recording the thorax (T, 3, 3) in the laboratory and the axis (3,) that points up

    Raises
    ------
    ConfigError                      nothing says where up is
    """
    known = [(thorax, up) for thorax, up in thoraxes if up is not None]
    ups = [np.einsum("tji,j->i", thorax, up) / len(thorax) for thorax, up in known]
    if not ups:
        raise ConfigError(
            "nothing says which axis of the laboratory points up, so gravity is not known. Write "
            'up: "+z", or another axis, in the map.'
        )
    up = np.mean(ups, axis=0)
    gravity = -GRAVITY_MPS2 * up / np.linalg.norm(up)
    return tuple(round(float(value), 5) for value in gravity)


def task_and_repeat(pattern: str, stems: Sequence[str]) -> dict[str, dict[str, Any]]:
    """What names of trials say: stem -> task and repeat.

    Parameters
    ----------
    pattern : regular expression of whole names, with the groups `task` and `repeat`
    stems : names of trials

    Raises
    ------
    ConfigError                      the pattern is none, lacks a group, fits no name, or finds no
                                     task or no number from 1 on in a name
    """
    try:
        compiled = re.compile(pattern)
    except re.error as error:
        raise ConfigError(f"--tasks '{pattern}': no regular expression: {error}.") from error
    if {"task", "repeat"} - set(compiled.groupindex):
        raise ConfigError(
            f"--tasks '{pattern}': expected groups (?P<task>...) and (?P<repeat>...), as in "
            r"'(?P<task>.+)_(before|after)_(?P<repeat>\d+)'."
        )
    found = {stem: compiled.fullmatch(stem) for stem in stems}
    named = {stem: match for stem, match in found.items() if match}
    if not named:
        raise ConfigError(
            f"--tasks '{pattern}': fits none of {', '.join(stems)} as a whole. Correct it."
        )
    return {stem: _task_and_repeat(pattern, match) for stem, match in named.items()}


def _task_and_repeat(pattern: str, match: re.Match[str]) -> dict[str, Any]:
    """Task and repeat of one name, as a diagnosis reads them."""
    task, repeat = match["task"], match["repeat"]
    if not task:
        raise ConfigError(
            f"--tasks '{pattern}': finds no task in {match.string}; expected one in each name "
            "that it fits. Write (?P<task>.+), not optional."
        )
    if not re.fullmatch(REPEAT, repeat or ""):
        raise ConfigError(
            f"--tasks '{pattern}': finds the repeat '{repeat or ''}' in {match.string}; expected a "
            f"number from 1 on. Write (?P<repeat>{REPEAT})."
        )
    return {"task": task, "repeat": int(repeat)}


def participant_document(folder: Path, remedy: str) -> dict[str, Any] | None:
    """Content of the participant file in a folder, if there is one.

    Parameters
    ----------
    folder : of the file
    remedy : what to do about a file that cannot be read, as a sentence

    Raises
    ------
    ConfigError                      it cannot be read
    """
    path = folder / PARTICIPANT_FILE
    if not path.is_file():
        return None
    return read_mapping(path, "'schema: participant/1' and others", remedy)


def read_earlier(folder: Path, person_id: str, of_study: bool) -> dict[str, Any]:
    """What the participant file in a folder says of a person already; empty if there is none.

    Parameters
    ----------
    folder : of the file
    person_id : of the person that is to be written
    of_study : whether the file is to be one of the study, and not of a diagnosis

    Raises
    ------
    ConfigError                      the file is of somebody else, or of the other kind
    """
    document = participant_document(folder, "Correct the line named, or move the file.")
    if document is None:
        return {}
    kinds = {True: "the study", False: "a diagnosis"}
    found = (document.get("id"), kinds[is_of_study(document)])
    expected = (person_id, kinds[of_study])
    if found != expected:
        raise ConfigError(
            f"{folder / PARTICIPANT_FILE}: is of '{found[0]}', for {found[1]}, and would be "
            f"replaced; expected '{expected[0]}', for {expected[1]}. Correct --id, or name another "
            "folder as --out."
        )
    return document


def is_of_study(document: Mapping[str, Any]) -> bool:
    """Whether a participant file is one of the study; else it is one of a diagnosis."""
    return "scale" in document


def write_diagnosis_participant(
    folder: Path, person: Person, tables: ModelTables, trials: Mapping[str, Mapping[str, Any]]
) -> Path:
    """Write participant.yaml and scaled.yaml of a diagnosis; returns the former.

    What an earlier file says of EMG and of further trials is kept.

    Parameters
    ----------
    folder : of the trial tables
    person, tables : who it is, and the base model
    trials : stem -> task and repeat, as from `task_and_repeat`

    Raises
    ------
    ConfigError                      the folder has a participant file of another person or kind
    """
    earlier = read_earlier(folder, person.id, of_study=False)
    masses = segment_masses(person.body, tables)
    scaled = {
        "bodies": [{"name": n, "mass_kg": round(m, 5)} for n, m in masses.items()],
        "segment_scale": [
            {"segment": n, "scale_xyz": [round(factor, 5)] * 3}
            for n, factor in person.scale.items()
        ],
    }
    document: dict[str, Any] = earlier | {
        "schema": "participant/1",
        "id": person.id,
        "side": "right",
        "model": {"file": SCALED_FILE},
        "gravity_in_thorax_mps2": list(person.gravity_mps2),
    }
    known = earlier.get("trials") or {}
    if known or trials:
        named = {stem: {**known.get(stem, {}), **entry} for stem, entry in trials.items()}
        document["trials"] = known | named
    make_folder(folder)
    _write(folder / SCALED_FILE, scaled, "Scale factors from landmarks, masses from de Leva 1996.")
    path = folder / PARTICIPANT_FILE
    _write(path, document, "Left arms were mirrored: the side is that of the model.")
    return path


def without_companions(tables: Sequence[Path]) -> list[Path]:
    """Tables of motion: those of EMG and joint force beside them are read by a diagnosis alone."""
    kinds = ("_emg", "_force")
    stems = {table.stem for table in tables}
    return [
        table
        for table in tables
        if not any(
            table.stem.endswith(kind) and table.stem.removesuffix(kind) in stems for kind in kinds
        )
    ]


def write_study_participant(
    folder: Path, person: Person, tables: ModelTables, trials: Mapping[str, Path]
) -> Path:
    """Write a participant of the study, with copies of its trials; returns participant.yaml.

    Records of conversions go with their tables, as without one all angles count as measured. What
    an earlier file says of trials, and of what is not known here, is kept.

    Parameters
    ----------
    folder : of all participants; the person's own is made in it
    person, tables : who it is, and the base model
    trials : name -> trial table

    Raises
    ------
    ConfigError                      names that the study cannot use, or the file of somebody else
    DataError                        a trial table cannot be read or smoothed
    """
    _check_names(person, trials)
    own = folder / person.id
    path = own / PARTICIPANT_FILE
    entries = {name: _entry_of(table) for name, table in trials.items()}
    earlier = read_earlier(own, person.id, of_study=True)
    document = _study_document(person, tables, entries, earlier)
    # Before anything is written: one broken participant stops the study of all.
    check_schema(path, document, PARTICIPANT_SCHEMA, "see config/participants/README.md")
    for name, table in trials.items():
        _check_trial(table, own / f"{name}.csv", document["trials"][name], tables)
    make_folder(own)
    for name, table in trials.items():
        _copy(table, own / f"{name}.csv")
    _write(
        path,
        document,
        "Scale factors from landmarks; mass.published_total_kg gives the arm the mass that de Leva "
        "1996\n# gives for this body mass. Set hand_load_kg and daily_task where they apply.",
    )
    # The reader of the study has the last word on what it can use.
    read_participant(folder, person.id)
    return path


def _check_names(person: Person, trials: Mapping[str, Path]) -> None:
    """Refuse names that the study cannot use in its files."""
    if not re.fullmatch(r"[a-z0-9]+", person.id):
        raise ConfigError(f"id '{person.id}': expected small letters and digits. Rename it.")
    wrong = [name for name in trials if not re.fullmatch(r"[a-z0-9_]+", name)]
    if wrong:
        raise ConfigError(
            f"trial {', '.join(wrong)}: expected small letters, digits and _. Rename the tables."
        )


def _study_document(
    person: Person,
    tables: ModelTables,
    entries: Mapping[str, Mapping[str, Any]],
    earlier: Mapping[str, Any],
) -> dict[str, Any]:
    """Content of a participant.yaml of the study, over that of an earlier one.

    `entries`: of trials, in place where an earlier file says nothing of them.
    """
    total = total_mass(segment_masses(person.body, tables), tables)
    known = earlier.get("trials") or {}
    return {
        **earlier,
        "schema": "participant/1",
        "id": person.id,
        "side": "right",
        "sex": person.body.sex,
        "height_m": person.body.height_m,
        "body_mass_kg": person.body.mass_kg,
        "gravity_in_thorax_mps2": list(person.gravity_mps2),
        "scale": {name: [round(factor, 5)] * 3 for name, factor in person.scale.items()},
        "mass": {"published_total_kg": round(total, 4), "preserve_mass_distribution": True},
        "trials": {
            **known,
            **{
                name: {**known.get(name, entry), "file": f"{name}.csv"}
                for name, entry in entries.items()
            },
        },
    }


def _entry_of(table: Path) -> dict[str, Any]:
    """What the study is told of a new trial; a table that was smoothed is not smoothed again."""
    entry = {"hand_load_kg": 0.0, "published": None}
    smoothed = read_record(table).get("smoothed_hz") is not None
    return entry if smoothed else entry | {"smooth_cutoff_hz": SMOOTH_CUTOFF_HZ}


def _check_trial(table: Path, to: Path, entry: Mapping[str, Any], tables: ModelTables) -> None:
    """Refuse a table that cannot be copied to its place, read, or smoothed as its entry says.

    One that no conversion has judged is refused if no shoulder moves so.
    """
    if table.resolve() == to.resolve():
        raise DataError(f"{table}: is already in the participant's folder. Name tables elsewhere.")
    motion = read_motion(table)
    if not read_record(table):
        faults = [f for f in check_motion(motion, tables) if f.severity == FAULT]
        if faults:
            wrong = "; ".join(fault.text for fault in faults)
            raise DataError(f"{table}: {wrong}. Correct the table, or leave the trial out.")
    if "smooth_cutoff_hz" in entry:
        smooth_recording(motion, float(entry["smooth_cutoff_hz"]), table)


def _copy(table: Path, to: Path) -> None:
    shutil.copyfile(table, to)
    # A record of another table of this name must not speak for this one.
    record_path(to).unlink(missing_ok=True)
    if record_path(table).is_file():
        shutil.copyfile(record_path(table), record_path(to))


def _write(path: Path, document: Mapping[str, Any], comment: str) -> None:
    text = yaml.safe_dump(dict(document), sort_keys=False, default_flow_style=None, width=100)
    path.write_text(f"# {comment}\n{text}", encoding="utf-8")


def kept_records(folder: Path) -> dict[str, dict[str, Any]]:
    """Records of the conversions that a folder holds, by trial, but for those with a fault."""
    records = {table.stem: read_record(table) for table in sorted(folder.glob("*.csv"))}
    return {name: record for name, record in records.items() if record.get("usable")}


def gravity_of_records(records: Iterable[Mapping[str, Any]]) -> tuple[float, ...] | None:
    """Mean gravity in thorax axes of records of conversions; None if none of them knows it."""
    known = [r["gravity_in_thorax_mps2"] for r in records if r.get("gravity_in_thorax_mps2")]
    if not known:
        return None
    mean = np.mean(known, axis=0)
    scaled = GRAVITY_MPS2 * mean / np.linalg.norm(mean)
    return tuple(round(float(value), 5) for value in scaled)


def rescaled(folder: Path, scale: Mapping[str, float]) -> list[str]:
    """What changes of the scale factors that a folder holds already, in words.

    Parameters
    ----------
    folder : of the trial tables; scale : segment -> factor, which will be written there
    """
    path = folder / SCALED_FILE
    if not path.is_file():
        return []
    document = read_mapping(path, "'segment_scale' and others", "Remove it.")
    before = {one["segment"]: one["scale_xyz"][0] for one in document["segment_scale"]}
    changed = [
        f"{name} {factor:.3f} for {before[name]:.3f}"
        for name, factor in scale.items()
        if name in before and abs(factor / before[name] - 1.0) > SAME_SCALE
    ]
    if not changed:
        return []
    return [
        f"{path}: scale factors are those of the recordings converted now ({', '.join(changed)}); "
        "convert all recordings at once, so that all count"
    ]


def leaning(records: Mapping[str, Mapping[str, Any]], gravity: Sequence[float]) -> list[str]:
    """Trials whose trunk leans otherwise than the one gravity of a participant says, in words.

    Parameters
    ----------
    records : of conversions, by trial; gravity : (3,) in thorax axes, of all
    """
    notes = []
    for name, record in records.items():
        own = record.get("gravity_in_thorax_mps2")
        if not own:
            continue
        cosine = np.dot(own, gravity) / np.linalg.norm(own) / np.linalg.norm(gravity)
        angle_deg = float(np.rad2deg(np.arccos(min(float(cosine), 1.0))))
        if angle_deg > LEANING_DEG:
            notes.append(
                f"{name}: gravity is turned by {angle_deg:.0f} deg in the thorax against the mean "
                f"of all trials, which {PARTICIPANT_FILE} holds; put trials of another posture "
                "into another folder, as another participant"
            )
    return notes
