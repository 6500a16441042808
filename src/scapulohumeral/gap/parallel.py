"""Independent jobs in processes of their own."""

from __future__ import annotations

import signal
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import active_children, get_context
from typing import Any


def side_by_side(function: Callable[..., Any], jobs: Sequence[tuple], processes: int) -> list[Any]:
    """Results of jobs in their order; in this process if there is one job or process only.

    Processes begin as copies of this one and find the jobs there: what they share has been set up
    once, and what one job sets up serves the next of its process.
    """
    workers = min(processes, len(jobs))
    if workers < 2:
        return [function(*job) for job in jobs]
    context = get_context("fork")
    with ProcessPoolExecutor(workers, context, _take, (function, jobs)) as pool:
        try:
            return list(pool.map(_work, range(len(jobs))))
        except KeyboardInterrupt:
            for worker in active_children():
                worker.terminate()
            raise


# Function and jobs of this process, if it is one of several.
_taken: list[tuple[Callable[..., Any], Sequence[tuple]]] = []


def _take(function: Callable[..., Any], jobs: Sequence[tuple]) -> None:
    # Ctrl-C reaches all processes: the one that waits hears it, speaks, and ends the others.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _taken.append((function, jobs))


def _work(number: int) -> Any:
    function, jobs = _taken[-1]
    return function(*jobs[number])
