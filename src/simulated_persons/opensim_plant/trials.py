"""All trials of cases of the second plant, without noise.

Persons move as recorded, usually or otherwise: contact of the scapula is no spring here, so every
recorded pose can be kept. Who gives way is bent by the effect (:mod:`.process`).
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from scapulohumeral.errors import SolveError
from scapulohumeral.model.rotations import relative_angle
from simulated_persons.case_person import draw_case
from simulated_persons.drawing.study import Study
from simulated_persons.drawing.trials import (
    LARGEST_MISS,
    MISSED,
    TOO_WEAK,
    Recordings,
    Run,
    recorded_ways,
    tiredness,
    trial_runs,
)
from simulated_persons.movement import SETTLE_S, phase_of_trial
from simulated_persons.observation import Recording, electrode_matrix, record
from simulated_persons.opensim_plant.arm import OpenSimArm, draw_opensim_person
from simulated_persons.opensim_plant.body import JOBS, UNSHARED, write_body
from simulated_persons.opensim_plant.effects import affected
from simulated_persons.plan import YIELDS, Plan
from simulated_persons.simulation import TICK_S
from simulated_persons.wish import humerus_of

PROCESS = "simulated_persons.opensim_plant.process"
NOT_SHARED = "a load cannot be shared out among muscles"
# Largest root mean square of a torque that nothing gives: a quarter of a degree, over the stiffness
# of a shoulder. Sharing itself leaves about a tenth.
LARGEST_RESERVE_NM = 0.5
SETTLING = round(SETTLE_S / TICK_S)


def simulated_by_opensim(study: Study, plans: Sequence[Plan]) -> dict[str, Recordings | str]:
    """Noise-free recordings of every trial, or why a case has none.

    That is `MISSED`, `TOO_WEAK` or `NOT_SHARED`.
    """
    return {plan.id: _case(study, plan) for plan in plans}


def _case(study: Study, plan: Plan) -> Recordings | str:
    """One case in a process of OpenSim's; noise-free trials go first, to fail soon."""
    anatomy = study.anatomies[plan.participant]
    person = draw_case(anatomy, plan, draw_opensim_person, affected)
    runs = trial_runs(plan, person, recorded_ways(study, plan, person))
    exact = [run for run in runs if run.name[2] == 0]
    repeats = [run for run in runs if run.name[2] != 0]
    model = study.models / f"{plan.participant}.osim"
    recordings: Recordings = {}
    for part in (exact, repeats):
        every = _made(model, part, person.usual, plan)
        if every is None:
            return NOT_SHARED
        for run, made in zip(part, every, strict=True):
            failure = _failure(run, made)
            if failure:
                return failure
            recordings[run.name] = _recorded(run, made)
    return recordings


def _made(
    model: Path, runs: Sequence[Run], usual: OpenSimArm, plan: Plan
) -> list[Mapping[str, np.ndarray]] | None:
    """What each run becomes; None if the load of one cannot be shared out.

    The settling before a recording is left out: nothing moves there.
    """
    bodies = [usual.body]
    for run in runs:
        if not any(run.arm.body is body for body in bodies):
            bodies.append(run.arm.body)
    with tempfile.TemporaryDirectory() as name:
        folder, trials = Path(name), []
        for number, body in enumerate(bodies):
            write_body(body, folder / f"body_{number}.npz")
        for number, run in enumerate(runs):
            tired = tiredness(phase_of_trial(len(run.pose)))
            path = folder / f"trial_{number}.npz"
            np.savez(path, pose=run.pose[SETTLING:], tired=tired[SETTLING:])
            own = next(k for k, body in enumerate(bodies) if body is run.arm.body)
            bends = plan.person == YIELDS and own > 0
            trials.append({"body": own, "bends_from": 0 if bends else None})
        jobs = {
            "model": str(model),
            "muscles": list(usual.anatomy.names),
            "step_s": TICK_S,
            "trials": trials,
        }
        (folder / JOBS).write_text(json.dumps(jobs), encoding="utf-8")
        if not _shared_out(folder):
            return None
        return [dict(np.load(folder / f"made_{number}.npz")) for number in range(len(runs))]


def _shared_out(folder: Path) -> bool:
    """Run the process on a folder; False where a load cannot be shared out among muscles."""
    done = subprocess.run(
        [sys.executable, "-m", PROCESS, str(folder)], capture_output=True, text=True, check=False
    )
    if done.returncode not in (0, UNSHARED):
        message = done.stderr.strip().rpartition("\n")[2]
        raise SolveError(
            f"{PROCESS} ended with {done.returncode}: {message or 'no message'} Run "
            "`python -c 'import opensim'` to see whether opensim works here."
        )
    return done.returncode == 0


def _failure(run: Run, made: Mapping[str, np.ndarray]) -> str:
    """Why a run is none of the task; empty if it is."""
    humerus, wished = humerus_of(made["pose"]), humerus_of(run.pose[SETTLING:])
    if not relative_angle(humerus, wished).max() <= LARGEST_MISS:
        return MISSED
    reserve = np.sqrt(np.mean(made["reserve_Nm"] ** 2, axis=0)).max()
    if run.name[2] == 0 and not reserve <= LARGEST_RESERVE_NM:
        return TOO_WEAK
    return ""


def _recorded(run: Run, made: Mapping[str, np.ndarray]) -> Recording:
    """A recording, which wants the settling before it as well."""
    before = ((SETTLING, 0), (0, 0))
    pose, excitation, reaction = (
        np.pad(made[name], before, mode="edge") for name in ("pose", "excitation", "reaction_N")
    )
    anatomy = run.arm.anatomy
    electrodes = electrode_matrix(anatomy.names, anatomy.groups)
    return record(pose, excitation, reaction, run.arm.measurement, electrodes)
