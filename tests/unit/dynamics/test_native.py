"""Compiled functions: the numbers of the virtual machine, and what happens without a compiler."""

import json

import casadi as ca
import numpy as np
import pytest
from cached_equations import built_equations

from scapulohumeral.dynamics import compiled, native
from scapulohumeral.errors import ModelError

pytestmark = pytest.mark.unit


@pytest.fixture
def saved(tmp_path):
    """Function that compiles two functions of columns, and returns them with what it says."""
    x, p = ca.SX.sym("x", 3), ca.SX.sym("p", 2)
    slope = ca.jacobian(ca.sin(x * p[0]) + x[0] * p[1], x)
    functions = {
        "curve": ca.Function("curve", [x, p], [ca.exp(-x) * p[0], ca.vec(slope)]),
        "norm": ca.Function("norm", [x], [ca.sqrt(ca.sumsqr(x))]),
    }
    return lambda: (functions, native.compile_functions(functions, tmp_path))


def test_compiled_functions_give_the_same_numbers(saved, tmp_path):
    functions, about = saved()
    again = native.load_functions(tuple(functions), tmp_path, about)
    rng = np.random.default_rng(1)
    for name, function in functions.items():
        arguments = [rng.normal(size=(function.size1_in(i), 7)) for i in range(function.n_in())]
        for ours, theirs in zip(again[name].call(arguments), function.call(arguments), strict=True):
            np.testing.assert_allclose(np.array(ours), np.array(theirs), rtol=1e-14)
    assert [path.name for path in tmp_path.iterdir()] == [native.LIBRARY]


def test_without_a_compiler_the_virtual_machine_does_it_and_says_so(
    saved, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(native.shutil, "which", lambda name: None)
    functions, about = saved()
    assert "no compiler found" in about["missing"]
    assert "virtual machine, ten times slower" in capsys.readouterr().out
    assert native.load_functions(tuple(functions), tmp_path, about) is None
    assert not list(tmp_path.iterdir())


def test_a_compiler_that_fails_is_reported(saved, tmp_path, monkeypatch):
    monkeypatch.setattr(native, "OPTIONS", ("--no-such-option",))
    _, about = saved()
    assert "no-such-option" in about["missing"]


def test_a_library_of_another_machine_is_left_alone(saved, tmp_path, monkeypatch, capsys):
    functions, about = saved()
    monkeypatch.setattr(native.platform, "machine", lambda: "another")
    assert native.load_functions(tuple(functions), tmp_path, about) is None
    assert "not another" in capsys.readouterr().out


def test_sparse_results_are_spread_over_all_nodes(quaternion_equations):
    """Against one call of the function for each node."""
    rng = np.random.default_rng(2)
    z = rng.normal(size=(4, 36))
    parameters = rng.normal(size=quaternion_equations.functions["jacobian"].size1_in(1))
    together = quaternion_equations.jacobian(z, parameters)
    for row, matrix in zip(z, together, strict=True):
        alone = np.array(quaternion_equations.functions["jacobian"](row, parameters))
        np.testing.assert_array_equal(matrix, alone.reshape(36, 13).T)


def test_equations_of_earlier_versions_are_refused(tmp_path):
    header = {"formulation": "quaternion", "versions": {"casadi": ca.__version__}}
    (tmp_path / "header.json").write_text(json.dumps(header))
    with pytest.raises(ModelError, match="run the rule build_equations again"):
        compiled.load(tmp_path)


def test_equations_say_how_they_were_compiled(equations_folder, quaternion_equations):
    folder = built_equations("quaternion", equations_folder)
    header = json.loads((folder / "header.json").read_text())
    assert ("compiler" in header["native"]) == (folder / native.LIBRARY).exists()
    assert set(quaternion_equations.functions) == set(compiled.FUNCTIONS)


def test_equations_of_other_code_are_not_current(equations_folder, tmp_path):
    header = json.loads(
        (built_equations("quaternion", equations_folder) / "header.json").read_text()
    )
    assert not compiled.is_current(tmp_path)
    for code, current in ((header["code"], True), ("another", False)):
        (tmp_path / "header.json").write_text(json.dumps({**header, "code": code}))
        assert compiled.is_current(tmp_path) == current
