"""Size and mass of a person's segments: scale from landmarks, masses from body mass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scapulohumeral.errors import DataError
from scapulohumeral.laboratory.markers.frames import Points, elbow_centre
from scapulohumeral.model.participant_schema import SCALED_SEGMENTS
from scapulohumeral.model.rotations import Array, joint_rotation
from scapulohumeral.model.tables import ModelTables

# Distances whose ratio to the model's scales a segment; the elbow is the midpoint of EL and EM.
DISTANCES = {
    "thorax": (("IJ", "PX"), ("C7", "T8"), ("IJ", "C7"), ("PX", "T8")),
    "clavicle_r": (("SC", "AC"),),
    "scapula_r": (("TS", "AA"), ("AA", "AI"), ("TS", "AI")),
    "humerus_r": (("GH", "elbow"),),
    "forearm": (("elbow", "US"),),
}
FOREARM = ("ulna_r", "radius_r", "hand_r")
# Beyond these no adult's segment lies; a distance is then another one.
SCALE_RANGE = (0.5, 2.0)
ELBOW_DEG = 30.0


@dataclass(frozen=True)
class Body:
    """Body mass [kg], height [m], sex ("male", "female" or None: mean of both)."""

    mass_kg: float
    height_m: float
    sex: str | None = None


def scale_factors(recordings: Sequence[Points], tables: ModelTables) -> dict[str, float]:
    """Segment size over that of the base model, the same along all axes.

    Markers sit on skin, so a thorax measures some centimetres too deep. Segments without landmarks
    take the mean of the others.

    Parameters
    ----------
    recordings : landmark -> (T, 3) [m], one or more recordings of the person
    tables : markers of the base model

    Returns
    -------
    dict                             segment of ``SCALED_SEGMENTS`` -> factor

    Raises
    ------
    DataError                        a factor beyond `SCALE_RANGE`: landmarks of another place
    """
    base = _with_elbow(_model_points(tables))
    found: dict[str, float] = {}
    for segment, pairs in DISTANCES.items():
        ratios = [
            _median_distance(points, a, b) / _median_distance(base, a, b)
            for points in map(_with_elbow, recordings)
            for a, b in pairs
            if a in points and b in points
        ]
        if ratios:
            found[segment] = _possible(segment, float(np.median(ratios)))
    usual = float(np.mean(list(found.values())))
    forearm = found.pop("forearm", usual)
    return {
        segment: forearm if segment in FOREARM else found.get(segment, usual)
        for segment in SCALED_SEGMENTS
    }


def _possible(segment: str, factor: float) -> float:
    """The factor, unless no adult has it."""
    low, high = SCALE_RANGE
    if low <= factor <= high:
        return factor
    names = sorted({name for pair in DISTANCES[segment] for name in pair})
    raise DataError(
        f"{segment}: {factor:.2f} times the model; expected {low} to {high}. Check landmarks "
        f"{', '.join(names)}."
    )


def _with_elbow(points: Points) -> dict[str, Array]:
    return {**points, "elbow": elbow_centre(points)}


def _median_distance(points: Points, a: str, b: str) -> float:
    return float(np.median(np.linalg.norm(points[a] - points[b], axis=-1)))


def _model_points(tables: ModelTables) -> dict[str, Array]:
    """Landmarks of the base model, (1, 3) each; only distances within a segment mean anything.

    The ulna is bent as little as an arm at rest: the hinge passes the epicondyles by 8 mm, so the
    distance to US changes by 1 % with the angle.
    """
    from scipy.spatial.transform import Rotation

    points = {name: np.array([marker.location_m]) for name, marker in tables.markers.items()}
    clavicle = np.array([tables.joints["ac1"].location_m])
    points["SC"], points["AC"] = np.zeros((1, 3)), clavicle
    # The scapula has its origin in AC; its own landmarks are in its axes.
    hinge = tables.joints["hu"]
    axis = np.array(tables.coordinates["EL_x"].axis)
    bend = Rotation.from_rotvec(np.deg2rad(ELBOW_DEG) * axis / np.linalg.norm(axis))
    turn = Rotation.from_matrix(joint_rotation(hinge.orientation_rad)) * bend
    points["US"] = np.array([hinge.location_m]) + turn.apply(points["US"])
    return points


def segment_masses(body: Body, tables: ModelTables) -> dict[str, float]:
    """Masses of the scaled segments [kg]: fractions of body mass for the arm (de Leva 1996).

    Clavicle and scapula keep their share relative to the humerus; the thorax, which does not move,
    keeps the mass of the base model.
    """
    anthropometry = tables.constants.anthropometry
    base = {name: tables.segments[name].mass_kg for name in SCALED_SEGMENTS}
    masses = dict(base)
    parts = {"upper_arm": ("humerus_r",), "forearm": ("ulna_r", "radius_r"), "hand": ("hand_r",)}
    for part, segments in parts.items():
        target = body.mass_kg * anthropometry.share(part, body.sex)
        ratio = target / sum(base[name] for name in segments)
        followers = ("clavicle_r", "scapula_r") if part == "upper_arm" else ()
        masses |= {name: ratio * base[name] for name in (*segments, *followers)}
    return masses


def total_mass(masses: Mapping[str, float], tables: ModelTables) -> float:
    """Mass of the whole model at which its own mass distribution gives the arm its mass [kg]."""
    arm = [name for name in SCALED_SEGMENTS if name != "thorax"]
    base = sum(tables.segments[name].mass_kg for name in SCALED_SEGMENTS)
    return base * sum(masses[n] for n in arm) / sum(tables.segments[n].mass_kg for n in arm)
