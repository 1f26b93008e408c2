"""Timing of several functions turn by turn, so that all meet the same load."""

import gc
import statistics
import time
import tracemalloc
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

from tests.benchmarks.peers import present

Work = Callable[[], object]


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """Seconds a call took, turn by turn."""

    seconds: tuple[float, ...]

    @property
    def median(self) -> float:
        """The middle one."""
        return statistics.median(self.seconds)

    @property
    def spread(self) -> float:
        """Half the distance of the quartiles, over the median."""
        if len(self.seconds) < 4:
            return (max(self.seconds) - min(self.seconds)) / (2 * self.median)
        low, _, high = statistics.quantiles(self.seconds, n=4)
        return (high - low) / (2 * self.median)


def side_by_side(
    works: Mapping[str, Work],
    *,
    turns: int,
    min_s: float = 0.02,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[str, Timing]:
    """Time every function in turn, warm, each call repeated until it takes `min_s`."""
    repeats = {name: warm_repeats(work, min_s, clock) for name, work in works.items()}
    seconds: dict[str, list[float]] = {name: [] for name in works}
    gc.collect()
    gc.disable()
    try:
        for _ in range(turns):
            for name, work in works.items():
                start = clock()
                for _ in range(repeats[name]):
                    work()
                seconds[name].append((clock() - start) / repeats[name])
    finally:
        gc.enable()
    return {name: Timing(seconds=tuple(each)) for name, each in seconds.items()}


def warm_repeats(work: Work, min_s: float, clock: Callable[[], float]) -> int:
    """How many calls take `min_s` once everything is loaded."""
    # A first call may import: to take the number of repeats from it would time a peer
    # that loads itself one cold call a turn.
    work()
    repeats = 1
    while True:
        start = clock()
        for _ in range(repeats):
            work()
        seconds = clock() - start
        if seconds >= min_s:
            return repeats
        growth = 1.2 * min_s / seconds if seconds > 0.1 * min_s else 10.0
        repeats = int(repeats * growth) + 1


def peak_megabytes(work: Work) -> float:
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
