"""Forward integration of arms that follow a wish: computed muscle control at 100 Hz.

Every 10 ms a controller turns the deviation from the wished motion into wished joint torques and
distributes them over the muscles at least effort (cubed activations; Thelen et al. 2003 is the
precedent). The humerus is followed closely; clavicle and scapula give way to effort, so they end
where strength, load and contact let them: they are predicted. In between, activations, fibres and
skeleton are integrated at 500 Hz by a linearly implicit Euler step.

A person may instead keep a motion whatever acts (:func:`keep`): the skeleton is led along it, and
only muscles answer.

Letters: N simulations, S control steps, M muscles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from simulated_persons.allocation import Allocation, allocate
from simulated_persons.body import Body, Linearisation, linearise, rotate, turned
from simulated_persons.muscles import (
    activation_rate,
    activation_step,
    active_force,
    fibre_step,
    passive_force,
    resting_fibres,
)
from simulated_persons.wish import Goal, Wish

STEP_S = 0.002
CONTROL_STEPS = 5
TICK_S = STEP_S * CONTROL_STEPS
HUMERUS_FREQUENCY = 18.0  # rad/s, critically damped
# Clavicle and scapula weigh little and lie in soft tissue: their wish is a torque, not a motion.
GIRDLE_STIFFNESS, GIRDLE_DAMPING = 60.0, 4.0  # N m/rad, N m s/rad
TORQUE_WEIGHT = 2.0  # 1/(N m)^2: the humerus deviates by hundredths of a newton metre
KEEPING_WEIGHT = 0.2  # 1/(N m)^2, of the girdle where its motion is kept
SMALLEST_COMPRESSION_N = 80.0


@dataclass(frozen=True, eq=False)
class Control:
    """What the nervous system of each simulation wants.

    Attributes
    ----------
    cost : (N, M) weight of each muscle's effort; tonic, cap : (N, M) bounds of activation
    girdle_weight : (N,) weight of torques at clavicle and scapula [1/(N m)^2]
    stability_weight : (N,) weight of squared shear over compression at the glenoid
    glenoid_rad : (N, 2) inferior inclination and anterior version
    """

    cost: np.ndarray
    tonic: np.ndarray
    cap: np.ndarray
    girdle_weight: np.ndarray
    stability_weight: np.ndarray
    glenoid_rad: np.ndarray


@dataclass(frozen=True, eq=False)
class Trace:
    """Simulated motion at the control steps.

    q (S, N, 13); excitation (S, N, M); reaction_N (S, N, 3) of the glenoid on the humeral head;
    missing_Nm (S, N, 10) torques that were wished and not given.
    """

    q: np.ndarray
    excitation: np.ndarray
    reaction_N: np.ndarray  # noqa: N815 - unit
    missing_Nm: np.ndarray  # noqa: N815 - unit


@dataclass
class _State:
    """Mutable state of the integration."""

    q: np.ndarray
    u: np.ndarray
    activation: np.ndarray
    fibre: np.ndarray
    fibre_speed: np.ndarray
    force: np.ndarray
    multipliers: np.ndarray
    compression: np.ndarray


def simulate(body: Body, control: Control, wish: Wish) -> Trace:
    """Follow a wish from rest at its first pose."""
    state = _rest(body, wish)
    first, _ = _lengths(body, state, None)
    rows = []
    for tick in range(wish.count):
        goal = wish.at(tick)
        length, arms = _lengths(body, state, first)
        line = linearise(body, state.q, state.u)
        excitation, missing = _decide(body, control, goal, state, line, arms)
        rows.append((state.q.copy(), excitation, _reaction(line, arms, state.force), missing))
        _advance(body, state, line, length, arms, goal.left * excitation)
    return _trace(rows)


def keep(body: Body, control: Control, wish: Wish) -> Trace:
    """Do exactly what is wished, as far as torques are concerned that muscles can give."""
    control = replace(control, girdle_weight=np.full_like(control.girdle_weight, KEEPING_WEIGHT))
    state = _rest(body, wish)
    first, _ = _lengths(body, state, None)
    rows = []
    for tick in range(wish.count):
        goal = wish.at(tick)
        state.q, state.u = goal.pose.copy(), _joint_rates(body, goal)
        length, arms = _lengths(body, state, first)
        line = linearise(body, state.q, state.u)
        excitation, missing = _decide(body, control, goal, state, line, arms)
        rows.append((state.q, excitation, _reaction(line, arms, state.force), missing))
        _lead(body, state, length, arms, goal.left * excitation)
    return _trace(rows)


def _trace(rows: Sequence[tuple[np.ndarray, ...]]) -> Trace:
    return Trace(*(np.array(column) for column in zip(*rows, strict=True)))


def _rest(body: Body, wish: Wish) -> _State:
    n, m = body.muscles.max_force.shape
    q = wish.pose[0].copy()
    length, _ = body.forces.lengths(q, np.zeros((n, 10)))
    fibre = resting_fibres(body.muscles, length)
    return _State(
        q=q,
        u=np.zeros((n, 10)),
        activation=np.full((n, m), 0.02),
        fibre=fibre,
        fibre_speed=np.zeros((n, m)),
        force=passive_force(body.muscles, fibre),
        multipliers=np.zeros((n, 12)),
        compression=np.full(n, 300.0),
    )


def _lengths(body: Body, state: _State, first: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Muscle-tendon lengths (N, M) and their slopes (N, M, 13), both with the arms' scale."""
    length, _ = body.forces.lengths(state.q, state.u)
    scale = body.muscles.arm_scale
    if first is not None:
        length = first + scale * (length - first)
    return length, scale[..., None] * body.forces.gradients(state.q)


