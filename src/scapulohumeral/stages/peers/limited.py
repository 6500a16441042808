"""Work of a peer in a process of its own, which is ended when its time is over."""

from __future__ import annotations

import ctypes
import json
import multiprocessing
import os
import re
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from multiprocessing.context import ForkProcess
from pathlib import Path
from typing import Any

LINE_BUFFERED = 1
LOOK_EVERY_S = 0.2
# A peer that waits for something, rather than computing, is ended after this multiple of its time.
IDLE_FACTOR = 50.0
# Fields of /proc/PID/stat behind the name: process group; own and children's time in ticks.
GROUP, TIMES = 2, (11, 12, 13, 14)
# IPOPT's line about an iteration: its number, r in the restoration phase, objective.
ITERATION = re.compile(r"^\s*(\d+)[r ]\s*-?\d\.\d+e[+-]\d+\s", re.MULTILINE)


class Notes:
    """What is known so far, kept in a file so that it outlives the process.

    Parameters
    ----------
    path : of the file
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._known: dict[str, Any] = {}

    def add(self, **facts: Any) -> None:
        """Note facts."""
        self._known |= facts
        self._path.write_text(json.dumps(self._known) + "\n", encoding="utf-8")


def within(seconds: float, work: Callable[[Notes], None], log: Path) -> dict[str, Any]:
    """What some work noted until it ended, or until its time was over.

    Parameters
    ----------
    seconds : processor time that the work may take, its children included, so that what else the
        machine does decides nothing
    work : notes what it found; a last note ``message`` is its own word on how it ended. It runs in
        an empty folder, where it may leave files
    log : receives its output; what it notes is kept beside it

    Returns
    -------
    dict                             the notes, ``wall_seconds``, ``processor_seconds``,
                                     ``finished``, ``message``, and ``iterations`` of IPOPT as far
                                     as its output tells them
    """
    notes = log.with_suffix(".notes.json")
    notes.unlink(missing_ok=True)
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as scratch:
        arguments = (work, notes.resolve(), log.resolve(), scratch)
        process = multiprocessing.get_context("fork").Process(target=_work, args=arguments)
        process.start()
        spent, over = _watched(process, seconds)
    output = log.read_text(encoding="utf-8", errors="replace")
    steps = ITERATION.findall(output)
    found: dict[str, Any] = {"iterations": int(steps[-1])} if steps else {}
    if notes.exists():
        found |= json.loads(notes.read_text(encoding="utf-8"))
        notes.unlink()
    if over:
        found["message"] = f"not finished in {seconds:g} s"
    elif process.exitcode != 0:
        found["message"] = _last_line(output)
    return {
        "message": "",
        **found,
        "finished": not over and process.exitcode == 0,
        "processor_seconds": spent,
        "wall_seconds": time.perf_counter() - begin,
    }


def _watched(process: ForkProcess, seconds: float) -> tuple[float, bool]:
    """Processor time of a process until it ended, and whether it was ended for its time."""
    spent, group = 0.0, process.pid or 0
    begin = time.perf_counter()
    while process.is_alive():
        process.join(LOOK_EVERY_S)
        spent = max(spent, _processor_seconds(group))
        if spent > seconds or time.perf_counter() - begin > IDLE_FACTOR * seconds:
            # Its own children too: compilers.
            os.killpg(group, signal.SIGKILL)
            process.join()
            return spent, True
    return spent, False


def _processor_seconds(group: int) -> float:
    """Processor time of the processes of a group and of their children that have ended [s]."""
    ticks = 0
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text(encoding="utf-8").rsplit(")", 1)[1].split()
        except (FileNotFoundError, ProcessLookupError):
            continue  # ended between listing and reading
        if int(fields[GROUP]) == group:
            ticks += sum(int(fields[k]) for k in TIMES)
    return ticks / os.sysconf("SC_CLK_TCK")


def measured_within(seconds: float, work: Callable[[Notes], None], log: Path, record: Path) -> None:
    """Write what :func:`within` found, and the load of the machine before."""
    load = os.getloadavg()[0]
    document = {**within(seconds, work, log), "load": load}
    record.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def _work(work: Callable[[Notes], None], notes: Path, log: Path, scratch: str) -> None:
    os.setsid()
    os.chdir(scratch)
    with log.open("w", encoding="utf-8") as stream:
        os.dup2(stream.fileno(), 1)
        os.dup2(stream.fileno(), 2)
    # Compiled code writes to a buffer of its own, which a process that is ended never empties.
    library = ctypes.CDLL(None)
    library.setvbuf(ctypes.c_void_p.in_dll(library, "stdout"), None, LINE_BUFFERED, 0)
    sys.stdout = os.fdopen(1, "w", buffering=LINE_BUFFERED)
    sys.stderr = os.fdopen(2, "w", buffering=LINE_BUFFERED)
    try:
        work(Notes(notes))
    except Exception:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
    sys.stdout.flush()
    os._exit(0)


def _last_line(output: str) -> str:
    """The last words of a process that failed."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    return lines[-1][:300] if lines else "ended without a word"
