"""opty's private names that are relied on, and its set-up, made once per kind of problem."""

from pathlib import Path

import opty
import pytest
from opty import direct_collocation
from small_arm import small_objective
from small_problem import small_problem

from scapulohumeral.ocp import opty_adapter
from scapulohumeral.ocp.layout import REACTION_UNIT_N
from scapulohumeral.ocp.problem import Bounds

pytestmark = pytest.mark.unit

METHODS = [(owner, name) for owner, names in opty_adapter.PRIVATE_NAMES.items() for name in names]
ATTRIBUTES = [
    (owner, name) for owner, names in opty_adapter.PRIVATE_ATTRIBUTES.items() for name in names
]


@pytest.fixture
def make(equations):
    def make(nodes=5, bounds=None, hessian="exact"):
        objective = small_objective(equations.name, nodes, 2.0)
        return small_problem(equations, objective, hessian, bounds=bounds)

    return make


@pytest.mark.parametrize(("owner", "name"), METHODS)
def test_private_method_exists(owner, name):
    assert callable(getattr(getattr(direct_collocation, owner), name))


@pytest.mark.parametrize(("owner", "name"), ATTRIBUTES)
def test_private_attribute_is_still_used_by_opty(owner, name):
    # Setting an attribute that opty no longer reads would go unnoticed.
    source = Path(direct_collocation.__file__).read_text(encoding="utf-8")
    assert f"self.{name}" in source, f"{owner}.{name}, opty {opty.__version__}"


def test_a_problem_posed_again_takes_the_kept_set_up(make):
    make()
    before = opty_adapter.set_up.cache_info()
    make(hessian="gauss-newton")
    after = opty_adapter.set_up.cache_info()
    assert (after.hits, after.misses) == (before.hits + 1, before.misses)


def test_other_meshes_and_bounds_have_their_own_set_up(make):
    usual, longer, narrow = make(), make(nodes=6), make(bounds=Bounds(activation=(0.1, 0.9)))
    assert longer.num_free > usual.num_free
    assert usual.lower_bound.min() == pytest.approx(Bounds().reaction[0] / REACTION_UNIT_N)
    rows = usual.layout.index("a", usual.layout.rows["a"] * 0, 0)
    assert usual.lower_bound[rows].max() == 0.0
    assert narrow.lower_bound[rows].min() == 0.1


def test_bounds_of_one_problem_are_not_those_of_the_next(make):
    first = make()
    first.lower_bound[:] = -1.0
    assert make().lower_bound.max() == 0.0


def test_bounds_are_those_that_opty_itself_would_set(make):
    problem = make()
    expected = (problem.lower_bound.copy(), problem.upper_bound.copy())
    problem._generate_bound_arrays()
    for ours, theirs in zip(expected, (problem.lower_bound, problem.upper_bound), strict=True):
        assert (ours == theirs).all()
