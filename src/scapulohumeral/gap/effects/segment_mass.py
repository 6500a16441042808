"""Segments heavier or lighter than scaling says."""

from __future__ import annotations

from dataclasses import dataclass, replace

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.model.rotations import Array

SEGMENTS = {
    "upper_arm": ("humerus",),
    "forearm": ("forearm",),
    "arm": ("humerus", "forearm"),
    "girdle": ("clavicle", "scapula"),
}
ONE = Param(
    "mass_factor",
    "1",
    1.0,
    0.6,
    1.4,
    1.2,
    0.15,
    "tables of anthropometry differ by tens of percent (Rao et al. 2006, J Biomech 39: 1531-1536)",
    "log",
)
ARM = replace(
    ONE,
    low=0.4,
    high=2.5,
    prior_sd=0.25,
    source="ASSUME: tables differ by tens of percent, and models of one study by up to threefold",
)
GIRDLE = replace(
    ARM,
    low=0.25,
    high=4.0,
    typical=1.5,
    prior_sd=0.4,
    source="ASSUME: how much of the soft tissue moves with the bones is a choice of each model",
)
PARAMS = {"upper_arm": ONE, "forearm": ONE, "arm": ARM, "girdle": GIRDLE}


@dataclass(frozen=True)
class SegmentMass(Effect):
    """Mass and inertia of some segments times one factor."""

    def apply(self, body: Body, values: Array) -> Body:
        """Scale the segments."""
        changed = {
            name: values[0] * body.parameters[name]
            for segment in SEGMENTS[str(self.member)]
            for name in (f"mass_{segment}", f"inertia_{segment}")
        }
        return replace(body, parameters={**body.parameters, **changed})


def members(setup: Setup) -> tuple[Effect, ...]:
    """Upper arm, forearm with hand, both, and clavicle with scapula."""
    return tuple(
        SegmentMass(
            "body", "segment_mass", name, (PARAMS[name],), KINEMATICS,
            ("hand_load", "thorax_tilt", "external_force"),
            "static holds with the elbow at 0 and 90 deg; weighing the limb",
        )
        for name in SEGMENTS
    )  # fmt: skip
