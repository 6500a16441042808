"""Generate blind cases: trials and participant files for the diagnosis, keys for whoever scores.

Usage: ``python -m simulated_persons.generate --cases N --results DIR --participants DIR
--names NAME ... --out DIR --keys DIR``. Keys must lie outside the checkout; the
seed, drawn unless ``--seed`` gives it, is kept with them in ``draw.json``: it tells every cause.

A case folder holds ``participant.yaml``, ``model.yaml``, ``test/TASK_rN.csv``, companions of EMG
and joint force, and ``reference/``, as far as the case has them. A key is ``KEYS/CASE.json``:
labels, amplitudes, plant, seed, what would be seen without noise, and the noise-free hidden task.
"""

from __future__ import annotations

import argparse
import json
import secrets
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml

from scapulohumeral.dynamics import compiled
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.errors import ConfigError, SolveError
from scapulohumeral.model.motion import Motion, read_motion
from scapulohumeral.model.muscle_paths.geometry import load_geometry
from scapulohumeral.model.record import ModelRecord, read_record
from scapulohumeral.model.rotations import ANGLE_NAMES, relative_angle
from simulated_persons.arm import Anatomy, Arm, batch, draw_person
from simulated_persons.footprint import (
    CONTACT,
    FOOTPRINT_MULTIPLE,
    channel_names,
    difference,
    floor,
    footprints,
)
from simulated_persons.movement import Variation, draw_variation, no_variation, wished_poses
from simulated_persons.observation import (
    CHANNELS,
    ELECTRODES,
    NEIGHBOURS,
    Measurement,
    Recording,
    add_noise,
    electrode_matrix,
    record,
)
from simulated_persons.plan import SHARES, Plan, draw_plans, redrawn
from simulated_persons.simulation import TICK_S, simulate
from simulated_persons.wish import humerus_of, make_wish

BATCH = 100
GIRDLE_PATH_DEG, HUMERUS_PATH_DEG = 0.6, 0.8
RECORDING_PATH_DEG = 1.0  # of a recording that stands for its own repeats
SESSION_GAIN, SESSION_TURN_DEG = 0.04, 0.4  # electrodes and markers, put on again
LARGEST_MISS = np.deg2rad(25.0)  # of the humerus: beyond, the arm did not do the task
LARGEST_ATTEMPTS = 12
# Largest difference of a mean envelope between repeats of a task [fraction of MVC]. Most persons
# stay below 0.06; some have two ways to do a task, 0.15 to 0.3 apart: a change of way is no effect.
STEADY_EMG = 0.1
# Draws for an effect that shows; families that hardly ever do are kept as they are then.
SHOWN_ATTEMPTS = 3
# The published arm of par1 weighs 12 kg, three times what anthropometry gives, and its muscles
# cannot lift it: plants and their participant files take a third.
ARM_MASS = {"par1": 1.0 / 3.0}
ARM_SEGMENTS = ("clavicle_r", "scapula_r", "humerus_r", "ulna_r", "radius_r", "hand_r")


@dataclass(frozen=True, eq=False)
class Run:
    """One trial to simulate; `name` is (side, task, repeat), repeat 0 being noise-free."""

    case: str
    name: tuple[str, str, int]
    arm: Arm
    pose: np.ndarray


