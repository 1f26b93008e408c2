"""Tables in every form they are read in, and the rules by which numbers are rounded.

A table holds its values as they were computed. This is the only module of the report
that rounds, and it does so when a table is shown (screen, LaTeX, HTML, Markdown); the
CSV keeps every digit.
"""

import csv
import io
import math
import re
import textwrap
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Any, Literal

from masrel._files import safe_cell

SYMBOL = re.compile(r"(?<!\w)(ΔT|k|ν|θ|p)_(peak|post|th|L|start|end|o|e)(?!\w)")
"""Symbols of the model as they are written in plain text: an index after "_"."""

ABSENT = "–"
"""What is shown where there is nothing."""

UNDEFINED = "undefined"
"""What is shown for ``nan``."""

# What tables and figures of simulated data carry
SIMULATED = "SIMULATED DATA"
SIMULATED_DEVICE = "SIMULATED DEVICE"
INTERIM = "INTERIM"


def tag_of(data: str) -> str:
    """Return the label of anything made of simulated or interim data."""
    device = [SIMULATED_DEVICE] * ("simulated device" in data)
    labels = device or [SIMULATED] * ("simulated" in data)
    labels += [INTERIM] * (INTERIM.lower() in data)
    return f"{', '.join(labels).capitalize()}." if labels else ""


Value = str | int | float | None
"""What a cell holds: text, a number, or nothing."""

Align = Literal["left", "right", "center"]
"""How a column is set."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """One column of a table."""

    key: str  # its name in the CSV, unit included
    heading: str  # its name for a reader, unit included
    # decimals shown of a float; None for text, whole numbers, and numbers shown with
    # the digits they were entered with
    digits: int | None = None
    align: Align = "right"
    is_p: bool = False  # whether a page shows it as a p-value
    # whether a page (or screen) and the CSV have it: a page puts in one column what a
    # CSV keeps in several
    where: Literal["everywhere", "page", "csv"] = "everywhere"


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table whose first column names the rows."""

    name: str  # name of its file, without extension
    caption: str  # what it shows, understood alone
    columns: tuple[Column, ...]
    # values as computed: text, numbers, ``nan`` for undefined, None for absent
    rows: tuple[tuple[Value, ...], ...]
    # what a page shows where the rows are too many for it; the CSV has all
    page_rows: tuple[tuple[Value, ...], ...] | None = None
    in_units: tuple[int, ...] = ()  # rows of numbers that may be of any size
    notes: tuple[str, ...] = ()  # what the reader must know, below the table
    read: tuple[str, ...] = ()  # what was read for it, above the table
    # where the data come from: "simulated", "simulated device" where persons gave the
    # grades, "published", "reconstructed", "recorded" or "foreign"; after a plus
    # "interim", while sessions are awaited
    data: str

    @property
    def tag(self) -> str:
        """Label before the caption of data that are simulated or interim."""
        return tag_of(self.data)

    @property
    def labelled_caption(self) -> str:
        """The caption, after the label of simulated or interim data."""
        return f"{tag_of(self.data).upper()} {self.caption}".strip()


def table_of(
    name: str,
    caption: str,
    columns: Iterable[Column],
    rows: Sequence[Mapping[str, Any]],
    *,
    hide_empty: bool = False,
    **more: Any,
) -> Table:
    """Return a table of rows, whose cells have the keys of its columns."""
    # hide_empty: whether a page has no column of which there is nothing; more: notes,
    # data and whatever else a table has
    shown = [
        replace(column, where="csv")
        if hide_empty and all(row.get(column.key) is None for row in rows)
        else column
        for column in columns
    ]
    cells = ([row.get(column.key) for column in shown] for row in rows)
    return Table(
        name=name,
        caption=caption,
        columns=tuple(shown),
        rows=tuple(
            tuple(_joined(c) if isinstance(c, list | tuple) else c for c in row)
            for row in cells
        ),
        **more,
    )


def _joined(values: Sequence[float]) -> str | None:
    # numbers such as degrees of freedom as one text
    parts = [str(int(x)) if float(x).is_integer() else significant(x) for x in values]
    return ", ".join(parts) or None


def number(value: Value, digits: int | None, *, in_units: bool = False) -> str:
    """Return a number as shown: rounded, with a true minus sign."""
    # in_units: whether it may be of any size, and keeps four digits where it is small
    # Text and whole numbers are shown as they are.
    if value is None:
        return ABSENT
    if not isinstance(value, float):
        return str(value)
    if digits is None:
        return as_entered(value)
    if math.isinf(value):
        return "∞" if value > 0.0 else "−∞"
    if math.isnan(value):
        return UNDEFINED
    text = fixed_or_significant(value, digits) if in_units else f"{value:.{digits}f}"
    if float(text) == 0.0:
        text = text.removeprefix("-")  # no "-0.000"
    return text.replace("-", "−")


def significant(value: float, digits: int = 6) -> str:
    """Return a number with this many digits, whatever its size."""
    return f"{value:.{digits}g}"


def fixed_or_significant(value: float, decimals: int) -> str:
    """Return a number with fixed decimals where they show it, else four digits."""
    is_fixed = value == 0.0 or 10.0 ** (1 - decimals) <= abs(value) < 1e7
    return f"{value:.{decimals}f}" if is_fixed else significant(value, 4)


