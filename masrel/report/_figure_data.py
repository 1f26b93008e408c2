"""What figures show, as plain values: they load nothing that draws."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from masrel.elbow.identification import ElbowFit, FrictionFit
    from masrel.estimates import Interval

    Floats = NDArray[np.float64]

Form = Literal["png", "svg", "pdf"]
"""What a figure's file can be."""


# From more than so many on, a figure shows distributions instead of every one.
MANY_RATERS = 30
MANY_STRETCHES = 12
MANY_MODELS = 12  # and panels are smaller


@dataclass(frozen=True, slots=True, kw_only=True)
class GradeGrid:
    """Grades of one session, one row a model and one column a rater."""

    # models, raters: names of the rows and columns
    models: tuple[str, ...]
    raters: tuple[str, ...]
    intended: tuple[str | None, ...]  # by model
    # by model and rater, the grades of every presentation in order; no None
    grades: tuple[tuple[tuple[str, ...], ...], ...]
    scale: tuple[str, ...]  # every grade of the scale, mildest first


@dataclass(frozen=True, slots=True, kw_only=True)
class GradeCounts:
    """How often each model was given each grade in one session."""

    models: tuple[str, ...]
    intended: tuple[str | None, ...]  # by model
    scale: tuple[str, ...]  # every grade of the scale, mildest first
    counts: tuple[tuple[int, ...], ...]  # by model and grade


@dataclass(frozen=True, slots=True, kw_only=True)
class GradesByAim:
    """How often models of each intended grade were given each grade."""

    intended: tuple[str, ...]
    scale: tuple[str, ...]  # every grade of the scale, mildest first
    counts: tuple[tuple[int, ...], ...]  # by intended grade and grade
    # by intended grade: the part that has it, and the ends of its interval
    shares: tuple[tuple[float, float, float], ...]


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
class Forest:
    """Estimates with their intervals, one below the other."""

    rows: tuple[ForestRow, ...]  # first on top
    axis_label: str


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedColumn:
    """Mean speeds of one model in one session, deg/s."""

    model: str
    session: str
    speeds: tuple[tuple[float, ...], ...]  # of every rater, in the raters' order
    mean: float
    graded: tuple[tuple[float, ...], ...] = ()  # those that a grade is said to rest on


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedDots:
    """Every rater's mean speed for every model."""

    columns: tuple[SpeedColumn, ...]  # by session and model
    raters: tuple[str, ...]
    slowest: float  # below it the catch angle stays the same, deg/s


@dataclass(frozen=True, slots=True, kw_only=True)
class TraceBand:
    """Where most of many stretches are at each time, while half of them go on."""

    # (n_points,): s; (n_ends, n_points): deg and N·m, from the lowest to the highest
    time: "Floats" = field(compare=False, repr=False)
    angle: "Floats" = field(compare=False, repr=False)
    torque: "Floats" = field(compare=False, repr=False)
    shares: tuple[float, ...]  # of the stretches below each of them


@dataclass(frozen=True, slots=True, kw_only=True)
class TracePanel:
    """All stretches of one model, or a few of many and where most are."""

    title: str  # the model, its intended grade, and the range of speeds
    # per rater: time (s), angle (deg), torque (N·m), code of the phase
    stretches: "tuple[tuple[NDArray[np.generic], ...], ...]"
    graded: tuple[bool, ...] = ()  # by stretch, whether a grade is said to rest on it
    names: tuple[str, ...] = ()  # by stretch, whose it is, if that is written at it
    band: TraceBand | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TraceColumns:
    """Torque and angle against time, one column a model."""

    panels: tuple[TracePanel, ...]
    has_angle: bool = True  # else torque alone, four panels a row


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredPanel:
    """One presentation on a device with a torque sensor."""

    title: str  # the model, and whose presentation it is
    # (n_samples,): s, deg and N·m; ``nan`` where the sensor gave no number
    time: "Floats" = field(compare=False, repr=False)
    angle: "Floats" = field(compare=False, repr=False)
    sent: "Floats" = field(compare=False, repr=False)
    measured: "Floats" = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredTorque:
    """Torque that was sent and torque that was measured, one column a presentation."""

    panels: tuple[MeasuredPanel, ...]


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
class LatentScale:
    """What a latent-trait model places on its scale."""

    # severities and thresholds from the mean severity, biases from no bias
    items: tuple[ScaleRow, ...]
    thresholds: tuple[ScaleRow, ...]
    raters: tuple[ScaleRow, ...]
    grades: tuple[str, ...]  # the scale, one more than thresholds
    level: float  # of the intervals


