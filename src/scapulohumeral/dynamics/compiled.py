"""Where symbols become numbers: SymPy expressions to CasADi functions with exact derivatives.

Above this module there are only symbols, below it only arrays. CasADi differentiates the
expressions algorithmically and evaluates them for all nodes in one call. What is compiled
(:mod:`native`) has no numbers of a participant in it, so one build serves all.

Letters: N nodes, Nq coordinates, Nu = 10 speeds, P parameters, K = 13 equations,
Z = Nq + 2 Nu + 3 arguments (q, u, du/dt, R), F = 36 rotation features.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

from scapulohumeral import provenance
from scapulohumeral.dynamics import equations, native
from scapulohumeral.dynamics.formulation import Formulation, get_formulation
from scapulohumeral.dynamics.parameters import BALL_JOINTS, SIZE, scalar_names
from scapulohumeral.errors import ModelError
from scapulohumeral.model.muscle_paths.geometry import ROTATION_BLOCKS

FUNCTIONS = ("residual", "jacobian", "hessian", "features", "feature_second", "pose_matrices")
CASADI_NAMES = {
    "sin": ca.sin,
    "cos": ca.cos,
    "sqrt": ca.sqrt,
    "exp": ca.exp,
    "asin": ca.asin,
    "atan2": ca.atan2,
}


class _OfNodes:
    """Evaluates functions for many nodes; buffers stay, by function and number of nodes."""

    @cached_property
    def _mapped(self) -> dict[tuple[str, int], _Mapped]:
        return {}

    def __getstate__(self) -> dict[str, Any]:
        """What another process needs: not the buffers, which hold addresses of this one."""
        return {name: value for name, value in vars(self).items() if name != "_mapped"}

    def _for_nodes(self, function: ca.Function, *arguments: np.ndarray) -> tuple[np.ndarray, ...]:
        key = function.name(), len(arguments[0])
        if key not in self._mapped:
            self._mapped[key] = _Mapped(function, len(arguments[0]))
        return self._mapped[key](*arguments)


@dataclass(frozen=True)
class CompiledDynamics(_OfNodes):
    """Numeric equations of motion of one formulation.

    Attributes
    ----------
    name : formulation name
    coordinate_names, speed_names : names in the order of q and u
    kinematics_constant : (Nq, Nu), kinematics_linear : (Nq, Nu, Nq); dq/dt = T(q) u with
        T(q) = constant + linear q
    polynomial_variables : indices into q of the variables of the muscle length polynomials
    jacobian_pattern : (K, Z) bool; hessian_pattern : (Z, Z) bool, symmetric
    functions : CasADi functions by name
    header : what was built, from which expressions, by which code, with which versions
    """

    name: str
    coordinate_names: tuple[str, ...]
    speed_names: tuple[str, ...]
    kinematics_constant: np.ndarray
    kinematics_linear: np.ndarray
    polynomial_variables: tuple[int, ...]
    jacobian_pattern: np.ndarray
    hessian_pattern: np.ndarray
    functions: dict[str, ca.Function]
    header: dict

    @property
    def number_of_coordinates(self) -> int:
        """Nq."""
        return len(self.coordinate_names)

    def rate_map(self, q: np.ndarray) -> np.ndarray:
        """T(q), shape (N, Nq, Nu), for q of shape (N, Nq)."""
        return self.kinematics_constant + np.einsum("ijk,nk->nij", self.kinematics_linear, q)

    def residual(self, z: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Residual without muscles, shape (N, K), for z (N, Z) and parameters (P,)."""
        return self._call("residual", z, parameters)

    def jacobian(self, z: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Derivative of the residual with respect to z, shape (N, K, Z)."""
        flat = self._call("jacobian", z, parameters)
        return flat.reshape(len(z), z.shape[1], -1).transpose(0, 2, 1)

    def hessian(self, z: np.ndarray, multipliers: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Second derivative of multipliers . residual, shape (N, Z, Z); multipliers (N, K)."""
        flat = self._call("hessian", z, multipliers, parameters)
        return flat.reshape(len(z), z.shape[1], z.shape[1])

    def features(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rotation features (N, F) and their gradients (N, F, Nq)."""
        values, gradients = self._call("features", q)
        return values, gradients.reshape(len(q), q.shape[1], -1).transpose(0, 2, 1)

    def feature_second(
        self, q: np.ndarray, rate: np.ndarray, weights: np.ndarray, rate_weights: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Second-order quantities of the features f.

        Returns d(grad f . rate)/dq (N, F, Nq); sum_k weights_k hess f_k (N, Nq, Nq); and
        sum_k rate_weights_k hess(grad f_k . rate) (N, Nq, Nq), for rate (N, Nq).
        """
        n, nq = q.shape
        jdot, hess, third = self._call("feature_second", q, rate, weights, rate_weights)
        return (
            jdot.reshape(n, nq, -1).transpose(0, 2, 1),
            hess.reshape(n, nq, nq),
            third.reshape(n, nq, nq),
        )

    def pose_matrices(self, q: np.ndarray) -> np.ndarray:
        """Rotation matrices of clavicle, scapula, humerus in the thorax, shape (N, 3, 3, 3)."""
        return self._call("pose_matrices", q).reshape(len(q), 3, 3, 3)

    def _call(self, name: str, *arguments: np.ndarray):
        results = self._for_nodes(self.functions[name], *arguments)
        return results if len(results) > 1 else results[0]

    def save(self, folder: Path) -> None:
        """Write the functions, compiled ones where possible, and their header to a folder."""
        folder.mkdir(parents=True, exist_ok=True)
        for name, function in self.functions.items():
            function.save(str(folder / f"{name}.casadi"))
        header = {**self.header, "native": native.compile_functions(self.functions, folder)}
        (folder / "header.json").write_text(json.dumps(header, indent=1) + "\n")


class _Mapped:
    """A function of columns, evaluated for N of them without copies beside its results.

    Parameters
    ----------
    function : CasADi function of columns; nodes : N
    """

    def __init__(self, function: ca.Function, nodes: int) -> None:
        self._map = function.map(nodes)
        self._buffer, self._evaluate = self._map.buffer()
        self._nodes = nodes
        outputs = [function.sparsity_out(i) for i in range(function.n_out())]
        self._sizes = [sparsity.numel() for sparsity in outputs]
        self._places = [
            None if sparsity.is_dense() else np.array(sparsity.find()) for sparsity in outputs
        ]

    def __call__(self, *arguments: np.ndarray) -> tuple[np.ndarray, ...]:
        """Results (N, size) for arguments (N, size), or (size,) where they are the same for all."""
        rows = [np.broadcast_to(a, (self._nodes, a.shape[-1])) for a in arguments]
        # The buffer keeps addresses only: these arrays have to live until the call is over.
        inputs = [np.ascontiguousarray(a, dtype=float) for a in rows]
        results = [
            np.empty((self._nodes, size if places is None else len(places)))
            for size, places in zip(self._sizes, self._places, strict=True)
        ]
        for i, array in enumerate(inputs):
            self._buffer.set_arg(i, array.data)
        for i, array in enumerate(results):
            self._buffer.set_res(i, array.data)
        self._evaluate()
        return tuple(map(self._dense, results, self._sizes, self._places))

    def _dense(self, values: np.ndarray, size: int, places: np.ndarray | None) -> np.ndarray:
        if places is None:
            return values
        dense = np.zeros((self._nodes, size))
        dense[:, places] = values
        return dense


def load(folder: Path) -> CompiledDynamics:
    """Read what :meth:`CompiledDynamics.save` wrote.

    Raises
    ------
    ModelError
        If the folder is incomplete, or was written by another CasADi version or before equations
        were compiled.
    """
    try:
        header = json.loads((folder / "header.json").read_text())
    except FileNotFoundError as error:
        raise ModelError(f"{folder}: no equations here; run the rule build_equations") from error
    if header["versions"]["casadi"] != ca.__version__:
        raise ModelError(
            f"{folder}: built with CasADi {header['versions']['casadi']}, this is "
            f"{ca.__version__}; delete the folder and run the rule build_equations again"
        )
    if "native" not in header:
        raise ModelError(
            f"{folder}: built before equations were compiled; delete the folder and run the rule "
            "build_equations again"
        )
    functions = native.load_functions(FUNCTIONS, folder, header["native"])
    if functions is None:
        functions = {name: ca.Function.load(str(folder / f"{name}.casadi")) for name in FUNCTIONS}
    return _assemble(get_formulation(header["formulation"]), functions, header)


def is_current(folder: Path) -> bool:
    """Whether a folder holds equations that this code, with the packages installed, would build."""
    header = folder / "header.json"
    return header.is_file() and _origin().items() <= json.loads(header.read_text()).items()


def _origin() -> dict[str, Any]:
    """What equations are built by."""
    return {
        "code": provenance.code_hash(__name__),
        "versions": {"sympy": sm.__version__, "casadi": ca.__version__},
    }


def build(name: str) -> CompiledDynamics:
    """Derive, convert and differentiate the equations of one formulation."""
    start = time.perf_counter()
    formulation = get_formulation(name)
    substitutions, rows = equations.formulation_residual(formulation)
    derived = time.perf_counter()
    shared, reduced = sm.cse(list(rows), optimizations=None)
    arguments = _arguments(formulation)
    residual = _to_casadi(substitutions, shared, reduced, _symbol_table(formulation, arguments))
    functions = {
        **_dynamics_functions(arguments, residual),
        **_rotation_functions(formulation),
    }
    header = {
        "formulation": name,
        "operations": int(sm.count_ops([e for _, e in (*substitutions, *shared)] + reduced)),
        "instructions": {k: int(f.n_instructions()) for k, f in functions.items()},
        "expression_hash": _expression_hash((*substitutions, *shared), reduced),
        **_origin(),
        "derivation_seconds": derived - start,
        "build_seconds": time.perf_counter() - start,
    }
    return _assemble(formulation, functions, header)


def _assemble(formulation: Formulation, functions, header) -> CompiledDynamics:
    constant, linear = formulation.kinematic_tensor()
    z = len(formulation.q) + 23
    jac = ca.reshape(functions["jacobian"].sparsity_out(0), 13, z)
    hess = ca.reshape(functions["hessian"].sparsity_out(0), z, z)
    return CompiledDynamics(
        name=formulation.name,
        coordinate_names=formulation.coordinate_names,
        speed_names=formulation.speed_names,
        kinematics_constant=constant,
        kinematics_linear=linear,
        polynomial_variables=formulation.polynomial_variables,
        jacobian_pattern=np.array(ca.DM(jac, 1.0)) != 0,
        hessian_pattern=np.array(ca.DM(hess, 1.0)) != 0,
        functions=functions,
        header=header,
    )


def _expression_hash(assignments, rows) -> str:
    text = "\n".join([*(f"{a}={b}" for a, b in assignments), *(str(row) for row in rows)])
    return hashlib.sha256(text.encode()).hexdigest()


def _arguments(formulation: Formulation) -> dict[str, ca.SX]:
    nq = len(formulation.q)
    z = ca.SX.sym("z", nq + 23)
    q, u, ud, reaction = ca.vertsplit(z, [0, nq, nq + 10, nq + 20, nq + 23])
    return {"z": z, "q": q, "u": u, "ud": ud, "R": reaction, "p": ca.SX.sym("p", SIZE)}


def sympy_to_casadi(expressions: Sequence[sm.Expr], table: dict[sm.Expr, ca.SX]) -> list[ca.SX]:
    """SymPy expressions in CasADi symbols; `table` gives the CasADi symbol of each SymPy one."""
    function = sm.lambdify(list(table), list(expressions), modules=[CASADI_NAMES])
    return [ca.SX(e) for e in function(*table.values())]


def _to_casadi(substitutions, shared, rows, table: dict[sm.Expr, ca.SX]) -> ca.SX:
    values = sympy_to_casadi([e for _, e in substitutions], table)
    table = {**table, **{s: v for (s, _), v in zip(substitutions, values, strict=True)}}
    function = sm.lambdify(list(table), rows, modules=[CASADI_NAMES], cse=lambda _: (shared, rows))
    return ca.vertcat(*function(*table.values()))


def _symbol_table(formulation: Formulation, arguments: dict[str, ca.SX]) -> dict[sm.Expr, ca.SX]:
    t = me.dynamicsymbols._t
    table: dict[sm.Expr, ca.SX] = {}
    table.update({s.diff(t): arguments["ud"][i] for i, s in enumerate(formulation.u)})
    for key, symbols in (("q", formulation.q), ("u", formulation.u), ("R", equations.REACTIONS)):
        table.update({s: arguments[key][i] for i, s in enumerate(symbols)})
    for i, name in enumerate(scalar_names()):
        table[sm.Symbol(name, real=True)] = arguments["p"][i]
    return table


def _dynamics_functions(a: dict[str, ca.SX], residual: ca.SX) -> dict[str, ca.Function]:
    z = a["z"]
    multipliers = ca.SX.sym("multipliers", 13)
    hessian, _ = ca.hessian(ca.dot(multipliers, residual), z)
    options = {"cse": True}
    return {
        "residual": ca.Function("residual", [z, a["p"]], [residual], options),
        "jacobian": ca.Function(
            "jacobian", [z, a["p"]], [ca.vec(ca.jacobian(residual, z))], options
        ),
        "hessian": ca.Function("hessian", [z, multipliers, a["p"]], [ca.vec(hessian)], options),
    }


def _rotation_functions(formulation: Formulation) -> dict[str, ca.Function]:
    q = ca.SX.sym("q", len(formulation.q))
    table = {s: q[i] for i, s in enumerate(formulation.q)}
    matrices = {}
    for joint in BALL_JOINTS:
        entries = sympy_to_casadi(list(formulation.rotations[joint]), table)
        matrices[joint] = ca.reshape(ca.vertcat(*entries), 3, 3).T
    matrices["TS"] = matrices["SC"] @ matrices["AC"]
    features = ca.vertcat(*(ca.vec(matrices[block].T) for block in ROTATION_BLOCKS))
    jacobian = ca.jacobian(features, q)
    rate = ca.SX.sym("rate", q.numel())
    weights, rate_weights = ca.SX.sym("w", features.numel()), ca.SX.sym("v", features.numel())
    directional = jacobian @ rate
    hess, _ = ca.hessian(ca.dot(weights, features), q)
    third, _ = ca.hessian(ca.dot(rate_weights, directional), q)
    poses = [matrices["SC"], matrices["TS"], matrices["TS"] @ matrices["GH"]]
    options = {"cse": True}
    return {
        "features": ca.Function("features", [q], [features, ca.vec(ca.densify(jacobian))], options),
        "feature_second": ca.Function(
            "feature_second",
            [q, rate, weights, rate_weights],
            [ca.vec(ca.densify(m)) for m in (ca.jacobian(directional, q), hess, third)],
            options,
        ),
        "pose_matrices": ca.Function(
            "pose_matrices", [q], [ca.vertcat(*(ca.vec(m.T) for m in poses))], options
        ),
    }


@dataclass(frozen=True)
class VectorFunction(_OfNodes):
    """A vector of expressions e(x; p) with exact derivatives, evaluated for many nodes.

    Letters: E expressions, X variables, P parameters.

    Attributes
    ----------
    function : of x, p and weights: values, Jacobian and weighted curvature
    slopes : of x and p: the first two alone, which is all that most steps of a solver ask for
    """

    function: ca.Function
    slopes: ca.Function

    def first(self, x: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values (N, E) and Jacobians (N, E, X) at x (N, X), p (N, P)."""
        value, jacobian = self._for_nodes(self.slopes, x, p)
        return value, _by_expression(jacobian, x)

    def all(
        self, x: np.ndarray, p: np.ndarray, weights: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Values, Jacobians and sum_k weights_k hess e_k (N, X, X), weights (N, E)."""
        value, jacobian, curvature = self._for_nodes(self.function, x, p, weights)
        n, width = x.shape
        return value, _by_expression(jacobian, x), curvature.reshape(n, width, width)


def _by_expression(jacobian: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Jacobians (N, E, X) from columns one after the other, (N, X E), at x (N, X)."""
    return jacobian.reshape(*x.shape, -1).transpose(0, 2, 1)


def compile_vector(
    variables: Sequence[sm.Expr], parameters: Sequence[sm.Expr], expressions: Sequence[sm.Expr]
) -> VectorFunction:
    """Numeric function of SymPy expressions in ordered variables and parameters."""
    x = ca.SX.sym("x", len(variables))
    p = ca.SX.sym("p", max(len(parameters), 1))
    table = {s: x[i] for i, s in enumerate(variables)}
    table.update({s: p[i] for i, s in enumerate(parameters)})
    values = ca.vertcat(*sympy_to_casadi(expressions, table))
    weights = ca.SX.sym("weights", len(expressions))
    curvature, _ = ca.hessian(ca.dot(weights, values), x)
    outputs = [values, ca.vec(ca.densify(ca.jacobian(values, x))), ca.vec(ca.densify(curvature))]
    options = {"cse": True}
    return VectorFunction(
        ca.Function("vector", [x, p, weights], outputs, options),
        ca.Function("slopes", [x, p], outputs[:2], options),
    )
