"""Tables of what predictions are judged by: distances to recordings and to published predictions.

One row per participant, plane, condition and variant; failed solves have a row with their status
and no distances.

Letters: N nodes.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from scapulohumeral.model.motion import read_motion
from scapulohumeral.model.muscle_paths.pose_region import Region, recorded_poses
from scapulohumeral.model.participant import participant_of
from scapulohumeral.model.published_arm import (
    PUBLISHED_PLANES,
    followed_poses,
    published_pose,
)
from scapulohumeral.ocp.solution import Solution, read_solution
from scapulohumeral.quantities import paper
from scapulohumeral.quantities.fit_region import outside_region
from scapulohumeral.quantities.joint_loading import percent_body_weight
from scapulohumeral.quantities.published_distance import (
    ANGLES,
    PUBLISHED_OF,
    Compared,
    at_level,
    published_distances,
)
from scapulohumeral.quantities.recording_distance import recording_distance
from scapulohumeral.quantities.rhythm import rising_part
from scapulohumeral.quantities.segment_angles import (
    ELEVATION_COLUMN,
    UPWARD_ROTATION_COLUMN,
    thorax_angles,
)

# Column names are those of the tables that predictions are judged by.
STOP_MOMENT, CERTIFIED = "stop_moment_median_Nm", "certified"
HEALTHY, CUFF = "healthy", "cuff_w10"
# The healthy shoulder at the weight of the cuff-limited one: falls from it are those of the cuff.
EQUAL_WEIGHT = "healthy_w10"
FALL_LEVEL_DEG = 70.0
# Elevations of the rising arm at which joint forces are compared [deg]. With the last those of
# implants are compared, which is an assumption: their elevations are not known.
FORCE_LEVELS_DEG = (30.0, 45.0, 60.0, 90.0)
FALL = "upward_rotation_fall_deg"
FALL_EQUAL_WEIGHT = "upward_rotation_fall_equal_weight_deg"


@dataclass(frozen=True, eq=False)
class Predicted:
    """One prediction, failed or not: `solution` and its summary."""

    solution: Solution
    summary: Mapping[str, Any]

    @property
    def names(self) -> dict[str, Any]:
        """Participant, condition, variant and arm of the prediction."""
        return {
            "participant": self.summary["participant"],
            "condition": self.summary["condition"]["name"],
            "variant": self.summary["variant"],
            "arm": self.summary["choices"]["arm"],
            "status": self.summary["status"],
        }

    @property
    def solved(self) -> bool:
        """Whether the solver arrived."""
        return self.summary["status"] == "optimal"

    @property
    def certified(self) -> bool:
        """Whether it is shown to be a strict local minimum; nothing is shown of a failed solve."""
        proof = self.summary["certificate"]
        return proof is not None and bool(proof["holds"])


def read_predictions(solutions: Sequence[Path], summaries: Sequence[Path]) -> list[Predicted]:
    """Predictions from files in the same order."""
    return [
        Predicted(
            read_solution(path, allow_failed=True),
            json.loads(summary.read_text(encoding="utf-8")),
        )
        for path, summary in zip(solutions, summaries, strict=True)
    ]


def against_recording(
    predictions: Sequence[Predicted],
    tracked: Mapping[str, Mapping[str, np.ndarray]],
    people: Mapping[str, Path],
    region: Region,
    rest_below_deg: float,
    elsewhere: Collection[str] = (),
) -> pd.DataFrame:
    """Distances of all predictions to the recordings of their participant.

    Parameters
    ----------
    tracked : recorded poses by participant and plane
    people : participant.yaml by participant
    region : that muscle paths were fitted to
    rest_below_deg : elevation below which the arm counts as at rest
    elsewhere : variants whose muscle paths were fitted to other poses than that region's, so that
        no share of theirs is said to lie outside
    """
    persons = {name: participant_of(path) for name, path in people.items()}
    fitted = {(name, "own"): recorded_poses(person) for name, person in persons.items()}
    for name, person in persons.items():
        if HEALTHY in person.predictions:
            poses = [fitted[name, "own"], followed_poses(person)]
            fitted[name, "published"] = np.concatenate(poses)
    rows = []
    for one in predictions:
        participant = one.summary["participant"]
        for plane, (first, stop) in one.summary["planes"].items():
            row = {"plane": plane, **one.names, CERTIFIED: one.certified}
            if one.solved:
                pose = one.solution.pose[first:stop]
                found = recording_distance(pose, tracked[participant][plane], plane, rest_below_deg)
                outside = outside_region(pose, fitted[participant, one.names["arm"]], region)
                row |= asdict(found) | {
                    "outside_fit_share": (
                        np.nan if one.names["variant"] in elsewhere else float(outside.mean())
                    ),
                    STOP_MOMENT: one.summary[STOP_MOMENT],
                }
                row |= _joint_force(one, slice(first, stop), rest_below_deg)
            rows.append(row)
    return pd.DataFrame(rows)


def _joint_force(one: Predicted, nodes: slice, rest_below_deg: float) -> dict[str, float]:
    """Glenohumeral force of an elevation [% of body weight].

    At rest (mean), where the rising arm reaches fixed elevations, and at its largest.
    """
    angles = thorax_angles(one.solution.pose[nodes])
    elevation = angles[:, ELEVATION_COLUMN]
    rise = rising_part(elevation)
    newtons = np.linalg.norm(one.solution.reaction_N[nodes], axis=1)
    share = percent_body_weight(newtons, one.summary["body_mass_kg"])
    with_force = np.column_stack([angles, share])
    return {
        "gh_force_rest_bw": float(share[rise][elevation[rise] <= rest_below_deg].mean()),
        **{
            f"gh_force_{level:g}_bw": at_level(with_force, angles.shape[1], level)
            for level in FORCE_LEVELS_DEG
        },
        "gh_force_peak_bw": float(share.max()),
        "arm_peak_deg": float(elevation.max()),
    }


def against_published(predictions: Sequence[Predicted], people: Mapping[str, Path]) -> pd.DataFrame:
    """Every quantity of predictions on the published arm beside the published one."""
    rows: list[dict[str, Any]] = []
    on_arm = [one for one in predictions if one.names["arm"] == "published"]
    for one in on_arm:
        names = {key: one.names[key] for key in ("variant", "participant", "condition", "status")}
        if not one.solved:
            rows.append(names)
            continue
        for compared in _compared(one, people):
            rows.append({**names, **asdict(compared)})
    rows += _falls(on_arm, people)
    columns = ["variant", "participant", "plane", "condition", "phase", "quantity"]
    columns += ["published", "reproduced", "status"]
    return pd.DataFrame(rows, columns=columns)


def _compared(one: Predicted, people: Mapping[str, Path]) -> Iterator[Compared]:
    condition, pose = one.names["condition"], one.solution.pose
    known = _published(people[one.summary["participant"]], condition)
    table = {HEALTHY: "healthy", CUFF: "rc_limited"}
    printed = paper.RHYTHM.get(table.get(condition, ""), {})
    missing = np.full(len(pose), np.nan)
    if known is not None:
        yield from published_distances(pose, known, printed)
    angles = thorax_angles(pose)
    for plane, (first, stop) in PUBLISHED_PLANES.items():
        part = angles[first:stop]
        rest = int(
            np.argmin(part[: int(np.argmax(part[:, ELEVATION_COLUMN])) + 1, ELEVATION_COLUMN])
        )
        theirs = (
            missing
            if known is None
            else thorax_angles(known)[first:stop, ANGLES["clavicle_elevation"]]
        )
        yield Compared(
            plane,
            "rest",
            "clavicle_elevation_deg",
            float(theirs[rest]),
            float(part[rest, ANGLES["clavicle_elevation"]]),
        )
        force = np.linalg.norm(one.solution.reaction_N[first:stop], axis=1)
        share = paper.PEAK_FORCE_BW.get(plane, np.nan) if condition == HEALTHY else np.nan
        newtons = share / 100.0 * paper.BODY_WEIGHT_OF_FIGURES_N
        yield Compared(plane, "peak", "gh_force_N", newtons, float(force.max()))
        yield Compared(plane, "rest", "gh_force_N", np.nan, float(force[rest]))


def _published(participant: Path, condition: str) -> np.ndarray | None:
    """Poses (268, 13) of the published motion of a condition, None where there is none."""
    motions = participant_of(participant).predictions
    file = motions.get(PUBLISHED_OF.get(condition, ""))
    return None if file is None else published_pose(read_motion(file))


def _falls(predictions: Sequence[Predicted], people: Mapping[str, Path]) -> list[dict[str, Any]]:
    """How much lower the peak of upward rotation and its value at 70 deg lie than when healthy.

    From the healthy shoulder, as the paper counts, and from the healthy one at the same weight of
    joint stability where that is another.
    """
    rows = []
    solved = [one for one in predictions if one.solved]
    for one in solved:
        for base, quantity in ((HEALTHY, FALL), (EQUAL_WEIGHT, FALL_EQUAL_WEIGHT)):
            same = [other for other in solved if other.names == {**one.names, "condition": base}]
            limited = one.names["condition"] not in (HEALTHY, EQUAL_WEIGHT)
            if same and limited and (base == HEALTHY or one.names["condition"] == CUFF):
                rows += _fall_rows(same[0], one, quantity, people)
    return rows


def _fall_rows(
    healthy: Predicted, limited: Predicted, quantity: str, people: Mapping[str, Path]
) -> list[dict[str, Any]]:
    names = limited.names
    known = [
        _published(people[names["participant"]], one.names["condition"])
        for one in (healthy, limited)
    ]
    rows = []
    for plane, (first, stop) in PUBLISHED_PLANES.items():
        ours = _fall(healthy.solution.pose[first:stop], limited.solution.pose[first:stop])
        theirs = dict.fromkeys(ours, np.nan)
        if known[0] is not None and known[1] is not None:
            theirs = _fall(known[0][first:stop], known[1][first:stop])
        for phase, value in ours.items():
            about = {key: names[key] for key in ("variant", "participant", "condition", "status")}
            compared = Compared(plane, phase, quantity, theirs[phase], value)
            rows.append(about | asdict(compared))
    return rows


def _fall(healthy: np.ndarray, limited: np.ndarray) -> dict[str, float]:
    whole, part = thorax_angles(healthy), thorax_angles(limited)
    column = UPWARD_ROTATION_COLUMN
    levels = [at_level(angles, column, FALL_LEVEL_DEG) for angles in (whole, part)]
    return {
        "peak": float(whole[:, column].max() - part[:, column].max()),
        f"at {FALL_LEVEL_DEG:g} deg": levels[0] - levels[1],
    }


def with_audit(table: pd.DataFrame, audit: pd.DataFrame) -> pd.DataFrame:
    """Distances with the largest error of muscle length [mm] of the study's own predictions."""
    largest = audit.groupby(["participant", "condition"]).length_max_mm.max()
    names = zip(table.participant, table.condition, strict=True)
    errors = [largest.get(name, np.nan) for name in names]
    return table.assign(length_error_max_mm=np.where(table.variant == "study", errors, np.nan))


