"""The nominal model of a case: scaled, its muscles fitted over the recorded poses, its thorax.

The functions of the study make it, from the case instead of from ``config/participants``. Models
are kept in a cache under the hash of all they are made from, so that repeating a diagnosis does
not rebuild them. Muscle geometry, which takes nearly all of the time, has a place of its own under
the hash of what it is made from: size of the segments, choices of the paths, and movements. Other
masses, another direction of gravity or another set of electrodes find it there.

Muscle lengths are fitted over the poses of all trials. Thorax and fibre lengths follow from the
reference trials alone, if there are any, so that an effect in the test trials does not move into
the model. One fit for all that a person may do would be less exact where the trials are, or slower
to evaluate: see the README of ``gap``.
"""

from __future__ import annotations

import hashlib
import json
import logging
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from scapulohumeral import provenance
from scapulohumeral.dynamics import compiled
from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.dynamics.participant_parameters import muscle_parameters
from scapulohumeral.errors import REFUSED, ModelError, SolveError
from scapulohumeral.gap.recording.case import Case, GapTrial
from scapulohumeral.gap.recording.participant_file import check_groups
from scapulohumeral.model.choices import read_choices
from scapulohumeral.model.motion import ANGLE_COLUMNS, TIME_COLUMN
from scapulohumeral.model.muscle_paths.fit import FitSettings
from scapulohumeral.model.muscle_paths.geometry import load_geometry, save_geometry
from scapulohumeral.model.record import ModelRecord, read_record
from scapulohumeral.model.rotations import pose_to_trial, trial_to_pose
from scapulohumeral.provenance import MODEL_TABLES
from scapulohumeral.stages.geometry import fit_muscle_geometry
from scapulohumeral.stages.thorax import fit_thorax

log = logging.getLogger(__name__)

FORMULATION = "quaternion"
OPENSIM_STAGE = "scapulohumeral.gap.nominal.opensim_process"
GEOMETRY_STAGE = "scapulohumeral.stages.geometry"
THORAX_STAGE = "scapulohumeral.stages.thorax"
# Name of the participant in its cached model: the real one must not influence anything.
CASE = "case"
GEOMETRY_FILE = "geometry.npz"
# Every trial contributes as many poses, whatever its rate and length.
PHASE_POINTS = 101


@dataclass(frozen=True)
class ModelSettings:
    """What a model is made with, beside the case.

    Attributes
    ----------
    tables : folder of the model tables
    choices : keys of section ``model`` of the study; a participant's own masses go before them
    geometry : how muscle geometry is fitted, keys of section ``geometry``
    """

    tables: Path
    choices: Mapping[str, str]
    geometry: Mapping[str, Any]

    @staticmethod
    def of(config: Mapping[str, Any]) -> ModelSettings:
        """Those of a configuration, whose section `gap` fits fewer poses."""
        geometry = {**config["geometry"], **config["gap"]["geometry"]}
        return ModelSettings(MODEL_TABLES, config["model"], geometry)


@dataclass(frozen=True, eq=False)
class ParticipantModel:
    """What the solves of a case need.

    Attributes
    ----------
    record : model record, "model/1"
    thorax : fitted ellipsoid, "thorax/1"
    forces : equations of motion and muscle geometry, in quaternions
    muscles : generic muscle parameters, in the order of the record
    hash : SHA-256 of all that the model is made from
    """

    record: ModelRecord
    thorax: Mapping[str, Any]
    forces: MuscleForces
    muscles: MuscleParameters
    hash: str


@dataclass(frozen=True)
class BuiltFiles:
    """Files of a model that was built: its record, fitted thorax, and geometry in quaternions."""

    record: Path
    thorax: Path
    geometry: Path


