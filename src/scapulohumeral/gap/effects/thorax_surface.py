"""A thorax under the scapula of another size or place."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.model.rotations import Array

PARAMS = (
    Param(
        "radius_factor",
        "1",
        1.0,
        0.85,
        1.15,
        1.04,
        0.04,
        "ASSUME: thoraces of adults of one size differ by less than 15 %",
        "log",
    ),
    Param(
        "back_mm",
        "mm",
        0.0,
        -25.0,
        25.0,
        8.0,
        6.0,
        "ASSUME: an ellipsoid fitted to where the scapula glides is known to a centimetre",
    ),
)


@dataclass(frozen=True)
class ThoraxSurface(Effect):
    """Radii of the thorax ellipsoid times a factor, and its centre further back."""

    def apply(self, body: Body, values: Array) -> Body:
        """Scale and move it; thorax axes have z back."""
        factor, back = values
        centre = body.parameters["thorax_centre"]
        changed = {
            "thorax_radii": factor * body.parameters["thorax_radii"],
            "thorax_centre": centre + np.array([0.0, 0.0, 1e-3 * back]),
        }
        return replace(body, parameters={**body.parameters, **changed})


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member of the family."""
    return (
        ThoraxSurface(
            "body", "thorax_surface", None, PARAMS, KINEMATICS,
            ("scapula_sta", "st_contact", "serratus_path"),
            "the shape of the back, scanned or from markers",
        ),
    )  # fmt: skip
