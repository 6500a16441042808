"""Faster dense kernels for MUMPS: a third less time for each factorisation.

Most of a factorisation is products of small dense blocks. The BLAS that the casadi wheel brings
does them without the instructions of present processors; that of the scipy wheel has them. The
names that MUMPS looks for are given to it by ``dense_kernels.c``, compiled once and loaded into
the process before MUMPS is.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import platform
import subprocess
from importlib import metadata
from pathlib import Path

import scipy

from scapulohumeral.cached_file import cached_file
from scapulohumeral.dynamics.native import find_compiler
from scapulohumeral.provenance import user_cache

SOURCE = Path(__file__).with_suffix(".c")
NAME = "libscipy_openblas*.so"
OPTIONS = ("-O2", "-fPIC", "-shared")


@functools.cache
def use_fast_kernels() -> bool:
    """Load the kernels into this process; whether they are there. Says why if they are not."""
    library = _blas()
    compiler = find_compiler()
    if library is None or compiler is None:
        missing = f"no {NAME} beside scipy" if library is None else "no compiler"
        print(f"Factorisations take the BLAS of casadi, a third slower: {missing}.", flush=True)
        return False
    try:
        ctypes.CDLL(str(_compiled(compiler, library)), mode=ctypes.RTLD_GLOBAL)
    except (OSError, subprocess.CalledProcessError) as error:
        print(f"Factorisations take the BLAS of casadi, a third slower: {error}.", flush=True)
        return False
    return True


def _blas() -> Path | None:
    """BLAS of the scipy wheel, with 32-bit integers as MUMPS has them."""
    folder = Path(scipy.__file__).parent.with_name("scipy.libs")
    return next(iter(sorted(folder.glob(NAME))), None)


def _compiled(compiler: str, library: Path) -> Path:
    """The kernels as a library, kept for all processes of the user."""
    key = hashlib.sha256(SOURCE.read_bytes())
    key.update(f"{library}{metadata.version('scipy')}{platform.machine()}{OPTIONS}".encode())

    def compile_to(path: Path) -> None:
        files = [str(SOURCE), str(library), "-o", str(path)]
        where = f"-Wl,-rpath,{library.parent}"
        subprocess.run([compiler, *OPTIONS, *files, where], check=True)

    return cached_file(user_cache() / f"dense_kernels_{key.hexdigest()[:16]}.so", compile_to)
