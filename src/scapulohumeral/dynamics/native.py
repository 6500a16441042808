"""CasADi functions as machine code: generated as C and compiled once, where there is a compiler.

CasADi's virtual machine gives the same numbers in ten times the time.
"""

from __future__ import annotations

import platform
import shutil
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import casadi as ca

LIBRARY = "functions.so"
COMPILERS = ("gcc", "cc")
# More optimisation takes minutes for functions of a hundred thousand lines.
OPTIONS = ("-O1", "-fPIC", "-shared")


def find_compiler() -> str | None:
    """Path of a C compiler, or None."""
    return next((path for path in map(shutil.which, COMPILERS) if path), None)


def compile_functions(functions: Mapping[str, ca.Function], folder: Path) -> dict[str, Any]:
    """Compile functions into one library in a folder; what was done, for a header.

    Without a compiler nothing is written, and the answer says why under ``missing``.
    """
    compiler = find_compiler()
    if compiler is None:
        return _without(f"no compiler found (looked for {', '.join(COMPILERS)})")
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        generator = ca.CodeGenerator("functions.c", {"with_header": False})
        for function in functions.values():
            generator.add(function)
        source = generator.generate(f"{scratch}/")
        unfinished = Path(scratch) / LIBRARY
        command = [compiler, *OPTIONS, source, "-o", str(unfinished), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            return _without(f"{compiler} ended with {done.returncode}: {done.stderr[:200]}")
        unfinished.replace(folder / LIBRARY)
    return {
        "compiler": Path(compiler).name,
        "options": " ".join(OPTIONS),
        "machine": platform.machine(),
        "seconds": time.perf_counter() - begin,
    }


def load_functions(
    names: Sequence[str], folder: Path, about: Mapping[str, Any]
) -> dict[str, ca.Function] | None:
    """Compiled functions of a folder, or None where the virtual machine has to do.

    Parameters
    ----------
    names : of the functions; about : what :func:`compile_functions` answered
    """
    if "missing" in about:
        return None
    if about["machine"] != platform.machine():
        _say(f"{folder / LIBRARY} was compiled for {about['machine']}, not {platform.machine()}")
        return None
    library = str((folder / LIBRARY).resolve())
    return {name: ca.external(name, library) for name in names}


def _without(reason: str) -> dict[str, Any]:
    _say(reason)
    return {"missing": reason}


def _say(reason: str) -> None:
    print(f"Equations run on CasADi's virtual machine, ten times slower: {reason}.", flush=True)