@dataclass(frozen=True, slots=True, kw_only=True)
class StretchLine:
    """One motion of one model."""

    label: str  # what tells it from the others, such as its speed
    # (n_points,): s, deg, N·m; where the torque jumps, two points have one time
    time: "Floats" = field(compare=False, repr=False)
    angle: "Floats" = field(compare=False, repr=False)
    torque: "Floats" = field(compare=False, repr=False)
    # name, first and last time of each phase, s
    phases: tuple[tuple[str, float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class StretchPanel:
    """The motions of one model."""

    title: str  # the model
    lines: tuple[StretchLine, ...]  # the phases of one are shaded


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretches:
    """Torque against angle, or torque and angle against time."""

    panels: tuple[StretchPanel, ...]  # at most four, beside each other
    against: Literal["angle", "time"]  # what is on the horizontal axis


@dataclass(frozen=True, slots=True, kw_only=True)
class ToneLine:
    """One joint along a motion."""

    label: str  # what tells it from the others, such as its grade
    # (n_points,): s, deg, N·m; where the torque jumps, two points are near
    time: "Floats" = field(compare=False, repr=False)
    angle: "Floats" = field(compare=False, repr=False)
    torque: "Floats" = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class ToneView:
    """A law of tone along one motion: torque against angle, and both against time."""

    lines: tuple[ToneLine, ...]  # at most four, of one motion
    shown: int  # which of them has its events marked
    parts: tuple[tuple[str, float, float], ...]  # name, first and last time, s
    events: tuple[tuple[str, float], ...]  # name, time, s
    rendered: ToneLine  # that line as a device made it, its angle the arm's


@dataclass(frozen=True, slots=True, kw_only=True)
class CatchCurve:
    """Catches of one model in motions of many speeds."""

    label: str  # the model
    # (n_motions,): mean speed from onset to catch, deg/s
    mean_speed: "Floats" = field(compare=False, repr=False)
    catch_angle: "Floats" = field(compare=False, repr=False)  # (n_motions,): deg
    # (n_motions,): mean speed during the catch, deg/s
    catch_speed: "Floats" = field(compare=False, repr=False)
    # (n_motions,): of the catch, s; ``nan`` where the motion ends within it
    duration: "Floats" = field(compare=False, repr=False)
    clamps: tuple[float, float]  # ν_L and ν_H of (6), deg/s


@dataclass(frozen=True, slots=True, kw_only=True)
class CatchCurves:
    """Angle, duration, and duration times speed of catches against mean speed."""

    curves: tuple[CatchCurve, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CatchSchematic:
    """One stretch, with the parts of its catch named."""

    title: str  # the model and its motion
    # (n_points,): s and N·m; where the torque jumps, two points have one time
    time: "Floats" = field(compare=False, repr=False)
    torque: "Floats" = field(compare=False, repr=False)
    # name, first and last time of each phase, s
    phases: tuple[tuple[str, float, float], ...]
    # s; the last is the end of the stretch if that comes first
    catch: float
    peak_end: float
    catch_end: float
    # torque before, at and after the peak, N·m
    pre_end: float
    peak: float
    residual: float
    residual_name: str  # what the residual is above `pre_end`, in matplotlib's TeX


@dataclass(frozen=True, slots=True, kw_only=True)
class JointFitView:
    """An identified joint, seen in one of four ways."""

    fit: "ElbowFit"
    view: Literal["slow", "fast", "catches", "residuals"]


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionView:
    """The identified friction of a device."""

    fit: "FrictionFit"


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
class PairMaps:
    """How well every two raters agree, in every group."""

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
class Differences:
    """Differences against means, with limits of agreement."""

    panels: tuple[DifferencePanel, ...]
    unit: str  # of the ratings, or nothing
    level: float  # of the intervals


@dataclass(frozen=True, slots=True, kw_only=True)
class LearningView:
    """A training: kappa time and again, and each grade below it."""

    title: str  # whose training, and how it ended
    # (n_points,): number of the last presentation; kappa and its interval
    positions: tuple[int, ...]
    kappas: tuple[tuple[float, float, float], ...]
    level: float  # of the intervals
    bounds: tuple[float, float]  # insufficient and sufficient kappa
    differences: tuple[int, ...]  # grades by which each grade is too high


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanCurve:
    """What studies of so many raters, or items, can show, by the number of others."""

    label: str
    sizes: tuple[int, ...]
    numbers: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanCurves:
    """Plans of many sizes."""

    title: str
    what: str  # the number
    over: str  # "items" or "raters"
    limit: float | None  # what it is to reach
    curves: tuple[PlanCurve, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class OrderPanel:
    """Schedules of one session, counted."""

    title: str
    n_schedules: int
    models: tuple[str, ...]  # names of the rows of both
    places: tuple[tuple[int, ...], ...]  # by model and place
    pairs: tuple[tuple[int, ...], ...]  # by model and the one right after it


@dataclass(frozen=True, slots=True, kw_only=True)
class OrderPanels:
    """How even orders are, session below session."""

    panels: tuple[OrderPanel, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceDots:
    """How far the grades of each part of a session are from those of their models."""

    session: str
    places: tuple[str, ...]  # of the parts, from the first
    steps: tuple[float, ...]  # mean of each part, of the scale; not finite without one


@dataclass(frozen=True, slots=True, kw_only=True)
class OrderDifferences:
    """Differences of grades by when a model came, in steps of the scale."""

    parts: tuple[PlaceDots, ...]  # by session; none where no places are known
    # what is compared; mean, and the ends of its interval, which may not be finite
    effects: tuple[tuple[str, float, float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class FlowStep:
    """How many raters came so far, and what became of the others."""

    label: str
    n: int
    others: tuple[str, ...] = ()  # a line each


@dataclass(frozen=True, slots=True, kw_only=True)
class RaterFlow:
    """The way of the raters through a study."""

    steps: tuple[FlowStep, ...]  # first on top


@dataclass(frozen=True, slots=True, kw_only=True)
class AnswerPanel:
    """How often each answer to one question was given."""

    title: str  # the question, and the session
    labels: tuple[str, ...]  # the answers, or ranges of them
    counts: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class AnswerBars:
    """Answers to questionnaires, a panel a question and session."""

    panels: tuple[AnswerPanel, ...]


Content = (
    GradeGrid
    | GradeCounts
    | GradesByAim
    | OrderDifferences
    | RaterFlow
    | Forest
    | SpeedDots
    | TraceColumns
    | MeasuredTorque
    | LatentScale
    | Stretches
    | CatchCurves
    | CatchSchematic
    | ToneView
    | JointFitView
    | FrictionView
    | PairMaps
    | Differences
    | LearningView
    | OrderPanels
    | AnswerBars
    | PlanCurves
)
"""Whatever can be drawn."""
