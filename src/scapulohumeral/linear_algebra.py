"""How many threads the linear algebra takes: one."""

from __future__ import annotations

import os

VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")


def take_one_thread() -> None:
    """Ask the libraries that are loaded later, and programs that are started, for one thread each.

    Solves run side by side in processes of their own, and the number of threads changes results in
    the last digits. Snakemake tells a job of two processors to take two: two diagnoses beside each
    other then took five to ten times as long.
    """
    os.environ.update(dict.fromkeys(VARIABLES, "1"))
