import time

import pytest

from masrel.errors import ParameterError
from masrel.lab.hess import RealClock, SimulatedClock


def test_the_real_clock_does_not_return_before_its_deadline() -> None:
    clock = RealClock()
    for wait_ns in (0, 200_000, 3_000_000):
        deadline = clock.now_ns() + wait_ns
        clock.sleep_until_ns(deadline)
        assert clock.now_ns() >= deadline


def test_the_real_clock_sleeps_but_for_the_end_of_a_wait() -> None:
    clock = RealClock()
    began = time.thread_time()
    clock.sleep_until_ns(clock.now_ns() + 200_000_000)
    assert time.thread_time() - began < 0.05


def test_the_real_clock_returns_at_once_when_the_deadline_has_passed() -> None:
    clock = RealClock()
    before = time.monotonic()
    clock.sleep_until_ns(clock.now_ns() - 10_000_000_000)
    assert time.monotonic() - before < 1.0


def test_the_simulated_clock_stands_still_until_told_to_sleep() -> None:
    clock = SimulatedClock(start_ns=7)
    assert [clock.now_ns(), clock.now_ns()] == [7, 7]
    clock.sleep_until_ns(1_000)
    assert clock.now_ns() == 1_000


def test_the_simulated_clock_never_goes_back() -> None:
    clock = SimulatedClock(start_ns=1_000)
    clock.sleep_until_ns(10)
    assert clock.now_ns() == 1_000


def test_a_negative_time_is_refused() -> None:
    with pytest.raises(ParameterError, match="start_ns: needs 0 or more, got -1"):
        SimulatedClock(start_ns=-1)
