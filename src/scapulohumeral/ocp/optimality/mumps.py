"""Sparse symmetric indefinite factorisation with inertia: MUMPS, as IPOPT calls it.

CasADi's interface to MUMPS gives neither inertia nor several right-hand sides, so the library of
its wheel, which IPOPT uses as well, is called through its C interface.
"""

from __future__ import annotations

import ctypes
import weakref
from functools import cache
from pathlib import Path
from typing import Any

import casadi
import numpy as np
from scipy import sparse

from scapulohumeral.errors import ConfigError, SolveError
from scapulohumeral.ocp.dense_kernels import use_fast_kernels

VERSION = "5.8.2"
GENERAL_SYMMETRIC = 2
WORLD = -987654  # communicator of the sequential library
INITIALISE, FACTORISE, SOLVE, TERMINATE = -1, 4, 3, -2
# Controls by MUMPS' own numbers: silent; no permutation for large diagonal entries, which doubles
# the time of the analysis, and METIS ordering, both as for IPOPT; spare memory for delayed pivots
# [%], at first and at most, and detection of null pivots.
CONTROLS = {1: -1, 2: -1, 3: -1, 4: 0, 6: 0, 7: 5, 24: 1}
SPARE_MEMORY = 14
SPARE_PERCENT, LARGEST_SPARE_PERCENT = 100, 1600
# Codes of a factorisation that ran out of its spare memory.
OUT_OF_SPACE = (-8, -9)
NEGATIVE_PIVOTS, NULL_PIVOTS = 12, 28
# Columns solved for at once: memory of the right-hand sides stays small.
BLOCK = 64
MAX_RELATIVE_RESIDUAL = 1e-6
# From here on a solution is refined: differences of smooth functions are no more exact.
REFINED_RESIDUAL = 1e-9

# Structure DMUMPS_STRUC_C in the order of dmumps_c.h: type, then names with array lengths.
_FIELDS = """
int sym par job comm_fortran icntl:60 keep:500
double cntl:15 dkeep:230
long keep8:150
int n nblk nz_alloc nz
long nnz
pointer irn jcn a
int nz_loc
long nnz_loc
pointer irn_loc jcn_loc a_loc
int nelt
pointer eltptr eltvar a_elt blkptr blkvar perm_in sym_perm uns_perm colsca rowsca
int colsca_from_mumps rowsca_from_mumps
pointer colsca_loc rowsca_loc rowind colind pivots
pointer rhs redrhs rhs_sparse sol_loc rhs_loc rhsintr
pointer irhs_sparse irhs_ptr isol_loc irhs_loc glob2loc_rhs glob2loc_sol
int nrhs lrhs lredrhs nz_rhs lsol_loc nloc_rhs lrhs_loc nsol_loc
int schur_mloc schur_nloc schur_lld mblock nblock nprow npcol ld_rhsintr info:80 infog:80
double rinfo:40 rinfog:40
int deficiency
pointer pivnul_list mapping singular_values
int size_schur
pointer listvar_schur schur wk_user
char version_number:32 ooc_tmpdir:1024 ooc_prefix:256 write_problem:1024
int lwk_user
char save_dir:1024 save_prefix:256
int metis_options:40 instance_number
"""
_TYPES: dict[str, Any] = {
    "int": ctypes.c_int32,
    "long": ctypes.c_int64,
    "double": ctypes.c_double,
    "pointer": ctypes.c_void_p,
    "char": ctypes.c_char,
}


def _fields() -> list[tuple[str, Any]]:
    fields: list[tuple[str, Any]] = []
    for line in _FIELDS.split("\n")[1:-1]:
        kind, *names = line.split()
        for name in names:
            name, _, length = name.partition(":")
            fields.append((name, _TYPES[kind] * int(length) if length else _TYPES[kind]))
    return fields


class _Instance(ctypes.Structure):
    """DMUMPS_STRUC_C."""

    _fields_ = _fields()


