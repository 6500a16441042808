"""The person of a case: the arm with and without the effects, and how movements vary and change."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from simulated_persons.arm import Anatomy, draw_person
from simulated_persons.effects import Injection
from simulated_persons.movement import draw_change
from simulated_persons.observation import AXIAL_SESSION, CHANNELS, Measurement, draw_axial
from simulated_persons.plan import Plan
from simulated_persons.scatter import draw_scale

# Electrodes and markers, put on again: standard deviations of the log of gains, and of turns. Means
# of three normalised repeats on two days differ by 42 to 66 % (limits of agreement; Andersen et al.
# 2014, J Electromyogr Kinesiol 24: 579-587), 0.22 to 0.34 of deviation; repeats make up 0.15.
SESSION_GAIN, SESSION_TURN_DEG = 0.2, 0.4


@dataclass(frozen=True, eq=False)
class Person:
    """Who is simulated in a case.

    Attributes
    ----------
    usual, affected : arm without and with the effects, an `Arm` or that of another plant; second :
        the latter in another session
    change : path (10, WAVES) [rad] on each task, done otherwise
    scale : of the scatter of each task's repeats
    rng : of the repeats
    """

    usual: Any
    affected: Any
    second: Any
    change: Mapping[str, np.ndarray]
    scale: Mapping[str, float]
    rng: np.random.Generator


def draw_case(
    anatomy: Anatomy,
    plan: Plan,
    draw: Callable[[Anatomy, np.random.Generator], Any] = draw_person,
    inject: Callable[[Any, Injection], Any] = lambda arm, injection: injection.apply(arm),
) -> Person:
    """The person of a case, from its seed.

    Parameters
    ----------
    draw : draws the arm, of the plant's own kind; inject : gives an arm an effect
    """
    rng = np.random.default_rng(plan.seed)
    usual = draw(anatomy, rng)
    if plan.markers:
        usual = replace(
            usual, measurement=replace(usual.measurement, axial_rad=draw_axial(rng, 1.0))
        )
    affected = usual
    for injection in plan.injections:
        affected = inject(affected, injection)
    again = _another_session(affected.measurement, plan.markers, rng)
    tasks = (*plan.tasks, plan.hidden)
    return Person(
        usual=usual,
        affected=affected,
        second=replace(affected, measurement=again),
        change=draw_change(rng, tasks),
        scale=scatter_scales(plan),
        rng=rng,
    )


def scatter_scales(plan: Plan) -> dict[str, float]:
    """How much the repeats of each task scatter, in motion and in the record."""
    rng = np.random.default_rng([plan.seed, 2])
    return {task: draw_scale(rng) for task in (*plan.tasks, plan.hidden)}


def _another_session(
    measurement: Measurement, markers: bool, rng: np.random.Generator
) -> Measurement:
    """Electrodes and markers put on again: what differs between recordings without a cause."""
    gain = np.exp(rng.normal(0.0, SESSION_GAIN, len(CHANNELS)))
    turns = np.deg2rad(SESSION_TURN_DEG) * rng.normal(size=(3, 3))
    axial = draw_axial(rng, AXIAL_SESSION) if markers else 0.0
    return replace(
        measurement,
        emg_gain=gain * measurement.emg_gain,
        thorax_rad=measurement.thorax_rad + turns[0],
        scapula_rad=measurement.scapula_rad + turns[1],
        humerus_rad=measurement.humerus_rad + turns[2],
        axial_rad=measurement.axial_rad + axial,
    )
