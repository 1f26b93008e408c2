"""What the loop asks of the system, and that it says what it did not get."""

import os
import resource
import subprocess
import sys

import pytest

from masrel.lab.hess._clock import off_the_loop, real_time

pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="scheduling and locked memory as Linux has them"
)

# Without privileges: a child that gives up root, and may neither lock nor schedule
UNPRIVILEGED = """
import os, resource
from masrel.lab.hess._clock import real_time
for limit in (resource.RLIMIT_RTPRIO, resource.RLIMIT_MEMLOCK):
    resource.setrlimit(limit, (0, 0))
if os.getuid() == 0:
    os.setgroups([]); os.setgid(65534); os.setuid(65534)
with real_time() as granted:
    print(granted)
"""


def locked_kb() -> int:
    with open("/proc/self/status", encoding="ascii") as status:
        line = next(line for line in status if line.startswith("VmLck:"))
    return int(line.split()[1])


def test_it_says_of_each_whether_it_was_granted_and_gives_it_back() -> None:
    policy, locked = os.sched_getscheduler(0), locked_kb()
    allowed = os.sched_getaffinity(0)
    last = max(allowed)
    where = f" on processor {last}" if len(allowed) > 1 else ""
    with real_time() as granted:
        scheduling, memory, timers = granted.split(", ")
        is_fifo = os.sched_getscheduler(0) == os.SCHED_FIFO
        assert is_fifo is (scheduling == f"SCHED_FIFO 80{where}")
        assert os.sched_getaffinity(0) == allowed
        assert (locked_kb() > locked) is (memory == "locked memory")
        assert timers == "prompt timers"  # needs no privilege
        if not is_fifo:
            assert scheduling.startswith("no SCHED_FIFO (")
    assert os.sched_getscheduler(0) == policy
    assert os.sched_getaffinity(0) == allowed
    assert locked_kb() == locked


def test_without_privileges_it_says_so_and_goes_on() -> None:
    done = subprocess.run(
        [sys.executable, "-c", UNPRIVILEGED], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == (
        "no SCHED_FIFO (Operation not permitted), "
        "no locked memory (Operation not permitted), prompt timers"
    )


def test_a_single_processor_is_shared_by_all() -> None:
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(allowed)})
    try:
        with off_the_loop() as processors:
            assert processors == []
            assert os.sched_getaffinity(0) == {min(allowed)}
        with real_time() as granted:
            assert "on processor" not in granted
            assert os.sched_getaffinity(0) == {min(allowed)}
    finally:
        os.sched_setaffinity(0, allowed)


def test_an_exception_gives_it_back_too() -> None:
    policy = os.sched_getscheduler(0)
    with pytest.raises(KeyboardInterrupt), real_time():
        raise KeyboardInterrupt
    assert os.sched_getscheduler(0) == policy
    assert resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] != 0 or locked_kb() == 0
