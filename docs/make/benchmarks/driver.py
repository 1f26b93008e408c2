"""The control loop: cost of a tick, speed on a simulated clock, lateness on a real one.

``python -m docs.make.benchmarks.driver [SECONDS]`` prints what
docs/evidence/driver.md says, and draws its figures; SECONDS is how long the real
clock runs for each of three loops.
"""

import sys
import time
import warnings
from array import array
from collections.abc import Callable
from functools import partial
from itertools import chain, repeat
from math import radians
from typing import ClassVar

import numpy as np

from docs.make.benchmarks import driver_figures
from masrel.errors import OverrunWarning
from masrel.lab.elbow import STANDARD_MODELS, MinimumJerk
from masrel.lab.hess import (
    Controller,
    Device,
    DeviceLimits,
    HandTraits,
    HumanHand,
    Reading,
    RealClock,
    SimulatedClock,
    SimulatedHand,
    open_device,
    run_presentation,
)
from masrel.lab.hess._clock import real_time
from tests.benchmarks import driver_integrators
from tests.benchmarks.sidebyside import middle, side_by_side

START, END = radians(30.0), radians(146.0)
STRETCH_S = 116.0 / 92.0
PERIOD_NS = 1_000_000
SEGMENT_S = 5.0


class Prescribed(Device):
    """Plays a motion: the loop without a plant."""

    name: ClassVar[str] = "prescribed"
    simulated: ClassVar[bool] = True

    def __init__(self, clock: SimulatedClock | RealClock, angles: list[float]) -> None:
        self.clock, self.angles = clock, angles
        self.start_ns: int | None = None

    def _start(self) -> None:
        """Nothing to take hold of."""

    def _read(self) -> Reading:
        now_ns = self.clock.now_ns()
        if self.start_ns is None:
            self.start_ns = now_ns
        tick = (now_ns - self.start_ns) // PERIOD_NS
        return Reading(now_ns, self.angles[min(tick, len(self.angles) - 1)])

    def _send(self, torque_nm: float) -> None:
        """Nobody feels it."""

    def _stop(self) -> None:
        """Nothing to let go of."""


def minimum_jerk(n: int) -> list[float]:
    """Angles of one stretch and the rest after it, in steps of the encoder."""
    motion = MinimumJerk(start=START, end=END, mean_speed=radians(92.0))
    time_s = np.minimum(np.arange(n) * 1e-3, STRETCH_S)
    step = radians(0.005)
    return (np.round(motion.angle(time_s) / step) * step).tolist()


class TickClock(SimulatedClock):
    """A simulated clock that notes what each tick cost this thread's processor."""

    __slots__ = ("n", "times")

    def __init__(self) -> None:
        super().__init__()
        self.times = array("q", bytes(8 * 20_000))
        self.n = 0

    def sleep_until_ns(self, deadline_ns: int) -> None:
        self.times[self.n] = time.thread_time_ns()
        self.n += 1
        super().sleep_until_ns(deadline_ns)


HAND = {"start": START, "end": END, "mean_speed": radians(92.0)}
KINDS: dict[str, Callable[[], SimulatedHand | None]] = {
    "prescribed motion": lambda: None,
    "simulated arm and hand": lambda: SimulatedHand(**HAND),
    "the same, a person's hand": lambda: HumanHand(HandTraits(), **HAND),
}


def presented(kind: str, clock: SimulatedClock) -> int:
    """One presentation of HM3 -> ticks."""
    hand = KINDS[kind]()
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    if hand is None:
        device: Device = Prescribed(clock, minimum_jerk(1500))
        device.open()
    else:
        device = open_device("simulated", clock=clock, hand=hand)
    with device:
        done = run_presentation(device, controller, clock=clock, limits=DeviceLimits())
    if done.fault is not None:
        raise SystemExit(done.fault.message)
    return done.recording.n_samples


