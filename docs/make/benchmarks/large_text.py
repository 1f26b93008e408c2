"""``masrel agree`` of a large file of text, beside pandas and DuckDB."""

from collections.abc import Iterator
from pathlib import Path

from docs.make.benchmarks.rows import Benchmark, Row, agree, python
from tests.benchmarks.large_text import DUCKDB, ORDERS, PANDAS, write_ratings


def rows(quick: bool, folder: Path) -> Iterator[Row]:
    """Yield the same ratings in several orders."""
    file = folder / "long.csv"
    for order in ORDERS:
        write_ratings(file, 20_000 if quick else 1_000_000, order)
        yield Row(
            what=order,
            works={
                "masrel": agree(file),
                "pandas": python(PANDAS, file),
                "DuckDB": python(DUCKDB, file),
            },
            turns=5,
        )


BENCHMARK = Benchmark(rows=rows)
