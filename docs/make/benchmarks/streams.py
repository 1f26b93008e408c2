"""``masrel agree FILE`` of files larger than memory, beside DuckDB's own group-by.

Files of up to 10⁸ ratings are generated, 1 GB.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import duckdb

from docs.make.benchmarks.figures import chart, series
from docs.make.benchmarks.rows import Benchmark, Result, Row, agree, python

RATERS = "ABCDE"
KINDS = {
    "wide": "wide, one row an item",
    "sorted": "long, items in order",
    "shuffled": "long, shuffled, items are numbers",
    "texts": "long, shuffled, items are text",
}
LOOKS: dict[str, dict[str, Any]] = {
    "wide": {"color": "#0072B2", "marker": "o"},
    "sorted": {"color": "#009E73", "marker": "s"},
    "shuffled": {"color": "#D55E00", "marker": "^"},
    "texts": {"color": "#CC79A7", "marker": "D"},
}
DUCKDB = "DuckDB's group-by"
GRADE = """
CREATE MACRO grade(item, rater) AS (
    CASE WHEN hash(item, rater, 1) % 10 < 7 THEN hash(item) ELSE hash(item, rater) END
    % 5
)::TINYINT
"""
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


def write(file: Path, kind: str, n_items: int) -> None:
    """Write ratings of some agreement: 7 of 10 raters see the grade of an item."""
    item = "concat('p', item)" if kind == "texts" else "item::INTEGER"
    if kind == "wide":
        columns = [f"grade(item, {r}) AS {name}" for r, name in enumerate(RATERS)]
        query = f"SELECT {item} AS item, {', '.join(columns)} FROM items"
    else:
        order = "item" if kind == "sorted" else "hash(item, r, 2)"
        query = (
            f"SELECT {item} AS item, substr('{RATERS}', r::INTEGER + 1, 1) AS rater, "
            f"grade(item, r) AS grade FROM items, range({len(RATERS)}) AS raters(r) "
            f"ORDER BY {order}"
        )
    with duckdb.connect() as database:
        database.execute(GRADE)
        database.execute(f"CREATE VIEW items AS FROM range({n_items}) AS items(item)")
        database.execute(f"SET temp_directory = '{file.parent}'")
        database.execute(f"COPY ({query}) TO '{file}'")


def rival(kind: str, n_ratings: int, file: Path) -> str:
    """Return DuckDB's program, for a file of a kind."""
    query = (GROUP_WIDE if kind == "wide" else GROUP_LONG).format(file=file)
    limit = LIMITS.get((kind, n_ratings), 900)
    return RIVAL.format(query=query, limit=limit)


def rows(quick: bool, folder: Path) -> Iterator[Row]:
    """Yield files of every kind and size."""
    for kind, title in KINDS.items():
        for n in (10**5, 10**6) if quick else (10**6, 10**7, 10**8):
            file = folder / f"{kind}_{n}.parquet"
            write(file, kind, n // len(RATERS))
            yield Row(
                what=title,
                n_ratings=n,
                works={
                    "masrel": agree(file, "--stream"),
                    DUCKDB: python(rival(kind, n, file), file),
                },
                turns=2 if n < 10**8 else 1,
            )
            file.unlink()


def draw(lines: list[Result]) -> None:
    """Draw time against ratings, ours and DuckDB's; ours is extrapolated to 10⁹."""
    title = "masrel agree; dotted: DuckDB's group-by"
    x, y = "ratings", "processor time (s)"
    with chart("benchmark_streams", x=x, y=y, title=title) as axes:
        by_title = series(lines, "what")
        for kind, name in KINDS.items():
            of, look = series(by_title[name], "program"), LOOKS[kind]
            n = [line["ratings"] for line in of["masrel"]]
            ours = [line["seconds"] for line in of["masrel"]]
            theirs = [line["seconds"] for line in of[DUCKDB]]
            axes.loglog(n, ours, label=name, **look)
            axes.loglog(n, theirs, ls=":", lw=1, mfc="none", alpha=0.7, **look)
            last = ours[-1] + (ours[-1] - ours[-2]) * (10**9 - n[-1]) / (n[-1] - n[-2])
            axes.loglog([n[-1], 10**9], [ours[-1], last], "--", color=look["color"])
            axes.loglog([10**9], [last], mfc="none", ls="", **look)
        axes.grid(alpha=0.25)


BENCHMARK = Benchmark(rows=rows, draw=draw)
