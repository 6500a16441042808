"""The files a participant's model consists of, read once for every stage that solves."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scapulohumeral.dynamics import compiled
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.dynamics.participant_parameters import dynamics_parameters, with_capsule
from scapulohumeral.model.muscle_paths.geometry import load_geometry
from scapulohumeral.model.record import ModelRecord, read_record
from scapulohumeral.quantities.joint_loading import glenoid_angles, superior_inferior_share


@dataclass(frozen=True)
class ModelFiles:
    """What a solve is made from."""

    participant: Path
    model: Path
    thorax: Path
    geometry: Path
    equations: Path

    def all(self) -> list[Path]:
        """Single files, for hashes: of the equations what they were made to, and not how fast."""
        own = [self.participant, self.model, self.thorax, self.geometry]
        return own + sorted(self.equations.glob("*.casadi"))


@dataclass(frozen=True, eq=False)
class ShoulderModel:
    """A participant's model in memory.

    Attributes
    ----------
    record : model record "model/1"; thorax : fitted ellipsoid
    forces : equations of motion with muscle geometry
    """

    record: ModelRecord
    thorax: dict[str, Any]
    forces: MuscleForces

    @property
    def glenoid(self) -> tuple[float, float]:
        """Inclination and version of the glenoid [rad]."""
        return glenoid_angles(self.record)

    @property
    def superior_inferior_share(self) -> float:
        """Weight of superior-inferior over that of anterior-posterior shear in J_GH [1]."""
        return superior_inferior_share(self.record)

    def parameters(self, hand_load_kg: float = 0.0) -> np.ndarray:
        """Run-time parameters of the equations of motion, shape (P,)."""
        return dynamics_parameters(self.record, self.thorax, hand_load_kg)

    def free_parameters(self, hand_load_kg: float = 0.0) -> np.ndarray:
        """The same, (P,), for a girdle that moves freely."""
        return with_capsule(self.parameters(hand_load_kg), self.record)


def load_model(files: ModelFiles) -> ShoulderModel:
    """Read a participant's model."""
    return ShoulderModel(
        record=read_record(files.model),
        thorax=json.loads(files.thorax.read_text(encoding="utf-8")),
        forces=MuscleForces(compiled.load(files.equations), load_geometry(files.geometry)),
    )
