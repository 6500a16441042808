"""The page element that shows scenes.

The picture is drawn by ``player.js`` on a plain canvas; data, script and style are part of the
page, so that it can be read without a network.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from scapulohumeral.errors import DataError
from scapulohumeral.model.rotations import Array
from scapulohumeral.model.tables import Point
from scapulohumeral.player.scene import SEGMENTS, Scene, Surface
from scapulohumeral.templates import page_template

# Steps of the stored whole numbers: 0.1 mm, 0.1 N of a muscle, 1 N of the joint, 0.1 %BW.
LENGTH_STEP_M = 1e-4
FORCE_STEP_N = 0.1
REACTION_STEP_N = 1.0
PERCENT_STEP = 0.1
UNIT_STEP = 1.0 / 30000.0
ECCENTRICITY_STEP = 1e-3
LARGEST_ECCENTRICITY = 30.0


def player_html(scenes: Sequence[Scene], groups: Mapping[str, str] | None = None) -> str:
    """HTML element that shows scenes; needs nothing but itself, several fit on one page.

    Parameters
    ----------
    scenes : the first is shown first; each other can be laid over it as a ghost
    groups : names of muscle groups for readers, by group; those not named appear as they are

    Raises
    ------
    DataError                        no scene, or numbers that are not finite or too large
    """
    if not scenes:
        raise DataError("player: no scene; expected one or more. Build one by build_scene.")
    named = [_with_group_names(scene, groups or {}) for scene in scenes]
    data = json.dumps([_document(scene) for scene in named], separators=(",", ":"))
    # No label can end the script element that carries the data.
    return page_template("scapulohumeral.player", "player.html.j2").render(
        labels=[scene.label for scene in named],
        groups=list(dict.fromkeys(m.group for scene in named for m in scene.muscles)),
        measured=any(scene.measured_m for scene in named),
        data=data.replace("<", "\\u003c"),
    )


def _with_group_names(scene: Scene, groups: Mapping[str, str]) -> Scene:
    named = tuple(replace(m, group=groups.get(m.group, m.group)) for m in scene.muscles)
    return replace(scene, muscles=named)


def _document(scene: Scene) -> dict[str, Any]:
    """A scene for the script: whole numbers, long arrays as base64 text."""
    return {
        "label": scene.label,
        "converged": scene.converged,
        "time": np.round(scene.time_s - scene.time_s[0], 4).tolist(),
        "origin": _packed(scene.origin_m, LENGTH_STEP_M),
        "rotation": _packed(scene.rotation, UNIT_STEP),
        "activation": _packed(scene.activation, UNIT_STEP),
        "force": _packed(scene.force_N, FORCE_STEP_N),
        "reaction": _packed(scene.reaction_N, REACTION_STEP_N),
        "percent": _packed(scene.percent_body_weight, PERCENT_STEP),
        "eccentricity": _packed(
            np.minimum(scene.eccentricity, LARGEST_ECCENTRICITY), ECCENTRICITY_STEP
        ),
        "landmarks": {name: _place(point) for name, point in scene.landmarks.items()},
        "thorax": scene.thorax and _ellipsoid(scene.thorax),
        "head": _whole([scene.head_radius_m])[0],
        "rim": [_place(Point("scapula_r", tuple(point))) for point in scene.rim_m],
        "measured": {
            name: _packed(points, LENGTH_STEP_M) for name, points in scene.measured_m.items()
        },
        "muscles": [
            {
                "name": muscle.name,
                "group": muscle.group,
                "points": [_place(point) for point in muscle.points],
                "surfaces": [_ellipsoid(surface) for surface in muscle.surfaces],
            }
            for muscle in scene.muscles
        ],
    }


def _packed(values: Array, step: float) -> dict[str, Any]:
    """Numbers as whole multiples of a step, 16-bit little-endian in base64."""
    limit = np.iinfo(np.int16).max
    if values.size and not np.abs(values).max() <= limit * step:
        raise DataError(
            f"player: largest number {np.abs(values).max():g}, expected at most {limit * step:g}. "
            "Look at the solution that the scene is made from."
        )
    whole = np.round(values / step).astype("<i2")
    return {"step": step, "data": base64.b64encode(whole.tobytes()).decode()}


def _whole(lengths_m: Sequence[float]) -> list[int]:
    return [round(length / LENGTH_STEP_M) for length in lengths_m]


def _place(point: Point) -> list[int]:
    return [SEGMENTS.index(point.segment), *_whole(point.location_m)]


def _ellipsoid(surface: Surface) -> list[int]:
    return [SEGMENTS.index(surface.segment), *_whole(surface.centre_m), *_whole(surface.radii_m)]
