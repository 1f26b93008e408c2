"""Tables of the report: the only place that rounds, and the only one with words.

A table holds its values as they were computed. Rounding happens when it is shown
(HTML, Markdown, screen); the CSV keeps every digit.
"""

import csv
import io
import math
import unicodedata
from dataclasses import dataclass
from typing import Literal

__all__ = [
    "ABSENT",
    "LANDIS_KOCH",
    "Column",
    "Table",
    "Value",
    "as_csv",
    "as_text",
    "interval_words",
    "number",
    "shown",
    "strength",
    "whole_or_tenths",
]

Value = str | int | float | None
"""What a cell holds: text, a number, or nothing."""

ABSENT = "–"
"""What is shown where there is nothing."""
UNDEFINED = "undefined"

LANDIS_KOCH = (
    "Words after Landis JR, Koch GG (1977). The measurement of observer agreement "
    "for categorical data. Biometrics 33(1), 159-174, doi 10.2307/2529310; they name "
    "the point estimate alone."
)

# Landis and Koch's table on p. 165: upper ends of the classes.
_STRENGTHS = (
    (0.20, "slight"),
    (0.40, "fair"),
    (0.60, "moderate"),
    (0.80, "substantial"),
    (1.00, "almost perfect"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """One column of a table.

    Attributes
    ----------
    key : str
        Its name in the CSV, unit included.
    heading : str
        Its name for a reader, unit included.
    digits : int or None
        Decimals shown of a float; None for text and whole numbers.
    align : {"left", "right", "center"}
        How it is set.
    """

    key: str
    heading: str
    digits: int | None = None
    align: Literal["left", "right", "center"] = "right"


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table whose first column names the rows.

    Attributes
    ----------
    name : str
        Name of its file, without extension.
    caption : str
        What it shows, understood alone.
    columns : tuple of Column
        The columns.
    rows : tuple of tuple
        Values as computed: text, numbers, ``nan`` for undefined, None for absent.
    notes : tuple of str
        What the reader must know, below the table.
    data : str
        Where the data come from: "simulated", "published", "recorded" or "foreign".
    """

    name: str
    caption: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Value, ...], ...]
    notes: tuple[str, ...] = ()
    data: str

    @property
    def simulated(self) -> bool:
        """Whether any of its data are simulated."""
        return "simulated" in self.data


def number(value: float | None, digits: int) -> str:
    """Return a number as shown: rounded, with a true minus sign.

    Parameters
    ----------
    value : float or None
        The number; ``nan`` is shown as undefined, None as absent.
    digits : int
        Decimals.

    Returns
    -------
    str
        What is printed.

    Examples
    --------
    >>> number(-0.04649, 3), number(float("nan"), 3), number(None, 3)
    ('−0.046', 'undefined', '–')
    """
    if value is None:
        return ABSENT
    if not math.isfinite(value):
        return UNDEFINED
    text = f"{value:.{digits}f}"
    if float(text) == 0.0:
        text = text.removeprefix("-")  # no "-0.000"
    return text.replace("-", "−")


def shown(value: Value, column: Column) -> str:
    """Return a value as it is shown in a column.

    Parameters
    ----------
    value : str, int, float or None
        The value as computed.
    column : Column
        Its column, whose `digits` round it.

    Returns
    -------
    str
        What is printed.
    """
    if value is None or isinstance(value, float):
        return number(value, 3 if column.digits is None else column.digits)
    return str(value)


def whole_or_tenths(values: list[float]) -> int:
    """Return the decimals a column of measurements needs: 0 if all are whole.

    Parameters
    ----------
    values : list of float
        The measurements; ``nan`` is passed over.

    Returns
    -------
    int
        0 or 1.
    """
    known = [value for value in values if math.isfinite(value)]
    return 0 if all(value.is_integer() for value in known) else 1


def interval_words(low: float, high: float, digits: int = 3) -> str:
    """Return the endpoints of an interval in brackets.

    Parameters
    ----------
    low, high : float
        The endpoints; ``nan`` when undefined.
    digits : int
        Decimals.

    Returns
    -------
    str
        Such as ``"[0.320, 0.933]"``, or that it is undefined.
    """
    if not (math.isfinite(low) and math.isfinite(high)):
        return f"[{UNDEFINED}]"
    return f"[{number(low, digits)}, {number(high, digits)}]"


def strength(coefficient: str, value: float) -> str:
    """Name the strength of agreement in Landis and Koch's words.

    Parameters
    ----------
    coefficient : str
        Name of the coefficient; only kappas have words.
    value : float
        Its value.

    Returns
    -------
    str
        The word, or a dash where there is none.

    References
    ----------
    .. [1] Landis, J. R., Koch, G. G. (1977). The measurement of observer agreement
       for categorical data. Biometrics, 33(1), 159-174.
       https://doi.org/10.2307/2529310

    Examples
    --------
    >>> strength("fleiss_kappa", 0.626), strength("percent_agreement", 0.9)
    ('substantial', '–')
    """
    if not coefficient.endswith("kappa") or not math.isfinite(value):
        return ABSENT
    if value < 0.0:
        return "poor"
    return next((word for end, word in _STRENGTHS if value <= end), "almost perfect")


def as_csv(table: Table) -> str:
    """Return a table as CSV, every digit kept, with its provenance in each row.

    Parameters
    ----------
    table : Table
        The table.

    Returns
    -------
    str
        CSV with a header line; the last column, ``data``, says where the row's
        data come from. Undefined and absent values are empty.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*(column.key for column in table.columns), "data"])
    for row in table.rows:
        writer.writerow([*(_plain(value) for value in row), table.data])
    return out.getvalue()


def _plain(value: Value) -> str:
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    return repr(value) if isinstance(value, float) else str(value)


def as_text(table: Table) -> str:
    """Return a table for a screen of fixed-width letters.

    Parameters
    ----------
    table : Table
        The table.

    Returns
    -------
    str
        Caption, aligned columns and notes, one a line.
    """
    head = [column.heading for column in table.columns]
    body = [
        [shown(value, column) for value, column in zip(row, table.columns, strict=True)]
        for row in table.rows
    ]
    widths = [max(map(_width, cells)) for cells in zip(head, *body, strict=True)]
    lines = [table.caption]
    if table.simulated:
        lines[0] = f"SIMULATED DATA. {table.caption}"
    for cells in [head, ["-" * width for width in widths], *body]:
        padded = [
            _pad(cell, width, column.align)
            for cell, width, column in zip(cells, widths, table.columns, strict=True)
        ]
        lines.append("  ".join(padded).rstrip())
    return "\n".join([*lines, *table.notes])


def _pad(cell: str, width: int, align: str) -> str:
    space = " " * (width - _width(cell))
    return space + cell if align == "right" else cell + space


def _width(text: str) -> int:
    # combining marks take no column of the screen
    return sum(1 for letter in text if not unicodedata.combining(letter))