@dataclass(frozen=True, eq=False)
class Study:
    """Participants' models and recorded motions."""

    anatomies: dict[str, Anatomy]
    motions: dict[tuple[str, str], Motion]
    scale: dict[str, dict]


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=secrets.randbelow(2**31))
    parser.add_argument("--cases", type=int, required=True)
    parser.add_argument("--names", nargs="+", required=True, help="folders of participants")
    parser.add_argument("--kind", choices=sorted(SHARES), help="open cases of one kind only")
    for name in ("results", "participants", "out", "keys"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    options = parser.parse_args(arguments)
    _check_keys_folder(options.keys)
    study = load_study(options.results, options.participants, options.names)
    plans = draw_plans(options.seed, options.cases, tuple(study.anatomies), options.kind)
    for folder in (options.out, options.keys):
        folder.mkdir(parents=True, exist_ok=True)
    draw = {"seed": options.seed, "cases": options.cases, "kind": options.kind}
    (options.keys / "draw.json").write_text(json.dumps(draw) + "\n", encoding="utf-8")
    for plan, recordings in recorded_cases(study, plans):
        write_case(study, plan, recordings, options.out / plan.id)
        key = options.keys / f"{plan.id}.json"
        key.write_text(json.dumps(case_key(plan, recordings)) + "\n", encoding="utf-8")
        print(f"{plan.id} written", flush=True)


def _check_keys_folder(keys: Path) -> None:
    """Refuse a folder that the diagnosis could read, or that holds keys already."""
    checkout = Path(__file__).resolve().parents[2]
    if keys.resolve().is_relative_to(checkout):
        raise ConfigError(
            f"--keys {keys}: lies in {checkout}, where the diagnosis could read it. "
            "Name a folder outside."
        )
    if keys.is_dir() and any(keys.iterdir()):
        raise ConfigError(f"--keys {keys}: holds files already. Name a new folder for new keys.")


def load_study(results: Path, participants: Path, names: Sequence[str]) -> Study:
    """Models that the study has built, and the recordings they were built for."""
    equations = compiled.load(results / "equations" / "quaternion")
    anatomies, motions, scale = {}, {}, {}
    for name in names:
        geometry = load_geometry(results / "muscle_geometry" / name / "quaternion.npz")
        record = _weighed(read_record(results / "models" / f"{name}.json"), ARM_MASS.get(name, 1.0))
        thorax = json.loads((results / "models" / f"{name}_thorax.json").read_text("utf-8"))
        anatomies[name] = Anatomy(record, thorax, MuscleForces(equations, geometry))
        text = (participants / name / "participant.yaml").read_text(encoding="utf-8")
        scale[name] = yaml.safe_load(text)["scale"]
        for task in ("frontal", "scapular", "sagittal"):
            motions[name, task] = read_motion(participants / name / f"{task}.csv")
    return Study(anatomies, motions, scale)


def _weighed(record: ModelRecord, factor: float) -> ModelRecord:
    """A model record with masses and inertias of the arm scaled."""
    masses = {name: factor * record.segments[name].mass_kg for name in ARM_SEGMENTS}
    return record.with_masses(masses)


Recordings = dict[tuple[str, str, int], Recording]


def recorded_cases(study: Study, plans: Sequence[Plan]) -> Iterator[tuple[Plan, Recordings]]:
    """Recordings of all cases, noise-free ones (repeat 0) included.

    A case whose arm cannot do the task, or does it now one way and now another, is drawn again,
    with other amplitudes and another person, and so is, a few times, a case whose effect hardly
    shows.
    """
    for plan in plans:
        if plan.plant == "S":
            yield plan, _salted(study, plan)
    waiting = [plan for plan in plans if plan.plant == "P1"]
    for attempt in range(1, LARGEST_ATTEMPTS + 1):
        traces = _simulated(study, waiting)
        again = []
        for plan in waiting:
            recordings = traces[plan.id]
            wanted = bool(plan.injections) and not plan.faint and attempt < SHOWN_ATTEMPTS
            if (
                recordings is not None
                and _steady(recordings)
                and (not wanted or _shown(plan, recordings))
            ):
                yield plan, _with_noise(plan, recordings)
            else:
                again.append(redrawn(plan, attempt))
        print(f"draw {attempt}: {len(again)} of {len(waiting)} to be drawn again", flush=True)
        waiting = again
        if not waiting:
            break
    if waiting:
        raise SolveError(
            f"cases {', '.join(plan.id for plan in waiting)}: the arm misses its task in "
            f"{LARGEST_ATTEMPTS} draws; expected less than {np.rad2deg(LARGEST_MISS):.0f} deg. "
            "Narrow the amplitudes of simulated_persons.effects"
        )


def _simulated(study: Study, plans: Sequence[Plan]) -> dict[str, Recordings | None]:
    """Noise-free recordings of every trial; None for a case with an arm that missed its task."""
    by_participant: dict[str, list[Run]] = defaultdict(list)
    for plan in plans:
        by_participant[plan.participant] += _runs(study, plan)
    found: dict[str, Recordings | None] = {plan.id: {} for plan in plans}
    for name, runs in by_participant.items():
        anatomy = study.anatomies[name]
        electrodes = electrode_matrix(anatomy.names, anatomy.groups)
        runs = sorted(runs, key=lambda run: len(run.pose))
        for start in range(0, len(runs), BATCH):
            for run, q, excitation, reaction, miss in _follow(runs[start : start + BATCH]):
                trials = found[run.case]
                if not miss <= LARGEST_MISS:
                    found[run.case] = None
                elif trials is not None:
                    trials[run.name] = record(
                        q, excitation, reaction, run.arm.measurement, electrodes
                    )
    return found


def _steady(recordings: Recordings) -> bool:
    """Whether all repeats of a task, the noise-free one too, have much the same mean envelopes."""
    ways: dict[tuple[str, str], list[np.ndarray]] = defaultdict(list)
    for (side, task, _), trial in recordings.items():
        ways[side, task].append(trial.emg.mean(axis=0))
    return all(np.ptp(means, axis=0).max() <= STEADY_EMG for means in ways.values())


def _runs(study: Study, plan: Plan) -> list[Run]:
    """Every trial of a case: noise-free twins of all tasks, repeats of those that are recorded."""
    rng = np.random.default_rng(plan.seed)
    person = draw_person(study.anatomies[plan.participant], rng)
    affected = person
    for injection in plan.injections:
        affected = injection.apply(affected)
    second = replace(affected, measurement=_another_session(affected.measurement, rng))
    runs = []
    for task in (*plan.tasks, plan.hidden):
        motion = study.motions[plan.participant, task]
        still = wished_poses(motion, no_variation())
        runs.append(Run(plan.id, ("reference", task, 0), person, still))
        runs.append(Run(plan.id, ("test", task, 0), affected, still))
        if task == plan.hidden:
            continue
        for side, arm in (("reference", person), ("test", second)):
            for repeat in range(1, plan.repeats + 1):
                if side == "reference" and not plan.reference:
                    continue
                varied = draw_variation(rng, GIRDLE_PATH_DEG, HUMERUS_PATH_DEG)
                runs.append(Run(plan.id, (side, task, repeat), arm, wished_poses(motion, varied)))
    return runs


def _follow(
    runs: Sequence[Run],
) -> Iterator[tuple[Run, np.ndarray, np.ndarray, np.ndarray, float]]:
    """Simulate runs of one anatomy together: pose, excitation, reaction, largest miss of each."""
    longest = max(len(run.pose) for run in runs)
    pose = np.stack([_held(run.pose, longest) for run in runs], axis=1)
    body, control = batch([run.arm for run in runs])
    wish = make_wish(pose, TICK_S)
    with np.errstate(all="ignore"):  # an arm that cannot do its task may diverge: it is dropped
        trace = simulate(body, control, wish)
    for number, run in enumerate(runs):
        count = len(run.pose)
        q = trace.q[:count, number]
        miss = relative_angle(humerus_of(q), wish.humerus[:count, number]).max()
        excitation, reaction = (v[:count, number] for v in (trace.excitation, trace.reaction_N))
        yield run, q, excitation, reaction, float(miss)


def _salted(study: Study, plan: Plan) -> Recordings:
    """Recorded motion with salt: its repeats are the recording with smooth noise.

    There is one recording per task, so test and reference differ by that noise only, not by what a
    person does differently from time to time. The noise is of the size found between repeats.
    """
    rng = np.random.default_rng(plan.seed)
    anatomy = study.anatomies[plan.participant]
    person = draw_person(anatomy, rng)
    affected = person
    for injection in plan.injections:
        affected = injection.apply(affected)
    electrodes = electrode_matrix(anatomy.names, anatomy.groups)
    trials: Recordings = {}
    for task in (*plan.tasks, plan.hidden):
        motion = study.motions[plan.participant, task]
        for side, arm in (("reference", person), ("test", affected)):
            for repeat in range(plan.repeats + 1 if task != plan.hidden else 1):
                varied = no_variation() if repeat == 0 else _recording_noise(rng)
                pose = wished_poses(motion, varied)
                rest = np.zeros((len(pose), len(anatomy.names)))
                free = np.zeros((len(pose), 3))
                trials[side, task, repeat] = record(pose, rest, free, arm.measurement, electrodes)
    return trials


def _recording_noise(rng: np.random.Generator) -> Variation:
    return draw_variation(rng, RECORDING_PATH_DEG, RECORDING_PATH_DEG)


def _another_session(measurement: Measurement, rng: np.random.Generator) -> Measurement:
    """Electrodes and markers put on again: what differs between recordings without a cause."""
    gain = np.exp(rng.normal(0.0, SESSION_GAIN, len(CHANNELS)))
    turns = np.deg2rad(SESSION_TURN_DEG) * rng.normal(size=(3, 3))
    return replace(
        measurement,
        emg_gain=gain * measurement.emg_gain,
        thorax_rad=measurement.thorax_rad + turns[0],
        scapula_rad=measurement.scapula_rad + turns[1],
        humerus_rad=measurement.humerus_rad + turns[2],
    )


def _with_noise(plan: Plan, recordings: Recordings) -> Recordings:
    rng = np.random.default_rng([plan.seed, 1])
    return {name: add_noise(trial, rng) if name[2] else trial for name, trial in recordings.items()}


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


def case_key(plan: Plan, recordings: Recordings) -> dict:
    """What is sealed: the truth of a case."""
    channels = channel_names(plan.emg, plan.contact)
    sigma, size = _changes(plan, recordings)
    hidden = {side: recordings[side, plan.hidden, 0] for side in ("test", "reference")}
    return {
        "schema": "blind-key/1",
        "case": plan.id,
        "plant": plan.plant,
        "kind": plan.kind,
        "seed": plan.seed,
        "participant": plan.participant,
        "tasks": list(plan.tasks),
        "mode": {"emg": plan.emg, "contact": plan.contact, "reference": plan.reference},
        "effects": [
            {"label": i.label, "parameter": i.parameter, "amplitude": i.amplitude}
            for i in plan.injections
        ],
        "channels": list(channels),
        "footprint": dict(zip(channels, np.round(size, 3).tolist(), strict=True)),
        "shown": _shown(plan, recordings),
        "footprint_multiple": FOOTPRINT_MULTIPLE,
        "change_sigma": {task: np.round(change, 2).tolist() for task, change in sigma.items()},
        "hidden_task": {
            "task": plan.hidden,
            **{side: _noise_free(trial, plan) for side, trial in hidden.items()},
        },
    }


def _changes(plan: Plan, recordings: Recordings) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """What would change without noise: standard errors by task (F, K), largest footprints (K,)."""
    sigma = {}
    for task in plan.tasks:
        test, reference = (recordings[side, task, 0] for side in ("test", "reference"))
        error = floor(reference, plan.repeats, plan.emg, plan.contact, plan.reference)
        sigma[task] = difference(test, reference, plan.emg, plan.contact) / error
    return sigma, np.max([footprints(change) for change in sigma.values()], axis=0)


def _shown(plan: Plan, recordings: Recordings) -> bool:
    return bool(_changes(plan, recordings)[1].max() >= FOOTPRINT_MULTIPLE)


def _noise_free(trial: Recording, plan: Plan) -> dict:
    return {
        "time_s": np.round(trial.time_s, 4).tolist(),
        "angles_deg": np.round(np.rad2deg(trial.angles_rad), 4).tolist(),
        "emg": np.round(trial.emg, 5).tolist() if plan.emg else None,
        "force_N": np.round(trial.force_N, 2).tolist() if plan.contact else None,
    }


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


def _held(pose: np.ndarray, count: int) -> np.ndarray:
    """Poses (count, 13) that stay where they end."""
    return np.vstack([pose, np.repeat(pose[-1:], count - len(pose), axis=0)])


if __name__ == "__main__":
    main()
