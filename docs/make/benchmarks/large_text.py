"""``masrel agree`` of a large file of text, beside pandas and DuckDB.

``python -m docs.make.benchmarks.large_text [--quick]`` writes its part of
``docs/evidence/benchmarks.md``.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from docs.make.evidence import write_tables
from tests.benchmarks.large_text import ORDERS, Run, measured, ratio

TURNS = 5


def line(order: str, runs: dict[str, list[Run]]) -> str:
    """Return the line of a table."""
    cells = [order]
    for name, each in runs.items():
        processor = statistics.median(run.processor_s for run in each)
        wall = statistics.median(run.wall_s for run in each)
        most = max(run.megabytes for run in each)
        cells.append(f"{processor:.2f} s, {wall:.2f} s, {most:.0f} MB")
        if name != "masrel":
            for of in ("processor_s", "wall_s"):
                ours, theirs = (
                    [getattr(run, of) for run in many]
                    for many in (runs["masrel"], each)
                )
                middle, half = ratio(ours, theirs)
                cells.append(f"{middle:.2f} ± {half:.2f}")
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Measure, and write the part of the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small files, no page")
    options = parser.parse_args()
    n_items, turns = (20_000, 1) if options.quick else (1_000_000, TURNS)
    rows, loads = [], []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "long.csv"
        for order in ORDERS:
            # in a process of its own: memory that this one has used counts for others
            call = f"write_ratings(Path({str(path)!r}), {n_items}, {order!r})"
            program = f"from tests.benchmarks.large_text import *; {call}"
            subprocess.run([sys.executable, "-c", program], check=True)
            loads.append(os.getloadavg()[0])
            rows.append(line(order, measured(path, turns)))
    lines = [
        "| rows | masrel | pandas | ratio, processor | ratio, clock "
        "| DuckDB | ratio to DuckDB, processor | ratio to DuckDB, clock |",
        "|---|---|---|---|---|---|---|---|",
        *rows,
    ]
    if options.quick:
        print("\n".join(lines))
        return
    write_tables(["large_text"], lines)


if __name__ == "__main__":
    main()
