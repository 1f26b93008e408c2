"""Tables of the report, and their forms as CSV and on a screen.

A table holds its values as they were computed. Rounding happens when it is shown
(HTML, Markdown, screen); the CSV keeps every digit.
"""

import csv
import dataclasses
import io
import math
import unicodedata
from dataclasses import dataclass
from typing import Literal

from masrel.report.rounding import (
    ABSENT,
    UNDEFINED,
    as_given,
    counted,
    decimals_given,
    interval_words,
    number,
    percent,
    whole_or_tenths,
)
from masrel.report.strength import LANDIS_KOCH, strength

__all__ = [
    "ABSENT",
    "LANDIS_KOCH",
    "UNDEFINED",
    "Column",
    "Table",
    "Value",
    "as_csv",
    "as_given",
    "as_text",
    "counted",
    "decimals_given",
    "interval_words",
    "number",
    "on_page",
    "percent",
    "shown",
    "strength",
    "whole_or_tenths",
]

Value = str | int | float | None
"""What a cell holds: text, a number, or nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """One column of a table."""

    key: str  # its name in the CSV, unit included
    heading: str  # its name for a reader, unit included
    # decimals shown of a float; None for text, whole numbers, and numbers shown with
    # the digits they were given
    digits: int | None = None
    align: Literal["left", "right", "center"] = "right"  # how it is set
    # whether a page (or screen) and the CSV have it. A page puts in one column what a
    # CSV keeps in several.
    where: Literal["everywhere", "page", "csv"] = "everywhere"


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table whose first column names the rows."""

    name: str  # name of its file, without extension
    caption: str  # what it shows, understood alone
    columns: tuple[Column, ...]  # the columns
    # values as computed: text, numbers, ``nan`` for undefined, None for absent
    rows: tuple[tuple[Value, ...], ...]
    notes: tuple[str, ...] = ()  # what the reader must know, below the table
    # where the data come from: "simulated", "published", "recorded" or "foreign"
    data: str

    @property
    def simulated(self) -> bool:
        """Whether any of its data are simulated."""
        return "simulated" in self.data


def shown(value: Value, column: Column) -> str:
    """Return a value as it is shown in a column."""
    if value is None:
        return ABSENT
    if not isinstance(value, float):
        return str(value)
    if column.digits is None:
        return as_given(value)
    return number(value, column.digits)


def on_page(table: Table) -> Table:
    """Return a table with the columns a page or a screen has."""
    return _without(table, "csv")


def _without(table: Table, where: str) -> Table:
    kept = [i for i, column in enumerate(table.columns) if column.where != where]
    return dataclasses.replace(
        table,
        columns=tuple(table.columns[i] for i in kept),
        rows=tuple(tuple(row[i] for i in kept) for row in table.rows),
    )


def as_csv(table: Table) -> str:
    """Return a table as CSV, every digit kept, with its provenance in each row."""
    kept = _without(table, "page")
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*(column.key for column in kept.columns), "data"])
    for row in kept.rows:
        writer.writerow([*(_plain(value) for value in row), table.data])
    return out.getvalue()


def _plain(value: Value) -> str:
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    return repr(value) if isinstance(value, float) else str(value)


def as_text(table: Table) -> str:
    """Return a table for a screen of fixed-width letters."""
    page = on_page(table)
    head = [column.heading for column in page.columns]
    body = [
        [shown(value, column) for value, column in zip(row, page.columns, strict=True)]
        for row in page.rows
    ]
    widths = [max(map(_width, cells)) for cells in zip(head, *body, strict=True)]
    caption = f"SIMULATED DATA. {page.caption}" if page.simulated else page.caption
    lines = [caption]
    for cells in [head, ["-" * width for width in widths], *body]:
        padded = [
            _pad(cell, width, column.align)
            for cell, width, column in zip(cells, widths, page.columns, strict=True)
        ]
        lines.append("  ".join(padded).rstrip())
    return "\n".join([*lines, *page.notes])


def _pad(cell: str, width: int, align: str) -> str:
    space = " " * (width - _width(cell))
    return space + cell if align == "right" else cell + space


def _width(text: str) -> int:
    # combining marks take no column of the screen
    return sum(1 for letter in text if not unicodedata.combining(letter))
