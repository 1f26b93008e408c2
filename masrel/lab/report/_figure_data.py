"""What figures of the laboratory show, as plain values."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Literal

from masrel.plots._drawn_values import Content

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from masrel.lab.elbow import Outline, Trace
    from masrel.lab.elbow.identification import ElbowFit, FrictionFit

    Floats = NDArray[np.float64]

_FIGURES = "masrel.lab.report.figures."

# From more than so many on, a figure shows distributions instead of every one.
MANY_RATERS = 30
MANY_STRETCHES = 12
MANY_MODELS = 12  # and panels are smaller


@dataclass(frozen=True, slots=True, kw_only=True)
class GradeGrid(Content):
    """Grades of one session, one row a model and one column a rater."""

    drawer: ClassVar[str] = _FIGURES + "_study_figures:grade_figure"

    # models, raters: names of the rows and columns
    models: tuple[str, ...]
    raters: tuple[str, ...]
    intended: tuple[str | None, ...]  # by model
    # by model and rater, the grades of every presentation in order; no None
    grades: tuple[tuple[tuple[str, ...], ...], ...]
    scale: tuple[str, ...]  # every grade of the scale, mildest first


@dataclass(frozen=True, slots=True, kw_only=True)
class GradeCounts(Content):
    """How often each model was given each grade in one session."""

    drawer: ClassVar[str] = _FIGURES + "_study_figures:count_figure"

    models: tuple[str, ...]
    intended: tuple[str | None, ...]  # by model
    scale: tuple[str, ...]  # every grade of the scale, mildest first
    counts: tuple[tuple[int, ...], ...]  # by model and grade


@dataclass(frozen=True, slots=True, kw_only=True)
class GradesByAim(Content):
    """How often models of each intended grade were given each grade."""

    drawer: ClassVar[str] = _FIGURES + "_study_figures:aim_figure"

    intended: tuple[str, ...]
    scale: tuple[str, ...]  # every grade of the scale, mildest first
    counts: tuple[tuple[int, ...], ...]  # by intended grade and grade
    # by intended grade: the part that has it, and the ends of its interval
    shares: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedColumn:
    """Mean speeds of one model in one session, deg/s."""

    model: str
    session: str
    speeds: tuple[tuple[float, ...], ...]  # of every rater, in the raters' order
    mean: float
    graded: tuple[tuple[float, ...], ...] = ()  # those that a grade is said to rest on


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedDots(Content):
    """Every rater's mean speed for every model."""

    drawer: ClassVar[str] = _FIGURES + "_study_figures:speed_figure"

    columns: tuple[SpeedColumn, ...]  # by session and model
    raters: tuple[str, ...]
    slowest: float  # below it the catch angle stays the same, deg/s


@dataclass(frozen=True, slots=True, kw_only=True)
class TraceBand:
    """Where most of many stretches are at each time, while half of them go on."""

    # (n_points,): s; (4, n_points): deg and N·m, from the lowest to the highest
    time: "Floats" = field(compare=False, repr=False)
    angle: "Floats" = field(compare=False, repr=False)
    torque: "Floats" = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class TracePanel:
    """All stretches of one model, or a few of many and where most are."""

    title: str  # the model, its intended grade, and the range of speeds
    traces: "tuple[Outline | Trace, ...]"
    graded: tuple[bool, ...]  # by trace, whether a grade is said to rest on it
    names: tuple[str, ...] = ()  # by trace, whose it is, if that is written at it
    band: TraceBand | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TraceColumns(Content):
    """Torque and angle against time, one column a model."""

    drawer: ClassVar[str] = _FIGURES + "_trace_figures:trace_figure"

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
class MeasuredTorque(Content):
    """Torque that was sent and torque that was measured, one column a presentation."""

    drawer: ClassVar[str] = _FIGURES + "_trace_figures:measured_figure"

    panels: tuple[MeasuredPanel, ...]


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
class Stretches(Content):
    """Torque against angle, or torque and angle against time."""

    drawer: ClassVar[str] = _FIGURES + "_scene_figures:scene_figure"

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
class ToneView(Content):
    """A law of tone along one motion: torque against angle, and both against time."""

    drawer: ClassVar[str] = _FIGURES + "_tone_figures:tone_figure"

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
class CatchCurves(Content):
    """Angle, duration, and duration times speed of catches against mean speed."""

    drawer: ClassVar[str] = _FIGURES + "_scene_figures:scene_figure"

    curves: tuple[CatchCurve, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CatchSchematic(Content):
    """One stretch, with the parts of its catch named."""

    drawer: ClassVar[str] = _FIGURES + "_scene_figures:scene_figure"

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
class JointFitView(Content):
    """An identified joint, seen in one of four ways."""

    drawer: ClassVar[str] = _FIGURES + "_fit_figures:fit_figure"

    fit: "ElbowFit"
    view: Literal["slow", "fast", "catches", "residuals"]


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionView(Content):
    """The identified friction of a device."""

    drawer: ClassVar[str] = _FIGURES + "_fit_figures:fit_figure"

    fit: "FrictionFit"


@dataclass(frozen=True, slots=True, kw_only=True)
class LearningView(Content):
    """A training: kappa time and again, and each grade below it."""

    drawer: ClassVar[str] = _FIGURES + "_learning_figure:learning_figure"

    title: str  # whose training, and how it ended
    # (n_points,): number of the last presentation; kappa and its interval
    positions: tuple[int, ...]
    kappas: tuple[tuple[float, float, float], ...]
    level: float  # of the intervals
    bounds: tuple[float, float]  # insufficient and sufficient kappa
    differences: tuple[int, ...]  # grades by which each grade is too high


@dataclass(frozen=True, slots=True, kw_only=True)
class OrderPanel:
    """Schedules of one session, counted."""

    title: str
    n_schedules: int
    models: tuple[str, ...]  # names of the rows of both
    places: tuple[tuple[int, ...], ...]  # by model and place
    pairs: tuple[tuple[int, ...], ...]  # by model and the one right after it


@dataclass(frozen=True, slots=True, kw_only=True)
class OrderPanels(Content):
    """How even orders are, session below session."""

    drawer: ClassVar[str] = _FIGURES + "_order_figure:order_figure"

    panels: tuple[OrderPanel, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceDots:
    """How far the grades of each part of a session are from those of their models."""

    session: str
    places: tuple[str, ...]  # of the parts, from the first
    steps: tuple[float, ...]  # mean of each part, of the scale; not finite without one


@dataclass(frozen=True, slots=True, kw_only=True)
class OrderDifferences(Content):
    """Differences of grades by when a model came, in steps of the scale."""

    drawer: ClassVar[str] = (
        "masrel.lab.report.figures._order_differences:difference_figure"
    )

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
class RaterFlow(Content):
    """The way of the raters through a study."""

    drawer: ClassVar[str] = _FIGURES + "_rater_flow:flow_figure"

    steps: tuple[FlowStep, ...]  # first on top


@dataclass(frozen=True, slots=True, kw_only=True)
class AnswerPanel:
    """How often each answer to one question was given."""

    title: str  # the question, and the session
    labels: tuple[str, ...]  # the answers, or ranges of them
    counts: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class AnswerBars(Content):
    """Answers to questionnaires, a panel a question and session."""

    drawer: ClassVar[str] = _FIGURES + "_answer_bars:answer_figure"

    panels: tuple[AnswerPanel, ...]
