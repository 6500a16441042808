"""The body model that effects change.

Letters: I mesh intervals, M muscle elements.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.model.rotations import Array

JOINTS = ("SC", "AC", "GH", "EL")


ALL = "all"


@dataclass(frozen=True, eq=False)
class Body:
    """What a tracking problem is made of, apart from the motion to track.

    Attributes
    ----------
    muscles : muscle parameters; tendon slack lengths may be (I, M), one row per mesh interval
    parameters : blocks of the dynamics parameters by name
    glenoid_rad : (2,) inferior inclination and anterior version
    effort : (M,) cost of each muscle's squared excitation over that of its squared activation
    floor, cap : (M,) bounds of activations and excitations
    seen : (M,) share of each element's excitation that reaches electrodes
    groups : (M,) anatomical group of each element; crossing : (M, 4) joints that it crosses
    tendon_load : (I, M) nominal tension over maximal isometric force, at mesh midpoints
    gh_elevation_rad : (I,) nominal elevation of the humerus from the scapula's own axis
    gh_lift : (I, 3) axis about which it grows, in axes of the humerus
    external_Nm : (I, 10) generalised forces on the speeds, beside those of the model
    """

    muscles: MuscleParameters
    parameters: Mapping[str, Array]
    glenoid_rad: Array
    effort: Array
    floor: Array
    cap: Array
    seen: Array
    groups: np.ndarray
    crossing: np.ndarray
    tendon_load: Array
    gh_elevation_rad: Array
    gh_lift: Array
    external_Nm: Array

    def chosen(self, member: str | None) -> np.ndarray:
        """Elements of a muscle group, of all for ``"all"``: (M,) bool."""
        return np.full(len(self.groups), True) if member == ALL else self.groups == member
