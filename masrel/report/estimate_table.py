"""The table of estimates: narrow on a page, every field in the CSV."""

from collections.abc import Sequence

from masrel.estimates import Interval
from masrel.report._tables import (
    ABSENT,
    Column,
    Table,
    Value,
    interval_text,
)
from masrel.report.estimate_rows import EstimateRow
from masrel.report.estimate_words import TARGETS, interval_name
from masrel.report.strength import LANDIS_KOCH, strength

__all__ = ["estimate_table"]

_MARKS = "ᵃᵇᶜᵈᵉᶠᵍʰⁱʲᵏˡᵐⁿᵒᵖʳˢᵗᵘᵛʷˣʸᶻ"

_AGREEMENTS = (
    "p_o: observed agreement; p_e: agreement expected by chance, 0 where the "
    "coefficient takes none off."
)

_COLUMNS = (
    Column(key="id", heading="Estimate", align="left"),
    Column(key="coefficient", heading="Coefficient", align="left"),
    Column(key="models_shown", heading="Models", align="left", where="page"),
    Column(key="models", heading="Models", where="csv"),
    Column(key="sessions", heading="Session", align="left"),
    Column(key="n_items", heading="n models", where="csv"),
    Column(key="n_raters", heading="Raters"),
    Column(key="value", heading="Value", digits=3),
    Column(key="interval_shown", heading="Interval", where="page"),
    Column(key="low", heading="Low", digits=3, where="csv"),
    Column(key="high", heading="High", digits=3, where="csv"),
    Column(key="interval", heading="Interval", where="csv"),
    Column(key="target", heading="Speaks of", where="csv"),
    Column(key="strength", heading="Strength", align="left"),
    Column(key="observed", heading="p_o", digits=3),
    Column(key="chance", heading="p_e", digits=3),
    Column(key="reason", heading="Reason", where="csv"),
)


def estimate_table(
    rows: Sequence[EstimateRow], *, name: str, caption: str, data: str
) -> Table:
    """Make a table of estimates."""
    # On a page an interval is one column, marked with a letter; a note below says what
    # each letter means: level, method, and of whom the interval speaks.
    meant = (_meaning(row.interval) for row in rows if row.interval is not None)
    marks = {text: _mark(i) for i, text in enumerate(dict.fromkeys(meant))}
    notes = [f"{mark} {text}." for text, mark in marks.items()]
    notes += [
        f"{row.name}: {remark.rstrip('.')}." for row in rows for remark in row.remarks
    ]
    if any(row.estimate is not None for row in rows):
        notes.append(_AGREEMENTS)
    if any(_word(row) is not None for row in rows):
        notes.append(LANDIS_KOCH)
    return Table(
        name=name,
        caption=caption,
        columns=_COLUMNS,
        rows=tuple(_cells(row, marks) for row in rows),
        notes=tuple(notes),
        data=data,
    )


def _meaning(interval: Interval) -> str:
    return f"{interval_name(interval)}; speaks of {TARGETS[interval.target]}"


def _mark(position: int) -> str:
    # a, b, ..., z, aa, bb, ...: letters that stand high without any markup
    rounds, letter = divmod(position, len(_MARKS))
    return _MARKS[letter] * (rounds + 1)


def _word(row: EstimateRow) -> str | None:
    if row.estimate is None:
        return None
    word = strength(row.estimate.coefficient, row.estimate.value)
    return None if word == ABSENT else word


def _cells(row: EstimateRow, marks: dict[str, str]) -> tuple[Value, ...]:
    estimate = row.estimate
    head = (row.name, row.coefficient)
    if estimate is None:
        used = (row.models, row.models, row.sessions, None, None)
        return (*head, *used, None, row.text, *[None] * 7, row.reason)
    return (
        *head,
        f"{estimate.n_items} {row.models}",
        row.models,
        row.sessions,
        estimate.n_items,
        row.n_raters,
        estimate.value,
        *_interval_cells(row.interval, marks),
        _word(row),
        estimate.observed,
        estimate.chance,
        estimate.reason,
    )


def _interval_cells(
    interval: Interval | None, marks: dict[str, str]
) -> tuple[Value, ...]:
    if interval is None:
        return (None,) * 5
    return (
        f"{interval_text(interval.low, interval.high)} {marks[_meaning(interval)]}",
        interval.low,
        interval.high,
        interval_name(interval),
        TARGETS[interval.target],
    )