def _advance(
    body: Body,
    state: _State,
    line: Linearisation,
    length: np.ndarray,
    arms: np.ndarray,
    excitation: np.ndarray,
) -> None:
    """Integrate over one control step; slopes are renewed at its start only."""
    h, turn = STEP_S, arms[:, :, :10]
    system = line.mass - h * line.damping - h**2 * line.stiffness
    base, u0 = line.load[:, :10], state.u.copy()
    travelled = np.zeros_like(state.u)
    for _ in range(CONTROL_STEPS):
        state.activation = activation_step(body.muscles, state.activation, excitation, h)
        ahead = length + h * np.einsum("nmk,nk->nm", turn, state.u)
        fibre, force, slope = fibre_step(body.muscles, ahead, state.fibre, state.activation, h)
        soft = h**2 * np.matmul((turn * slope[..., None]).transpose(0, 2, 1), turn)
        load = base + np.einsum("nkl,nl->nk", line.damping, state.u - u0)
        load += np.einsum("nkl,nl->nk", line.stiffness, travelled + h * state.u)
        load -= np.einsum("nm,nmk->nk", force, turn)
        change = np.linalg.solve(system + soft, h * load[..., None])[..., 0]
        state.u = state.u + change
        gained = h * np.einsum("nmk,nk->nm", turn, change)
        # The fibre takes its share of what the implicit step added to the length.
        state.force = np.maximum(force + slope * gained, 0.0)
        length = ahead + gained
        state.fibre_speed = (fibre - state.fibre) / h
        state.fibre = fibre
        state.q = rotate(state.q, h * state.u)
        travelled = travelled + h * state.u


def _lead(
    body: Body, state: _State, length: np.ndarray, arms: np.ndarray, excitation: np.ndarray
) -> None:
    """Integrate the muscles over one control step of a skeleton that is led."""
    lengthening = np.einsum("nmk,nk->nm", arms[:, :, :10], state.u)
    for step in range(1, CONTROL_STEPS + 1):
        state.activation = activation_step(body.muscles, state.activation, excitation, STEP_S)
        ahead = length + step * STEP_S * lengthening
        fibre, state.force, _ = fibre_step(
            body.muscles, ahead, state.fibre, state.activation, STEP_S
        )
        state.fibre_speed = (fibre - state.fibre) / STEP_S
        state.fibre = fibre


