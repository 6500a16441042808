"""opty alone: building and evaluating the problem with a few of the muscles."""

from __future__ import annotations

import dataclasses
import os
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import sparse

from scapulohumeral.dynamics import compiled
from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.model.muscle_paths.geometry import MuscleGeometry
from scapulohumeral.ocp.opty_adapter import ConstraintCollocator
from scapulohumeral.ocp.plain_opty import symbolic_equations
from scapulohumeral.ocp.problem import Problem
from scapulohumeral.problems.posed_problem import PosedProblem
from scapulohumeral.stages.peers.limited import Notes

REPEATS = 5


def opty_build(posed: PosedProblem, count: int) -> Callable[[Notes], None]:
    """Work that builds the problem with some muscles by opty alone and by this package.

    Notes, in seconds, what this package needs to derive its equations and to evaluate constraints
    and Jacobian, then opty's generation and compilation of each, then its evaluation, and the
    largest differences of the numbers.
    """

    def work(notes: Notes) -> None:
        name = posed.model.forces.dynamics.name
        begin = processor_seconds()
        dynamics = compiled.build(name)
        notes.add(own_build_seconds=processor_seconds() - begin)
        chosen = np.linspace(0, len(posed.muscles.names) - 1, count).astype(int)
        geometry, muscles = muscle_subset(posed.model.forces.geometry, posed.muscles, chosen)
        problem = Problem(
            MuscleForces(dynamics, geometry), muscles, posed.parameters, posed.objective, "exact"
        )
        free = np.random.default_rng(0).normal(0.3, 0.1, size=(problem.num_free,))
        notes.add(
            own_evaluation_seconds=median_seconds(
                lambda: (problem.constraints(free), problem.jacobian(free))
            )
        )
        begin = processor_seconds()
        equations = symbolic_equations(name, geometry, muscles, posed.parameters)
        collocator = ConstraintCollocator(
            equations.rows,
            equations.states,
            posed.nodes,
            posed.objective.step,
            instance_constraints=problem.collocator.instance_constraints,
            integration_method="midpoint",
        )
        constraints = collocator.generate_constraint_function()
        notes.add(constraint_build_seconds=processor_seconds() - begin)
        jacobian = collocator.generate_jacobian_function()
        notes.add(
            build_seconds=processor_seconds() - begin,
            evaluation_seconds=median_seconds(lambda: (constraints(free), jacobian(free))),
            constraint_difference=float(
                np.abs(constraints(free) - problem.constraints(free)).max()
            ),
            jacobian_difference=_jacobian_difference(
                problem, free, jacobian(free), collocator.jacobian_indices()
            ),
        )

    return work


def muscle_subset(
    geometry: MuscleGeometry, muscles: MuscleParameters, chosen: np.ndarray
) -> tuple[MuscleGeometry, MuscleParameters]:
    """Geometry and parameters of some of the muscles, with the features that they use."""
    size = len(geometry.exponents)
    used = (geometry.length[chosen] != 0).any(axis=0)
    used |= (geometry.translation[:, chosen] != 0).any(axis=(0, 1))
    used[size:] = True
    names = tuple(muscles.names[i] for i in chosen)
    arrays = {
        field.name: getattr(muscles, field.name)[chosen]
        for field in dataclasses.fields(muscles)
        if isinstance(getattr(muscles, field.name), np.ndarray)
    }
    subset = MuscleGeometry(
        names,
        geometry.exponents[used[:size]],
        geometry.length[chosen][:, used],
        geometry.translation[:, chosen][:, :, used],
        geometry.squared[chosen],
    )
    return subset, dataclasses.replace(muscles, names=names, **arrays)


def _jacobian_difference(problem: Problem, free: np.ndarray, values, indices) -> float:
    """Largest difference between opty's Jacobian and ours."""
    shape = (problem.num_constraints, problem.num_free)
    theirs = sparse.coo_matrix((values, indices), shape=shape).tocsr()
    ours = sparse.coo_matrix((problem.jacobian(free), problem.jacobianstructure()), shape=shape)
    return float(np.abs((theirs - ours.tocsr()).data).max(initial=0.0))


def processor_seconds() -> float:
    """Processor time of this process and of children that have ended, compilers among them [s]."""
    return sum(os.times()[:4])


def median_seconds(function: Callable[[], Any]) -> float:
    """Median seconds of a call."""
    function()
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        function()
        times.append(time.process_time() - start)
    return float(np.median(times))
