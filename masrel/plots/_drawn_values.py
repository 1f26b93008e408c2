"""What figures show, as plain values: they load nothing that draws."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Literal

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from masrel.estimates import Interval

    Floats = NDArray[np.float64]

Form = Literal["png", "svg", "pdf"]
"""What a figure's file can be."""


class Content:
    """What a figure shows; its class names the function that draws it."""

    __slots__ = ()
    drawer: ClassVar[str]  # "module:function"


@dataclass(frozen=True, slots=True, kw_only=True)
class ForestRow:
    """One estimate with its interval."""

    # label, detail: what is estimated; how and for whom, or nothing
    label: str
    detail: str = ""
    value: float | None  # None where there is no finite one
    # None where its ends are not finite; drawn with its distribution if it has one
    interval: "Interval | None"
    text: str  # the numbers, or why there are none, as shown at the right
    has_zero: bool = True  # whether 0 is what chance gives, so that it is marked
    group: str = ""  # heading above the first row of those that share it


@dataclass(frozen=True, slots=True, kw_only=True)
class Forest(Content):
    """Estimates with their intervals, one below the other."""

    drawer: ClassVar[str] = "masrel.plots._forest:forest_figure"

    rows: tuple[ForestRow, ...]  # first on top
    axis_label: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaleRow:
    """One unknown of a latent-trait model."""

    label: str  # whose it is
    # value, low, high: where it is, and its interval
    value: float
    low: float
    high: float
    # of a rater, how far the same item is perceived from one time to the next
    noise: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LatentScale(Content):
    """What a latent-trait model places on its scale."""

    drawer: ClassVar[str] = "masrel.plots._latent_scale:latent_figure"

    # severities and thresholds from the mean severity, biases from no bias
    items: tuple[ScaleRow, ...]
    thresholds: tuple[ScaleRow, ...]
    raters: tuple[ScaleRow, ...]
    grades: tuple[str, ...]  # the scale, one more than thresholds
    level: float  # of the intervals


@dataclass(frozen=True, slots=True, kw_only=True)
class RaterPairs:
    """How well every two raters of a group agree, and what each of them adds."""

    title: str  # the coefficient
    raters: tuple[str, ...]  # first on top
    # by rater and rater, and then with the reference if there is one; ``nan`` for none
    pairs: tuple[tuple[float, ...], ...]
    reference: str | None
    changes: tuple[float, ...]  # by rater, of the coefficient of all without
    change_ends: tuple[tuple[float, float], ...]
    level: float  # of the intervals


@dataclass(frozen=True, slots=True, kw_only=True)
class PairMaps(Content):
    """How well every two raters agree, in every group."""

    drawer: ClassVar[str] = "masrel.plots._rater_pairs:rater_figure"

    groups: tuple[RaterPairs, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class DifferencePanel:
    """How two raters differ on every item."""

    title: str  # of which part, or nothing
    raters: tuple[str, str]  # the first less the second
    # (n_items,): of the two ratings of each item
    averages: "Floats" = field(compare=False, repr=False)
    differences: "Floats" = field(compare=False, repr=False)
    # value, low and high of upper limit, mean and lower limit; none if undefined
    lines: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Differences(Content):
    """Differences against means, with limits of agreement."""

    drawer: ClassVar[str] = "masrel.plots._limits_figure:limits_figure"

    panels: tuple[DifferencePanel, ...]
    unit: str  # of the ratings, or nothing
    level: float  # of the intervals


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanCurve:
    """What studies of so many raters, or items, can show, by the number of others."""

    label: str
    sizes: tuple[int, ...]
    numbers: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanCurves(Content):
    """Plans of many sizes."""

    drawer: ClassVar[str] = "masrel.plots._planning_figure:planning_figure"

    title: str
    what: str  # the number
    over: str  # "items" or "raters"
    limit: float | None  # what it is to reach
    curves: tuple[PlanCurve, ...]