def tick_costs(turns: int = 40) -> None:
    """Print the cost of a tick and the speed of a presentation."""
    calls = {
        kind: lambda kind=kind: presented(kind, SimulatedClock()) for kind in KINDS
    }
    samples = side_by_side(calls, turns=turns)
    print("of processor time, but for the last column; medians of", turns)
    print(f"{'':30} tick p50 µs   p99.9 µs   times real time   by the wall")
    for kind, of in samples.items():
        clocks = [TickClock() for _ in range(turns)]
        for clock in clocks:
            presented(kind, clock)
        costs = np.concatenate([np.diff(clock.times[: clock.n]) for clock in clocks])
        median, high = np.percentile(costs, [50.0, 99.9]) / 1e3
        simulated_s = of[0].result * 1e-3
        speed = simulated_s / middle([sample.seconds for sample in of])[0]
        wall = simulated_s / middle([sample.clock for sample in of])[0]
        print(f"{kind:30} {median:11.1f} {high:10.1f} {speed:17.0f} {wall:13.0f}")


class LateClock(RealClock):
    """The real clock, which notes how late each sleep ends."""

    __slots__ = ("late", "n")

    def __init__(self, capacity: int) -> None:
        self.late = array("q", bytes(8 * capacity))
        self.n = 0

    def sleep_until_ns(self, deadline_ns: int) -> None:
        super().sleep_until_ns(deadline_ns)
        self.late[self.n] = time.monotonic_ns() - deadline_ns
        self.n += 1


def loop(seconds: float) -> tuple[list[int], int]:
    """The control loop on a prescribed motion -> lateness ns, missed ticks."""
    n = round(seconds * 1000)
    clock = LateClock(2 * n)
    forth = minimum_jerk(1500)
    stretches = chain.from_iterable(repeat(forth + forth[::-1], n // 3000 + 1))
    limits = DeviceLimits(
        missed_ticks=n,
        watchdog_time=10.0,
        frozen_time=10.0,
        jump_angle=3.0,
        standing_time=1e3,
        torque_rate=1e9,
    )
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with Prescribed(clock, list(stretches)) as device, warnings.catch_warnings():
        warnings.simplefilter("ignore", OverrunWarning)
        done = run_presentation(
            device,
            controller,
            clock=clock,
            limits=limits,
            max_duration_s=seconds,
            end_angle=10.0,
        )
    if done.fault is not None:
        raise SystemExit(done.fault.message)
    return list(clock.late[: clock.n]), done.n_missed_ticks


def ordinary(seconds: float) -> tuple[list[int], int]:
    """The same loop doing nothing, at ordinary priority -> the same."""
    n = round(seconds * 1000)
    clock = LateClock(2 * n)
    n_missed, tick = 0, 0
    start_ns = clock.now_ns()
    while tick < n:
        tick += 1
        due_ns = start_ns + tick * PERIOD_NS
        clock.sleep_until_ns(due_ns)
        skipped = (clock.now_ns() - due_ns) // PERIOD_NS
        n_missed += skipped
        tick += skipped
    return list(clock.late[: clock.n]), n_missed


def nothing(seconds: float) -> tuple[list[int], int]:
    """The same at the priority of the control loop."""
    with real_time():
        return ordinary(seconds)


def lateness(seconds: float) -> None:
    """Print how late ticks are, three loops in turn, segment by segment."""
    loops = {"control loop": loop, "nothing": nothing, "nothing, ordinary": ordinary}
    runs = side_by_side(
        {name: partial(run, min(seconds, SEGMENT_S)) for name, run in loops.items()},
        turns=max(1, round(seconds / SEGMENT_S)),
    )
    with real_time() as granted:
        print(f"granted: {granted}")
    print(f"{'lateness, µs':20}     p50     p99   p99.9     max   missed of")
    for name, samples in runs.items():
        late_us = np.concatenate([of.result[0] for of in samples]) / 1e3
        n_missed = sum(of.result[1] for of in samples)
        quantiles = np.percentile(late_us, [50, 99, 99.9, 100])
        cells = " ".join(f"{v:7.0f}" for v in quantiles)
        print(f"{name:20} {cells} {n_missed:8} {late_us.size}")


def main() -> None:
    tick_costs()
    lateness(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)
    for name, points in driver_integrators.measured().items():
        for setting, seconds, error in points:
            print(f"{name:22} {setting:8.2g}  {seconds:9.5f} s/s  {error:.2e} N·m")
    driver_figures.draw_simulated()


if __name__ == "__main__":
    main()
