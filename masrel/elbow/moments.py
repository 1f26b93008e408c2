"""What happens in a motion, in 50-digit decimals: moments, stretches, phases."""

from dataclasses import dataclass
from decimal import Decimal

from masrel.recording import Phase

__all__ = ["Change", "Course", "Moment", "Stretch"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """An instant of a motion; where its speed jumps, the later one.

    Attributes
    ----------
    time : Decimal
        s.
    angle : Decimal
        rad.
    velocity : Decimal
        rad/s.
    acceleration : Decimal
        rad/s².
    """

    time: Decimal
    angle: Decimal
    velocity: Decimal
    acceleration: Decimal


@dataclass(slots=True, kw_only=True)
class Stretch:
    """A movement in extension that reached ν_th, as far as it has got.

    Attributes
    ----------
    onset : Moment
        Speed first reaches ν_th.
    catch : Moment or None
        The catch begins.
    mean_speed : Decimal or None
        Mean speed from onset to catch, rad/s.
    catch_end : Moment or None
        The catch ends, by the angle travelled or because the arm was flexed.
    post_catch : Moment or None
        Post-catch begins.
    post_catch_end : Moment or None
        Post-catch ends.
    """

    onset: Moment
    catch: Moment | None = None
    mean_speed: Decimal | None = None
    catch_end: Moment | None = None
    post_catch: Moment | None = None
    post_catch_end: Moment | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """A phase that begins.

    Attributes
    ----------
    phase : {"pre-catch", "catch", "post-catch"}
        The phase.
    moment : Moment
        When.
    stretch : Stretch or None
        The stretch whose catch or post-catch it is.
    """

    phase: Phase
    moment: Moment
    stretch: Stretch | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Course:
    """What happens in a motion.

    Attributes
    ----------
    changes : tuple of Change
        The phases in order, the first at time 0.
    stretches : tuple of Stretch
        The movements in extension faster than ν_th.
    end : Moment
        The end of the motion, or of the range of motion.
    """

    changes: tuple[Change, ...]
    stretches: tuple[Stretch, ...]
    end: Moment