class SymmetricFactors:
    """Factors L D L^T of a sparse symmetric matrix, D with pivots of order one and two.

    Parameters
    ----------
    lower : (n, n) sparse matrix, lower triangle

    Attributes
    ----------
    order : n
    inertia : numbers of positive, negative and zero eigenvalues (Sylvester's law of inertia)

    Raises
    ------
    SolveError
        If the factorisation breaks down.
    ConfigError
        If the installed MUMPS is not the release whose interface is written here.
    """

    def __init__(self, lower: sparse.csc_matrix) -> None:
        entries = lower.tocoo()
        self.order = lower.shape[0]
        self._matrix = lower + sparse.tril(lower, -1).T
        # MUMPS keeps pointers into these arrays.
        self._rows = np.ascontiguousarray(entries.row + 1, dtype=np.int32)
        self._columns = np.ascontiguousarray(entries.col + 1, dtype=np.int32)
        self._values = np.ascontiguousarray(entries.data, dtype=float)
        self._instance = _Instance(sym=GENERAL_SYMMETRIC, par=1, comm_fortran=WORLD)
        self._call(INITIALISE)
        weakref.finalize(self, _terminate, self._instance)
        for number, value in CONTROLS.items():
            self._instance.icntl[number - 1] = value
        self._instance.n, self._instance.nnz = self.order, len(self._values)
        self._instance.irn = self._rows.ctypes.data
        self._instance.jcn = self._columns.ctypes.data
        self._instance.a = self._values.ctypes.data
        self._factorise()
        negative, zero = (self._instance.infog[i - 1] for i in (NEGATIVE_PIVOTS, NULL_PIVOTS))
        self.inertia = (self.order - negative - zero, negative, zero)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solution of one (n,) or several (n, k) right-hand sides, refined where that is needed.

        Raises
        ------
        SolveError
            If the matrix is singular or the residual stays large.
        """
        if self.inertia[2]:
            raise SolveError(
                f"the matrix of order {self.order} has {self.inertia[2]} null pivot(s): its "
                "equations are not independent; look for redundant constraints"
            )
        columns = right.reshape(len(right), -1)
        size = np.abs(columns).max(axis=0, initial=0.0)
        solution = self._back_substitute(columns)
        left = columns - self._matrix @ solution
        residual = np.abs(left).max(axis=0, initial=0.0)
        if (residual > REFINED_RESIDUAL * size).any():
            solution += self._back_substitute(left)
            residual = np.abs(columns - self._matrix @ solution).max(axis=0, initial=0.0)
        if (residual > MAX_RELATIVE_RESIDUAL * size).any():
            raise SolveError(
                f"linear system of order {self.order}: relative residual up to "
                f"{(residual / np.maximum(size, 1e-300)).max():.1e}, expected at most "
                f"{MAX_RELATIVE_RESIDUAL:g}; the matrix is nearly singular"
            )
        return solution.reshape(right.shape)

    def _factorise(self) -> None:
        """Analyse and factorise, with twice the spare memory as often as it does not do."""
        spare = SPARE_PERCENT
        while True:
            self._instance.icntl[SPARE_MEMORY - 1] = spare
            try:
                return self._call(FACTORISE)
            except SolveError:
                if self._instance.infog[0] not in OUT_OF_SPACE or spare >= LARGEST_SPARE_PERCENT:
                    raise
                spare *= 2

    def _back_substitute(self, columns: np.ndarray) -> np.ndarray:
        solution = np.array(columns, dtype=float, order="F")
        for start in range(0, solution.shape[1], BLOCK):
            block = np.asfortranarray(solution[:, start : start + BLOCK])
            self._instance.rhs = block.ctypes.data
            self._instance.nrhs, self._instance.lrhs = block.shape[1], block.shape[0]
            self._call(SOLVE)
            solution[:, start : start + BLOCK] = block
        return solution

    def _call(self, job: int) -> None:
        self._instance.job = job
        _library().dmumps_c(ctypes.byref(self._instance))
        code, detail = self._instance.infog[0], self._instance.infog[1]
        if code < 0:
            raise SolveError(
                f"MUMPS stopped with INFOG(1) = {code}, INFOG(2) = {detail} in job {job} on a "
                f"matrix of order {self._instance.n}; see the user's guide of MUMPS {VERSION}"
            )


def _terminate(instance: _Instance) -> None:
    """Give MUMPS' memory back."""
    instance.job = TERMINATE
    _library().dmumps_c(ctypes.byref(instance))


@cache
def _library() -> ctypes.CDLL:
    """MUMPS of the CasADi wheel, after a check of its version: the structure must fit."""
    folder = Path(casadi.__file__).parent
    header = folder / "include" / "coin-or" / "mumps" / "dmumps_c.h"
    if f'MUMPS_VERSION "{VERSION}"' not in header.read_text(encoding="utf-8"):
        raise ConfigError(
            f"{header}: expected MUMPS {VERSION}; install the versions of environment.lock"
        )
    use_fast_kernels()
    library = ctypes.CDLL(str(folder / "libcoinmumps.so"))
    library.dmumps_c.restype = None
    return library
