"""The page of a conversion: 3-D view of segments and landmarks, angles, findings; one HTML file.

Letters: T frames.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from scapulohumeral.laboratory.convert import Outcome
from scapulohumeral.laboratory.markers.frames import axes_matrix, unit
from scapulohumeral.laboratory.trial import ASSUMED, ESTIMATED, MEASURED, Converted
from scapulohumeral.model.rotations import (
    ANGLE_NAMES,
    Array,
    make_continuous,
    matrix_to_quaternion,
)
from scapulohumeral.model.tables import ModelTables, Point
from scapulohumeral.player.page import player_html
from scapulohumeral.player.scene import SEGMENTS, Scene
from scapulohumeral.report.drawing.svg import Drawing, Picture, styled
from scapulohumeral.templates import page_template

# Frames per second and points per curve that the page holds; the table has all.
PAGE_RATE_HZ = 20.0
CURVE_POINTS = 200
# Farther away than this the page draws nothing [m].
SEEN_M = 3.0
HEAD_SURFACE = "inf_sup_sub"
LANDMARKS_OF = {
    "thorax": ("IJ", "PX", "C7", "T8"),
    "clavicle_r": ("SC",),
    "scapula_r": ("AC", "AA", "TS", "AI"),
    "humerus_r": ("GH", "EL", "EM"),
    "forearm": ("US", "RS"),
}
MARKS = {MEASURED: "#0072b2", ESTIMATED: "#d55e00", ASSUMED: "#8a8a8a"}


def render_page(outcomes: Sequence[Outcome], tables: ModelTables, command: str) -> str:
    """HTML text of the page; it needs nothing but itself to be read.

    Parameters
    ----------
    outcomes : of one conversion
    tables : ranges of the model's joint angles and its landmarks
    command : that made the trials
    """
    scenes = [
        scene_of(outcome.name, outcome.converted, outcome.points, tables)
        for outcome in outcomes
        if outcome.converted is not None
    ]
    curves = {o.name: angle_figure(o.converted, tables) for o in outcomes if o.converted}
    return page_template("scapulohumeral.laboratory", "page.html.j2").render(
        outcomes=outcomes,
        player=player_html(scenes) if scenes else "",
        curves=curves,
        rules={o.name: not_measured(o.converted) for o in outcomes if o.converted},
        marks=MARKS,
        usable=sum(outcome.usable for outcome in outcomes),
        command=command,
    )


def not_measured(converted: Converted) -> list[str]:
    """A sentence per rule that stands for joint angles that were not measured."""
    sentences = []
    for channel in dict.fromkeys(converted.channels.values()):
        names = [name for name, c in converted.channels.items() if c == channel]
        if channel.status != MEASURED:
            sentences.append(
                f"{', '.join(names)}: {channel.status}, +-{channel.uncertainty_deg:.0f} deg. "
                f"{channel.rule}."
            )
    return sentences


def scene_of(
    name: str, converted: Converted, points: Mapping[str, Array], tables: ModelTables
) -> Scene:
    """Scene of a trial: rigid bones at their mean shape, and dots where the landmarks were.

    Parameters
    ----------
    name : of the trial
    converted : Converted
    points : landmark -> (T, 3) [m], thorax axes from IJ; empty: those of the model
    tables : ModelTables
    """
    step = max(1, round(converted.rate_hz / PAGE_RATE_HZ))
    frames = np.arange(0, len(converted.time_s), step)
    # A ghost marker is told as a fault; it may not cost the page.
    measured = {key: np.clip(track[frames], -SEEN_M, SEEN_M) for key, track in points.items()}
    matrices = _segment_matrices(converted, frames, measured)
    if points:
        origins, landmarks = _recorded_bones(measured, matrices)
    else:
        origins, landmarks = _model_bones(matrices, tables)
    count = len(frames)
    quaternions = [make_continuous(matrix_to_quaternion(m)) for m in matrices.values()]
    return Scene(
        label=name,
        converged=True,
        time_s=converted.time_s[frames],
        origin_m=np.stack([origins[s] for s in SEGMENTS], axis=1),
        rotation=np.stack(quaternions, axis=1),
        landmarks=landmarks,
        thorax=None,
        head_radius_m=tables.wrap_objects[HEAD_SURFACE].dimensions_m[0],
        rim_m=np.zeros((0, 3)),
        muscles=(),
        activation=np.zeros((count, 0)),
        force_N=np.zeros((count, 0)),
        reaction_N=np.zeros((count, 3)),
        percent_body_weight=np.zeros(count),
        eccentricity=np.zeros(count),
        measured_m=measured,
    )


def _segment_matrices(
    converted: Converted, frames: np.ndarray, points: Mapping[str, Array]
) -> dict[str, Array]:
    """Segments in the thorax, (T, 3, 3) each, in the order of ``SEGMENTS``."""
    still = np.tile(np.eye(3), (len(frames), 1, 1))
    matrices = {name: rotation[frames] for name, rotation in converted.rotations.items()}
    humerus = matrices["humerus_r"]
    if converted.segments.forearm is None:
        return {"thorax": still, **matrices, "forearm": humerus}
    y = -converted.segments.forearm[frames]
    # Without the radial styloid the turn of the forearm about its own axis is not known.
    aside = points["RS"] - points["US"] if "RS" in points else humerus[:, :, 0]
    x = unit(np.cross(y, np.cross(aside, y)))
    return {"thorax": still, **matrices, "forearm": axes_matrix(x, y)}


def _recorded_bones(
    points: Mapping[str, Array], matrices: Mapping[str, Array]
) -> tuple[dict[str, Array], dict[str, Point]]:
    """Origins of segments (T, 3), the mean of their landmarks, and landmarks fixed in them."""
    origins, landmarks = {}, {}
    count = len(matrices["thorax"])
    for segment, names in LANDMARKS_OF.items():
        found = [name for name in names if name in points]
        tracks = [points[name] for name in found]
        origin = np.mean(tracks, axis=0) if tracks else np.zeros((count, 3))
        origins[segment] = origin if segment != "thorax" else np.zeros((count, 3))
        for name, track in zip(found, tracks, strict=True):
            local = np.einsum("tji,tj->ti", matrices[segment], track - origins[segment])
            landmarks[name] = Point(segment, tuple(local.mean(axis=0)))
    return origins, landmarks


def _model_bones(
    matrices: Mapping[str, Array], tables: ModelTables
) -> tuple[dict[str, Array], dict[str, Point]]:
    """Bones of the model in its joints, where a recording has no landmarks."""
    joints = {name: np.array(tables.joints[name].location_m) for name in ("sc1", "ac1", "gh1")}
    origins = {"thorax": np.zeros((len(matrices["thorax"]), 3))}
    chain = (("thorax", "sc1", "clavicle_r"), ("clavicle_r", "ac1", "scapula_r"))
    for parent, joint, child in (*chain, ("scapula_r", "gh1", "humerus_r")):
        origins[child] = origins[parent] + matrices[parent] @ joints[joint]
    origins["forearm"] = origins["humerus_r"]
    names = [name for segment in SEGMENTS[:4] for name in LANDMARKS_OF[segment]]
    return origins, {name: tables.markers[name] for name in names}


@styled
def angle_figure(converted: Converted, tables: ModelTables) -> Picture:
    """Joint angles over time against the ranges of the model, coloured by what they rest on."""
    drawing = Drawing(3, 4, (10.0, 6.4), sharex=True)
    frames = np.unique(np.linspace(0, len(converted.time_s) - 1, CURVE_POINTS).astype(int))
    time = converted.time_s[frames]
    panels = drawing.panels(len(ANGLE_NAMES) + 2)
    for i, (name, axes) in enumerate(zip(ANGLE_NAMES, panels, strict=False)):
        coordinate, status = tables.coordinates[name], converted.channels[name].status
        low, high = np.rad2deg([coordinate.min_rad, coordinate.max_rad])
        axes.axhspan(low, high, color="#e4efe4", zorder=0)
        axes.set_title(name if status == MEASURED else f"{name} ({status})", loc="left")
        angle = np.rad2deg(converted.angles_rad[frames, i])
        drawing.curve(axes, "angle [deg]", time, angle, color=MARKS[status], linewidth=1.3)
    extra = (
        ("humeral elevation", converted.humeral_elevation_rad),
        ("scapular upward rotation", converted.upward_rotation_rad),
    )
    for (name, angle), axes in zip(extra, panels[len(ANGLE_NAMES) :], strict=True):
        axes.set_title(name, loc="left")
        curve = np.rad2deg(angle[frames])
        drawing.curve(axes, "angle [deg]", time, curve, color="#000000", linewidth=1.3)
    drawing.figure.supxlabel("time [s]")
    drawing.figure.supylabel("angle [deg]")
    caption = "Joint angles; green: range of the model. The outer angles of the humerus (GH_y, "
    return drawing.finish("angles", caption + "GH_yy) have no meaning of their own near GH_z = 0.")
