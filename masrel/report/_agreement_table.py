"""The table and the figure of the agreement in a file of ratings."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from masrel.agreement import COEFFICIENTS, BandScale, benchmark
from masrel.estimates import Estimate, Interval, Target
from masrel.report._estimate_words import (
    aside,
    forest_row,
    origin,
    promise,
)
from masrel.report._figure_data import Forest, ForestRow
from masrel.report._tables import Column, Table, Value, percent

_POPULATIONS = {"items": "items", "raters": "raters", "both": "items and raters"}

_SOURCES = {
    "landis_koch": "Landis and Koch (1977)",
    "altman": "Altman (1991)",
    "fleiss": "Fleiss (1981)",
    "cicchetti": "Cicchetti and Sparrow (1981)",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class AgreementRow:
    """One estimate, and what to say of it that is not in it."""

    # session, title: of what, and which coefficient
    session: str
    title: str
    estimate: Estimate
    # what it lacks of what was requested, and what was assumed
    notes: tuple[str, ...] = ()


def agreement_table(
    rows: Sequence[AgreementRow],
    *,
    caption: str,
    by: str | None = None,
    bands: BandScale | None = None,
    notes: tuple[str, ...] = (),
    data: str = "foreign",
) -> Table:
    """Return the table of estimates, with every interval explained in the notes."""
    # by: heading of the column that names the sessions, if there is one;
    # bands: whose words for values; notes: what to say of the ratings
    columns = [
        Column(key="coefficient", heading="Coefficient", align="left"),
        Column(key="value", heading="Value", digits=3),
        Column(key="standard_error", heading="SE", digits=3),
        Column(key="low", heading="Low", digits=3),
        Column(key="high", heading="High", digits=3),
        Column(key="n_items", heading="Items"),
        Column(key="n_raters", heading="Raters"),
    ]
    cells = [_cells(row) for row in rows]
    if by is not None:
        columns.insert(0, Column(key=by, heading=by.title(), align="left"))
        cells = [(row.session, *rest) for row, rest in zip(rows, cells, strict=True)]
    if bands is not None:
        columns.append(Column(key="words", heading="At least", align="left"))
        words = [_band(row.estimate, bands) for row in rows]
        cells = [(*rest, word) for rest, word in zip(cells, words, strict=True)]
    return Table(
        name="agreement",
        caption=caption,
        columns=tuple(columns),
        rows=tuple(cells),
        notes=(*notes, *_notes(rows, by, bands)),
        data=data,
    )


def _cells(row: AgreementRow) -> tuple[Value, ...]:
    estimate, interval = row.estimate, row.estimate.interval
    # observed agreement is nan where the statistic has none, and so no error
    has_error = not math.isnan(estimate.observed) or estimate.reason is not None
    return (
        row.title,
        estimate.value,
        estimate.standard_error if has_error else None,
        None if interval is None else interval.low,
        None if interval is None else interval.high,
        estimate.n_items,
        estimate.n_raters,
    )


def _band(estimate: Estimate, bands: BandScale) -> str | None:
    word = benchmark(estimate, scale=bands)
    entry = COEFFICIENTS.get(estimate.coefficient)
    if entry is None or not entry.chance_corrected or math.isnan(estimate.value):
        return None
    return word


def _notes(
    rows: Sequence[AgreementRow], by: str | None, bands: BandScale | None
) -> tuple[str, ...]:
    # How each interval was made, what to know of it, and why a value is undefined.
    # A note names its rows, unless it holds for every interval.
    rows_of: dict[str, list[AgreementRow]] = {}
    for row in rows:
        estimate, interval = row.estimate, row.estimate.interval
        texts = [] if estimate.reason is None else [f"undefined: {estimate.reason}"]
        texts += row.notes
        if interval is not None:
            texts += [_interval_note(interval), *interval.notes]
            if interval.reason not in (None, estimate.reason):
                texts.append(f"no interval: {interval.reason}")
        for text in texts:
            rows_of.setdefault(text, []).append(row)
    with_interval = [row for row in rows if row.estimate.interval is not None]
    notes = ["SE: delta method, items as the sample."]
    for text, subset in rows_of.items():
        every = len(subset) > 1 and subset == with_interval
        names = "" if every else f"{'; '.join(_names(subset, rows, by))}: "
        notes.append(f"{names}{text}.")
    if bands is not None:
        notes.append(
            "At least: the best word of "
            f"{_SOURCES[bands]} that the true value earns with a probability of "
            "95 %, normal law around the estimate; the words are conventions."
        )
    return tuple(notes)


def _interval_note(interval: Interval) -> str:
    name = f"{percent(interval.level)} % {interval.kind} interval, {interval.method}"
    population = f"it speaks of other {_POPULATIONS[interval.target]}"
    if math.isnan(interval.low):
        return f"{name}; {population}"
    promised = promise(interval, "item")
    return f"{name}{origin(interval, 'item')}; {population}: {promised}"


def _names(
    subset: Sequence[AgreementRow], rows: Sequence[AgreementRow], by: str | None
) -> list[str]:
    # the coefficients, with the sessions where a note does not hold for all of them
    names = []
    for title in dict.fromkeys(row.title for row in subset):
        every = [row.session for row in rows if row.title == title]
        sessions = [row.session for row in subset if row.title == title]
        in_part = by is not None and sessions != every
        names.append(f"{title} ({', '.join(sessions)})" if in_part else title)
    return names


def agreement_forest(rows: Sequence[AgreementRow], target: Target) -> Forest:
    """Return what a figure shows: the estimates and their intervals."""
    population = _POPULATIONS[target]
    several = len({row.session for row in rows}) > 1
    return Forest(
        rows=tuple(_forest_row(row, target, has_group=several) for row in rows),
        axis_label=f"agreement (1 is perfect); intervals for other {population}",
    )


def _forest_row(row: AgreementRow, target: Target, *, has_group: bool) -> ForestRow:
    interval = row.estimate.interval
    # what neither the axis nor the legend says of the interval
    details = []
    if interval is not None:
        details.append(aside(interval))
        if interval.target != target:
            details.append(f"other {_POPULATIONS[interval.target]}")
    return forest_row(
        row.title,
        row.estimate,
        detail=", ".join(filter(None, details)),
        group=row.session if has_group else "",
    )
