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
from simulated_persons.case_person import Person, draw_case, scatter_scales
from simulated_persons.footprint import (
    CONTACT,
    FOOTPRINT_MULTIPLE,
    channel_names,
    difference,
    floor,
    footprints,
)
from simulated_persons.movement import (
    SETTLE_S,
    Variation,
    draw_variation,
    habit,
    no_variation,
    phase_of_trial,
    wished_poses,
)
from simulated_persons.observation import (
    CHANNELS,
    ELECTRODES,
    NEIGHBOURS,
    Recording,
    add_noise,
    electrode_matrix,
    record,
)
from simulated_persons.plan import SHARES, YIELDS, Plan, draw_plans, redrawn
from simulated_persons.simulation import GIRDLE_STIFFNESS, TICK_S, Trace, keep, simulate
from simulated_persons.wish import humerus_of, make_wish

BATCH = 100
LARGEST_MISS = np.deg2rad(25.0)  # of the humerus: beyond, the arm did not do the task
# Largest rotation of a person who keeps a movement: torques that the muscles do not give, over the
# stiffness of a shoulder.
LARGEST_DEFLECTION = np.deg2rad(0.3)
LARGEST_ATTEMPTS = 12
KEEPING_ATTEMPTS = 3  # draws in which a movement may turn out to be impossible to keep
# Side of noise-free trials that are done as the test is, but without the effect.
OTHERWISE = "otherwise"
TIRING = 2.0  # muscles tire as 1 - exp(-2 phase)
# Largest difference of a mean envelope between repeats of a task [fraction of MVC]. Some persons
# have two ways to do a task, 0.15 to 0.3 apart: a change of way is no effect.
STEADY_EMG = 0.15
# Draws for an effect that shows; families that hardly ever do are kept as they are then.
SHOWN_ATTEMPTS = 3
# The published arm of par1 weighs 12 kg, three times what anthropometry gives, and its muscles
# cannot lift it: plants and their participant files take a third.
ARM_MASS = {"par1": 1.0 / 3.0}
ARM_SEGMENTS = ("clavicle_r", "scapula_r", "humerus_r", "ulna_r", "radius_r", "hand_r")


@dataclass(frozen=True, eq=False)
class Run:
    """One trial to simulate; `name` is (side, task, repeat), repeat 0 being noise-free.

    `keeps`: the person does exactly the wished `pose` (S, 13).
    """

    case: str
    name: tuple[str, str, int]
    arm: Arm
    pose: np.ndarray
    keeps: bool


@dataclass(frozen=True, eq=False)
class Way:
    """How a person does a task: a motion, and a path (10, WAVES) [rad] on top of it."""

    motion: Motion
    path_rad: np.ndarray

    def poses(self, variation: Variation) -> np.ndarray:
        """Wished poses (S, 13) of a trial."""
        return wished_poses(self.motion, variation.and_also(self.path_rad))


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
    shows. Where no person manages to keep a movement against an effect, the person gives way.
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
            wanted &= plan.may_show
            if (
                recordings is not None
                and _steady(recordings)
                and (not wanted or _shown(plan, recordings))
            ):
                yield plan, _with_noise(plan, recordings)
            else:
                again.append(_redrawn(plan, attempt))
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


def _redrawn(plan: Plan, attempt: int) -> Plan:
    """The case drawn again; who never manages to keep the movement gives way."""
    other = redrawn(plan, attempt)
    return replace(other, person=YIELDS) if attempt >= KEEPING_ATTEMPTS else other


def _simulated(study: Study, plans: Sequence[Plan]) -> dict[str, Recordings | None]:
    """Noise-free recordings of every trial; None for a case with an arm that missed its task."""
    persons = {plan.id: draw_case(study.anatomies[plan.participant], plan) for plan in plans}
    ways = _ways(study, plans, persons)
    able = [plan for plan in plans if plan.id in ways]
    found: dict[str, Recordings | None] = {plan.id: None for plan in plans}
    found.update({plan.id: {} for plan in able})
    runs = {plan.id: _runs(plan, persons[plan.id], ways[plan.id]) for plan in able}
    for run, q, trace, missed in _followed(study, plans, runs):
        trials = found[run.case]
        if missed:
            found[run.case] = None
        elif trials is not None:
            anatomy = run.arm.anatomy
            electrodes = electrode_matrix(anatomy.names, anatomy.groups)
            trials[run.name] = record(
                q, trace.excitation, trace.reaction_N, run.arm.measurement, electrodes
            )
    return found


