"""Our transcription against the code that opty generates from the same equations."""

import numpy as np
import pytest
from opty.direct_collocation import ConstraintCollocator
from scipy import sparse
from small_arm import (
    STEP,
    small_geometry,
    small_muscles,
    small_objective,
    small_parameters,
)
from small_problem import small_problem

from scapulohumeral.ocp.plain_opty import symbolic_equations

pytestmark = pytest.mark.unit

NODES = 4


@pytest.mark.slow  # opty needs five minutes to generate and compile three muscles
def test_constraints_and_jacobian_equal_those_of_opty(equations):
    objective = small_objective(equations.name, NODES, stability=0.0)
    problem = small_problem(equations, objective)
    plain = symbolic_equations(
        equations.name, small_geometry(), small_muscles(), small_parameters()
    )
    collocator = ConstraintCollocator(
        plain.rows,
        plain.states,
        NODES,
        STEP,
        instance_constraints=problem.collocator.instance_constraints,
        integration_method="midpoint",
    )
    free = np.random.default_rng(5).normal(0.3, 0.2, size=problem.num_free)
    expected = collocator.generate_constraint_function()(free)
    np.testing.assert_allclose(problem.constraints(free), expected, atol=1e-10)
    values = collocator.generate_jacobian_function()(free)
    shape = (problem.num_constraints, problem.num_free)
    theirs = sparse.coo_matrix((values, collocator.jacobian_indices()), shape=shape).toarray()
    ours = sparse.coo_matrix((problem.jacobian(free), problem.jacobianstructure()), shape=shape)
    np.testing.assert_allclose(ours.toarray(), theirs, atol=1e-10)