def participant_model(case: Case, settings: ModelSettings, cache: Path) -> ParticipantModel:
    """The nominal model of a case, from the cache or built (a minute).

    Parameters
    ----------
    case : Case
    settings : ModelSettings
    cache : folder of models; made if missing

    Raises
    ------
    ConfigError                      unknown muscle groups or model choices, or a model that cannot
                                     be scaled
    ModelError                       opensim refuses the model
    SolveError                       the process of opensim crashed
    """
    check_groups(case.participant, settings.tables)
    inputs = _inputs(case, settings)
    key = _key(inputs, settings)
    paths = cache / f"geometry_{_geometry_key(case, inputs, settings)}"
    folder = _cached(cache / key, lambda target: _build(target, paths, case, inputs, settings))
    files = BuiltFiles(folder / "model.json", folder / "thorax.json", folder / GEOMETRY_FILE)
    return read_model(files, muscle_parameters, key)


def read_model(
    files: BuiltFiles, muscles: Callable[[ModelRecord], MuscleParameters], key: str
) -> ParticipantModel:
    """A model from its files, with the equations of the user's cache.

    Parameters
    ----------
    muscles : gives the muscle parameters of its record
    key : hash of all that the model is made from

    Raises
    ------
    ModelError                       the record cannot be read, or something in it is refused
    """
    equations = cached_equations(provenance.user_cache())
    record = read_record(files.record)
    return ParticipantModel(
        record=record,
        thorax=json.loads(files.thorax.read_text(encoding="utf-8")),
        forces=MuscleForces(compiled.load(equations), load_geometry(files.geometry)),
        muscles=muscles(record),
        hash=key,
    )


def cached_equations(cache: Path) -> Path:
    """Folder of the equations of motion in quaternions; built once per version of their code.

    They are the same for all people and cases: `cache` is that of the user.
    """
    key = provenance.code_hash("scapulohumeral.dynamics.compiled")
    versions = provenance.environment_versions()
    name = f"equations_{key[:16]}_{versions['casadi']}_{versions['sympy']}"
    return _cached(cache / name, lambda target: compiled.build(FORMULATION).save(target))


def _cached(folder: Path, build: Callable[[Path], None]) -> Path:
    """A complete folder: built beside its place, so that it appears at once or not at all."""
    if not folder.is_dir():
        folder.parent.mkdir(parents=True, exist_ok=True)
        unfinished = Path(tempfile.mkdtemp(prefix="unfinished_", dir=folder.parent))
        try:
            build(unfinished)
            unfinished.replace(folder)
        except OSError:
            if not folder.is_dir():  # else another process was faster
                raise
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)
    return folder


def _inputs(case: Case, settings: ModelSettings) -> dict[str, Any]:
    """All files that a model is made from, as name -> content."""
    model = case.participant.model
    motions = {
        f"{kind}{i}": _table(trial)
        for kind, trials in (("test", case.test), ("reference", case.reference))
        for i, trial in enumerate(trials)
    }
    document = {
        "schema": "participant/1",
        "id": CASE,
        "side": case.participant.side,
        "sex": model.sex,
        "height_m": model.height_m,
        "body_mass_kg": model.body_mass_kg,
        "gravity_in_thorax_mps2": list(case.participant.gravity_mps2),
        "scale": {segment: list(factors) for segment, factors in model.scale.items()},
        "mass": {"published_total_kg": model.total_mass_kg, "preserve_mass_distribution": True},
        "trials": {
            name: {"file": f"{name}.csv", "hand_load_kg": 0.0, "published": None}
            for name in motions
        },
    }
    chosen = {
        "tables": str(settings.tables.resolve()),
        "choices": {**settings.choices, "masses": model.masses},
        "segment_mass_kg": dict(model.segment_mass_kg),
        "shaping_trials": _shaping_trials(case),
        "geometry": dict(settings.geometry),
    }
    return {
        "settings.json": json.dumps(chosen, sort_keys=True),
        f"{CASE}/participant.yaml": yaml.safe_dump(document),
        **{f"{CASE}/{name}.csv": text for name, text in motions.items()},
    }


def _shaping_trials(case: Case) -> list[str]:
    """Names of the trials that thorax and fibre lengths follow from."""
    kind, trials = ("reference", case.reference) if case.reference else ("test", case.test)
    return [f"{kind}{i}" for i in range(len(trials))]


