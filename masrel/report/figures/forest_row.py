"""A row of a forest of estimates, and where rows stand below each other."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from masrel.estimates import Distribution, Interval
from masrel.report.figures.ridge import least_shown

__all__ = ["LINE", "RIDGE", "ForestRow", "Placed", "below", "least", "placed", "zeros"]

# Heights in inches: of a line of text, of a line below it, of a ridge and a heading.
LINE, DETAIL, RIDGE, GROUP = 0.25, 0.14, 0.34, 0.28


@dataclass(frozen=True, slots=True, kw_only=True)
class ForestRow:
    """One estimate with its interval.

    Attributes
    ----------
    label, detail : str
        What is estimated; how and for whom, or nothing.
    value : float or None
        The estimate; None or ``nan`` is not drawn.
    interval : Interval or None
        Its interval, drawn with its distribution if it has one.
    text : str
        The numbers, or why there are none, as shown at the right.
    has_zero : bool
        Whether 0 is what chance gives, so that it is marked.
    group : str
        Heading above the first row of those that share it; none if empty.
    """

    label: str
    detail: str = ""
    value: float | None
    interval: Interval | None
    text: str
    has_zero: bool = True
    group: str = ""

    @property
    def drawn(self) -> Interval | None:
        """The interval, if its ends are known."""
        if self.interval is None:
            return None
        known = map(math.isfinite, (self.interval.low, self.interval.high))
        return self.interval if all(known) else None

    @property
    def distribution(self) -> Distribution | None:
        """The distribution of the interval, if there is one to draw."""
        return None if self.drawn is None else self.drawn.distribution

    @property
    def is_known(self) -> bool:
        """Whether there is a value to draw."""
        return self.value is not None and math.isfinite(self.value)

    @property
    def height(self) -> float:
        """How much room it takes, in inches."""
        room = LINE + (DETAIL if self.detail else 0.0)
        return room + (0.0 if self.distribution is None else RIDGE)


Placed = tuple[ForestRow, float, float | None]
"""A row, where its interval's line is, and its heading if it has one."""


def placed(rows: Sequence[ForestRow]) -> Iterator[Placed]:
    """Give every row its place, from the top down."""
    top, group = 0.0, ""
    for row in rows:
        heading = None
        if row.group and row.group != group:
            heading = top + 0.6 * GROUP
            top += GROUP
        group = row.group
        top += row.height
        yield row, top - below(row), heading


def below(row: ForestRow) -> float:
    """Return how far it is from a row's interval to the end of its room, inches."""
    return 0.5 * (LINE + (DETAIL if row.detail else 0.0))


def zeros(places: Sequence[Placed]) -> list[tuple[float, float]]:
    """Return where rows next to each other have a zero: one line for all of them."""
    lines: list[tuple[float, float]] = []
    above = 0.0
    for row, y, _ in places:
        end = y + below(row)
        if row.has_zero and lines and lines[-1][1] == above:
            lines[-1] = (lines[-1][0], end)
        elif row.has_zero:
            lines.append((above, end))
        above = end
    return lines


def least(rows: Sequence[ForestRow]) -> float:
    """Return the least of 0 and all that rows show."""
    numbers = [0.0]
    for row in rows:
        if row.value is not None and row.is_known:
            numbers.append(row.value)
        if row.drawn is not None:
            numbers.append(row.drawn.low)
        if row.distribution is not None:
            numbers.append(least_shown(row.distribution))
    return min(numbers)
