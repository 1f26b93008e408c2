"""Values that figures show; they load no drawing library."""

from dataclasses import dataclass
from typing import Literal

from masrel.estimates import Interval

Form = Literal["png", "svg", "pdf", "inline"]
"""What a figure's file can be; inline is the SVG of a page, in the page's colours."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """A picture, or several below each other: what makes it, and of what."""

    drawer: str  # "module:function"
    arguments: tuple[object, ...]


FOREST = "masrel.plots._forest:forest_picture"


@dataclass(frozen=True, slots=True, kw_only=True)
class ForestRow:
    """One estimate with its interval."""

    # label, detail: what is estimated; how and for whom, or nothing
    label: str
    detail: str = ""
    value: float | None = None  # None where there is no finite one
    # None where its ends are not finite; drawn with its distribution if it has one
    interval: Interval | None = None
    text: str  # the numbers, or why there are none, as shown at the right
    has_zero: bool = True  # whether 0 is what chance gives, so that it is marked
    group: str = ""  # heading above the first row of those that share it
