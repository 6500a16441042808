"""Equations of motion of the shoulder by Kane's method, derived with SymPy Mechanics.

The chain thorax -> clavicle -> scapula -> humerus -> forearm is described by joint rotation
matrices and relative angular velocities. Three auxiliary speeds move the humeral head along the
scapula axes; they are zero, and their equations yield the glenohumeral reaction (paper, section
on equations of motion). Muscles enter later, on the numeric side, as generalised forces.

Residual = generalised active + inertia forces (muscles excluded); 13 rows: ten speeds, then the
three auxiliary ones. The equations of motion are residual + muscle forces = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import sympy as sm
import sympy.physics.mechanics as me

from scapulohumeral.dynamics.formulation import Formulation
from scapulohumeral.dynamics.joint_springs import hinge_torque, spring_torques
from scapulohumeral.dynamics.joint_stops import stop_torques
from scapulohumeral.dynamics.parameters import BALL_JOINTS, GIRDLE_JOINTS, SEGMENTS, SPECS

JOINTS = (*BALL_JOINTS, "EL")
REACTIONS = sm.symbols("R_x R_y R_z")


@dataclass(frozen=True)
class Chain:
    """Frames, points and speeds of the linkage, in terms of joint rotation matrices."""

    thorax: me.ReferenceFrame
    frames: dict[str, me.ReferenceFrame]
    origins: dict[str, me.Point]
    glenoid: me.Point
    speeds: tuple[sm.Expr, ...]
    auxiliary: tuple[sm.Expr, ...]


def parameter_symbols() -> dict[str, tuple[sm.Symbol, ...]]:
    """Symbols of every parameter block, named as in :mod:`parameters`."""
    symbols = {}
    for spec in SPECS:
        names = [spec.name] if spec.size == 1 else [f"{spec.name}_{i}" for i in range(spec.size)]
        symbols[spec.name] = tuple(sm.Symbol(name, real=True) for name in names)
    return symbols


def rotation_symbols(joint: str) -> sm.Matrix:
    """Placeholder symbols for the entries of a joint rotation matrix."""
    return sm.Matrix(3, 3, lambda i, j: sm.Symbol(f"rot_{joint}_{i}{j}"))


def omega_symbols(joint: str) -> tuple[sm.Expr, ...]:
    """Placeholder functions for the relative angular velocity of a joint, child axes."""
    suffixes = "xyz" if joint != "EL" else ("",)
    return tuple(me.dynamicsymbols(f"omega_{joint}{s}") for s in suffixes)


def _vector(components, frame: me.ReferenceFrame) -> me.Vector:
    return sum((c * e for c, e in zip(components, frame, strict=True)), me.Vector(0))


def build_chain(p: dict[str, tuple[sm.Symbol, ...]]) -> Chain:
    """Frames and points of the four segments, velocities and accelerations included."""
    thorax = me.ReferenceFrame("thorax")
    frames: dict[str, me.ReferenceFrame] = {}
    speeds: list[sm.Expr] = []
    parents = (thorax, *(me.ReferenceFrame(s) for s in SEGMENTS))
    for (parent, frame), joint, segment in zip(pairwise(parents), JOINTS, SEGMENTS, strict=True):
        frame.orient_explicit(parent, rotation_symbols(joint))
        omega = omega_symbols(joint)
        components = omega if joint != "EL" else tuple(omega[0] * a for a in p["axis_EL"])
        frame.set_ang_vel(parent, _vector(components, frame))
        frames[segment] = frame
        speeds.extend(omega)

    fixed = me.Point("thorax_origin")
    fixed.set_vel(thorax, 0)
    fixed.set_acc(thorax, 0)
    sc = fixed.locatenew("SC", _vector(p["offset_SC"], thorax))
    sc.set_vel(thorax, 0)
    sc.set_acc(thorax, 0)
    ac = _rigid_point(
        "AC", sc, _vector(p["offset_AC"], frames["clavicle"]), thorax, frames["clavicle"]
    )
    glenoid = _rigid_point(
        "glenoid", ac, _vector(p["offset_GH"], frames["scapula"]), thorax, frames["scapula"]
    )
    auxiliary = me.dynamicsymbols("aux_x aux_y aux_z")
    head = glenoid.locatenew("head", me.Vector(0))
    head.set_vel(thorax, glenoid.vel(thorax) + _vector(auxiliary, frames["scapula"]))
    head.set_acc(thorax, glenoid.acc(thorax))
    elbow = _rigid_point(
        "elbow", head, _vector(p["offset_EL"], frames["humerus"]), thorax, frames["humerus"]
    )
    origins = dict(zip(SEGMENTS, (sc, ac, head, elbow), strict=True))
    return Chain(thorax, frames, origins, glenoid, tuple(speeds), tuple(auxiliary))


def _rigid_point(name, base: me.Point, position, inertial, frame) -> me.Point:
    point = base.locatenew(name, position)
    point.v2pt_theory(base, inertial, frame)
    point.a2pt_theory(base, inertial, frame)
    return point


def _inertia_loads(chain: Chain, p) -> list[tuple[me.Vector, me.Vector, me.Vector, me.Vector]]:
    """Per body: (force, velocity, torque, angular velocity) of gravity and inertia."""
    still = dict.fromkeys(chain.auxiliary, 0)
    gravity = _vector(p["gravity"], chain.thorax)
    loads = []
    for segment in SEGMENTS:
        frame, origin = chain.frames[segment], chain.origins[segment]
        com = _rigid_point(
            f"com_{segment}", origin, _vector(p[f"com_{segment}"], frame), chain.thorax, frame
        )
        xx, yy, zz, xy, xz, yz = p[f"inertia_{segment}"]
        inertia = me.inertia(frame, xx, yy, zz, xy, yz, xz)
        omega = frame.ang_vel_in(chain.thorax)
        alpha = frame.ang_acc_in(chain.thorax)
        force = p[f"mass_{segment}"][0] * (gravity - com.acc(chain.thorax).subs(still))
        torque = -(inertia.dot(alpha) + omega.cross(inertia.dot(omega)))
        loads.append((force, com.vel(chain.thorax), torque, omega))
    forearm = chain.frames["forearm"]
    load = _rigid_point(
        "load", chain.origins["forearm"], _vector(p["com_load"], forearm), chain.thorax, forearm
    )
    force = p["mass_load"][0] * (gravity - load.acc(chain.thorax).subs(still))
    loads.append((force, load.vel(chain.thorax), me.Vector(0), me.Vector(0)))
    return loads


def _conoid_loads(chain: Chain, p) -> list[tuple[me.Point, me.Vector]]:
    """Conoid ligament: tension k s+ with s+ smooth (DAS3; Chadwick et al. 2014)."""
    clavicle, scapula = chain.frames["clavicle"], chain.frames["scapula"]
    origin = _rigid_point(
        "conoid_origin",
        chain.origins["clavicle"],
        _vector(p["conoid_origin"], clavicle),
        chain.thorax,
        clavicle,
    )
    insertion = _rigid_point(
        "conoid_insertion",
        chain.origins["scapula"],
        _vector(p["conoid_insertion"], scapula),
        chain.thorax,
        scapula,
    )
    line = sm.Matrix(insertion.pos_from(origin).to_matrix(clavicle))
    length = sm.sqrt(line.dot(line))
    stretch = length - p["conoid_length"][0]
    taut = (stretch + sm.sqrt(stretch**2 + p["conoid_eps"][0] ** 2)) / 2
    pull = _vector(p["conoid_stiffness"][0] * taut / length * line, clavicle)
    return [(origin, pull), (insertion, -pull)]


def _contact_loads(chain: Chain, p) -> list[tuple[me.Point, me.Vector]]:
    """Scapulothoracic contact of two points with the thorax ellipsoid (DAS3).

    Force -k |A|^2 (x_i / A_i^2) F-, with x from the ellipsoid centre, radii A, level-set value
    F = sum (x_i/A_i)^2 - 1 and its smooth negative part F-: k is in N/m.
    """
    scapula = chain.frames["scapula"]
    radii = p["thorax_radii"]
    loads = []
    for name in ("contact_TS", "contact_AI"):
        point = _rigid_point(
            name, chain.origins["scapula"], _vector(p[name], scapula), chain.thorax, scapula
        )
        position = _contact_position(p, name)
        level = sum((x / a) ** 2 for x, a in zip(position, radii, strict=True)) - 1
        inside = (level - sm.sqrt(level**2 + p["contact_eps"][0] ** 2)) / 2
        scale = -p["contact_stiffness"][0] * sum(a**2 for a in radii) * inside
        force = [scale * x / a**2 for x, a in zip(position, radii, strict=True)]
        loads.append((point, _vector(force, chain.thorax)))
    return loads


def _contact_position(p, name: str) -> sm.Matrix:
    """Contact point relative to the ellipsoid centre, thorax axes."""
    r_sc, r_ac = rotation_symbols("SC"), rotation_symbols("AC")
    return (
        sm.Matrix(p["offset_SC"])
        + r_sc * (sm.Matrix(p["offset_AC"]) + r_ac * sm.Matrix(p[name]))
        - sm.Matrix(p["thorax_centre"])
    )


def _joint_torques(p, elbow_angle: sm.Expr) -> list[sm.Expr]:
    """Passive spring and damper torques on the ten relative speeds, child axes.

    SC and AC have stops at the ends of their ranges besides.
    """
    torques: list[sm.Expr] = []
    for i, joint in enumerate(BALL_JOINTS):
        rest = sm.Matrix(3, 3, p[f"rest_{joint}"])
        springs = spring_torques(
            rotation_symbols(joint), rest, p["joint_stiffness"][i], p["spring_torque"][i]
        )
        stops = (0, 0, 0)
        if joint in GIRDLE_JOINTS:
            stops = stop_torques(
                rotation_symbols(joint),
                (p[f"range_least_{joint}"], p[f"range_largest_{joint}"]),
                p["stop_stiffness"][0],
                p["stop_eps"][0],
            )
        for axis, omega in enumerate(omega_symbols(joint)):
            torques.append(springs[axis] - p["joint_damping"][i] * omega + stops[axis])
    torques.append(
        hinge_torque(elbow_angle - p["rest_EL"][0], p["joint_stiffness"][3], p["spring_torque"][3])
        - p["joint_damping"][3] * omega_symbols("EL")[0]
    )
    return torques


def residual(elbow_angle: sm.Expr) -> tuple[sm.Matrix, Chain]:
    """Kane's residual, 13 x 1, in placeholder rotations, angular velocities and accelerations.

    Rows: SC xyz, AC xyz, GH xyz, EL (torques in child axes), then the three auxiliary rows
    (forces along scapula axes). Muscles are left out. The glenohumeral reaction ``REACTIONS`` is
    the force of the glenoid on the humeral head, scapula axes [N].
    """
    p = parameter_symbols()
    chain = build_chain(p)
    rates = (*chain.speeds, *chain.auxiliary)
    rows: list[sm.Expr] = [*_joint_torques(p, elbow_angle), 0, 0, 0]

    def add(force: me.Vector, velocity: me.Vector) -> None:
        for row, rate in enumerate(rates):
            partial = velocity.diff(rate, chain.thorax, var_in_dcm=False)
            if partial != 0:
                rows[row] += force.dot(partial)

    for force, velocity, torque, omega in _inertia_loads(chain, p):
        add(force, velocity)
        add(torque, omega)
    for point, force in (*_conoid_loads(chain, p), *_contact_loads(chain, p)):
        add(force, point.vel(chain.thorax))
    reaction = _vector(REACTIONS, chain.frames["scapula"])
    add(reaction, chain.origins["humerus"].vel(chain.thorax))
    add(-reaction, chain.glenoid.vel(chain.thorax))
    return sm.Matrix(rows), chain


def formulation_residual(
    formulation: Formulation,
) -> tuple[list[tuple[sm.Symbol, sm.Expr]], sm.Matrix]:
    """Residual in a formulation's own coordinates, as common subexpressions and rows.

    Returns
    -------
    substitutions : pairs (placeholder, expression in q, u, du/dt), to be applied in order
    rows : 13 x 1 residual conjugate to the formulation's speeds and the auxiliary speeds
    """
    core, chain = residual(formulation.q[-1])
    t = me.dynamicsymbols._t
    substitutions: list[tuple[sm.Symbol, sm.Expr]] = []
    replacements: dict[sm.Expr, sm.Expr] = {}
    jacobians = []
    q_rates = formulation.kinematics * sm.Matrix(formulation.u)
    rates = {c.diff(t): rate for c, rate in zip(formulation.q, q_rates, strict=True)}
    for joint in JOINTS:
        for placeholder, entry in zip(
            rotation_symbols(joint), formulation.rotations[joint], strict=True
        ):
            substitutions.append((placeholder, entry))
    for joint in BALL_JOINTS:
        omega = formulation.angular_velocity[joint]
        columns = [u for u in formulation.u if str(u.func).startswith(f"u_{joint}_")]
        jacobians.append(omega.jacobian(columns))
        alpha = omega.diff(t).subs(rates)
        for k, placeholder in enumerate(omega_symbols(joint)):
            w, a = sm.symbols(f"w_{joint}_{k} alpha_{joint}_{k}")
            substitutions += [(w, omega[k]), (a, alpha[k])]
            replacements[placeholder] = w
            replacements[placeholder.diff(t)] = a
    replacements[omega_symbols("EL")[0]] = formulation.u[-1]
    replacements[omega_symbols("EL")[0].diff(t)] = formulation.u[-1].diff(t)
    projection = sm.diag(*jacobians, 1, sm.eye(3))
    rows = projection.T * me.msubs(core, replacements)
    return substitutions, rows
