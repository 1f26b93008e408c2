"""The agreement table of a file of ratings, for a screen, CSV and LaTeX."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

from masrel.cli.agreement_rows import Row, Wanted
from masrel.estimates import Interval

if TYPE_CHECKING:
    from masrel.report._tables import Table, Value

__all__ = ["agreement_table"]


def agreement_table(
    rows: list[Row],
    file: Path,
    by: str | None,
    wanted: Wanted,
    about: tuple[str, ...] = (),
    data: str = "foreign",
) -> "Table":
    """Lay the estimates out as a table."""
    from masrel.report._tables import Column, Table

    columns = [
        Column(key="coefficient", heading="Coefficient", align="left"),
        Column(key="value", heading="Value", digits=3),
        Column(key="standard_error", heading="SE", digits=3),
        Column(key="low", heading="Low", digits=3),
        Column(key="high", heading="High", digits=3),
        Column(key="n_items", heading="Items"),
        Column(key="n_raters", heading="Raters"),
    ]
    if by is not None:
        columns.insert(0, Column(key=by, heading=by.title(), align="left"))
    if wanted.words is not None:
        columns.append(Column(key="words", heading="At least", align="left"))
    return Table(
        name="agreement",
        caption=f"Agreement of the raters in {file}",
        columns=tuple(columns),
        rows=tuple(_cells(row, by, wanted) for row in rows),
        notes=(*about, *_notes(rows, by, wanted)),
        data=data,
    )


def _cells(row: Row, by: str | None, wanted: Wanted) -> tuple["Value", ...]:
    estimate, interval = row.estimate, row.estimate.interval
    has_error = estimate.observed == estimate.observed or estimate.reason is not None
    cells: list[Value] = [] if by is None else [row.session]
    cells += [
        row.title,
        estimate.value,
        estimate.standard_error if has_error else None,
        None if interval is None else interval.low,
        None if interval is None else interval.high,
        estimate.n_items,
        estimate.n_raters,
    ]
    if wanted.words is not None:
        from masrel.agreement import COEFFICIENTS, benchmark

        entry = COEFFICIENTS.get(estimate.coefficient)
        kappa_like = entry is not None and entry.chance_corrected
        word = benchmark(estimate, scale=wanted.words)  # type: ignore[arg-type]
        cells.append(word if kappa_like and not math.isnan(estimate.value) else None)
    return tuple(cells)


def _notes(rows: list[Row], by: str | None, wanted: Wanted) -> tuple[str, ...]:
    # How each interval was made, what to know of it, and why a value is undefined;
    # what holds for every interval is said without their names.
    said: dict[str, list[Row]] = {}
    for row in rows:
        for text in _of_row(row):
            said.setdefault(text, []).append(row)
    with_interval = [row for row in rows if row.estimate.interval is not None]
    notes = ["SE: delta method, items as the sample."]
    for text, of_rows in said.items():
        every = len(of_rows) > 1 and of_rows == with_interval
        names = "" if every else f"{'; '.join(_names(of_rows, rows, by))}: "
        notes.append(f"{names}{text}.")
    if wanted.words is not None:
        notes.append(
            "At least: the best word of "
            f"{_WORDS[wanted.words]} that the true value earns with a probability of "
            "95 %, normal law around the estimate; the words are conventions."
        )
    return tuple(notes)


def _names(of_rows: list[Row], rows: list[Row], by: str | None) -> list[str]:
    # the coefficients, with the sessions where it is not said of all of them
    named = []
    for title in dict.fromkeys(row.title for row in of_rows):
        every = [row.session for row in rows if row.title == title]
        these = [row.session for row in of_rows if row.title == title]
        in_part = by is not None and these != every
        named.append(f"{title} ({', '.join(these)})" if in_part else title)
    return named


def _of_row(row: Row) -> list[str]:
    estimate, interval = row.estimate, row.estimate.interval
    said = [] if estimate.reason is None else [f"undefined: {estimate.reason}"]
    said += row.notes
    if interval is not None:
        said.append(_about(interval))
        said += interval.notes
        if interval.reason not in (None, estimate.reason):
            said.append(f"no interval: {interval.reason}")
    return said


def _about(interval: Interval) -> str:
    from masrel.report._tables import percent
    from masrel.report.meaning import origin, promise

    name = f"{percent(interval.level)} % {interval.kind} interval, {interval.method}"
    speaks = f"it speaks of other {_OTHERS[interval.target]}"
    if math.isnan(interval.low):
        return f"{name}; {speaks}"
    return f"{name}{origin(interval, 'item')}; {speaks}: {promise(interval, 'item')}"


_OTHERS = {"items": "items", "raters": "raters", "both": "items and raters"}
_WORDS = {
    "landis_koch": "Landis and Koch (1977)",
    "altman": "Altman (1991)",
    "fleiss": "Fleiss (1981)",
    "cicchetti": "Cicchetti and Sparrow (1981)",
}
