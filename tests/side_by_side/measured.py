"""What both codes measure of a solve, and how a solution is handed on."""

from __future__ import annotations

import json
import resource
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

POINT = ("free", "multipliers", "lower", "upper")


def measure(solve: Callable[[], Any], path: Path) -> Any:
    """The result of a solve; time on the clock and of the processor, and memory, go to a file."""
    clock, processor = time.perf_counter(), time.process_time()
    result = solve()
    record = {
        "seconds": time.perf_counter() - clock,
        "processor_seconds": time.process_time() - processor,
        "iterations": result.iterations,
        "objective": result.objective,
        "status": "optimal" if result.optimal else result.message,
        "nodes": getattr(result, "meshes", ()),
        "peak_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }
    path.write_text(json.dumps(record) + "\n", encoding="utf-8")
    return result


def write_point(point: Any, path: Path) -> None:
    """Keep a solution, for solves that start from it."""
    np.savez(path, **{name: getattr(point, name) for name in POINT})


def read_point(path: Path) -> list[np.ndarray]:
    """Free vector and multipliers of a solution."""
    with np.load(path) as stored:
        return [stored[name] for name in POINT]
