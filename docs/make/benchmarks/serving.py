"""Sessions by the browser: what a server costs the control loop, and how soon it acts.

``python -m docs.make.benchmarks.serving [--quick]`` writes its part of
``docs/benchmarks.md``. It needs a machine that does nothing else.
"""

import argparse
import platform
import tempfile
from collections.abc import Sequence
from pathlib import Path

import masrel
from docs.make.benchmarks.parts import write_part
from masrel.hess._realtime import real_time
from tests.benchmarks.bench_serve import (
    Lateness,
    Stops,
    by_masrel_run,
    by_the_browser,
    long_study,
    quantile_ms,
)
from tests.serve.desks import small_study

DOCS = Path(__file__).parents[2]
FLOOD_HZ = 1000.0
RUN, SERVED, FLOODED = (
    "`masrel run`",
    "`masrel serve`, both pages open",
    f"the same, {FLOOD_HZ:,.0f} requests a second from one browser",
)


def lateness(folder: Path, turns: int, seconds: float) -> list[str]:
    """Lines of the table of the loop's lateness, each way in turn."""
    late = {name: Lateness() for name in (RUN, SERVED, FLOODED)}
    memory = ""
    for turn in range(turns):
        for number, name in enumerate(late):
            study = long_study(folder / f"turn_{turn}_{number}", seconds)
            if name == RUN:
                by_masrel_run(study)
            else:
                flood_hz = FLOOD_HZ if name == FLOODED else 0.0
                serving = by_the_browser(study, flood_hz=flood_hz)
                before, after = serving.memory_mb
                memory = f"{serving.n_sent:,} requests, {before:.0f} → {after:.0f} MB"
            late[name].add(study)
    rows = []
    for name, each in late.items():
        quantiles = (quantile_ms(each.all, q) * 1e3 for q in (0.5, 0.99, 0.999, 1.0))
        cells = (name, f"{each.all.size:,}", f"{each.n_missed}")
        rows.append(_row(*cells, *(f"{value:.0f}" for value in quantiles)))
    return [
        "| | ticks | missed | p50 µs | p99 µs | p99.9 µs | largest µs |",
        "|---|---|---|---|---|---|---|",
        *rows,
        "",
        f"Memory of the server before and after the last flood: {memory}.",
    ]


def taps(folder: Path, turns: int, repeats: int) -> list[str]:
    """Lines of the table of what a tap takes."""
    more = ("repeats = 1 ", f"repeats = {repeats} ")
    grades_s: list[float] = []
    begins_s: list[float] = []
    stops_s: list[float] = []
    for turn in range(turns):
        study = small_study(folder / f"taps_{turn}", "", more, quick=True)
        took_s = by_the_browser(study).tablet.took_s
        grades_s += took_s["grade"]
        begins_s += took_s["begin"]
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
    turns, seconds, repeats = (1, 12.0, 2) if quick else (5, 120.0, 20)
    with real_time() as granted:
        pass  # what a loop would be granted here
    with tempfile.TemporaryDirectory() as folder:
        tables = lateness(Path(folder), turns, seconds)
        tables += ["", *taps(Path(folder), turns, repeats)]
    print("\n".join(tables))
    if quick:
        return
    lines = [
        "## Sessions by the browser",
        "",
        "`python -m docs.make.benchmarks.serving` repeats this part: sessions in real "
        "time on the simulated device, whose simulated hand moves the arm; the same "
        f"one in turn by `masrel run` and by the browser, {turns} turns of "
        f"{seconds:g} s each. A tick is late by how long after its time it reads the "
        "arm, as its recording has it. Both pages keep their streams open, the "
        "coordinator's with the live view; browsers are Python clients on the same "
        "machine. Taps are those of the rater's page.",
        "",
        f"{platform.machine()}, Python {platform.python_version()}; "
        f"masrel {masrel.__version__}; the loop was granted {granted}.",
        "",
        *tables,
    ]
    write_part(DOCS / "benchmarks.md", "serving", lines)


if __name__ == "__main__":
    main()
