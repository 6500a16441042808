"""The same equations as plain symbols, for opty's own code generation.

An oracle for the numeric transcription on models with few muscles, and the baseline of the
benchmark. Not used by any solve.

Letters: M muscles, F features.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

from scapulohumeral.dynamics.equations import REACTIONS, formulation_residual
from scapulohumeral.dynamics.formulation import Formulation, get_formulation
from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.dynamics.parameters import scalar_names
from scapulohumeral.model.muscle_paths.geometry import MuscleGeometry
from scapulohumeral.ocp.layout import REACTION_UNIT_N
from scapulohumeral.ocp.opty_adapter import REACTION_NAMES


@dataclass(frozen=True)
class SymbolicEquations:
    """Equations of motion as opty takes them: 0 = rows(x', x, inputs)."""

    rows: sm.Matrix
    states: tuple[sm.Expr, ...]


def symbolic_equations(
    name: str, geometry: MuscleGeometry, muscles: MuscleParameters, parameters: np.ndarray
) -> SymbolicEquations:
    """Kinematic, dynamic and activation equations of a formulation with numbers for parameters."""
    formulation = get_formulation(name)
    t = me.dynamicsymbols._t
    substitutions, rows = formulation_residual(formulation)
    values = {
        sm.Symbol(p, real=True): sm.Float(v)
        for p, v in zip(scalar_names(), parameters, strict=True)
    }
    reactions = [REACTION_UNIT_N * me.dynamicsymbols(r) for r in REACTION_NAMES]
    values.update(dict(zip(REACTIONS, reactions, strict=True)))
    for placeholder, expression in substitutions:
        values[placeholder] = expression.xreplace(values)
    dynamic = rows.xreplace(values)
    activations = [me.dynamicsymbols(f"a_{m}") for m in muscles.names]
    excitations = [me.dynamicsymbols(f"e_{m}") for m in muscles.names]
    dynamic += _muscle_rows(formulation, geometry, muscles, activations)
    units = sm.diag(*([1] * 10 + [1 / REACTION_UNIT_N] * 3))
    kinematic = sm.Matrix(formulation.q).diff(t) - formulation.kinematics * sm.Matrix(formulation.u)
    activation = [
        a.diff(t) - (1 / td + (1 / ta - 1 / td) * e) * (e - a)
        for a, e, ta, td in zip(
            activations,
            excitations,
            muscles.activation_time,
            muscles.deactivation_time,
            strict=True,
        )
    ]
    return SymbolicEquations(
        sm.Matrix([*kinematic, *(units * dynamic), *activation]),
        (*formulation.q, *formulation.u, *activations),
    )


def _features(formulation: Formulation, geometry: MuscleGeometry) -> list[sm.Expr]:
    variables = [formulation.q[i] for i in formulation.polynomial_variables]
    monomials = [
        sm.prod(v**e for v, e in zip(variables, row.tolist(), strict=True))
        for row in geometry.exponents
    ]
    r = formulation.rotations
    blocks = (r["SC"], r["AC"], r["SC"] * r["AC"], r["GH"])
    return monomials + [entry for block in blocks for entry in block]


def _muscle_rows(
    formulation: Formulation, geometry: MuscleGeometry, muscles: MuscleParameters, activations
) -> sm.Matrix:
    """Generalised muscle forces, 13 x 1."""
    features = _features(formulation, geometry)
    q, rate_map = sm.Matrix(formulation.q), formulation.kinematics
    total = sm.zeros(13, 1)
    for m, activation in enumerate(activations):

        def linear(row: np.ndarray) -> sm.Expr:
            return sm.Add(*(sm.Float(row[k]) * features[k] for k in np.flatnonzero(row)))

        squared = bool(geometry.squared[m])
        y = linear(geometry.length[m])
        length = sm.sqrt(y) if squared else y
        gradient = (sm.Matrix([length]).jacobian(q) * rate_map).T
        shift = [linear(geometry.translation[k, m]) / (length if squared else 1) for k in range(3)]
        velocity = gradient.dot(sm.Matrix(formulation.u))
        force = _tension(muscles, m, length, velocity, activation)
        total -= force * sm.Matrix([*gradient, *shift])
    return total


def _tension(muscles: MuscleParameters, m: int, length, velocity, activation) -> sm.Expr:
    c, lopt = muscles.constants, muscles.optimal_fibre_length[m]
    x = (length - muscles.tendon_slack_length[m]) / lopt - 1
    s = c.d2 * velocity / (c.max_velocity * lopt) + c.d3
    active = sm.exp(-(x**2) / c.gaussian_width)
    active *= c.d1 * sm.log(s + sm.sqrt(s**2 + 1)) + c.d4
    passive = (sm.exp(c.passive_stiffness / c.passive_strain * x) - 1) / np.expm1(
        c.passive_stiffness
    )
    return muscles.max_isometric_force[m] * (muscles.capacity[m] * active * activation + passive)
