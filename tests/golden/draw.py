"""Draw the golden cases again: trials of simulated persons with a known effect.

Usage: ``PYTHONPATH=tests python -m golden.draw --results results --participants config/participants
--out tests/golden/cases``, after the models and equations of `PARTICIPANT` have been built. The
trials are committed, so this is needed only for other cases.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

from simulated_persons.drawing.attempts import Drawn, drawn_cases
from simulated_persons.drawing.case_files import write_case
from simulated_persons.drawing.keys import case_key
from simulated_persons.drawing.study import load_study
from simulated_persons.drawing.trials import Recordings
from simulated_persons.effects import Injection, co_contraction, frame_misalignment
from simulated_persons.observation import Recording
from simulated_persons.plan import YIELDS, Plan
from simulated_persons.spoilt import FULL_ROTATION, spoilt

PARTICIPANT = "par2"
# Every fourth of the simulated frames is kept, 25 Hz: what people do lies below 6 Hz.
KEPT = 4
# Skin of the upper arm, and frames of other markers, in one of two records of the same movements.
TWO_RECORDS, LOST_SHARE, PUT_ON_DEG, MARKER_SEED = "two_records", 0.4, 1.0, 1
SKIN = {"label": "measurement/humerus_sta", "parameter": "lost_share", "amplitude": LOST_SHARE}


def large(draw: Callable[[np.random.Generator], Injection], label: str, least: float) -> Injection:
    """The first injection of a family with a label and at least an amplitude, by seed."""
    for seed in range(1000):
        injection = draw(np.random.default_rng(seed))
        if injection.label == label and abs(injection.amplitude) >= least:
            return injection
    raise ValueError(f"{draw.__name__}: no '{label}' of {least} in 1000 draws.")


def plan(name: str, seed: int, injections: tuple[Injection, ...], **changes) -> Plan:
    """A case with two repeats of one elevation and side."""
    base = Plan(
        id=name,
        seed=seed,
        plant="P1",
        kind="single" if injections else "null",
        participant=PARTICIPANT,
        tasks=("scapular",),
        hidden="sagittal",
        injections=injections,
        emg=True,
        contact=False,
        reference=True,
        repeats=2,
        faint=True,  # drawn once, whatever shows
        person=YIELDS,
        markers=False,
    )
    return replace(base, **changes)


def plans() -> list[Plan]:
    """The golden cases: with causes that stand out, so that their names are no matter of luck."""
    stiff = large(co_contraction, "control/co_contraction/GH", 0.1)
    turn = large(frame_misalignment, "input/frame_misalignment/scapula", 10.0)
    return [
        plan("reference_and_emg", 1, (stiff,), tasks=("frontal", "scapular")),
        plan("motion_alone", 2, (turn,), emg=False),
        plan("without_effect", 3, (), reference=False),
        plan(TWO_RECORDS, 4, (), tasks=("frontal", "scapular"), emg=False),
    ]


def thinned(trial: Recording) -> Recording:
    """Every `KEPT`-th frame."""
    parts = {name: values[::KEPT] for name, values in vars(trial).items()}
    return replace(trial, **parts)


def recorded_twice(trials: Recordings) -> Recordings:
    """Reference trials, and the same movements as skin of the upper arm has them."""
    rng = np.random.default_rng(MARKER_SEED)
    lost_deg = LOST_SHARE * np.rad2deg(FULL_ROTATION)
    found = {}
    for (side, task, repeat), trial in trials.items():
        if side != "reference":
            continue
        found[side, task, repeat] = trial
        turned = spoilt(trial.angles_rad, "humerus", "y", lost_deg, growing=True)
        for segment, axis in product(("thorax", "scapula", "humerus"), "xyz"):
            turned = spoilt(turned, segment, axis, rng.normal(0.0, PUT_ON_DEG), growing=False)
        found["test", task, repeat] = replace(trial, angles_rad=turned)
    return found


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("results", "participants", "out"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    options = parser.parse_args()
    study = load_study(options.results, options.participants, (PARTICIPANT,))
    for drawn in drawn_cases(study, plans()):
        if not isinstance(drawn, Drawn):
            raise SystemExit(f"{drawn.attempt.plan.id}: {', '.join(drawn.attempt.failures)}")
        case, folder = drawn.plan, options.out / drawn.plan.id
        coarse: Recordings = {name: thinned(trial) for name, trial in drawn.recordings.items()}
        if case.id == TWO_RECORDS:
            coarse = recorded_twice(coarse)
        write_case(study, case, coarse, folder)
        key = case_key(case, drawn.recordings)
        truth = {name: key[name] for name in ("participant", "seed", "mode", "effects")}
        if case.id == TWO_RECORDS:
            truth["effects"] = [SKIN]
        (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
