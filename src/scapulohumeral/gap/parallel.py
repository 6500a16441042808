"""Independent jobs in processes of their own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any


def side_by_side(function: Callable[..., Any], jobs: Sequence[tuple], processes: int) -> list[Any]:
    """Results of jobs in their order; in this process if there is one job or process only."""
    workers = min(processes, len(jobs))
    if workers < 2:
        return [function(*job) for job in jobs]
    with ProcessPoolExecutor(workers) as pool:
        futures = [pool.submit(function, *job) for job in jobs]
        return [future.result() for future in futures]
