"""Functions and commands run turn by turn, so that all meet the same load."""

import gc
import os
import statistics
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from tests.benchmarks.peers import present

Command = list[str]
Work = Callable[[], Any] | Command

# A process counts the memory of its parent as its own: the parent is this small one.
LAUNCHER = """
import os, subprocess, sys, time
began = time.perf_counter()
process = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL)
_, status, usage = os.wait4(process.pid, 0)
took = time.perf_counter() - began
print(usage.ru_utime + usage.ru_stime, took, usage.ru_maxrss / 1e3)
sys.exit(os.waitstatus_to_exitcode(status))
"""


class Sample(NamedTuple):
    """What a call took: seconds of processors and of the clock, and megabytes."""

    seconds: float
    clock: float
    megabytes: float | None = None  # of a command
    result: Any = None  # of a function


def middle(values: Sequence[float]) -> tuple[float, float | None]:
    """Return the median, and half the distance of the quartiles over it, in %."""
    median = statistics.median(values)
    if len(values) == 1:
        return median, None
    low, high = min(values), max(values)
    if len(values) > 3:
        low, _, high = statistics.quantiles(values, n=4)
    return median, 100.0 * (high - low) / (2.0 * median)


def side_by_side(
    works: Mapping[str, Work], *, turns: int, min_s: float = 0.02
) -> dict[str, list[Sample]]:
    """Run everything in turn; warm, and functions for `min_s`, if more than once."""
    calls = {
        name: _warm(work, min_s) if turns > 1 else partial(_once, work)
        for name, work in works.items()
    }
    samples: dict[str, list[Sample]] = {name: [] for name in works}
    gc.collect()
    gc.disable()
    try:
        for _ in range(turns):
            for name, call in calls.items():
                samples[name].append(call())
    finally:
        gc.enable()
    return samples


def _once(work: Work) -> Sample:
    return _command(work) if isinstance(work, list) else _function(work, 1)


def _warm(work: Work, min_s: float) -> Callable[[], Sample]:
    # A first call may import, or compile: to take the number of repeats from it would
    # time a peer that loads itself one cold call a turn.
    _once(work)
    if isinstance(work, list):
        return partial(_command, work)
    repeats = 1
    while (took := _function(work, repeats).clock * repeats) < min_s:
        growth = 1.2 * min_s / took if took > 0.1 * min_s else 10.0
        repeats = int(repeats * growth) + 1
    return partial(_function, work, repeats)


def _function(work: Callable[[], Any], repeats: int) -> Sample:
    processor, clock = time.process_time(), time.perf_counter()
    for _ in range(repeats):
        result = work()
    took = time.process_time() - processor, time.perf_counter() - clock
    return Sample(took[0] / repeats, took[1] / repeats, result=result)


def _command(command: Command) -> Sample:
    # its modules are compiled, as pip leaves what it installs
    compiled = str(Path(tempfile.gettempdir()) / "masrel_compiled")
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": compiled}
    environment |= {"OPENBLAS_NUM_THREADS": "1"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    launched = [sys.executable, "-I", "-S", "-c", LAUNCHER, *command]
    done = subprocess.run(
        launched, capture_output=True, text=True, env=environment, check=False
    )
    if done.returncode:
        raise SystemExit(f"{' '.join(command[-3:])}: {done.stderr}")
    return Sample(*map(float, done.stdout.split()))


def peak_megabytes(work: Callable[[], Any]) -> float:
    """Return the most memory that was allocated at once during a call, in MB."""
    gc.collect()
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1] / 1e6
    finally:
        tracemalloc.stop()


def one_thread() -> AbstractContextManager[object]:
    """Keep linear algebra to one thread, where a package for that is installed."""
    if not present(["threadpoolctl"]):
        return nullcontext()
    from threadpoolctl import threadpool_limits

    return threadpool_limits(1)  # type: ignore[no-any-return]
