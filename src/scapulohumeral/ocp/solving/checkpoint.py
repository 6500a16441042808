"""Interrupted solves go on where they were: iterates on disk, and a clean end on SIGTERM.

A checkpoint belongs to one problem, told by the hash of all that it is made of, its start included,
and to one task that solves it: others may solve the same at the same time.
It is written beside its place and moved there, so that it is complete whenever the process dies,
and removed when the problem is solved.

Letters: n unknowns, m constraints.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import signal
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

ITERATE = "iterate.npz"
# Least time between two checkpoints [s]: writing one takes a hundredth of it.
INTERVAL_S = 3.0


@dataclass(frozen=True, eq=False)
class Iterate:
    """Where a solve was.

    Attributes
    ----------
    nodes : of its mesh; phase : Hessian mode; barrier : barrier parameter
    iterations, seconds : spent on the problem until then, by interrupted processes too
    free : (n,); multipliers : (m,); lower, upper : (n,) of the bounds
    """

    nodes: int
    phase: str
    barrier: float
    iterations: int
    seconds: float
    free: np.ndarray
    multipliers: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


@dataclass
class Checkpoint:
    """The place of one problem's iterates.

    Attributes
    ----------
    folder : named by the task, an underscore and the hash of the problem
    """

    folder: Path
    written: float = field(default_factory=time.monotonic)

    @property
    def is_due(self) -> bool:
        """Whether the last iterate was written long enough ago."""
        return time.monotonic() - self.written >= INTERVAL_S

    def write(self, iterate: Iterate) -> None:
        """Keep an iterate in place of the last one."""
        self.folder.mkdir(parents=True, exist_ok=True)
        unfinished = self.folder / f"unfinished_{os.getpid()}.npz"
        np.savez(unfinished, **{f.name: getattr(iterate, f.name) for f in fields(Iterate)})
        unfinished.replace(self.folder / ITERATE)
        self.written = time.monotonic()

    def read(self) -> Iterate | None:
        """The iterate that was kept last, or None."""
        path = self.folder / ITERATE
        if not path.exists():
            return None
        with np.load(path, allow_pickle=False) as data:
            return Iterate(
                nodes=int(data["nodes"]),
                phase=str(data["phase"]),
                barrier=float(data["barrier"]),
                iterations=int(data["iterations"]),
                seconds=float(data["seconds"]),
                free=data["free"],
                multipliers=data["multipliers"],
                lower=data["lower"],
                upper=data["upper"],
            )

    def remove(self) -> None:
        """Forget all iterates: the task is solved, by this problem or an older one of it."""
        task = _task(self.folder)
        for folder in self.folder.parent.glob(f"{task}*"):
            if _task(folder) == task:
                shutil.rmtree(folder, ignore_errors=True)


def _task(folder: Path) -> str:
    """Task in the name of a checkpoint's folder."""
    return folder.name.rsplit("_", 1)[0]


def content_hash(*parts: Any) -> str:
    """SHA-256 over arrays, numbers, texts and dataclasses of them, whatever their nesting.

    Functions count by their name only.
    """
    digest = hashlib.sha256()
    for part in parts:
        _update(digest, part)
    return digest.hexdigest()


def _update(digest, part: Any) -> None:
    digest.update(type(part).__name__.encode())
    if isinstance(part, np.ndarray):
        digest.update(f"{part.shape}{part.dtype}".encode())
        digest.update(np.ascontiguousarray(part).tobytes())
    elif is_dataclass(part):
        for each in fields(part):
            digest.update(each.name.encode())
            _update(digest, getattr(part, each.name))
    elif isinstance(part, Mapping):
        for key in sorted(part):
            digest.update(str(key).encode())
            _update(digest, part[key])
    elif isinstance(part, (tuple, list)):
        for each in part:
            _update(digest, each)
    elif callable(part):
        digest.update(getattr(part, "__name__", type(part).__name__).encode())
    else:
        digest.update(repr(part).encode())


class Stop:
    """Whether the process was asked to end."""

    def __init__(self) -> None:
        self.requested = False

    def request(self, *_: Any) -> None:
        """Handler of SIGTERM: the solve ends after its present iteration."""
        self.requested = True


@contextmanager
def stop_on_sigterm() -> Iterator[Stop]:
    """While it lasts, SIGTERM asks to stop instead of ending the process at once."""
    stop = Stop()
    # Python lets the main thread alone handle signals.
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    before = signal.signal(signal.SIGTERM, stop.request)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGTERM, before)
