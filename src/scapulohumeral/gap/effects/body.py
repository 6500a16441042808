"""The body model that effects change.

Letters: I mesh intervals, M muscle elements.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.model.rotations import Array

JOINTS = ("SC", "AC", "GH", "EL")
ALL = "all"
# Muscle groups that tears of the cuff take most often (Henseler et al. 2015, PLoS ONE 10(2)
# e0118158), and large ones together.
CUFF, OF_CUFF = "cuff", ("supra", "infra")


@dataclass(frozen=True, eq=False)
class Body:
    """What a tracking problem is made of, apart from the motion to track.

    Attributes
    ----------
    muscles : muscle parameters; tendon slack lengths and capacities may be (I, M), one row per mesh
        interval
    parameters : blocks of the dynamics parameters by name
    glenoid_rad : (2,) inferior inclination and anterior version
    effort : (M,) cost of each muscle's squared excitation over that of its squared activation
    floor, cap : (M,) bounds of activations and excitations
    seen : (M,) share of each element's excitation that reaches electrodes
    groups : (M,) anatomical group of each element; crossing : (M, 4) joints that it crosses
    tendon_load : (I, M) nominal tension over maximal isometric force, at mesh midpoints
    gh_elevation_rad : (I,) nominal elevation of the humerus from the scapula's own axis
    gh_lift : (I, 3) axis about which it grows, in axes of the humerus
    levers : (I, 13, 3) by point: nominal generalised forces on the speeds [N m], and on the humeral
        head along scapula axes [N], of a force of 1 N along each thorax axis
    pull : (I, 13, M) the same of each element's nominal tension
    external_Nm : (I, 10) generalised forces on the speeds, beside those of the model
    external_N : (I, 3) forces on the humeral head along scapula axes, beside those of the model
    stability, rates : weights of joint stability and of rates in the cost, over the nominal ones
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
    levers: Mapping[str, Array]
    pull: Array
    external_Nm: Array
    external_N: Array
    stability: float
    rates: float

    def chosen(self, member: str | None) -> np.ndarray:
        """Elements of a muscle group, of the cuff or of all for ``"cuff"`` and ``"all"``: (M,)
        bool."""
        if member == ALL:
            return np.full(len(self.groups), True)
        return np.isin(self.groups, OF_CUFF) if member == CUFF else self.groups == member

    def loaded(self, generalised: Array) -> Body:
        """The body with generalised forces (I, 13), rows as in `levers`, beside those it has."""
        speeds = self.external_Nm.shape[1]
        return replace(
            self,
            external_Nm=self.external_Nm + generalised[:, :speeds],
            external_N=self.external_N + generalised[:, speeds:],
        )
