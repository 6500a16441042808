"""What simulated persons are made from: the study's models and recorded motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from scapulohumeral.dynamics import compiled
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.model.motion import Motion, read_motion
from scapulohumeral.model.muscle_paths.geometry import load_geometry
from scapulohumeral.model.record import ModelRecord, read_record
from scapulohumeral.model.rotations import trial_to_pose
from scapulohumeral.stages.thorax import contact_points, fit_ellipsoid, prior_ellipsoid
from simulated_persons.arm import Anatomy
from simulated_persons.plan import TASKS

# A recorded point inside the fitted thorax counts so many times more than one outside. The surface
# of the study runs through the recorded points, half of which then lie inside: in a person whose
# scapula is to be where it was recorded, contact pushes with up to 650 N m there (par1), and the
# arm misses its task whatever the muscles do. With 4 the scapula floats 8 mm outside on average.
INSIDE_FACTOR = 4.0


@dataclass(frozen=True, eq=False)
class Study:
    """Participants' models, the folder of their files for OpenSim, and recorded motions."""

    models: Path
    anatomies: dict[str, Anatomy]
    motions: dict[tuple[str, str], Motion]
    scale: dict[str, dict]


def load_study(results: Path, participants: Path, names: Sequence[str]) -> Study:
    """Models that the study has built, and the recordings they were built for."""
    equations = compiled.load(results / "equations" / "quaternion")
    anatomies, motions, scale = {}, {}, {}
    for name in names:
        for task in TASKS:
            motions[name, task] = read_motion(participants / name / f"{task}.csv")
        geometry = load_geometry(results / "muscle_geometry" / name / "quaternion.npz")
        record = read_record(results / "models" / f"{name}.json")
        thorax = thorax_under(record, [motions[name, task] for task in TASKS])
        anatomies[name] = Anatomy(record, thorax, MuscleForces(equations, geometry))
        text = (participants / name / "participant.yaml").read_text(encoding="utf-8")
        scale[name] = yaml.safe_load(text)["scale"]
    return Study(results / "models", anatomies, motions, scale)


def thorax_under(record: ModelRecord, motions: Sequence[Motion]) -> dict[str, Any]:
    """Centre and radii [m] of the thorax under the scapula of recorded motions."""
    poses = np.concatenate([trial_to_pose(motion.angles_rad) for motion in motions])
    points = contact_points(record, poses).reshape(-1, 3)
    centre, radii = fit_ellipsoid(points, *prior_ellipsoid(record), INSIDE_FACTOR)
    return {"centre_m": centre.tolist(), "radii_m": radii.tolist()}
