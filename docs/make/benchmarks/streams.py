"""``masrel agree FILE`` of files larger than memory, beside DuckDB's own group-by.

``python -m docs.make.benchmarks.streams [--quick] [--folder FOLDER]`` writes its part
of ``docs/evidence/benchmarks.md`` and a figure. Files of up to 10⁸ ratings are
generated, 1 GB. Memory of this process counts for its children: what writes and draws
is loaded late.
"""

import argparse
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from docs.make.benchmarks.reading import run
from docs.make.evidence import FIGURES, write_tables

RATERS = "ABCDE"
BLOCK = 1 << 20  # items, or ratings, that are written at once
N_BLOCKS = 20
KINDS = {
    "wide": "wide, one row an item",
    "sorted": "long, items in order",
    "shuffled": "long, shuffled, items are numbers",
    "texts": "long, shuffled, items are text",
}
COLOURS = {
    "wide": "#0072B2",
    "sorted": "#009E73",
    "shuffled": "#D55E00",
    "texts": "#CC79A7",
}
MARKERS = {"wide": "o", "sorted": "s", "shuffled": "^", "texts": "D"}
GROUP_WIDE = "SELECT A, B, C, D, E, count(*) FROM '{file}' GROUP BY ALL"
GROUP_LONG = (
    "SELECT packed, count(*) FROM (SELECT item, sum((grade + 1)::INTEGER << CASE rater "
    "WHEN 'A' THEN 0 WHEN 'B' THEN 4 WHEN 'C' THEN 8 WHEN 'D' THEN 12 ELSE 16 END) AS "
    "packed FROM '{file}' GROUP BY item) GROUP BY packed"
)
LIMITS = {("texts", 10**8): 2000}  # megabytes, where 900 are too few
RIVAL = """
import duckdb, sys, tempfile
with tempfile.TemporaryDirectory() as folder, duckdb.connect() as database:
    database.execute("SET memory_limit = '{limit}MB'")
    database.execute(f"SET temp_directory = '{{folder}}'")
    database.execute("SET preserve_insertion_order = false")
    assert len(database.execute({query!r}).fetchall()) > 100
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """A file, and what both took: processor seconds turn by turn, and megabytes."""

    kind: str
    n_ratings: int
    ours: list[float]
    theirs: list[float]
    memory: float
    their_memory: float

    @property
    def ratio(self) -> tuple[float, float]:
        """Ours over theirs, and half the range of that."""
        ratios = [a / b for a, b in zip(self.ours, self.theirs, strict=True)]
        return statistics.median(ratios), (max(ratios) - min(ratios)) / 2


def grades(n_items: int) -> Iterator[tuple[int, np.ndarray[Any, Any]]]:
    """Ratings of some agreement, block by block, from the twentieth on once more."""
    # (n_items, n_raters) each
    rng = np.random.default_rng(20120831)
    blocks: list[np.ndarray[Any, Any]] = []
    for number, start in enumerate(range(0, n_items, BLOCK)):
        if number < N_BLOCKS:
            shape = BLOCK, len(RATERS)
            truth = rng.integers(0, 5, (BLOCK, 1), dtype=np.int8)
            other = rng.integers(0, 5, shape, dtype=np.int8)
            seen = rng.random(shape, dtype=np.float32) < 0.7
            blocks.append(np.where(seen, truth, other))
        yield start, blocks[number % N_BLOCKS][: n_items - start]


def long_batch(
    item: np.ndarray[Any, Any], rater: np.ndarray[Any, Any], grade: np.ndarray[Any, Any]
) -> Any:
    """One row a rating."""
    import pyarrow as pa

    names = pa.DictionaryArray.from_arrays(
        pa.array(rater.astype(np.int8)), pa.array(list(RATERS))
    )
    columns = [pa.array(item.astype(np.int32)), names, pa.array(grade)]
    return pa.table(columns, names=["item", "rater", "grade"])


def batches(kind: str, n_items: int) -> Iterator[Any]:
    """Tables of a file of a kind."""
    import pyarrow as pa
    import pyarrow.compute as pc

    r = len(RATERS)
    if kind in ("wide", "sorted"):
        for start, block in grades(n_items):
            rows = np.arange(block.size)
            items = np.arange(start, start + len(block), dtype=np.int32)
            if kind == "wide":
                names = ["item", *RATERS]
                yield pa.table([items, *block.T.copy()], names=names)
            else:
                yield long_batch(start + rows // r, rows % r, block.ravel())
        return
    every = np.concatenate([block.ravel() for _, block in grades(n_items)])
    order = np.arange(n_items * r, dtype=np.int32)
    np.random.default_rng(1).shuffle(order)
    for start in range(0, n_items * r, BLOCK):
        rows = order[start : start + BLOCK]
        batch = long_batch(rows // r, rows % r, every[rows])
        if kind == "texts":
            names = pc.binary_join_element_wise("p", batch["item"].cast("string"), "")
            batch = batch.set_column(0, "item", names)
        yield batch


def write(path: Path, kind: str, n_ratings: int) -> None:
    """Write a file of a kind."""
    import pyarrow.parquet as pq

    file = None
    for batch in batches(kind, n_ratings // len(RATERS)):
        file = file or pq.ParquetWriter(path, batch.schema)
        file.write_table(batch)
    if file is not None:
        file.close()


def measure(kind: str, n_ratings: int, folder: Path, turns: int) -> Point:
    """Ours and DuckDB's, in turn, as processes of their own."""
    path = folder / f"{kind}_{n_ratings}.parquet"
    if not path.exists():
        # in a process of its own: memory that this one has used counts for its children
        call = f"write(Path({str(path)!r}), {kind!r}, {n_ratings})"
        program = f"from docs.make.benchmarks.streams import *; {call}"
        subprocess.run([sys.executable, "-c", program], check=True)
    query = (GROUP_WIDE if kind == "wide" else GROUP_LONG).format(file=path)
    limit = LIMITS.get((kind, n_ratings), 900)
    program = RIVAL.format(query=query, limit=limit).replace("{{", "{")
    rival = [sys.executable, "-c", program]
    ours = [sys.executable, "-m", "masrel", "agree", str(path), "--stream"]
    pairs = [(run(ours), run(rival)) for _ in range(turns)]
    point = Point(
        kind=kind,
        n_ratings=n_ratings,
        ours=[a[0] for a, _ in pairs],
        theirs=[b[0] for _, b in pairs],
        memory=max(a[1] for a, _ in pairs),
        their_memory=max(b[1] for _, b in pairs),
    )
    print(point, flush=True)
    return point


