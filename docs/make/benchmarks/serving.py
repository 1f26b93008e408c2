"""Sessions by the browser: what a server costs the control loop, and how soon it acts.

``python -m docs.make.benchmarks.serving [--quick]`` writes its part of
``docs/evidence/benchmarks.md``, in about 18 minutes. It needs a machine that does
nothing else.
"""

import argparse
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from docs.make.evidence import write_tables
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

FLOOD_HZ = 1000.0
RUN, SERVED, FLOODED = (
    "`masrel run`",
    "`masrel serve`, both pages open",
    f"the same, {FLOOD_HZ:,.0f} requests a second from one browser",
)


def lateness(folder: Path, lengths_s: Sequence[float]) -> list[str]:
    """Lines of the table of the loop's lateness, each way in turn."""
    ways = (RUN, SERVED, FLOODED)
    late = {name: Lateness() for name in ways}
    memory = ""
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
                if flood_hz:
                    memory = f"{serving.n_sent:,} requests, {before:.1f} → {after:.1f}"
            late[name].add(study)
    return [
        "| | ticks | missed | p50 µs | p99 µs | p99.9 µs | largest µs "
        "| p99.9, by that of `masrel run` |",
        "|---|---|---|---|---|---|---|---|",
        *_lateness_rows(late),
        "",
        "In brackets where 95 % of 1000 draws of as many seconds lie. Memory of the "
        f"server before and after the last flood: {memory} MB.",
    ]


def _lateness_rows(late: Mapping[str, Lateness]) -> Iterator[str]:
    rng = np.random.default_rng(1)
    draws = {name: each.resampled(0.999, rng) for name, each in late.items()}
    of_run = quantile_ms(late[RUN].all, 0.999)
    for name, each in late.items():
        quantiles, missed = draws[name]
        p50, p99, p999, largest = (
            quantile_ms(each.all, share) for share in (0.5, 0.99, 0.999, 1.0)
        )
        yield _row(
            name,
            f"{each.all.size:,}",
            f"{sum(each.missed)} {_between(missed, '.0f')}",
            *(f"{value * 1e3:.0f}" for value in (p50, p99)),
            f"{p999 * 1e3:.0f} {_between(quantiles * 1e6, '.0f')}",
            f"{largest * 1e3:.0f}",
            ""
            if name == RUN
            else f"{p999 / of_run:.2f} {_between(quantiles / draws[RUN][0], '.2f')}",
        )


def _between(draws: Values, digits: str) -> str:
    low, high = np.quantile(draws, (0.025, 0.975))
    return f"({low:{digits}} to {high:{digits}})"


def taps(folder: Path, turns: int, n_grades: int, n_stops: int) -> list[str]:
    """Lines of the table of what a tap takes, of so many repeats in each turn."""
    grades_s: list[float] = []
    begins_s: list[float] = []
    stops_s: list[float] = []
    for turn in range(turns):
        more = ("repeats = 1 ", f"repeats = {n_grades} ")
        study = small_study(folder / f"taps_{turn}", "", more, quick=True)
        took_s = by_the_browser(study).tablet.took_s
        grades_s += took_s["grade"]
        begins_s += took_s["begin"]
        more = ("repeats = 1 ", f"repeats = {n_stops} ")
        study = small_study(folder / f"stops_{turn}", "", more)
        by_the_browser(study, during=Stops(study, stops_s))
    return [
        "| from the tap | n | p50 ms | p99 ms | largest ms |",
        "|---|---|---|---|---|",
        _times("of a grade until it is on disk and the page knows", grades_s),
        _times("of “begin” until the model is presented", begins_s),
        _times("of the emergency stop until the torque ramps down", stops_s),
    ]


def _times(name: str, took_s: Sequence[float]) -> str:
    quantiles = (quantile_ms(took_s, share) for share in (0.5, 0.99, 1.0))
    return _row(name, f"{len(took_s)}", *(f"{value:.1f}" for value in quantiles))


def _row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


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
        tables = lateness(Path(folder), lengths_s)
        print("\n".join(tables), flush=True)
        of_taps = taps(Path(folder), turns, n_grades, n_stops)
        print("\n".join(of_taps))
    if quick:
        return
    write_tables(["serving", "taps"], [*tables, "", *of_taps])


if __name__ == "__main__":
    main()
