"""Hill-type muscle with rigid tendon, exactly as in the paper's supplement.

F = Fmax (capacity f_l(l) f_v(v) a + f_pe(l)) with l = (L - slack)/l_opt and v = V/(v_max l_opt),
L and V length and lengthening velocity of the muscle-tendon unit. Pennation is not part of the
paper's model.

Letters: N nodes, M muscles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scapulohumeral.errors import ModelError


@dataclass(frozen=True)
class HillConstants:
    """Curve constants shared by all muscles (supplement, table of parameters)."""

    gaussian_width: float = 0.25
    passive_stiffness: float = 5.0
    passive_strain: float = 0.6
    d1: float = -0.318
    d2: float = -8.149
    d3: float = -0.374
    d4: float = 0.886
    max_velocity: float = 10.0


@dataclass(frozen=True)
class MuscleParameters:
    """Run-time muscle parameters, each of shape (M,).

    Attributes
    ----------
    max_isometric_force : N
    optimal_fibre_length, tendon_slack_length : m
    activation_time, deactivation_time : s
    capacity : factor on the active force, 1 healthy, 0 excluded
    """

    names: tuple[str, ...]
    max_isometric_force: np.ndarray
    optimal_fibre_length: np.ndarray
    tendon_slack_length: np.ndarray
    activation_time: np.ndarray
    deactivation_time: np.ndarray
    capacity: np.ndarray
    constants: HillConstants

    def __post_init__(self) -> None:
        """Refuse arrays of wrong size and unphysical values, naming the muscle."""
        for field in (
            "max_isometric_force",
            "optimal_fibre_length",
            "activation_time",
            "deactivation_time",
        ):
            values = getattr(self, field)
            if values.shape != (len(self.names),):
                raise ModelError(f"{field}: {values.shape} values for {len(self.names)} muscles")
            if not np.all(values > 0):
                bad = self.names[int(np.argmin(values > 0))]
                raise ModelError(f"{field} of {bad} must be positive")
        if np.any(self.capacity < 0):
            raise ModelError("muscle capacity must not be negative")


@dataclass(frozen=True)
class ForceDerivatives:
    """Active force per unit activation and passive force with derivatives, all (N, M).

    Suffix ``l``: per metre of muscle-tendon length; ``v``: per m/s of lengthening velocity.
    """

    active: np.ndarray
    active_l: np.ndarray
    active_v: np.ndarray
    active_ll: np.ndarray
    active_lv: np.ndarray
    active_vv: np.ndarray
    passive: np.ndarray
    passive_l: np.ndarray
    passive_ll: np.ndarray


@dataclass(frozen=True)
class FibreLengthDerivatives:
    """Derivatives of muscle force by optimal fibre length, all (N, M).

    Attributes
    ----------
    first, second : per metre of fibre length, and per metre squared
    l, v, active : of ``first``, by muscle-tendon length [m], lengthening velocity [m/s], activation
    """

    first: np.ndarray
    second: np.ndarray
    l: np.ndarray  # noqa: E741 - the supplement's letter
    v: np.ndarray
    active: np.ndarray


def force_length(x: np.ndarray, c: HillConstants) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gaussian active force-length factor of normalised fibre lengths, and two derivatives.

    Source: supplement of the paper, active force-length relation. Shapes are those of `x`.
    """
    d = x - 1.0
    f = np.exp(-(d**2) / c.gaussian_width)
    f1 = -2.0 * d / c.gaussian_width * f
    f2 = (-2.0 / c.gaussian_width + (2.0 * d / c.gaussian_width) ** 2) * f
    return f, f1, f2


def passive_force_length(x: np.ndarray, c: HillConstants) -> tuple[np.ndarray, ...]:
    """Exponential passive factor of normalised fibre lengths, and two derivatives.

    Source: supplement of the paper, passive force-length relation; below zero for fibres shorter
    than optimal, as there. Shapes are those of `x`.
    """
    rate = c.passive_stiffness / c.passive_strain
    scale = 1.0 / np.expm1(c.passive_stiffness)
    e = np.exp(rate * (x - 1.0))
    return (e - 1.0) * scale, rate * e * scale, rate**2 * e * scale


