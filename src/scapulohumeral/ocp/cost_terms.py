"""Error terms of the objective as expressions: orientation tracking, unit norm, joint stability.

Every node-wise cost is a weighted sum of squared errors, so its Gauss-Newton and exact Hessians
come from the same function.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import sympy as sm

from scapulohumeral.dynamics.compiled import VectorFunction, compile_vector
from scapulohumeral.dynamics.formulation import (
    Formulation,
    elementary_rotation,
    get_formulation,
    quaternion_matrix,
)
from scapulohumeral.model.rotations import (
    make_continuous,
    quaternion_to_euler,
    quaternion_to_matrix,
    segment_orientations,
    trial_to_pose,
)

GROUPS = ("clavicle", "scapula", "humerus", "elbow", "norm", "anchor")


@dataclass(frozen=True)
class PoseErrors:
    """Tracking errors of one formulation.

    Attributes
    ----------
    function : errors e(q; reference)
    groups : name of the group of each error
    """

    function: VectorFunction
    groups: tuple[str, ...]

    def reference(self, angles: np.ndarray, ac_distance: float) -> np.ndarray:
        """Reference parameters (N, P) from recorded joint angles (N, 10) [rad].

        ``ac_distance`` is the distance [m] of the acromioclavicular joint from the sternum.
        """
        pose = trial_to_pose(angles)
        clavicle, scapula, humerus = segment_orientations(pose).values()
        scapula, humerus = make_continuous(scapula), make_continuous(humerus)
        if "norm" not in self.groups:
            segments = [quaternion_to_euler(scapula, "YZX"), quaternion_to_euler(humerus, "YZY")]
            return np.hstack([angles[:, :2], *segments, angles[:, 9:]])
        ac = ac_distance * quaternion_to_matrix(clavicle)[:, :, 0]
        distance = np.full((len(pose), 1), ac_distance)
        return np.hstack([distance, ac, scapula, humerus, pose[:, 12:], clavicle])


@cache
def pose_errors(name: str) -> PoseErrors:
    """Errors of the paper's J_traj and J_quat for a formulation."""
    formulation = get_formulation(name)
    return _quaternion_errors(formulation) if name == "quaternion" else _euler_errors(formulation)


def _product(a, b) -> list[sm.Expr]:
    """Hamilton product of scalar-first quaternions."""
    return [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]


def _quaternion_errors(formulation: Formulation) -> PoseErrors:
    """Clavicle by the position of the AC joint; scapula and humerus by the vector part of
    Q Q_ref^-1 in the thorax frame; elbow angle; squared norms minus one; what the ends of the
    clavicle can be anchored by, with its reference in the last four parameters.

    The authors' program has the squared distance of the clavicle from its reference for an anchor,
    but adds the sum of the four slopes to each of them (objective_SC_t0_jac under np.sum in their
    notebooks), and IPOPT goes by slopes. They belong to the squared difference of the sums of the
    quaternion components, to first order in the distance.
    """
    q = formulation.q
    sc, ac, gh = q[0:4], q[4:8], q[8:12]
    distance = sm.Symbol("distance")
    point = sm.symbols("point:3")
    ref_scapula, ref_humerus = sm.symbols("scapula:4"), sm.symbols("humerus:4")
    ref_clavicle = sm.symbols("clavicle:4")
    ref_elbow = sm.Symbol("elbow")
    scapula = _product(sc, ac)
    humerus = _product(scapula, gh)

    def relative(a, reference) -> list[sm.Expr]:
        conjugate = (reference[0], *(-c for c in reference[1:]))
        return _product(a, conjugate)[1:]

    clavicle = distance * quaternion_matrix(sc)[:, 0] - sm.Matrix(point)
    errors = [
        *clavicle,
        *relative(scapula, ref_scapula),
        *relative(humerus, ref_humerus),
        q[12] - ref_elbow,
        *(sum(c**2 for c in quaternion) - 1 for quaternion in (sc, ac, gh)),
        sum(sc) - sum(ref_clavicle),
    ]
    sizes = zip(GROUPS, (3, 3, 3, 1, 3, 1), strict=True)
    groups = tuple(name for name, size in sizes for _ in range(size))
    parameters = (distance, *point, *ref_scapula, *ref_humerus, ref_elbow, *ref_clavicle)
    return PoseErrors(compile_vector(q, parameters, errors), groups)


def _euler_errors(formulation: Formulation) -> PoseErrors:
    """Differences of Euler angles: clavicle Y-Z (axial rotation is left out, as in the paper),
    scapula Y-Z-X and humerus Y-Z-Y in the thorax frame, elbow.

    The humerus angles are singular at zero elevation; that is what this formulation shows.
    """
    reference = sm.symbols("reference:9")
    r = formulation.rotations
    scapula = r["SC"] * r["AC"]
    humerus = scapula * r["GH"]
    lift = sm.sqrt(humerus[0, 1] ** 2 + humerus[2, 1] ** 2)
    errors = [
        formulation.q[0] - reference[0],
        formulation.q[1] - reference[1],
        _angle_difference(-scapula[2, 0], scapula[0, 0], reference[2]),
        sm.asin(scapula[1, 0]) - reference[3],
        _angle_difference(-scapula[1, 2], scapula[1, 1], reference[4]),
        _angle_difference(humerus[2, 1], -humerus[0, 1], reference[5]),
        _angle_difference(lift, humerus[1, 1], reference[6]),
        _angle_difference(humerus[1, 2], humerus[1, 0], reference[7]),
        formulation.q[9] - reference[8],
    ]
    groups = ("clavicle",) * 2 + ("scapula",) * 3 + ("humerus",) * 3 + ("elbow",)
    return PoseErrors(compile_vector(formulation.q, reference, errors), groups)


def _angle_difference(sine, cosine, reference) -> sm.Expr:
    """atan2(sine, cosine) - reference in (-pi, pi]; both arguments may have a common factor."""
    s, c = sm.sin(reference), sm.cos(reference)
    return sm.atan2(sine * c - cosine * s, cosine * c + sine * s)


def glenoid_rotation(inclination: sm.Expr, version: sm.Expr) -> sm.Matrix:
    """Columns: outward normal, superior and posterior axis of the glenoid, scapula axes.

    Scapula axes of a right shoulder: x lateral, y up, z back. Inferior inclination turns the
    normal down, anterior version turns it forward (paper, section on joint stability).
    """
    return elementary_rotation("y", version) * elementary_rotation("z", -inclination)


@cache
def stability_errors() -> VectorFunction:
    """Shear over compression of the glenohumeral reaction: superior-inferior, anterior-posterior.

    Variables: reaction of the glenoid on the humeral head, scapula axes (any unit of force);
    parameters: inclination and version [rad].
    """
    reaction = sm.symbols("reaction:3")
    angles = sm.symbols("inclination version")
    compression, superior, posterior = glenoid_rotation(*angles).T * sm.Matrix(reaction)
    return compile_vector(reaction, angles, [superior / compression, posterior / compression])
