"""Equations of motion for the tests: those of the study, or others, built once for their code."""

import fcntl
import shutil
import tempfile
from pathlib import Path

from places import REPOSITORY

from scapulohumeral.dynamics import compiled

FORMULATIONS = ("quaternion", "euler")


def cached_equations(name: str, folder: Path) -> compiled.CompiledDynamics:
    """Equations of a formulation from `folder`, built first if they are not there."""
    return compiled.load(built_equations(name, folder))


def built_equations(name: str, folder: Path) -> Path:
    """Folder of the equations of a formulation: the study's own, or one in `folder`, built first.

    Tests run in parallel processes, and all may begin without equations. While another process
    builds these, the other formulation is built: somebody will ask for it.
    """
    studied = REPOSITORY / "results" / "equations" / name
    if compiled.is_current(studied):
        return studied
    if not compiled.is_current(folder / name) and not _build(name, folder, wait=False):
        [other] = set(FORMULATIONS) - {name}
        _build(other, folder, wait=False)
        _build(name, folder, wait=True)
    return folder / name


def _build(name: str, folder: Path, wait: bool) -> bool:
    """Build a formulation if it is missing; False if another process does, unless told to wait."""
    target = folder / name
    with (folder / f"{name}.lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        except BlockingIOError:
            return False
        if not compiled.is_current(target):
            # A process that is killed leaves no half of a folder.
            unfinished = Path(tempfile.mkdtemp(dir=folder))
            compiled.build(name).save(unfinished)
            shutil.rmtree(target, ignore_errors=True)
            unfinished.replace(target)
    return True
