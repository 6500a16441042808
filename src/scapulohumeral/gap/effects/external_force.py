"""A force on the arm from outside: arm support, exoskeleton, cable, contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.model.rotations import Array

POINTS = ("hand", "forearm")
# Thorax axes (x right, y up, z back) of the parameters.
AXES = [1, 0, 2]
SOURCE = (
    "an arm weighs 5 % of the body, about 40 N (Winter 2009, Biomechanics and Motor Control of "
    "Human Movement, 4th ed.); ASSUME: aids carry at most it and its load, sideways half of that"
)
PARAMS = (
    Param("up_N", "N", 0.0, -60.0, 60.0, 15.0, 15.0, SOURCE),
    Param("right_N", "N", 0.0, -30.0, 30.0, 8.0, 8.0, SOURCE),
    Param("back_N", "N", 0.0, -30.0, 30.0, 8.0, 8.0, SOURCE),
)


@dataclass(frozen=True)
class ExternalForce(Effect):
    """A force that is constant in thorax axes.

    Quasi-static: its levers are those of the nominal solution, so the equations keep their form. A
    force that changes during the movement is met by its mean only.
    """

    def apply(self, body: Body, values: Array) -> Body:
        """Add its generalised forces."""
        force = np.zeros(3)
        force[AXES] = values
        return body.loaded(body.levers[str(self.member)] @ force)


def members(setup: Setup) -> tuple[Effect, ...]:
    """Centre of the hand, middle of the forearm."""
    return tuple(
        ExternalForce(
            "input", "external_force", point, PARAMS, KINEMATICS,
            ("hand_load", "segment_mass", "thorax_tilt"),
            "the same movement fast and slow: a force has no inertia; a trial with the aid off",
        )
        for point in POINTS
    )  # fmt: skip