def slope(points: list[Point]) -> float:
    """Rise of log time with log ratings between the two largest files."""
    (a, b) = sorted(points, key=lambda point: point.n_ratings)[-2:]
    times = statistics.median(b.ours) / statistics.median(a.ours)
    return float(np.log(times) / np.log(b.n_ratings / a.n_ratings))


def draw(points: list[Point], path: Path) -> None:
    """Draw time against ratings, ours and DuckDB's, extrapolated where not run."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False})
    mpl.rcParams.update({"axes.spines.right": False, "savefig.dpi": 200})
    figure = Figure(figsize=(5.6, 3.8), layout="constrained")
    axes = figure.add_subplot()
    for kind, title in KINDS.items():
        own = sorted(
            (p for p in points if p.kind == kind), key=lambda point: point.n_ratings
        )
        if len(own) < 2:
            continue
        n = [point.n_ratings for point in own]
        style: dict[str, Any] = {"color": COLOURS[kind], "marker": MARKERS[kind]}
        ours = [statistics.median(point.ours) for point in own]
        axes.loglog(n, ours, label=title, **style)
        theirs = [statistics.median(point.theirs) for point in own]
        axes.loglog(n, theirs, ls=":", lw=1, mfc="none", alpha=0.7, **style)
        if n[-1] < 10**9:
            last = ours[-1] + (ours[-1] - ours[-2]) * (10**9 - n[-1]) / (n[-1] - n[-2])
            axes.loglog([n[-1], 10**9], [ours[-1], last], "--", color=COLOURS[kind])
            axes.loglog([10**9], [last], mfc="none", ls="", **style)
    axes.set_xlabel("ratings")
    axes.set_ylabel("processor time (s)")
    axes.grid(alpha=0.25)
    axes.legend(frameon=False, title="masrel agree; dotted: DuckDB's group-by")
    figure.savefig(path)


def row(point: Point) -> str:
    """Return the line of a table."""
    ratio, half = point.ratio
    sure = f"{ratio:.2f} ± {half:.2f}" if len(point.ours) > 1 else f"{ratio:.2f}, once"
    return (
        f"| {KINDS[point.kind]} | {point.n_ratings:.0e} | "
        f"{statistics.median(point.ours):.2f} s, {point.memory:.0f} MB | "
        f"{statistics.median(point.theirs):.2f} s, {point.their_memory:.0f} MB | "
        f"{sure} |"
    ).replace("e+0", "e")


def page(points: list[Point]) -> list[str]:
    """Return the table of all points."""
    rows = sorted(points, key=lambda p: (list(KINDS).index(p.kind), p.n_ratings))
    return [
        "| file | ratings | masrel agree | DuckDB's group-by | ratio |",
        "|---|---|---|---|---|",
        *map(row, rows),
    ]


def main() -> None:
    """Measure, and write the part of the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small files, no page")
    parser.add_argument("--folder", type=Path, help="keep the files here")
    options = parser.parse_args()
    sizes = (10**5, 10**6) if options.quick else (10**6, 10**7, 10**8)
    with tempfile.TemporaryDirectory() as name:
        folder = options.folder or Path(name)
        points = [
            measure(kind, n, folder, 2 if n < 10**8 else 1)
            for kind in KINDS
            for n in sizes
        ]
    if options.quick:
        print("\n".join(page(points)))
        return
    draw(points, FIGURES / "benchmark_streams.png")
    write_tables(["streams"], page(points))


if __name__ == "__main__":
    main()
