"""Keys of cases: what is true of them, and what would be seen of it without noise.

Letters: K channels, F phase points.
"""

from __future__ import annotations

import numpy as np

from simulated_persons.drawing.trials import OTHERWISE, Recordings
from simulated_persons.footprint import (
    FOOTPRINT_MULTIPLE,
    channel_names,
    difference,
    floor,
    footprints,
)
from simulated_persons.observation import Recording
from simulated_persons.plan import Plan


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
        "shown": shown(plan, recordings),
        "footprint_multiple": FOOTPRINT_MULTIPLE,
        "change_sigma": {task: np.round(change, 2).tolist() for task, change in sigma.items()},
        "hidden_task": {
            "task": plan.hidden,
            **{side: _noise_free(trial, plan) for side, trial in hidden.items()},
        },
        "noise_free": {task: _noise_free_sides(task, plan, recordings) for task in plan.tasks},
    }


def _noise_free_sides(task: str, plan: Plan, recordings: Recordings) -> dict[str, dict]:
    """What would be recorded of a visible task without noise, by side, `OTHERWISE` among them."""
    sides = ("test", "reference", *((OTHERWISE,) if plan.otherwise else ()))
    return {side: _noise_free(recordings[side, task, 0], plan) for side in sides}


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


def shown(plan: Plan, recordings: Recordings) -> bool:
    """Whether the cause of a case shows in some channel, without noise."""
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