def _decide(
    body: Body,
    control: Control,
    goal: Goal,
    state: _State,
    line: Linearisation,
    arms: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Excitations (N, M) that bring the activations to the cheapest suitable ones in two steps.

    Also the torques (N, 10) that they leave to be wished. Of tired muscles a share is left.
    """
    unit = goal.left * active_force(body.muscles, state.fibre, state.fibre_speed)
    resting = passive_force(body.muscles, state.fibre)
    acceleration, impedance = _wishes(body, goal, state)
    wished = np.einsum("nkl,nl->nk", line.mass, acceleration) + impedance
    torque = wished - line.load[:, :10] + np.einsum("nm,nmk->nk", resting, arms[:, :, :10])
    matrix = -(unit[..., None] * arms).transpose(0, 2, 1)
    shear, offset = _shear_rows(control, state, line, arms, unit, resting)
    n = len(unit)
    weight = np.full((n, 12), TORQUE_WEIGHT)
    weight[:, :6] = control.girdle_weight[:, None]
    weight[:, 10:] = np.maximum(control.stability_weight, 1e-9)[:, None]
    problem = Allocation(
        matrix=np.concatenate([matrix[:, :10], shear], axis=1),
        target=np.concatenate([torque, -offset], axis=1),
        weight=weight,
        cost=control.cost,
        low=control.tonic,
        high=control.cap,
    )
    target, state.multipliers = allocate(problem, state.multipliers)
    # Two steps to get there: what is asked of the muscles within one makes them chatter.
    change = 1.0 - np.exp(-activation_rate(body.muscles, target) * 2.0 * TICK_S)
    active = state.activation / goal.left
    needed = active + (target - active) / change
    missing = torque - np.einsum("nkm,nm->nk", matrix[:, :10], target)
    return np.clip(needed, 0.0, 1.0), missing


def _wishes(body: Body, goal: Goal, state: _State) -> tuple[np.ndarray, np.ndarray]:
    """Wished accelerations of the speeds and torques of the girdle's impedance, each (N, 10)."""
    from_sc, from_ac = _into_humerus(body, state.q)
    u = state.u
    carried = turned(from_sc, u[:, :3]) + turned(from_ac, u[:, 3:6])
    error = goal.errors(state.q)
    slip = goal.rate - np.hstack([u[:, :6], carried + u[:, 6:9], u[:, 9:]])
    impedance = np.zeros_like(u)
    impedance[:, :6] = GIRDLE_STIFFNESS * error[:, :6] + GIRDLE_DAMPING * slip[:, :6]
    wanted = goal.acceleration.copy()
    wanted[:, 6:] += HUMERUS_FREQUENCY**2 * error[:, 6:] + 2.0 * HUMERUS_FREQUENCY * slip[:, 6:]
    wanted[:, 6:9] -= turned(from_sc, wanted[:, :3]) + turned(from_ac, wanted[:, 3:6])
    return wanted, impedance


def _joint_rates(body: Body, goal: Goal) -> np.ndarray:
    """Speeds (N, 10) of the joints of a wish, whose humerus is led against the thorax."""
    from_sc, from_ac = _into_humerus(body, goal.pose)
    rate = goal.rate.copy()
    rate[:, 6:9] -= turned(from_sc, goal.rate[:, :3]) + turned(from_ac, goal.rate[:, 3:6])
    return rate


def _into_humerus(body: Body, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (N, 3, 3) from axes of the clavicle, and of the scapula, into the humerus."""
    clavicle, scapula, humerus = np.moveaxis(body.forces.dynamics.pose_matrices(q), 1, 0)
    back = humerus.transpose(0, 2, 1)
    return np.matmul(back, clavicle), np.matmul(back, scapula)


def _shear_rows(control, state, line, arms, unit, resting) -> tuple[np.ndarray, np.ndarray]:
    """Shear over compression of the reaction: rows (N, 2, M) by activation and offset (N, 2)."""
    axes = glenoid_axes(control.glenoid_rad)
    passive = _reaction(line, arms, resting)
    by_activation = np.einsum("nmk,nm->nkm", arms[:, :, 10:], unit)
    now = np.einsum("nk,nk->n", _reaction(line, arms, state.force), axes[:, :, 0])
    state.compression += 0.1 * (np.maximum(now, SMALLEST_COMPRESSION_N) - state.compression)
    shear = axes[:, :, 1:].transpose(0, 2, 1) / state.compression[:, None, None]
    # Superior-inferior shear is held by a longer radius of the glenoid (paper: factor 0.31).
    shear[:, 0] *= np.sqrt(0.31)
    return np.matmul(shear, by_activation), turned(shear, passive)


def glenoid_axes(angles: np.ndarray) -> np.ndarray:
    """Columns: outward normal, superior, posterior axis (N, 3, 3), from inclination, version."""
    incline, version = angles.T
    ci, si, cv, sv = np.cos(incline), np.sin(incline), np.cos(version), np.sin(version)
    zero = np.zeros_like(ci)
    normal = np.stack([cv * ci, -si, -sv * ci], axis=1)
    superior = np.stack([cv * si, ci, -sv * si], axis=1)
    posterior = np.stack([sv, zero, cv], axis=1)
    return np.stack([normal, superior, posterior], axis=2)


def _reaction(line: Linearisation, arms: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Glenohumeral reaction (N, 3) [N] without the inertia of the arm, which is small."""
    return np.einsum("nm,nmk->nk", force, arms[:, :, 10:]) - line.load[:, 10:]
