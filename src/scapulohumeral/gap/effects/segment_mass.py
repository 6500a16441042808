"""A segment heavier or lighter than scaling says."""

from __future__ import annotations

from dataclasses import dataclass, replace

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.model.rotations import Array

SEGMENTS = {"upper_arm": "humerus", "forearm": "forearm"}
PARAMS = (
    Param(
        "mass_factor",
        "1",
        1.0,
        0.6,
        1.4,
        1.2,
        0.15,
        "tables of anthropometry differ by tens of percent (Rao et al. 2006, J Biomech 39: "
        "1531-1536)",
        "log",
    ),
)


@dataclass(frozen=True)
class SegmentMass(Effect):
    """Mass and inertia of a segment times one factor."""

    def apply(self, body: Body, values: Array) -> Body:
        """Scale the segment."""
        segment = SEGMENTS[str(self.member)]
        changed = {
            name: values[0] * body.parameters[name]
            for name in (f"mass_{segment}", f"inertia_{segment}")
        }
        return replace(body, parameters={**body.parameters, **changed})


def members(setup: Setup) -> tuple[Effect, ...]:
    """Upper arm and forearm with hand."""
    return tuple(
        SegmentMass(
            "body", "segment_mass", name, PARAMS, KINEMATICS, ("hand_load", "thorax_tilt"),
            "static holds with the elbow at 0 and 90 deg; weighing the limb",
        )
        for name in SEGMENTS
    )  # fmt: skip
