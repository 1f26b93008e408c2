"""Sessions by the browser: what a server costs the control loop, and how soon it acts.

``python -m docs.make.benchmarks.serving [--quick]`` writes its part of
``docs/evidence/benchmarks.md``, in about 18 minutes. It needs a machine that does
nothing else.
"""

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from docs.make.evidence import table, write_rows
from masrel.lab.hess._clock import real_time
from tests.benchmarks.bench_serve import (
    Lateness,
    Stops,
    Values,
    by_masrel_run,
    by_the_browser,
    long_study,
    quantile_ms,
)
from tests.lab.serve.pages import small_study

Line = dict[str, object]
FLOOD_HZ = 1000.0
RUN, SERVED, FLOODED = (
    "`masrel run`",
    "`masrel serve`, both pages open",
    f"the same, {FLOOD_HZ:,.0f} requests a second from one browser",
)
GRADE = "of a grade until it is on disk and the page knows"
BEGIN = "of “begin” until the model is presented"
STOP = "of the emergency stop until the torque ramps down"


def lateness(folder: Path, lengths_s: Sequence[float]) -> list[Line]:
    """Lines of the table of the loop's lateness, each way in turn."""
    ways = (RUN, SERVED, FLOODED)
    late = {name: Lateness() for name in ways}
    for turn, seconds in enumerate(lengths_s):
        # each way is as often the first, so that what goes on beside it evens out
        for name in (*ways[turn % 3 :], *ways[: turn % 3]):
            study = long_study(folder / f"turn_{turn}_{ways.index(name)}", seconds)
            if name == RUN:
                by_masrel_run(study)
            else:
                flood_hz = FLOOD_HZ if name == FLOODED else 0.0
                serving = by_the_browser(study, flood_hz=flood_hz)
                before, after = serving.memory_mb
                print(f"{name}: {serving.n_sent:,} sent, {before:.1f} → {after:.1f} MB")
            late[name].add(study)
    rng = np.random.default_rng(1)
    draws = {name: each.resampled(0.999, rng) for name, each in late.items()}
    of_run = quantile_ms(late[RUN].all, 0.999), draws[RUN][0]
    return [_late(name, each, draws[name], of_run) for name, each in late.items()]


def _late(
    name: str,
    late: Lateness,
    draws: tuple[Values, Values],
    of_run: tuple[float, Values],
) -> Line:
    # draws of the quantile and of missed ticks; the quantile of RUN, and its draws
    p50, p99, p999, largest = (
        quantile_ms(late.all, share) for share in (0.5, 0.99, 0.999, 1.0)
    )
    return {
        "": name,
        "ticks": f"{late.all.size:,}",
        "missed": _between(sum(late.missed), draws[1], ".0f"),
        "p50 µs": f"{p50 * 1e3:.0f}",
        "p99 µs": f"{p99 * 1e3:.0f}",
        "p99.9 µs": _between(p999 * 1e3, draws[0] * 1e6, ".0f"),
        "largest µs": f"{largest * 1e3:.0f}",
        "p99.9, by that of `masrel run`": _between(
            p999 / of_run[0], draws[0] / of_run[1], ".2f"
        ),
    }


def _between(value: float, draws: Values, digits: str) -> str:
    # in brackets where 95 % of 1000 draws of as many seconds lie
    low, high = np.quantile(draws, (0.025, 0.975))
    return f"{value:{digits}} ({low:{digits}} to {high:{digits}})"


def taps(folder: Path, turns: int, n_grades: int, n_stops: int) -> list[Line]:
    """Lines of the table of what a tap takes, of so many repeats in each turn."""
    took_s: dict[str, list[float]] = {GRADE: [], BEGIN: [], STOP: []}
    for turn in range(turns):
        more = ("repeats = 1 ", f"repeats = {n_grades} ")
        study = small_study(folder / f"taps_{turn}", "", more, quick=True)
        of_taps = by_the_browser(study).tablet.took_s
        took_s[GRADE] += of_taps["grade"]
        took_s[BEGIN] += of_taps["begin"]
        more = ("repeats = 1 ", f"repeats = {n_stops} ")
        study = small_study(folder / f"stops_{turn}", "", more)
        by_the_browser(study, during=Stops(study, took_s[STOP]))
    return [
        {
            "from the tap": name,
            "n": len(of),
            "p50 ms": f"{quantile_ms(of, 0.5):.1f}",
            "p99 ms": f"{quantile_ms(of, 0.99):.1f}",
            "largest ms": f"{quantile_ms(of, 1.0):.1f}",
        }
        for name, of in took_s.items()
    ]


def main() -> None:
    """Measure, and write the part."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small sizes, no page")
    quick = parser.parse_args().quick
    lengths_s = (12.0,) if quick else (*(12.0,) * 7, 60.0)
    turns, n_grades, n_stops = (1, 2, 2) if quick else (3, 20, 10)
    with real_time():
        pass  # what a loop would be granted here
    with tempfile.TemporaryDirectory() as folder:
        tables = {
            "benchmarks_serving": lateness(Path(folder), lengths_s),
            "benchmarks_taps": taps(Path(folder), turns, n_grades, n_stops),
        }
    for name, lines in tables.items():
        print(table(list(lines[0]), [list(line.values()) for line in lines]))
        if not quick:
            write_rows(name, lines)


if __name__ == "__main__":
    main()
