"""The part of the plant that needs opensim, run as a process of its own.

``python -m simulated_persons.opensim_plant.process FOLDER`` reads ``FOLDER/jobs.json`` with bodies
and trials as .npz beside it, and writes what each trial became to ``FOLDER/made_K.npz``.

A person keeps the wished movement, and only muscles answer to what acts; or gives way like a
spring: the torque that is missing if muscles do what they do without the effect bends each joint by
that torque over one stiffness, once, and the load is shared out anew in the bent pose.

Letters: S control steps, F frames, M muscles.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.signal import butter, sosfiltfilt

from scapulohumeral.errors import SolveError
from simulated_persons.opensim_plant.body import JOBS, UNSHARED, Body, read_body
from simulated_persons.opensim_plant.mechanics import Mechanics, coordinates_of, pose_of
from simulated_persons.opensim_plant.sharing import outcome, share, with_tired
from simulated_persons.opensim_plant.skeleton import Skeleton

# A frame every so many control steps: 12.5 Hz at 100 Hz, three times what envelopes keep.
FRAME_STEPS = 8
# ASSUME: stiffness of a shoulder with its reflexes and corrections; the slow part of a missing
# torque bends it.
STIFFNESS_NM_RAD, BENDING_HZ = 120.0, 2.0


@dataclass(frozen=True, eq=False)
class Person:
    """A skeleton with a body."""

    skeleton: Skeleton
    body: Body


def main(arguments: Sequence[str]) -> None:
    """Command line; ends with :data:`UNSHARED` where a load cannot be shared out."""
    try:
        run(Path(arguments[0]))
    except SolveError as error:
        print(error, file=sys.stderr)
        sys.exit(UNSHARED)


def run(folder: Path) -> None:
    """Simulate all trials of a folder."""
    jobs = json.loads((folder / JOBS).read_text(encoding="utf-8"))

    @cache
    def person(number: int) -> Person:
        body = read_body(folder / f"body_{number}.npz")
        return Person(Skeleton(Path(jobs["model"]), jobs["muscles"], body), body)

    for number, trial in enumerate(jobs["trials"]):
        with np.load(folder / f"trial_{number}.npz") as arrays:
            pose, tired = arrays["pose"], arrays["tired"]
        who = person(trial["body"])
        if trial["bends_from"] is not None:
            pose = bent(who, person(trial["bends_from"]), pose, tired, jobs["step_s"])
        trace = simulate(who, pose, tired, jobs["step_s"])
        np.savez(folder / f"made_{number}.npz", **trace)


def simulate(who: Person, pose: np.ndarray, tired: np.ndarray, step_s: float) -> dict:
    """Excitations that make a movement of poses (S, 13).

    Parameters
    ----------
    tired : (S,) how far muscles are on their way from fresh to the end of the trial

    Returns
    -------
    pose (S, 13); excitation (S, M); reaction_N (S, 3) of the glenoid; reserve_Nm (F, 10)
    """
    mechanics, frames = _seen(who, coordinates_of(pose), step_s)
    shared = share(mechanics, who.body, _left(who, tired[frames]))
    every = np.arange(len(pose))
    activation = PchipInterpolator(frames, shared.activation)(every)
    return {
        "pose": pose,
        "excitation": excitation(activation, who.body, step_s),
        "reaction_N": PchipInterpolator(frames, shared.reaction)(every),
        "reserve_Nm": shared.reserve,
    }


def bent(
    who: Person, usual: Person, pose: np.ndarray, tired: np.ndarray, step_s: float
) -> np.ndarray:
    """Poses (S, 13) of a person who gives way, against the one without the effect."""
    wished = coordinates_of(pose)
    before, frames = _seen(usual, wished, step_s)
    habit = share(before, usual.body, _left(usual, tired[frames]))
    after, _ = _seen(who, wished, step_s)
    left = _left(who, tired[frames])
    missing = outcome(with_tired(after, left), habit.activation, habit.support).reserve
    bending = PchipInterpolator(frames, missing / STIFFNESS_NM_RAD)(np.arange(len(pose)))
    sections = butter(2, BENDING_HZ, fs=1.0 / step_s, output="sos")
    return pose_of(wished - sosfiltfilt(sections, bending, axis=0))


def _seen(who: Person, wished: np.ndarray, step_s: float) -> tuple[Mechanics, np.ndarray]:
    """Mechanics at some frames of coordinates (S, 10), and their places (F,)."""
    frames = np.unique(np.append(np.arange(0, len(wished), FRAME_STEPS), len(wished) - 1))
    speed = np.gradient(wished, step_s, axis=0)
    acceleration = np.gradient(speed, step_s, axis=0)
    chosen = (wished[frames], speed[frames], acceleration[frames])
    return who.skeleton.mechanics(*chosen), frames


def _left(who: Person, tired: np.ndarray) -> np.ndarray:
    """Share of active forces (F, M) that has not tired."""
    return 1.0 - tired[:, None] * (1.0 - who.body.end_force)


def excitation(activation: np.ndarray, body: Body, step_s: float) -> np.ndarray:
    """Excitations (S, M) in [0, 1] that make activations (S, M): OpenSim's own dynamics, inverted.

    da/dt = (e - a) / tau with tau = rise (0.5 + 1.5 a), or fall / (0.5 + 1.5 a) where e < a
    (MuscleFirstOrderActivationDynamicModel, without its smoothing).
    """
    rate = np.gradient(activation, step_s, axis=0)
    speed = 0.5 + 1.5 * activation
    delay = np.where(rate > 0.0, body.rise_s * speed, body.fall_s / speed)
    return np.clip(activation + delay * rate, 0.0, 1.0)


if __name__ == "__main__":
    main(sys.argv[1:])