def as_entered(value: float) -> str:
    """Return a number that somebody chose with the digits it was entered with."""
    if not math.isfinite(value):
        return UNDEFINED
    # without an exponent
    return f"{Decimal(repr(float(value))):f}".removesuffix(".0").replace("-", "−")


def percent(share: float) -> str:
    """Return a share that somebody chose in percent, with the digits it has."""
    return f"{(Decimal(repr(float(share))) * 100).normalize():f}"


def interval_text(
    low: float, high: float, digits: int = 3, *, in_units: bool = False
) -> str:
    """Return the ends of an interval in brackets."""
    if math.isnan(low) or math.isnan(high):
        return f"[{UNDEFINED}]"
    ends = (number(end, digits, in_units=in_units) for end in (low, high))
    return f"[{', '.join(ends)}]"


def p_text(p: Value) -> str:
    """Return a p-value as shown: three decimals, or below the least that they show."""
    return "<0.001" if isinstance(p, float) and p < 0.0005 else number(p, 3)


def capital(text: str) -> str:
    """Return a text with a capital at its start."""
    return text[:1].upper() + text[1:]


def counted(count: int, noun: str, plural: str = "") -> str:
    """Return a count with its noun, in the plural unless there is one."""
    return f"{count} {noun}" if count == 1 else f"{count} {plural or noun + 's'}"


def joined(names: Sequence[str]) -> str:
    """Return names as a sentence lists them: a, b and c."""
    return " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))


def page_cells(table: Table) -> tuple[list[Column], list[list[str]]]:
    """Return the columns of a page or a screen, and its rows as shown in them."""
    places = [(i, c) for i, c in enumerate(table.columns) if c.where != "csv"]
    rows = [
        [
            p_text(row[i])
            if c.is_p
            else number(row[i], c.digits, in_units=at in table.in_units)
            for i, c in places
        ]
        for at, row in enumerate(
            table.rows if table.page_rows is None else table.page_rows
        )
    ]
    return [column for _, column in places], rows


def as_csv(table: Table, *, raw: bool = False) -> str:
    """Return a table as CSV, every digit kept, with its provenance in each row."""
    # raw: whether texts are as they are, also such as a spreadsheet would run
    cell = str if raw else safe_cell
    places = [i for i, c in enumerate(table.columns) if c.where != "page"]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*(cell(table.columns[i].key) for i in places), "data"])
    for row in table.rows:
        cells = [
            None if isinstance(c, float) and not math.isfinite(c) else c
            for c in (row[i] for i in places)
        ]
        shown = [cell(c) if isinstance(c, str) else c for c in cells]
        writer.writerow([*shown, table.data])  # None is written as nothing
    return out.getvalue()


def as_text(table: Table, *, width: int | None = None) -> str:
    """Return a table for a screen of fixed-width letters; None wraps no note."""
    columns, body = page_cells(table)
    head = [column.heading for column in columns]
    lines = aligned([head, *body], [column.align for column in columns], rule=True)
    wrapper = textwrap.TextWrapper(
        width or 0,
        subsequent_indent="  ",
        break_long_words=False,
        break_on_hyphens=False,
    )
    read, notes = (
        texts
        if width is None
        else [line for text in texts for line in wrapper.wrap(text)]
        for texts in (table.read, table.notes)
    )
    head, gap = [table.labelled_caption, *read], list[str]()
    if not table.caption:  # what was read stands for it
        head, gap = [f"{head[0]} {read[0]}".strip(), *read[1:], ""], [""]
    return "\n".join([*head, *lines, *(gap if notes else ()), *notes])


def as_html(table: Table) -> str:
    """Return a table for a notebook, with what was read above and notes below."""
    from html import escape  # loaded only in a notebook

    columns, body = page_cells(table)
    heading = [column.heading for column in columns]
    lines = [
        "".join(
            f"<{tag} style='text-align: {column.align}'>{escape(cell)}</{tag}>"
            for cell, column in zip(row, columns, strict=True)
        )
        for tag, row in (("th", heading), *(("td", row) for row in body))
    ]
    above, below = (
        "".join(f"<p>{escape(text)}</p>" for text in texts if text)
        for texts in ((table.labelled_caption, *table.read), table.notes)
    )
    rows = "".join(f"<tr>{line}</tr>" for line in lines)
    return f"<div>{above}<table>{rows}</table>{below}</div>"


def aligned(
    rows: Sequence[Sequence[str]], aligns: Sequence[Align], *, rule: bool = False
) -> list[str]:
    """Return rows of cells as lines that line up, with a rule below the first."""
    # combining marks take no column of the screen
    sizes = [
        [sum(not unicodedata.combining(letter) for letter in cell) for cell in cells]
        for cells in rows
    ]
    widths = [max(column) for column in zip(*sizes, strict=True)]
    lines = [
        "  ".join(
            " " * (width - size) + cell
            if align == "right"
            else cell + " " * (width - size)
            for cell, size, width, align in zip(*row, widths, aligns, strict=True)
        ).rstrip()
        for row in zip(rows, sizes, strict=True)
    ]
    if rule:
        lines.insert(1, "  ".join("-" * width for width in widths))
    return lines
