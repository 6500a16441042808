"""One prediction solved again: a weight, the mesh or the start changed, one at a time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from scapulohumeral.configuration.sensitivity import Sensitivity

BASE = "base"
STABILITY = "w_gh"


@dataclass(frozen=True)
class Case:
    """One change.

    Attributes
    ----------
    name : of the case, and of its files
    kind : "base" (nothing is changed), "weight", "mesh" or "start"
    change : in words
    factors : factor on weights, by name
    time_step_s : mesh interval; None: that of the tracked motion
    scapula_turn_deg : turn of the scapula of the start about its z axis
    seed : of a random start; None: the tracked motion
    """

    name: str
    kind: str
    change: str
    factors: Mapping[str, float] = field(default_factory=dict)
    time_step_s: float | None = None
    scapula_turn_deg: float = 0.0
    seed: int | None = None


def sensitivity_cases(settings: Sensitivity) -> dict[str, Case]:
    """All cases by name, the unchanged prediction first."""
    cases = [Case(BASE, "base", "nothing")]
    for weight in settings.weights:
        for word, sign, power in (("divided", "/", -1), ("times", "×", 1)):
            about = f"{weight.replace('_', ' ')} {sign} {settings.factor:g}"
            factors: dict[str, float] = {weight: settings.factor**power}
            cases.append(Case(f"{weight}_{word}", "weight", about, factors))
    for step in settings.time_steps_s:
        name = f"mesh_{round(1000 * step)}ms"
        cases.append(Case(name, "mesh", f"mesh interval {step:g} s", time_step_s=step))
    for turn in settings.scapula_turns_deg:
        name = f"start_{'down' if turn < 0 else 'up'}_{abs(turn):g}".replace(".", "p")
        about = f"scapula of the start turned by {turn:+g} deg"
        cases.append(Case(name, "start", about, scapula_turn_deg=turn))
    for seed in settings.random_seeds:
        cases.append(Case(f"start_random_{seed}", "start", f"random start {seed}", seed=seed))
    return {case.name: case for case in cases}


def changed_weights(case: Case, weights: Mapping[str, float]) -> dict[str, float]:
    """Weights of the objective of a case; that of joint stability is in its condition."""
    return {key: value * case.factors.get(key, 1.0) for key, value in weights.items()}