def _ways(
    study: Study, plans: Sequence[Plan], persons: Mapping[str, Person]
) -> dict[str, dict[tuple[bool, str], Way]]:
    """Movement of each task of each case, as usual (False) and otherwise (True).

    Who keeps a movement keeps the one that the arm made when it followed the recording without
    any effect. Cases whose arm could not are left out.
    """
    ways: dict[str, dict[tuple[bool, str], Way]] = {}
    first: dict[str, list[Run]] = {}
    still = no_variation()
    for plan in plans:
        person = persons[plan.id]
        ways[plan.id] = {
            (otherwise, task): Way(study.motions[plan.participant, task], path)
            for task in (*plan.tasks, plan.hidden)
            for otherwise, path in ((False, 0.0 * person.change[task]), (True, person.change[task]))
            if plan.otherwise or not otherwise
        }
        if plan.person != YIELDS:
            first[plan.id] = [
                Run(plan.id, (str(otherwise), task, 0), person.usual, way.poses(still), False)
                for (otherwise, task), way in ways[plan.id].items()
            ]
    for run, q, _, missed in _followed(study, plans, first):
        if missed:
            ways.pop(run.case, None)
        elif run.case in ways:
            otherwise, task, _ = run.name
            key = otherwise == str(True), task
            ways[run.case][key] = Way(habit(q), 0.0 * ways[run.case][key].path_rad)
    return ways


def _followed(
    study: Study, plans: Sequence[Plan], runs: Mapping[str, Sequence[Run]]
) -> Iterator[tuple[Run, np.ndarray, Trace, bool]]:
    """Simulate the runs of all cases: poses, trace, and whether the arm missed its task."""
    together: dict[tuple[str, bool], list[Run]] = defaultdict(list)
    for plan in plans:
        for run in runs.get(plan.id, ()):
            together[plan.participant, run.keeps].append(run)
    for group in together.values():
        group.sort(key=lambda run: len(run.pose))
        for start in range(0, len(group), BATCH):
            yield from _follow(group[start : start + BATCH])


def _steady(recordings: Recordings) -> bool:
    """Whether all repeats of a task, the noise-free one too, have much the same mean envelopes."""
    ways: dict[tuple[str, str], list[np.ndarray]] = defaultdict(list)
    for (side, task, _), trial in recordings.items():
        ways[side, task].append(trial.emg.mean(axis=0))
    return all(np.ptp(means, axis=0).max() <= STEADY_EMG for means in ways.values())


def _runs(plan: Plan, person: Person, ways: Mapping[tuple[bool, str], Way]) -> list[Run]:
    """Every trial of a case: noise-free twins of all tasks, repeats of those that are recorded."""
    runs = []

    def add(side: str, task: str, repeat: int, arm: Arm, way: Way, varied: Variation) -> None:
        keeps = plan.person != YIELDS
        runs.append(Run(plan.id, (side, task, repeat), arm, way.poses(varied), keeps))

    for task in (*plan.tasks, plan.hidden):
        usual, tested = ways[False, task], ways[plan.otherwise, task]
        add("reference", task, 0, person.usual, usual, no_variation())
        add("test", task, 0, person.affected, tested, no_variation())
        if task == plan.hidden:
            continue
        if plan.otherwise:
            add(OTHERWISE, task, 0, person.usual, tested, no_variation())
        sides = (("reference", person.usual, usual), ("test", person.second, tested))
        for side, arm, way in sides:
            for repeat in range(1, plan.repeats + 1):
                if side == "test" or plan.reference:
                    varied = draw_variation(person.rng, person.scale[task])
                    add(side, task, repeat, arm, way, varied)
    return runs


