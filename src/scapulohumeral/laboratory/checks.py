"""What looks wrong in a converted recording, by name, with frame and number.

A `fault` makes the joint angles unusable; a `note` is worth a look. Letters: T frames.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scapulohumeral.laboratory.markers.clusters import Carried
from scapulohumeral.laboratory.markers.frames import Points, elbow_centre
from scapulohumeral.laboratory.markers.landmarks import Landmarks
from scapulohumeral.laboratory.trial import Converted
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.plausibility import (
    LEAST_JUMP_DEG,
    LONGEST_STEP_S,
    largest_speed,
    turns_deg,
)
from scapulohumeral.model.rotations import ANGLE_NAMES, Array, pose_to_trial, trial_to_pose
from scapulohumeral.model.tables import Coordinate, ModelTables

FAULT, NOTE = "fault", "note"
# How far beyond the model's range an angle is worth a note, and how far it cannot be. Persons and
# markers on skin differ by 10 deg; the worst of the recordings that this was tried on by 25.
NOTEWORTHY_RAD = np.deg2rad(10.0)
IMPOSSIBLE_RAD = np.deg2rad(60.0)
# No landmark of an arm is farther from the sternum [m].
REACH_M = 1.5
# Sine of the elevation of the humerus on the scapula from which its axial rotation has one form.
UNIQUE_SINE = 0.5


@dataclass(frozen=True)
class Limits:
    """What passes as a recording of a person who sits or stands.

    Attributes
    ----------
    tilt_deg : of the thorax from the vertical; nobody leans as far in an arm task
    epicondyles_m : least and largest distance of EL and EM, markers on skin included; elbows of
        adults are 0.05 to 0.09 m wide
    thorax_change_m : of the distances between thorax landmarks against the other trials
    length_change_m : of any segment within a trial, standard deviation
    session_change_m : of the median length of a segment against the other trials
    cluster_m : root mean square by which markers of a cluster leave the rigid one, over the trial:
        worth a look, and too much. Plates stay below a millimetre, markers on the skin of the upper
        arm move by some millimetres against each other; exchanged ones by the size of the cluster
    """

    tilt_deg: float = 45.0
    epicondyles_m: tuple[float, float] = (0.04, 0.12)
    thorax_change_m: float = 0.03
    length_change_m: float = 0.01
    session_change_m: float = 0.02
    cluster_m: tuple[float, float] = (0.003, 0.01)


@dataclass(frozen=True)
class Finding:
    """One finding: its name, how bad it is, and a sentence with place and number."""

    name: str
    severity: str
    text: str


THORAX_LENGTHS = (("IJ", "PX"), ("C7", "T8"), ("IJ", "C7"), ("PX", "T8"))


def segment_lengths(points: Points) -> dict[str, Array]:
    """Lengths of the segments over time, by name: (T,) [m] each."""
    thorax = ((points["IJ"] + points["C7"]) - (points["PX"] + points["T8"])) / 2.0
    lengths = {
        "thorax": np.linalg.norm(thorax, axis=1),
        "humerus": np.linalg.norm(points["GH"] - elbow_centre(points), axis=1),
    }
    for name, a, b in (("clavicle", "SC", "AC"), ("scapula", "TS", "AA")):
        if a in points and b in points:
            lengths[name] = np.linalg.norm(points[a] - points[b], axis=1)
    if "US" in points:
        lengths["forearm"] = np.linalg.norm(points["US"] - elbow_centre(points), axis=1)
    return lengths


def thorax_shape(points: Points) -> dict[str, float]:
    """Median distances between the landmarks of the thorax [m], by the names of both."""
    return {
        f"{a}-{b}": float(np.median(np.linalg.norm(points[a] - points[b], axis=1)))
        for a, b in THORAX_LENGTHS
    }


def check_points(landmarks: Landmarks, converted: Converted, limits: Limits) -> list[Finding]:
    """Findings in one recording of landmarks.

    Parameters
    ----------
    landmarks : without an axis that points up, tilt is not checked
    converted : the trial
    limits : Limits
    """
    points, first_frame = landmarks.points, landmarks.first_frame
    found = _tilt(converted.segments.thorax, landmarks.up, limits)
    found += [*_epicondyles(points, limits), *_far_away(points, first_frame)]
    for name, length in segment_lengths(points).items():
        spread = float(length.std())
        if spread > limits.length_change_m:
            k = int(np.abs(length - np.median(length)).argmax())
            found.append(
                Finding(
                    "segment_length_varies",
                    NOTE,
                    f"{name}: length varies by {1e3 * spread:.1f} mm (standard deviation), most at "
                    f"frame {k + first_frame}; expected at most "
                    f"{1e3 * limits.length_change_m:.0f} mm",
                )
            )
    return found + _thorax_moves(points, first_frame, limits)


def _far_away(points: Points, first_frame: int) -> list[Finding]:
    """Landmarks where no arm reaches: a ghost marker, or one of something else."""
    found = []
    for name, track in points.items():
        away = np.linalg.norm(track - points["IJ"], axis=1)
        if away.max() > REACH_M:
            k = int(away.argmax())
            text = (
                f"{name} is {away[k]:.1f} m from IJ in frame {k + first_frame}; expected at most "
                f"{REACH_M:g} m. Look for a ghost marker there"
            )
            found.append(Finding("landmark_far_away", FAULT, text))
    return found


def _tilt(thorax: Array, up: Array | None, limits: Limits) -> list[Finding]:
    if up is None:
        text = "nothing says where up is; the tilt of the thorax was not checked (map key up)"
        return [Finding("up_unknown", NOTE, text)]
    tilt = float(np.rad2deg(np.arccos(np.clip(np.median(thorax[:, :, 1] @ up), -1.0, 1.0))))
    if tilt <= limits.tilt_deg:
        return []
    text = (
        f"thorax tilted by {tilt:.0f} deg from the vertical; expected at most "
        f"{limits.tilt_deg:.0f} deg. Markers IJ, PX, C7 or T8 are swapped or out of place, or the "
        "map names another axis as up"
    )
    return [Finding("thorax_tilted", FAULT, text)]


def _epicondyles(points: Points, limits: Limits) -> list[Finding]:
    width = float(np.median(np.linalg.norm(points["EL"] - points["EM"], axis=1)))
    low, high = limits.epicondyles_m
    if low <= width <= high:
        return []
    text = (
        f"EL and EM are {1e3 * width:.0f} mm apart; expected {1e3 * low:.0f} to {1e3 * high:.0f} "
        "mm. One of them is another marker"
    )
    return [Finding("epicondyles_apart", FAULT, text)]


def check_clusters(clusters: Mapping[str, Carried], limits: Limits) -> list[Finding]:
    """Findings of clusters that lack markers, or whose markers are not where the static has them.

    Parameters
    ----------
    clusters : cluster -> what it carried
    limits : Limits
    """
    found = []
    noteworthy, faulty = limits.cluster_m
    for name, carried in clusters.items():
        if carried.left_out:
            text = (
                f"cluster {name}: only {', '.join(carried.misfits)} carry its landmarks. "
                + " ".join(carried.left_out)
            )
            found.append(Finding("cluster_incomplete", NOTE, text))
        squares = {label: float(np.mean(away**2)) for label, away in carried.misfits.items()}
        size = float(np.sqrt(np.mean(list(squares.values()))))
        if size > noteworthy:
            worst = max(squares, key=squares.__getitem__)
            text = (
                f"cluster {name}: markers leave its shape in the static trial by "
                f"{1e3 * size:.1f} mm RMS, {worst} most; expected at most "
                f"{1e3 * noteworthy:.0f} mm. One was knocked, exchanged, or put on again"
            )
            found.append(Finding("cluster_bent", FAULT if size > faulty else NOTE, text))
    return found


def _thorax_moves(points: Points, first_frame: int, limits: Limits) -> list[Finding]:
    """Thorax landmarks that leave each other within a trial."""
    found = []
    for a, b in THORAX_LENGTHS:
        length = np.linalg.norm(points[a] - points[b], axis=1)
        away = np.abs(length - np.median(length))
        if away.max() > 2.0 * limits.thorax_change_m:
            k = int(away.argmax())
            text = (
                f"{a} and {b}: distance {1e3 * length[k]:.0f} mm at frame {k + first_frame}, "
                f"median {1e3 * np.median(length):.0f} mm. One of them was lost or swapped there"
            )
            found.append(Finding("thorax_markers_move", FAULT, text))
    return found


def check_session(
    shapes: Sequence[Mapping[str, float]], lengths: Sequence[Mapping[str, float]], limits: Limits
) -> list[list[Finding]]:
    """Findings of each trial against the others of one person: medians over the trials.

    Parameters
    ----------
    shapes : per trial, thorax distances [m] as from `thorax_shape`
    lengths : per trial, median lengths of segments [m]
    limits : Limits

    Returns
    -------
    list of list                     per trial; empty with fewer than three trials
    """
    found: list[list[Finding]] = [[] for _ in shapes]
    if len(shapes) < 3:
        return found
    rules = (
        (shapes, limits.thorax_change_m, "thorax_markers_out_of_place", FAULT),
        (lengths, limits.session_change_m, "segment_length_differs", NOTE),
    )
    for values, limit, name, severity in rules:
        common = {key for trial in values for key in trial}
        usual = {key: np.median([t[key] for t in values if key in t]) for key in sorted(common)}
        for trial, warnings in zip(values, found, strict=True):
            away = [key for key in trial if abs(trial[key] - usual[key]) > limit]
            if away:
                numbers = ", ".join(
                    f"{key} {1e3 * trial[key]:.0f} mm (other trials {1e3 * usual[key]:.0f} mm)"
                    for key in away
                )
                warnings.append(Finding(name, severity, numbers))
    return found


def check_motion(motion: Motion, tables: ModelTables, first_frame: int = 1) -> list[Finding]:
    """Steps in time too long for an arm, jumps of segments, angles beyond the model's ranges.

    Frames are named as those of a file are that count from `first_frame` on.
    """
    pose, steps = trial_to_pose(motion.angles_rad), np.diff(motion.time_s)
    found = _rate(float(np.median(steps)))
    for segment, turn in turns_deg(pose).items():
        speed, limit = turn / steps, largest_speed(segment)
        if np.any(too_fast := (speed > limit) & (turn > LEAST_JUMP_DEG)):
            k = int(np.where(too_fast, speed, 0.0).argmax())
            frame = k + first_frame
            text = (
                f"{segment} turns by {turn[k]:.1f} deg between frames {frame} and {frame + 1} "
                f"({speed[k]:.0f} deg/s); expected at most {limit:.0f} deg/s. Look for swapped "
                "markers of it or of the thorax there"
            )
            found.append(Finding(f"{segment}_jumps", FAULT, text))
    return found + _out_of_range(pose, tables)


def _rate(step_s: float) -> list[Finding]:
    if step_s <= LONGEST_STEP_S:
        return []
    text = (
        f"steps of {step_s:g} s between frames; expected {LONGEST_STEP_S} s or less, as arm "
        "motion needs. If times are milliseconds or numbers of frames, make them seconds"
    )
    return [Finding("slow_rate", FAULT, text)]


def check_coordinates(missing: Sequence[str]) -> list[Finding]:
    """A note of coordinates of an OpenSim model that a motion does not hold."""
    if not missing:
        return []
    text = f"the motion has no {', '.join(missing)}; the model's default was taken"
    return [Finding("coordinates_missing", NOTE, text)]


def _out_of_range(pose: Array, tables: ModelTables) -> list[Finding]:
    """Angles beyond the ranges of the model, of poses (T, 13).

    Of the humerus only its axial rotation has a range, where the arm is neither down nor up: there
    it has one form. Epicondyles that are exchanged turn it by 180 deg, and nothing else shows it.
    """
    found = []
    angles = pose_to_trial(pose)
    tilted = np.abs(np.sin(angles[:, ANGLE_NAMES.index("GH_z")])) > UNIQUE_SINE
    for i, name in enumerate(ANGLE_NAMES):
        coordinate, angle = tables.coordinates[name], angles[:, i]
        if name == "GH_yy":
            middle = (coordinate.min_rad + coordinate.max_rad) / 2.0
            angle = middle + np.angle(np.exp(1j * (angle[tilted] - middle)))
        elif name.startswith("GH"):
            continue
        beyond = _beyond(angle, coordinate)
        if beyond > NOTEWORTHY_RAD:
            low, high = np.rad2deg([coordinate.min_rad, coordinate.max_rad])
            text = (
                f"{name} reaches {np.rad2deg(angle.min()):.0f} to {np.rad2deg(angle.max()):.0f} "
                f"deg; the model's range is {low:.0f} to {high:.0f} deg"
            )
            if beyond > IMPOSSIBLE_RAD:
                text += ". No shoulder goes there: landmarks are swapped, or of another place"
                found.append(Finding("impossible_posture", FAULT, text))
            else:
                found.append(Finding("outside_model_range", NOTE, text))
    return found


def _beyond(angle: Array, coordinate: Coordinate) -> float:
    """How far angles leave a range [rad]; below zero inside."""
    if not angle.size:
        return -np.inf
    return float(max(coordinate.min_rad - angle.min(), angle.max() - coordinate.max_rad))
