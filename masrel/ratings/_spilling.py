"""Ratings of items in any order, put together by DuckDB, which spills to a disk."""

import os
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain
from threading import Event, Thread
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.errors import RatingsError
from masrel.ratings._large_files import is_whole
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


def packed_items(name: str, keys: Keys, marks: int) -> PackedItems:
    """Put the numbers of every item together, and count the items that are alike."""
    # marks: the bits of which an item has as many as ratings, unless two overlap
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
            return _packed(name, duckdb, database, keys, marks)


def _packed(
    name: str, duckdb: Any, database: Any, keys: Keys, marks: int
) -> PackedItems:
    items, sums = next(keys())
    names = [f"item{k}" for k in range(len(items))]
    columns = [f"key{k}" for k in range(len(sums))]
    group = _group(items, names)
    n_marks = " + ".join(f"bit_count(bit_or({k}) & {marks})" for k in columns)
    of_items = (
        f"SELECT {', '.join(f'bit_or({k}) AS {k}' for k in columns)}, "
        f"{n_marks} = count(*) AS plain FROM ratings GROUP BY {', '.join(group)}"
    )
    table = _answer(
        name,
        duckdb,
        database,
        keys,
        f"SELECT {', '.join(columns)}, plain, count(*) AS freq FROM ({of_items}) "
        f"GROUP BY {', '.join(columns)}, plain",
    )
    twice = None
    if not table["plain"].astype(bool).all():
        firsts = ", ".join(f"any_value({column})" for column in names)
        query = (
            f"SELECT {firsts} FROM ratings GROUP BY {', '.join(group)} "
            f"HAVING {n_marks} <> count(*) LIMIT 1"
        )
        row = _answer(name, duckdb, database, keys, query)
        twice = [column.tolist()[0] for column in row.values()]
    return PackedItems(
        keys=np.column_stack([table[k] for k in columns]).astype(np.int64),
        freq=table["freq"].astype(np.int64),
        twice=twice,
    )


def _group(items: list[Any], names: list[str]) -> list[str]:
    # what tells items apart: a whole number, or 128 bits of the hash of their names
    if len(items) == 1 and is_whole(items[0]):
        return names
    texts = names[0] if len(names) == 1 else f"concat_ws(chr(31), {', '.join(names)})"
    return [f"hash({texts})", f"hash({texts} || '~')"]


def _answer(
    name: str, duckdb: Any, database: Any, keys: Keys, query: str
) -> dict[str, NDArray[Any]]:
    # the columns of a query of ratings that come batch by batch
    started, stopped, done = Event(), Event(), Event()
    errors: list[BaseException] = []  # DuckDB would say them in its own words
    answers: list[dict[str, NDArray[Any]]] = []
    stream = _batches(name, keys, stopped, errors)
    first = next(stream)
    reader = library(name, "pyarrow").RecordBatchReader
    database.register(
        "ratings", reader.from_batches(first.schema, chain([first], stream))
    )

    def work() -> None:
        try:
            started.wait()
            if not stopped.is_set():
                answers.append(database.execute(query).fetchnumpy())
        except (duckdb.Error, RuntimeError, MemoryError) as error:
            errors.append(error)
        finally:
            done.set()

    # in a thread, because DuckDB holds Ctrl-C back until all is read; it waits to be
    # started, so that Ctrl-C before that leaves no query at work
    try:
        Thread(target=work, daemon=True).start()
        started.set()
        while not done.wait(0.1):
            pass
    except KeyboardInterrupt:
        stopped.set()
        if started.is_set():
            database.interrupt()
            done.wait()
        started.set()
        raise
    if answers:
        database.unregister("ratings")
        return answers[0]
    if not isinstance(errors[0], duckdb.Error):
        raise errors[0]
    lines = str(errors[0]).splitlines() or ["DuckDB stopped"]
    raise RatingsError(f"{name}: grouping it failed ({lines[0][:200]})") from errors[0]


def _batches(
    name: str, keys: Keys, stopped: Event, errors: list[BaseException]
) -> Iterator[Any]:
    # record batches of items and numbers
    arrow = library(name, "pyarrow")
    try:
        for items, sums in keys():
            if stopped.is_set():
                return
            names = [f"item{k}" for k in range(len(items))]
            names += [f"key{k}" for k in range(len(sums))]
            columns = [*items, *map(arrow.array, sums)]
            yield arrow.RecordBatch.from_arrays(columns, names=names)
    except BaseException as error:
        errors.append(error)
        raise
