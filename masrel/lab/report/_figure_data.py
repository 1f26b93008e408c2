"""What figures of the laboratory show, as plain values."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from masrel.lab.elbow import Outline, Trace

    Floats = NDArray[np.float64]

FIGURES = "masrel.lab.report.figures."
"""Where the functions are that draw them."""

# From more than so many on, a figure shows distributions instead of every one.
MANY_RATERS = 30
MANY_STRETCHES = 12
MANY_MODELS = 12  # and panels are smaller


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedColumn:
    """Mean speeds of one model in one session, deg/s."""

    model: str
    session: str
    speeds: tuple[tuple[float, ...], ...]  # of every rater, in the raters' order
    mean: float
    graded: tuple[tuple[float, ...], ...] = ()  # those that a grade is said to rest on


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
class MeasuredPanel:
    """One presentation on a device with a torque sensor."""

    title: str  # the model, and whose presentation it is
    # (n_samples,): s, deg and N·m; ``nan`` where the sensor gave no number
    time: "Floats" = field(compare=False, repr=False)
    angle: "Floats" = field(compare=False, repr=False)
    sent: "Floats" = field(compare=False, repr=False)
    measured: "Floats" = field(compare=False, repr=False)


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
class FlowStep:
    """How many raters came so far, and what became of the others."""

    label: str
    n: int
    others: tuple[str, ...] = ()  # a line each
