"""Which columns of a CSV file are the item, the rater and the grade."""

from dataclasses import dataclass

from masrel.errors import RatingsError
from masrel.ratings.rows import CsvRows

__all__ = ["Chosen", "LongColumns", "WideColumns", "find_columns"]

_NAMES = {
    "item": ("item", "model", "subject"),
    "rater": ("rater",),
    "grade": ("grade", "rating", "score"),
    "session": ("session",),
}
"""Names that are recognized, letter case aside."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen:
    """Columns the caller named; None is left to the names in the file."""

    # item, rater, grade, session: names of columns
    item: str | None = None
    rater: str | None = None
    grade: str | None = None
    session: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LongColumns:
    """Columns of a long table: one row a rating."""

    # item, rater, grade: their positions
    item: int
    rater: int
    grade: int
    session: int | None  # position of the session, if there is one


@dataclass(frozen=True, slots=True, kw_only=True)
class WideColumns:
    """Columns of a wide table: one row an item, one column a rater."""

    item: int  # position of the item
    raters: tuple[int, ...]  # positions of the raters
    session: int | None  # position of the session, if there is one


def find_columns(rows: CsvRows, chosen: Chosen) -> LongColumns | WideColumns:
    """Decide whether a table is long or wide, and which column is what."""
    # A table with a column for the rater or for the grade, named by the caller or by a
    # name that is recognized, is long and needs item, rater and grade. Any other table
    # is wide: the item is the column the caller named, else one whose name is
    # recognized, else the first; every other column but the session is a rater.
    found = {
        what: _find(rows, what, getattr(chosen, what), _taken(chosen, what))
        for what in _NAMES
    }
    if found["rater"] is None and found["grade"] is None:
        item = 0 if found["item"] is None else found["item"]
        session = found["session"]
        raters = tuple(
            position
            for position in range(len(rows.header))
            if position not in (item, session)
        )
        if not raters:
            raise _error(rows, "needed a column for a rater, got none")
        return WideColumns(item=item, raters=raters, session=session)
    for what in ("item", "rater", "grade"):
        if found[what] is None:
            raise _error(
                rows,
                f"needed a column for the {what} named {' or '.join(_NAMES[what])}, "
                f"got {', '.join(rows.header)}; say which it is",
            )
    return _long(rows, found)


def _long(rows: CsvRows, found: dict[str, int | None]) -> LongColumns:
    item, rater, grade = found["item"], found["rater"], found["grade"]
    if item is None or rater is None or grade is None:
        raise _error(rows, "needed columns for item, rater and grade")
    positions = [item, rater, grade, found["session"]]
    named = [p for p in positions if p is not None]
    if len(set(named)) < len(named):
        raise _error(
            rows,
            "needed different columns for item, rater, grade and session, got "
            + ", ".join(rows.header[p] for p in named),
        )
    return LongColumns(item=item, rater=rater, grade=grade, session=found["session"])


def _taken(chosen: Chosen, what: str) -> set[str]:
    # Columns the caller gave another meaning are no candidates for this one.
    others = (getattr(chosen, other) for other in _NAMES if other != what)
    return {name for name in others if name is not None}


def _find(rows: CsvRows, what: str, name: str | None, taken: set[str]) -> int | None:
    if name is not None:
        if name not in rows.header:
            raise _error(
                rows,
                f"needed a column {name!r} for the {what}, got "
                + ", ".join(rows.header),
            )
        return rows.header.index(name)
    fitting = [
        position
        for position, column in enumerate(rows.header)
        if column.casefold() in _NAMES[what] and column not in taken
    ]
    if len(fitting) > 1:
        columns = " and ".join(rows.header[position] for position in fitting)
        raise _error(
            rows, f"needed one column for the {what}, got {columns}; say which it is"
        )
    return fitting[0] if fitting else None


def _error(rows: CsvRows, message: str) -> RatingsError:
    return RatingsError(f"{rows.path}: line {rows.header_line}: {message}")
