"""A first call that loads what it needs does not decide how a function is timed."""

import pytest

from tests.benchmarks.sidebyside import side_by_side


class Clock:
    """Seconds that pass when a function is called."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def test_a_slow_first_call_does_not_decide_the_repeats() -> None:
    clock, calls = Clock(), []

    def loads_itself() -> None:
        clock.now += 1e-5 if calls else 1.0  # an import, then ten microseconds
        calls.append(clock.now)

    timing = side_by_side({"peer": loads_itself}, turns=3, min_s=0.02, clock=clock)
    assert timing["peer"].median == pytest.approx(1e-5)
    assert len(calls) > 3 * 2000  # warm: each turn takes min_s


def test_functions_are_timed_turn_by_turn() -> None:
    clock, order = Clock(), []

    def work(name: str) -> None:
        clock.now += 1.0
        order.append(name)

    side_by_side({"a": lambda: work("a"), "b": lambda: work("b")}, turns=2, clock=clock)
    assert order[-4:] == ["a", "b", "a", "b"]
