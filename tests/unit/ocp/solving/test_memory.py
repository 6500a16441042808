"""Freed memory is used again without asking the kernel for new pages."""

import platform
import subprocess
import sys

import pytest

pytestmark = pytest.mark.unit

PROGRAMME = """
import resource
import numpy as np
from scapulohumeral.ocp.solving.memory import keep_freed_memory

if {keep}:
    assert keep_freed_memory()
np.ones(25_000_000)
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(5):
    np.ones(25_000_000)
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def page_faults(keep: bool) -> int:
    """Page faults of five arrays of 200 MB, made and freed one after the other."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAMME.format(keep=keep)],
        capture_output=True,
        text=True,
        check=True,
    )
    return int(done.stdout)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="mallopt is of the GNU C library")
def test_freed_memory_stays_with_the_process():
    """Without it, each array takes new pages; with it, none does."""
    assert page_faults(keep=False) > 300
    assert page_faults(keep=True) < 100
