"""The loop in real time, on a moteus in another process and on the simulated device.

``python -m docs.make.benchmarks.driver_bus [N]`` prints the table of N presentations
on either, in turn, that docs/evidence/driver.md has. The emulated moteus asks for
SCHED_FIFO on the first processor; the loop has the last one. Where the machine does
other things, too, ``chrt -f 50`` before it keeps bring-up and letting go prompt.
"""

import os
import subprocess
import sys
import time
import warnings
from dataclasses import dataclass, field
from math import radians

import numpy as np
from numpy.typing import NDArray

from docs.make.benchmarks.driver import END, START, LateClock
from masrel.errors import DeviceError, OverrunWarning
from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    Controller,
    DeviceLimits,
    SimulatedHand,
    open_device,
    run_presentation,
)
from masrel.lab.hess.moteus import MoteusOptions

MODELS = ("HM1", "HM2", "HM3", "HM4")
N_RESAMPLES = 200
CAPACITY = 20_000

# A busy machine ends no presentation: ticks that it misses are counted
_LATE = {"missed_ticks": 10_000, "missed_replies": 20, "missed_replies_per_100": 100}
LIMITS = DeviceLimits(
    **_LATE,
    stale_time=0.1,
    watchdog_time=0.1,
    frozen_time=0.1,
    jump_angle=radians(5.0),
    torque_rate=1e6,
    speed=radians(5000.0),
)

SERVED = """
import os, sys
from masrel.lab.hess import RealClock, SimulatedHand
from masrel.lab.hess.moteus import MoteusOptions, connected

start, end, speed = map(float, sys.argv[2:])
hand = SimulatedHand(start=start, end=end, mean_speed=speed)
options = MoteusOptions(interface="udp_multicast", channel=sys.argv[1])
with connected(options, clock=RealClock(), hand=hand) as link:
    try:
        os.sched_setaffinity(0, {0})
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50))
    except OSError as error:
        print(f"an ordinary process: {error}", file=sys.stderr)
    print("ready", flush=True)
    link.peer.run(lambda: False)
"""
HAND = {"start": START, "end": END, "mean_speed": radians(92.0)}


@dataclass(kw_only=True)
class Run:
    """What came of the presentations on one device."""

    faults: list[str] = field(default_factory=list)
    n_ticks: list[int] = field(default_factory=list)
    n_missed: list[int] = field(default_factory=list)
    n_lost: list[int] = field(default_factory=list)  # answers
    late_us: list[NDArray[np.float64]] = field(default_factory=list)


def present(run: Run, number: int, backend: str, **options: object) -> None:
    """Present one model and take down how late its ticks were."""
    clock = LateClock(CAPACITY)
    controller = Controller(STANDARD_MODELS[MODELS[number % 4]], start_angle=START)
    with open_device(backend, clock=clock, **options) as device:
        clock.n = 0  # it may have waited to be ready
        done = run_presentation(
            device, controller, clock=clock, limits=LIMITS, end_angle=END
        )
    if done.fault is not None:
        run.faults.append(f"{backend} {number}: {done.fault}")
    run.n_ticks.append(done.recording.n_samples)
    run.n_missed.append(done.n_missed_ticks)
    run.n_lost.append(int(done.recording.facts["n_missed_replies"]))
    run.late_us.append(np.array(clock.late[: clock.n]) / 1e3)


def on_moteus(run: Run, number: int) -> None:
    """Present on an emulated moteus in a process of its own."""
    channel = f"239.74.163.2:{20_000 + os.getpid() % 40_000}"
    where = {"interface": "udp_multicast", "channel": channel}
    options = MoteusOptions(**where, patience_s=1.0, watchdog_ms=100.0)
    command = [sys.executable, "-c", SERVED, channel, *map(str, HAND.values())]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as other:
        try:
            if other.stdout is None or other.stdout.readline() != "ready\n":
                raise SystemExit("the emulated moteus did not start")
            present(run, number, "moteus", options=options)
        except DeviceError as error:
            run.faults.append(f"moteus {number}: {error}")
        finally:
            other.kill()


def with_errors(run: Run) -> list[str]:
    """Return the cells of a row; errors by resampling whole presentations."""
    rng = np.random.default_rng(1)
    quantiles = [50.0, 99.0, 99.9]
    n = len(run.late_us)
    drawn = []
    for _ in range(N_RESAMPLES):
        chosen = rng.integers(n, size=n)
        drawn.append(
            np.percentile(np.concatenate([run.late_us[i] for i in chosen]), quantiles)
        )
    found = np.percentile(np.concatenate(run.late_us), quantiles)
    cells = [
        f"{value:.0f} ± {error:.0f}"
        for value, error in zip(found, np.std(drawn, axis=0), strict=True)
    ]
    missed = np.array(run.n_missed)
    total = f"{missed.sum()} ± {np.std(missed, ddof=1) * np.sqrt(n):.0f}"
    largest = max(late.max() for late in run.late_us)
    return [
        f"{n}, {len(run.faults)} failed",
        *cells,
        f"{largest:.0f}",
        f"{total} of {sum(run.n_ticks)}",
        f"{missed.max()}",
        f"{sum(run.n_lost)}",
    ]


def main(n: int) -> None:
    moteus, simulated = Run(), Run()
    load, begun = os.getloadavg()[0], time.monotonic()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OverrunWarning)
        for number in range(n):
            on_moteus(moteus, number)
            present(simulated, number, "simulated", hand=SimulatedHand(**HAND))
            if number % 10 == 9:
                print(
                    number + 1,
                    sum(moteus.n_missed),
                    sum(simulated.n_missed),
                    flush=True,
                )
            load = max(load, os.getloadavg()[0])
    print(f"{time.monotonic() - begun:.0f} s; largest load of a minute {load:.1f}")
    print("\n".join([*moteus.faults, *simulated.faults]))
    heads = "device presentations p50 p99 p99.9 largest missed most lost".split()
    print(f"| {' | '.join(heads)} |")
    for name, run in {"moteus": moteus, "simulated": simulated}.items():
        print("| " + " | ".join([name, *with_errors(run)]) + " |")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 300)