def force_velocity(v: np.ndarray, c: HillConstants) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Logarithmic force-velocity factor (De Groote et al. 2016) and two derivatives.

    ``v`` is lengthening velocity over maximal shortening velocity: negative when shortening.
    Shapes are those of ``v``.
    """
    s = c.d2 * v + c.d3
    root = np.sqrt(s**2 + 1.0)
    f = c.d1 * np.log(s + root) + c.d4
    return f, c.d1 * c.d2 / root, -c.d1 * c.d2**2 * s / root**3


def force_derivatives(
    length: np.ndarray, velocity: np.ndarray, muscles: MuscleParameters
) -> ForceDerivatives:
    """Forces [N] and derivatives for muscle-tendon lengths [m] and velocities [m/s], (N, M)."""
    c = muscles.constants
    lopt = muscles.optimal_fibre_length
    vmax = c.max_velocity * lopt
    x = (length - muscles.tendon_slack_length) / lopt
    fl, fl1, fl2 = force_length(x, c)
    fv, fv1, fv2 = force_velocity(velocity / vmax, c)
    fp, fp1, fp2 = passive_force_length(x, c)
    fmax = muscles.max_isometric_force
    active = fmax * muscles.capacity
    return ForceDerivatives(
        active=active * fl * fv,
        active_l=active * fl1 * fv / lopt,
        active_v=active * fl * fv1 / vmax,
        active_ll=active * fl2 * fv / lopt**2,
        active_lv=active * fl1 * fv1 / (lopt * vmax),
        active_vv=active * fl * fv2 / vmax**2,
        passive=fmax * fp,
        passive_l=fmax * fp1 / lopt,
        passive_ll=fmax * fp2 / lopt**2,
    )


def fibre_length_derivatives(
    force: ForceDerivatives,
    activation: np.ndarray,
    length: np.ndarray,
    velocity: np.ndarray,
    muscles: MuscleParameters,
) -> FibreLengthDerivatives:
    """Derivatives by optimal fibre length of the force at an activation (N, M).

    ``force`` belongs to muscle-tendon lengths [m] and velocities [m/s], (N, M). Length above slack,
    velocity and optimal fibre length enter the force as ratios only, so it is homogeneous of
    degree zero in the three, and Euler's theorem turns derivatives by length and velocity into
    those by fibre length.
    """
    lopt = muscles.optimal_fibre_length
    stretch = length - muscles.tendon_slack_length
    f_l, f_v = force.active_l * activation + force.passive_l, force.active_v * activation
    f_ll = force.active_ll * activation + force.passive_ll
    f_lv, f_vv = force.active_lv * activation, force.active_vv * activation
    first = -(stretch * f_l + velocity * f_v) / lopt
    by_l = -(f_l + stretch * f_ll + velocity * f_lv) / lopt
    by_v = -(f_v + stretch * f_lv + velocity * f_vv) / lopt
    return FibreLengthDerivatives(
        first=first,
        l=by_l,
        v=by_v,
        second=-(first + stretch * by_l + velocity * by_v) / lopt,
        active=-(stretch * force.active_l + velocity * force.active_v) / lopt,
    )


def activation_rate(
    excitation: np.ndarray, activation: np.ndarray, muscles: MuscleParameters
) -> np.ndarray:
    """da/dt = (e/T_act + (1-e)/T_deact)(e - a), shape (N, M), in 1/s."""
    rise, fall = 1.0 / muscles.activation_time, 1.0 / muscles.deactivation_time
    return (fall + (rise - fall) * excitation) * (excitation - activation)


def excitation_change(
    rate: np.ndarray, activation: np.ndarray, muscles: MuscleParameters
) -> np.ndarray:
    """How far an excitation lies above an activation that changes at a rate: e - a, (N, M) [1].

    The inverse of :func:`activation_rate`, by the root that is zero with the rate. Where activation
    falls faster than that function can, there is no root and what is given grows on with the rate.
    Nothing keeps e within 0 to 1: that is left to who calls.

    Parameters
    ----------
    rate : da/dt (N, M) [1/s]; activation : a (N, M) [1]
    """
    rise, fall = 1.0 / muscles.activation_time, 1.0 / muscles.deactivation_time
    constant = fall + (rise - fall) * activation
    root = np.sqrt(np.maximum(constant**2 + 4.0 * (rise - fall) * rate, 0.0))
    return 2.0 * rate / (constant + root)
