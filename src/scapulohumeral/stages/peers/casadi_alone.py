"""CasADi and IPOPT alone on the tracking problem, with exact second derivatives."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable
from pathlib import Path

import casadi as ca
import numpy as np

from scapulohumeral.ocp.plain_casadi import transcribe
from scapulohumeral.problems.posed_problem import PosedProblem
from scapulohumeral.stages.peers.limited import Notes

FUNCTIONS = ("residual", "features")


def casadi_solve(
    posed: PosedProblem, equations: Path, tolerance: float, limit_s: float
) -> Callable[[Notes], None]:
    """Work that builds the problem with CasADi and solves it from the usual start.

    Parameters
    ----------
    posed : tracking problem; equations : folder of the equations of motion
    tolerance : of IPOPT; limit_s : processor time for solving
    """

    folder = equations.resolve()

    def work(notes: Notes) -> None:
        problem = posed.problem("exact")
        free = problem.layout.join(posed.cold_start())
        begin = time.process_time()
        functions = {name: ca.Function.load(str(folder / f"{name}.casadi")) for name in FUNCTIONS}
        plain = transcribe(problem, functions)
        evaluate = ca.Function("evaluate", [plain.x], [plain.f, plain.g])
        value, constraints = evaluate(plain.unknowns(free))
        expected = plain.constraints(problem.con(free))
        notes.add(
            objective_difference=abs(float(value) / problem.obj(free) - 1.0),
            constraint_difference=float(np.abs(np.array(constraints).ravel() - expected).max()),
        )
        options = {
            "linear_solver": "mumps",
            "tol": tolerance,
            "constr_viol_tol": tolerance,
            "max_cpu_time": limit_s,
        }
        program = {"x": plain.x, "f": plain.f, "g": plain.g}
        solver = ca.nlpsol("solver", "ipopt", program, {"ipopt": options})
        notes.add(build_seconds=time.process_time() - begin)
        begin = time.process_time()
        result = solver(
            x0=plain.unknowns(free),
            lbx=plain.unknowns(problem.lower_bound),
            ubx=plain.unknowns(problem.upper_bound),
            lbg=0,
            ubg=0,
        )
        stats = solver.stats()
        notes.add(
            solve_seconds=time.process_time() - begin,
            iterations=int(stats["iter_count"]),
            objective=float(result["f"]),
            optimal=bool(stats["success"]),
            message=stats["return_status"],
            peak_MB=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        )

    return work