@dataclass(frozen=True)
class AgainstFiles:
    """Files of the comparison; solutions and summaries in the same order.

    `elsewhere`: see :func:`against_recording`.
    """

    solutions: Sequence[Path]
    summaries: Sequence[Path]
    tracked: Sequence[Path]
    participants: Sequence[Path]
    targets: Path
    audit: Path | None = None
    elsewhere: Collection[str] = ()


def compare(files: AgainstFiles, region: Region, recording: Path, published: Path) -> None:
    """Write both tables."""
    distances_to_recordings(files, region).to_csv(recording, index=False, float_format="%.4g")
    predictions = read_predictions(files.solutions, files.summaries)
    people = {path.parent.name: path for path in files.participants}
    against_published(predictions, people).to_csv(published, index=False, float_format="%.4g")


def distances_to_recordings(files: AgainstFiles, region: Region) -> pd.DataFrame:
    """The table of :func:`against_recording` of predictions in files."""
    predictions = read_predictions(files.solutions, files.summaries)
    people = {path.parent.name: path for path in files.participants}
    tracked: dict[str, dict[str, np.ndarray]] = {}
    for path in files.tracked:
        # What was recorded stands in a failed solve too.
        solution = read_solution(path, allow_failed=True)
        own = tracked.setdefault(solution.header["participant"], {})
        own[solution.header["trial"]] = solution.reference_pose
    targets = yaml.safe_load(files.targets.read_text(encoding="utf-8"))
    rest = float(targets["against_recording"]["rest_below_deg"])
    table = against_recording(predictions, tracked, people, region, rest, files.elsewhere)
    if files.audit is not None:
        table = with_audit(table, pd.read_csv(files.audit))
    return table
