"""The kernels given to MUMPS: products of one triangle, against numpy."""

import ctypes
import os
import subprocess
import sys
from itertools import product

import numpy as np
import pytest

from scapulohumeral.ocp import dense_kernels

pytestmark = pytest.mark.unit

CASES = list(product("UL", "NT", "NT", (0.0, 1.0, -0.5), (1, 31, 32, 33, 100)))


@pytest.fixture(scope="module")
def library():
    assert dense_kernels.use_fast_kernels()
    return ctypes.CDLL(None)


@pytest.mark.parametrize(("triangle", "ta", "tb", "beta", "n"), CASES)
def test_dgemmt_changes_one_triangle_as_it_should(library, triangle, ta, tb, beta, n):
    rng = np.random.default_rng(n)
    k = 7
    a = np.asfortranarray(rng.normal(size=(n, k) if ta == "N" else (k, n)))
    b = np.asfortranarray(rng.normal(size=(k, n) if tb == "N" else (n, k)))
    # The target is part of a larger array, as in MUMPS.
    c = np.asfortranarray(rng.normal(size=(n + 3, n)))
    product_ = (a if ta == "N" else a.T) @ (b if tb == "N" else b.T)
    chosen = np.triu if triangle == "U" else np.tril
    mask = chosen(np.ones((n, n), dtype=bool))
    expected = c.copy()
    expected[:n][mask] = (beta * c[:n] + 2.0 * product_)[mask]

    def whole(value):
        return ctypes.byref(ctypes.c_int(value))

    def real(value):
        return ctypes.byref(ctypes.c_double(value))

    def address(array):
        return ctypes.c_void_p(array.ctypes.data)

    library.dgemmt_(
        *(letter.encode() for letter in (triangle, ta, tb)),
        *(whole(n), whole(k), real(2.0), address(a), whole(len(a))),
        *(address(b), whole(len(b)), real(beta), address(c), whole(n + 3)),
    )
    np.testing.assert_allclose(c, expected, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize(
    "module",
    [
        "ocp.solving.solver",
        "ocp.optimality.kkt",
        "gap.nominal.optimal_movement",
        "stages.benchmark",
    ],
)
def test_mumps_binds_to_the_kernels(module):
    """The dynamic linker reports which library each name of MUMPS was found in."""
    run = subprocess.run(
        [sys.executable, "-c", f"import scapulohumeral.{module}"],
        env={**os.environ, "LD_DEBUG": "bindings"},
        capture_output=True,
        text=True,
        check=True,
    )
    bound = [line for line in run.stderr.splitlines() if "libcoinmumps" in line.split(" to ")[0]]
    found = [line for line in bound if "symbol `dgemmt_'" in line]
    assert found
    assert all("dense_kernels_" in line.split(" to ")[1] for line in found)


def test_where_nothing_can_be_kept_it_says_so(monkeypatch, capsys, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setattr(dense_kernels, "user_cache", lambda: tmp_path / "file")
    assert not dense_kernels.use_fast_kernels.__wrapped__()
    assert "a third slower: " in capsys.readouterr().out


def test_without_scipys_blas_it_says_so(monkeypatch, capsys):
    monkeypatch.setattr(dense_kernels, "NAME", "no_such_library*.so")
    assert not dense_kernels.use_fast_kernels.__wrapped__()
    assert "the BLAS of casadi, a third slower" in capsys.readouterr().out
