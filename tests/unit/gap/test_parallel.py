"""Jobs in processes of their own give what they give in this one."""

import os
import signal
import subprocess
import sys

import pytest

from scapulohumeral.exit_codes import INTERRUPTED
from scapulohumeral.gap.parallel import side_by_side

pytestmark = pytest.mark.unit

JOBS = [(i, 10 * i) for i in range(5)]


@pytest.mark.parametrize("processes", [1, 2, 9])
def test_results_keep_the_order_of_the_jobs(processes):
    # A function of this place cannot be sent to another process: it has to be found there.
    assert side_by_side(lambda a, b: a + b, JOBS, processes) == [0, 11, 22, 33, 44]
    assert side_by_side(lambda a, b: a - b, [], processes) == []


@pytest.mark.parametrize("processes", [1, 2])
def test_what_was_set_up_before_serves_all_jobs(processes):
    shared = {}
    shared["known"] = os.getpid()
    found = side_by_side(lambda a, b: (os.getpid(), shared["known"]), JOBS, processes)
    assert {known for _, known in found} == {os.getpid()}
    assert (os.getpid() in {where for where, _ in found}) is (processes == 1)


def test_an_error_of_a_job_is_raised():
    def refuses(a, b):
        raise ValueError(f"no {a}")

    with pytest.raises(ValueError, match="no 0"):
        side_by_side(refuses, JOBS, 2)


def test_an_interrupt_ends_every_process_without_a_word():
    program = (
        # Shells let what runs in the background ignore interrupts.
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler);"
        "import time; from scapulohumeral.gap.parallel import side_by_side;"
        "from scapulohumeral.exit_codes import exit_code;"
        "begun = lambda i: (print(i, flush=True), time.sleep(60));"
        "raise SystemExit(exit_code(lambda: side_by_side(begun, [(1,), (2,)], 2)))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    for _ in range(2):
        process.stdout.readline()
    os.killpg(process.pid, signal.SIGINT)
    _, said = process.communicate(timeout=30)
    assert process.returncode == INTERRUPTED
    assert said.splitlines() == ["Interrupted: there is no answer. Run the same again."]