def _table(trial: GapTrial) -> str:
    """The movement of a trial at equal steps of phase, as a table of the study."""
    times, angles = trial.moved(PHASE_POINTS)
    # Angles that are continuous in time may wind up; a table holds one turn.
    angles = pose_to_trial(trial_to_pose(angles))
    table = pd.DataFrame(np.rad2deg(angles), columns=list(ANGLE_COLUMNS))
    table.insert(0, TIME_COLUMN, times)
    return table.to_csv(index=False, float_format="%.10g", lineterminator="\n")


def _key(inputs: Mapping[str, str], settings: ModelSettings) -> str:
    return _hash(inputs, settings, (OPENSIM_STAGE, GEOMETRY_STAGE, THORAX_STAGE))


def _geometry_key(case: Case, inputs: Mapping[str, str], settings: ModelSettings) -> str:
    """Hash of what muscle geometry is made from: no masses, no gravity, no names of trials."""
    shaping = {f"{CASE}/{name}.csv" for name in _shaping_trials(case)}
    scale = case.participant.model.scale
    choices = read_choices(settings.choices)
    described = {
        "scale": json.dumps({segment: list(factors) for segment, factors in scale.items()}),
        "geometry": json.dumps(dict(settings.geometry), sort_keys=True),
        "surface": choices.serratus_path,
        "paths": choices.paths,
    }
    movements = {
        name: f"{name in shaping}\n{text}" for name, text in inputs.items() if name.endswith(".csv")
    }
    return _hash({**described, **movements}, settings, (OPENSIM_STAGE, GEOMETRY_STAGE))


def _hash(texts: Mapping[str, str], settings: ModelSettings, modules: Sequence[str]) -> str:
    """Hash of texts by name, of the tables, and of the code of modules."""
    digest = hashlib.sha256()
    for module in modules:
        digest.update(provenance.code_hash(module).encode())
    digest.update(provenance.input_hash(provenance.files_below(settings.tables)).encode())
    for name, text in sorted(texts.items()):
        # The folder of the tables differs between checkouts; their content is hashed above.
        text = text.replace(str(settings.tables.resolve()), "")
        digest.update(f"{name}:{len(text)}:{text}".encode())
    return digest.hexdigest()


def _build(
    folder: Path, paths: Path, case: Case, inputs: Mapping[str, str], settings: ModelSettings
) -> None:
    """Fill the folder of a model; `paths` is the place of its muscle geometry."""
    (folder / CASE).mkdir()
    for name, text in inputs.items():
        (folder / name).write_text(text, encoding="utf-8")
    known = paths.is_dir()
    log.info("muscle geometry %s: %s", paths.name, "known" if known else "sampled and fitted")
    _run_opensim(folder, 0 if known else case.threads)
    _cached(paths, lambda target: _fit(folder, target, settings.geometry))
    shutil.copy(paths / GEOMETRY_FILE, folder / GEOMETRY_FILE)
    recordings = [folder / CASE / f"{name}.csv" for name in _shaping_trials(case)]
    fit_thorax(folder / "model.json", recordings, folder / "thorax.json")


def _fit(folder: Path, paths: Path, geometry: Mapping[str, Any]) -> None:
    """Fit muscle geometry to the samples in the folder of a model."""
    fit = fit_muscle_geometry(
        folder / "samples.npz",
        folder / "model.json",
        FORMULATION,
        FitSettings(
            length_target_m=geometry["length_target_m"],
            arm_target_m=geometry["arm_target_m"],
            rmse_change=geometry["rmse_change_stop"],
        ),
    )
    save_geometry(fit.geometry, paths / GEOMETRY_FILE)
    # Twenty megabytes that only the fit needed.
    (folder / "samples.npz").unlink()


def _run_opensim(folder: Path, processes: int) -> None:
    done = subprocess.run(
        [sys.executable, "-m", OPENSIM_STAGE, str(folder), str(processes)],
        capture_output=True,
        text=True,
        check=False,
    )
    message = done.stderr.strip().rpartition("\n")[2]
    if done.returncode == REFUSED:
        raise ModelError(message)
    if done.returncode != 0:
        raise SolveError(
            f"{OPENSIM_STAGE} ended with {done.returncode}: {message or 'no message'}. Run "
            "`python -c 'import opensim'` to see whether opensim works here."
        )
