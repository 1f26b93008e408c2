"""Ratings of items in any order, put together by DuckDB, which spills to a disk."""

import os
import tempfile
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.errors import RatingsError
from masrel.ratings._text_cells import library

_MEMORY = "500MB"
_MAX_THREADS = 4

Keys = Callable[[], Iterator[tuple[list[Any], list[NDArray[np.int64]]]]]
"""Yields items, and the numbers that are added up for each."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PackedItems:
    """Items as whole numbers, each combination once."""

    keys: NDArray[np.int64]  # (n_distinct, n_keys)
    freq: NDArray[np.int64]  # (n_distinct,)
    twice: list[Any] | None  # the name of an item whose numbers overlap


def packed_items(name: str, keys: Keys) -> PackedItems:
    """Add the numbers of every item up, and count the items that are alike."""
    duckdb = library(name, "duckdb", "big")
    # removed whatever happens, Ctrl-C too
    with tempfile.TemporaryDirectory(prefix="masrel-") as folder:
        with duckdb.connect(":memory:") as database:
            for option, value in (
                ("memory_limit", _MEMORY),
                ("temp_directory", folder),
                ("threads", min(_MAX_THREADS, os.cpu_count() or 1)),
                ("preserve_insertion_order", False),
            ):
                database.execute(f"SET {option} = '{value}'")
            return _packed(name, duckdb, database, keys)


def _packed(name: str, duckdb: Any, database: Any, keys: Keys) -> PackedItems:
    items, sums = _columns(keys)
    same = " AND ".join(f"sum({k}) = bit_or({k})" for k in sums)
    ors = ", ".join(f"bit_or({k}) AS {k}" for k in sums)
    of_items = f"SELECT {ors}, {same} AS plain FROM ratings GROUP BY {items}"
    table = _answer(
        name,
        duckdb,
        database,
        keys,
        f"SELECT {', '.join(sums)}, plain, count(*) AS freq FROM ({of_items}) "
        "GROUP BY ALL",
    )
    twice = None
    if not all(table["plain"].tolist()):
        query = (
            f"SELECT {items} FROM ratings GROUP BY {items} HAVING NOT ({same}) LIMIT 1"
        )
        row = _answer(name, duckdb, database, keys, query)
        twice = [
            column[0].item() if hasattr(column[0], "item") else column[0]
            for column in row.values()
        ]
    return PackedItems(
        keys=np.column_stack([table[k] for k in sums]).astype(np.int64),
        freq=table["freq"].astype(np.int64),
        twice=twice,
    )


def _columns(keys: Keys) -> tuple[str, list[str]]:
    # names of the columns of items, and those of the numbers
    items, sums = next(keys())
    return (
        ", ".join(f"item{k}" for k in range(len(items))),
        [f"key{k}" for k in range(len(sums))],
    )


def _answer(
    name: str, duckdb: Any, database: Any, keys: Keys, query: str
) -> dict[str, NDArray[Any]]:
    arrow = library(name, "pyarrow")
    errors: list[BaseException] = []  # DuckDB would say them in its own words

    def batches() -> Generator[Any]:
        try:
            for items, sums in keys():
                yield arrow.RecordBatch.from_arrays(
                    [*items, *map(arrow.array, sums)],
                    names=[
                        *(f"item{k}" for k in range(len(items))),
                        *(f"key{k}" for k in range(len(sums))),
                    ],
                )
        except BaseException as error:
            errors.append(error)
            raise

    stream = batches()
    first = next(stream)

    def every() -> Iterator[Any]:
        yield first
        yield from stream

    database.register(
        "ratings", arrow.RecordBatchReader.from_batches(first.schema, every())
    )
    try:
        answer: dict[str, NDArray[Any]] = database.execute(query).fetchnumpy()
    except duckdb.Error as error:
        if errors:
            raise errors[0] from None
        lines = str(error).splitlines() or ["DuckDB stopped"]
        raise RatingsError(f"{name}: sorting it failed ({lines[0][:200]})") from error
    finally:
        stream.close()
        database.unregister("ratings")
    return answer
