"""Moment arms and joint forces beside published measurements of other people.

Letters: N nodes, M muscles.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.dynamics import compiled
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.errors import DataError
from scapulohumeral.model.muscle_paths.geometry import load_geometry
from scapulohumeral.quantities.moment_arms import movement_arms
from scapulohumeral.quantities.rhythm import node_near, rising_part
from scapulohumeral.quantities.segment_angles import (
    ELEVATION_COLUMN,
    UPWARD_ROTATION_COLUMN,
    thorax_angles,
)
from scapulohumeral.report.study import Study
from scapulohumeral.report.tables import Table
from scapulohumeral.report.words import variant_in_words
from scapulohumeral.stages.distances.against import FORCE_LEVELS_DEG

MM = 1e3
CLAIMS = ("positive", "negative", "largest", "smallest")
# Part of a rise over which an arm along the recorded motion is told [deg].
RISE_DEG = (30.0, 70.0)


@dataclass(frozen=True)
class Arm:
    """Moment arms of the elements of one claim at one recorded pose.

    Attributes
    ----------
    place : participant, plane and elevation in words
    mean_mm, least_mm, most_mm : over the elements
    extreme : muscle with the largest or smallest arm of all, and the arm; empty for other claims
    holds : whether the claim holds here
    """

    place: str
    mean_mm: float
    least_mm: float
    most_mm: float
    extreme: str
    holds: bool


def moment_arms(study: Study, literature: Path) -> Table:
    """Every claim of ``config/literature/moment_arms.csv``; marked: it fails somewhere."""
    claims = pd.read_csv(literature, dtype=str)
    recorded = list(_recorded(study))
    rows, flagged = [], set()
    for row, claim in enumerate(claims.to_dict("records")):
        found = [arm for forces, place in recorded for arm in _arms(forces, *place, claim)]
        held = sum(arm.holds for arm in found)
        if held < len(found):
            flagged.add(row)
        rows.append(
            (
                claim["movement"].replace("_", " "),
                claim["muscle"],
                claim["claim"],
                f"{held} of {len(found)}",
                _range(found),
                "; ".join(f"{arm.place}: {_said(arm)}" for arm in found if not arm.holds),
                claim["source"],
                claim["read"],
            )
        )
    columns = (
        "movement", "muscle", "published", "holds at", "arms here [mm]", "where not",
        "source", "read in",
    )  # fmt: skip
    return Table(columns, rows, frozenset(flagged))


def _recorded(study: Study) -> Iterator[tuple[MuscleForces, tuple[str, str, np.ndarray]]]:
    """Muscle geometry of each participant with name, plane and recorded poses of each trial."""
    folder = next((path for path in study.equation_folders if path.name == "quaternion"), None)
    geometry = {path.parent.name: path for path in study.coordination.files.geometry}
    if folder is None or not geometry:
        return
    equations = compiled.load(folder)
    forces = {name: MuscleForces(equations, load_geometry(p)) for name, p in geometry.items()}
    for trial in study.trials:
        if trial.participant in forces:
            pose = trial.any_run.solution.reference_pose
            yield forces[trial.participant], (trial.participant, trial.trial, pose)


def _arms(
    forces: MuscleForces, participant: str, plane: str, pose: np.ndarray, claim: Mapping[Any, Any]
) -> Iterator[Arm]:
    if plane not in claim["planes"].split():
        return
    elements = _elements(forces, claim)
    elevation = thorax_angles(pose)[:, ELEVATION_COLUMN]
    for level in map(float, claim["levels_deg"].split()):
        node = node_near(elevation, level)
        if node is not None:
            arms = MM * movement_arms(forces, pose[[node]])[claim["movement"]][0]
            place = f"{participant} {plane} {level:g} deg"
            yield _judged(place, arms, elements, claim["claim"], forces.geometry.names)


def pectoralis_words(study: Study) -> str:
    """Whether pectoralis minor works against recorded upward rotation; empty without data.

    At the acromioclavicular joint alone it turns the scapula upward, because it is inserted
    medially of that joint. In a recorded rise the clavicle turns, too.
    """
    arms = []
    for forces, (_, _, pose) in _recorded(study):
        names = forces.geometry.names
        elements = [k for k, name in enumerate(names) if name.startswith("pect_min")]
        arm = arm_along_rise(forces, pose, elements) if elements else None
        arms += [] if arm is None else [arm]
    if not arms:
        return ""
    against = sum(arm < 0.0 for arm in arms)
    return (
        "Pectoralis minor turns the scapula upward at the acromioclavicular joint, with the "
        "clavicle still, because its insertion at the coracoid lies medially of that joint; "
        "anatomists mean the scapula on the thorax. With the clavicle moving as recorded, from "
        f"{RISE_DEG[0]:g} to {RISE_DEG[1]:g} deg of elevation, it works against upward rotation in "
        f"{against} of {len(arms)} recordings (arms {min(arms):.0f} to {max(arms):.0f} mm)."
    )


def arm_along_rise(forces: MuscleForces, pose: np.ndarray, elements: Sequence[int]) -> float | None:
    """Shortening per recorded upward rotation, mean of elements [mm]; None if the arm stays low.

    Parameters
    ----------
    pose : (N, 13) of a recorded elevation, of whose rise the part in `RISE_DEG` counts
    """
    angles = thorax_angles(pose)
    rise = rising_part(angles[:, ELEVATION_COLUMN])
    elevation = angles[rise, ELEVATION_COLUMN]
    inside = (elevation >= RISE_DEG[0]) & (elevation <= RISE_DEG[1])
    if np.count_nonzero(inside) < 2:
        return None
    poses = pose[rise][inside]
    length, _ = forces.lengths(poses, np.zeros((len(poses), 10)))
    upward = np.deg2rad(angles[rise, UPWARD_ROTATION_COLUMN][inside])
    slope, _ = np.polyfit(upward, MM * length[:, list(elements)].mean(axis=1), 1)
    return -float(slope)


def _elements(forces: MuscleForces, claim: Mapping[Any, Any]) -> list[int]:
    names = list(forces.geometry.names)
    unknown = [name for name in claim["elements"].split() if name not in names]
    if unknown or claim["claim"] not in CLAIMS:
        raise DataError(
            f"config/literature/moment_arms.csv, {claim['muscle']}: elements "
            f"{', '.join(unknown) or 'all known'}, claim {claim['claim']!r}; expected elements of "
            f"the model and one of {', '.join(CLAIMS)}. Correct the row"
        )
    return [names.index(name) for name in claim["elements"].split()]


def _judged(
    place: str, arms: np.ndarray, elements: list[int], claim: str, names: Sequence[str]
) -> Arm:
    own = arms[elements]
    extreme = ""
    if claim in ("positive", "negative"):
        holds = bool(own.mean() > 0) == (claim == "positive")
    else:
        first = int(arms.argmax() if claim == "largest" else arms.argmin())
        extreme, holds = f"{names[first]} {arms[first]:.0f}", first in elements
    return Arm(place, float(own.mean()), float(own.min()), float(own.max()), extreme, holds)


def _said(arm: Arm) -> str:
    return f"{arm.extreme or f'{arm.mean_mm:.0f}'} mm"


def _range(found: Sequence[Arm]) -> str:
    """Means over the elements, and in brackets single elements, over all poses."""
    if not found:
        return "no pose"
    means = [arm.mean_mm for arm in found]
    least, most = min(arm.least_mm for arm in found), max(arm.most_mm for arm in found)
    return f"{min(means):.0f} to {max(means):.0f} ({least:.0f} to {most:.0f})"


def joint_forces(
    recording: pd.DataFrame, whole: Mapping[str, str], literature: Path
) -> Table | None:
    """Joint force of healthy predictions over elevation beside instrumented implants.

    Parameters
    ----------
    recording : table ``against_recording``
    whole : condition with the full force of the muscles, by participant
    literature : ``config/literature/joint_force.csv``
    """
    known = pd.read_csv(literature)
    full = recording.condition == recording.participant.map(whole)
    healthy = recording[full & (recording.status == "optimal")]
    if healthy.empty:
        return None
    rows = [_force_row(row, known) for row in healthy.to_dict("records")]
    columns = (
        "participant", "variant", "plane", "arm rises to [deg]", "rest",
        *(f"at {level:g} deg" for level in FORCE_LEVELS_DEG), "largest",
        "implants, mean peak", "standard deviations from it at 90 deg",
    )  # fmt: skip
    return Table(columns, rows)


def _force_row(row: Mapping[Any, Any], known: pd.DataFrame) -> tuple[str, ...]:
    levels = [row[f"gh_force_{level:g}_bw"] for level in FORCE_LEVELS_DEG]
    implants = known[
        (known.plane == row["plane"]) & (known.compared_at_deg == FORCE_LEVELS_DEG[-1])
    ]
    there, away = "none", ""
    if not implants.empty:
        one = implants.iloc[0]
        there = f"{one.mean_bw:.1f} ± {one.sd_bw:.1f} (n = {one.shoulders:.0f})"
        reached = not np.isnan(levels[-1])
        away = f"{(levels[-1] - one.mean_bw) / one.sd_bw:+.1f}" if reached else "arm too low"
    return (
        row["participant"],
        variant_in_words(row["variant"]),
        row["plane"],
        f"{row['arm_peak_deg']:.0f}",
        *("" if np.isnan(x) else f"{x:.1f}" for x in (row["gh_force_rest_bw"], *levels)),
        f"{row['gh_force_peak_bw']:.1f}",
        there,
        away,
    )
