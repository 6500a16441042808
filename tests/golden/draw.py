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

PARTICIPANT = "par2"
# Every fourth of the simulated frames is kept, 25 Hz: what people do lies below 6 Hz.
KEPT = 4


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
    ]


def thinned(trial: Recording) -> Recording:
    """Every `KEPT`-th frame."""
    parts = {name: values[::KEPT] for name, values in vars(trial).items()}
    return replace(trial, **parts)


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
        write_case(study, case, coarse, folder)
        key = case_key(case, drawn.recordings)
        truth = {name: key[name] for name in ("participant", "seed", "mode", "effects")}
        (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
