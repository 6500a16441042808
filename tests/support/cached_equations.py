"""Equations of motion for the tests, built once and kept until their source files change."""

import fcntl
import hashlib
import tempfile
from pathlib import Path

from scapulohumeral import provenance
from scapulohumeral.dynamics import compiled

FORMULATIONS = ("quaternion", "euler")


def cached_equations(name: str, folder: Path) -> compiled.CompiledDynamics:
    """Equations of a formulation from `folder`, built first if they are not there."""
    return compiled.load(built_equations(name, folder))


def built_equations(name: str, folder: Path) -> Path:
    """Folder of the equations of a formulation in `folder`, built first if it is not there.

    Tests run in parallel processes, and all begin without equations. While another process builds
    these, the other formulation is built: somebody will ask for it.
    """
    target = _target(name, folder)
    if not target.exists() and not _build(name, folder, wait=False):
        [other] = set(FORMULATIONS) - {name}
        _build(other, folder, wait=False)
        _build(name, folder, wait=True)
    return target


def _target(name: str, folder: Path) -> Path:
    sources = provenance.code_of("scapulohumeral.dynamics.compiled")
    state = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:16]
    return folder / f"{name}_{state}"


def _build(name: str, folder: Path, wait: bool) -> bool:
    """Build a formulation if it is missing; False if another process does, unless told to wait."""
    target = _target(name, folder)
    with (folder / f"{name}.lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        except BlockingIOError:
            return False
        if not target.exists():
            # A process that is killed leaves no half of a folder.
            unfinished = Path(tempfile.mkdtemp(dir=folder))
            compiled.build(name).save(unfinished)
            unfinished.replace(target)
    return True