def _follow(runs: Sequence[Run]) -> Iterator[tuple[Run, np.ndarray, Trace, bool]]:
    """Simulate runs of one anatomy together; all of them keep their motion, or none does."""
    longest = max(len(run.pose) for run in runs)
    pose = np.stack([_held(run.pose, longest) for run in runs], axis=1)
    body, control = batch([run.arm for run in runs])
    phase = np.ones((longest, len(runs)))
    for number, run in enumerate(runs):
        phase[: len(run.pose), number] = phase_of_trial(len(run.pose))
    tired = np.expm1(-TIRING * phase) / np.expm1(-TIRING)
    wish = make_wish(pose, TICK_S, tired, body.muscles.end_force)
    with np.errstate(all="ignore"):  # an arm that cannot do its task may diverge: it is dropped
        trace = (keep if runs[0].keeps else simulate)(body, control, wish)
    for number, run in enumerate(runs):
        own = Trace(*(part[: len(run.pose), number] for part in vars(trace).values()))
        miss = relative_angle(humerus_of(own.q), wish.humerus[: len(run.pose), number]).max()
        missed = not miss <= LARGEST_MISS
        if run.keeps and run.name[2] == 0:
            missed |= not deflection(own.missing_Nm) <= LARGEST_DEFLECTION
        yield run, own.q, own, bool(missed)


def deflection(missing: np.ndarray) -> float:
    """How far joints give for want of torques (S, 10): largest root mean square [rad]."""
    recorded = missing[round(SETTLE_S / TICK_S) :]
    return float(np.sqrt(np.mean(recorded**2, axis=0)).max() / GIRDLE_STIFFNESS)


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
        motion, scale = study.motions[plan.participant, task], scatter_scales(plan)[task]
        for side, arm in (("reference", person), ("test", affected)):
            for repeat in range(plan.repeats + 1 if task != plan.hidden else 1):
                varied = no_variation() if repeat == 0 else draw_variation(rng, scale)
                pose = wished_poses(motion, varied)
                rest = np.zeros((len(pose), len(anatomy.names)))
                free = np.zeros((len(pose), 3))
                trials[side, task, repeat] = record(pose, rest, free, arm.measurement, electrodes)
    return trials


def _with_noise(plan: Plan, recordings: Recordings) -> Recordings:
    rng = np.random.default_rng([plan.seed, 1])
    scale = scatter_scales(plan)
    return {
        name: add_noise(trial, rng, scale[name[1]]) if name[2] else trial
        for name, trial in recordings.items()
    }


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
    sigma, size = _changes(plan, recordings, *_compared(plan))
    hidden = {side: recordings[side, plan.hidden, 0] for side in ("test", "reference")}
    return {
        "schema": "blind-key/1",
        "case": plan.id,
        "plant": plan.plant,
        "kind": plan.kind,
        "seed": plan.seed,
        "person": plan.person,
        "markers": plan.markers,
        "otherwise": _otherwise(plan, recordings),
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


def _compared(plan: Plan) -> tuple[str, str]:
    """Sides whose noise-free trials differ by the cause of a case alone."""
    return "test", OTHERWISE if plan.otherwise and plan.kind != "strategy" else "reference"


def _changes(
    plan: Plan, recordings: Recordings, after: str, before: str
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """What would change without noise: standard errors by task (F, K), largest footprints (K,)."""
    sigma = {}
    for task in plan.tasks:
        test, reference = (recordings[side, task, 0] for side in (after, before))
        error = floor(reference, plan.repeats, plan.emg, plan.contact, plan.reference)
        sigma[task] = difference(test, reference, plan.emg, plan.contact) / error
    return sigma, np.max([footprints(change) for change in sigma.values()], axis=0)


def _shown(plan: Plan, recordings: Recordings) -> bool:
    return bool(_changes(plan, recordings, *_compared(plan))[1].max() >= FOOTPRINT_MULTIPLE)


def _otherwise(plan: Plan, recordings: Recordings) -> dict | None:
    """How far the movement was done otherwise: degrees by channel, and whether that shows."""
    if not plan.otherwise:
        return None
    _, size = _changes(plan, recordings, OTHERWISE, "reference")
    moved = [
        difference(recordings[OTHERWISE, task, 0], recordings["reference", task, 0], False, False)
        for task in plan.tasks
    ]
    degrees = np.max([footprints(change) for change in moved], axis=0)
    return {
        "deg": dict(zip(channel_names(False, False), np.round(degrees, 2).tolist(), strict=True)),
        "shown": bool(size.max() >= FOOTPRINT_MULTIPLE),
    }


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
