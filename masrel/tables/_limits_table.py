"""Limits of agreement of two raters: their table, and what their figure shows.

In: a `RatingsFile`. Out: a table, the same as plain values for JSON, and the figure.
"""

import math

from masrel.agreement import LimitsOfAgreement
from masrel.analysis._file_parts import label, part_names
from masrel.analysis._file_two_raters import difference_limits
from masrel.estimates import Interval
from masrel.plots._drawn_values import DifferencePanel, Differences
from masrel.ratings import RatingsFile, RatingsPart
from masrel.tables._further_tables import (
    FurtherTable,
    data_of,
    finite,
    name_columns,
    part_keys,
)
from masrel.tables._tables import Column, Table, Value, percent

_COLUMNS = (
    Column(key="quantity", heading="Difference", align="left"),
    Column(key="value", heading="Value", digits=3),
    Column(key="low", heading="Low", digits=3),
    Column(key="high", heading="High", digits=3),
    Column(key="pair_low", heading="Low, both", digits=3),
    Column(key="pair_high", heading="High, both", digits=3),
    Column(key="n_items", heading="Items"),
)


def limits_table(file: RatingsFile, *, level: float, unit: str | None) -> FurtherTable:
    """Return between which bounds the differences of two raters lie."""
    cells: list[tuple[Value, ...]] = []
    documents: list[dict[str, object]] = []
    notes: dict[str, None] = {}
    panels = []
    for part in file.parts:
        limits = difference_limits(file, part, level)
        names = tuple(part_names(file, part).values())
        cells += [(*names, *row) for row in _rows(limits)]
        documents.append({**part_keys(file, part), **_document(part, limits)})
        of_part = f"{label(names)}: " if names else ""
        notes[f"Difference: {' less '.join(part.raters)}."] = None
        if limits.reason is not None:
            notes[f"{of_part}undefined: {limits.reason}."] = None
        panels.append(_panel(label(names), part, limits))
    notes |= dict.fromkeys(_explanation(level))
    of_unit = f" ({unit})" if unit else ""
    return FurtherTable(
        key="limits_of_agreement",
        table=Table(
            name="limits_of_agreement",
            caption=f"Limits of agreement{of_unit}",
            columns=(*name_columns(file), *_COLUMNS),
            rows=tuple(cells),
            notes=tuple(notes),
            data=data_of(file),
        ),
        documents=documents,
        figure=Differences(panels=tuple(panels), unit=unit or "", level=level),
    )


def _rows(limits: LimitsOfAgreement) -> list[tuple[Value, ...]]:
    def row(
        title: str,
        value: float,
        interval: Interval,
        pair: tuple[Value, Value] = (None, None),
    ) -> tuple[Value, ...]:
        return (title, value, interval.low, interval.high, *pair, limits.n_items)

    inner, outer = limits.inner, limits.outer
    return [
        row("Mean", limits.mean, limits.mean_interval),
        row("Lower limit", limits.lower, limits.lower_interval, (outer[0], inner[0])),
        row("Upper limit", limits.upper, limits.upper_interval, (inner[1], outer[1])),
    ]


def _explanation(level: float) -> tuple[str, ...]:
    return (
        "Limits: mean ∓ 1.96 standard deviations, between which 95 % of differences "
        "lie if they are normal.",
        f"Low, High: {percent(level)} % CI, exact (t, noncentral t), each for itself; "
        "both: for the two limits together, factors of tolerance; for other items like "
        "these, rated by the same raters.",
    )


def _document(part: RatingsPart, limits: LimitsOfAgreement) -> dict[str, object]:
    def ends(interval: Interval) -> dict[str, object]:
        return {"low": finite(interval.low), "high": finite(interval.high)}

    return {
        "first": part.raters[0],
        "second": part.raters[1],
        "n_items": limits.n_items,
        "mean": finite(limits.mean),
        "sd": finite(limits.sd),
        "lower": finite(limits.lower),
        "upper": finite(limits.upper),
        "share": limits.share,
        "level": limits.mean_interval.level,
        "mean_interval": ends(limits.mean_interval),
        "lower_interval": ends(limits.lower_interval),
        "upper_interval": ends(limits.upper_interval),
        "inner": [finite(end) for end in limits.inner],
        "outer": [finite(end) for end in limits.outer],
        "reason": limits.reason,
    }


def _panel(title: str, part: RatingsPart, limits: LimitsOfAgreement) -> DifferencePanel:
    def line(value: float, interval: Interval) -> tuple[float, float, float]:
        return value, interval.low, interval.high

    lines = (
        line(limits.upper, limits.upper_interval),
        line(limits.mean, limits.mean_interval),
        line(limits.lower, limits.lower_interval),
    )
    return DifferencePanel(
        title=title,
        raters=(part.raters[0], part.raters[1]),
        averages=limits.averages,
        differences=limits.differences,
        lines=() if math.isnan(limits.mean) else lines,
    )
