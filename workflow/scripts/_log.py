"""Logging that all scripts of the workflow have in common."""

import os
import sys
import traceback
from pathlib import Path
from types import TracebackType
from typing import Any


def log_to_file(snakemake: Any) -> None:
    """Send all output of this process to its log, and end the log of a failure with one sentence.

    File descriptors are redirected, not only the Python streams: IPOPT and OpenSim print from C.

    Parameters
    ----------
    snakemake : snakemake.script.Snakemake
        The job: ``log.python`` is the file, ``rule`` and ``wildcards`` name it in the sentence.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    log = os.open(snakemake.log.python, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(log, 1)
    os.dup2(log, 2)
    os.close(log)
    wildcards = ", ".join(f"{key} {value}" for key, value in snakemake.wildcards.items())
    job = f"{snakemake.rule} ({wildcards})" if wildcards else snakemake.rule

    def report(
        kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        sys.stdout.flush()
        traceback.print_exception(kind, error, trace)
        print(failure_sentence(job, error, trace), file=sys.stderr, flush=True)

    sys.excepthook = report


def failure_sentence(job: str, error: BaseException, trace: TracebackType | None) -> str:
    """One line: what failed, where, what to do.

    The errors of the package carry their own remedy; any other error is a defect.
    """
    frames = traceback.extract_tb(trace)
    place = f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "unknown place"
    message = " ".join(str(error).split()) or "no message"
    remedy = "" if _is_ours(error) else " This is a defect of the program: see the traceback above."
    return f"Failed: {job}: {type(error).__name__} at {place}: {message}{remedy}"


def _is_ours(error: BaseException) -> bool:
    """Whether the error is one of `scapulohumeral.errors`, which state what to do."""
    return type(error).__module__ == "scapulohumeral.errors"
