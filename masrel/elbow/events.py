"""The events of a motion, as roots of it: no time stepping.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (2), (4), (6) and Fig. 7.
"""

from dataclasses import dataclass, field
from decimal import Decimal

from masrel.elbow.course import course
from masrel.elbow.moments import Course, Moment, Stretch
from masrel.elbow.motion import Motion
from masrel.elbow.parameters import ElbowParameters
from masrel.elbow.polynomial import exactly
from masrel.recording import Phase

__all__ = ["Events", "PhaseSpan", "StretchEvents", "events", "events_of"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseSpan:
    """One phase of a motion.

    Attributes
    ----------
    name : {"pre-catch", "catch", "post-catch"}
        The phase.
    start, end : float
        Times, s.
    start_angle, end_angle : float
        Angles, rad.
    """

    name: Phase
    start: float
    end: float
    start_angle: float
    end_angle: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StretchEvents:
    """When one stretch catches and goes on; None for what it does not reach.

    Attributes
    ----------
    onset : float
        Speed first reaches ν_th, s.
    catch : float or None
        The catch begins, s.
    catch_angle : float or None
        Angle where it begins, rad.
    catch_speed : float or None
        v_c of (3), rad/s.
    mean_speed : float or None
        Mean speed from onset to catch, rad/s.
    peak_end : float or None
        The peak of (3) ends, s.
    catch_end : float or None
        The catch ends, s; None when the motion ends within it.
    post_catch_end : float or None
        Speed falls below ν_th again after the catch, s; None when it does not.
    """

    onset: float
    catch: float | None = None
    catch_angle: float | None = None
    catch_speed: float | None = None
    mean_speed: float | None = None
    peak_end: float | None = None
    catch_end: float | None = None
    post_catch_end: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Events:
    """When a motion moves, catches, and goes on.

    Attributes
    ----------
    stretches : tuple of StretchEvents
        Every movement in extension that reaches ν_th, in order.
    end : float
        The motion ends, at its own end or at the end of range, s.
    phases : tuple of PhaseSpan
        The phases in order.
    course : Course
        The same in 50 digits; torque, work and impulse are computed from it.

    Notes
    -----
    `onset`, `catch` and the other attributes of `StretchEvents` are those of the first
    stretch that catches, or of the first if none does; None if there is none.
    """

    stretches: tuple[StretchEvents, ...]
    end: float
    phases: tuple[PhaseSpan, ...]
    course: Course = field(repr=False, compare=False)

    @property
    def _first(self) -> StretchEvents | None:
        caught = [stretch for stretch in self.stretches if stretch.catch is not None]
        return next(iter(caught or self.stretches), None)

    @property
    def onset(self) -> float | None:
        """Speed first reaches ν_th, s."""
        return None if self._first is None else self._first.onset

    @property
    def catch(self) -> float | None:
        """The catch begins, s."""
        return None if self._first is None else self._first.catch

    @property
    def catch_angle(self) -> float | None:
        """Angle where the catch begins, rad."""
        return None if self._first is None else self._first.catch_angle

    @property
    def catch_speed(self) -> float | None:
        """v_c of (3), rad/s."""
        return None if self._first is None else self._first.catch_speed

    @property
    def mean_speed(self) -> float | None:
        """Mean speed from onset to catch, rad/s."""
        return None if self._first is None else self._first.mean_speed

    @property
    def peak_end(self) -> float | None:
        """The peak of (3) ends, s."""
        return None if self._first is None else self._first.peak_end

    @property
    def catch_end(self) -> float | None:
        """The catch ends, s."""
        return None if self._first is None else self._first.catch_end

    @property
    def post_catch_end(self) -> float | None:
        """Speed falls below ν_th again after the catch, s."""
        return None if self._first is None else self._first.post_catch_end


def events(parameters: ElbowParameters, motion: Motion) -> Events:
    """Find the events of a motion.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units.

    Returns
    -------
    Events
        Each time and angle is the float nearest to the exact one; what the motion
        does not reach is None.

    Raises
    ------
    ParameterError
        If the motion starts at or beyond the end of range.

    Notes
    -----
    Times that agree to 30 digits of the piece of motion they are in count as one.

    Examples
    --------
    HM3 at 92 deg/s catches at L - α v = 115 - 0.35 x 92 = 82.8 deg:

    >>> from math import degrees, radians
    >>> from masrel.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> found = events(STANDARD_MODELS["HM3"], stretch)
    >>> round(degrees(found.catch_angle), 6)
    82.8
    >>> [span.name for span in found.phases]
    ['pre-catch', 'catch', 'post-catch']
    """
    return events_of(parameters, course(parameters, motion))


def events_of(parameters: ElbowParameters, found: Course) -> Events:
    """Round a course to events.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    found : Course
        What happens in a motion.

    Returns
    -------
    Events
        The same, in floats.
    """
    with exactly():
        stretches = tuple(
            _stretch(stretch, Decimal(parameters.peak_duration), found.end)
            for stretch in found.stretches
        )
    return Events(
        stretches=stretches,
        end=float(found.end.time),
        phases=_phases(found),
        course=found,
    )


def _stretch(stretch: Stretch, peak: Decimal, end: Moment) -> StretchEvents:
    catch, ended = stretch.catch, stretch.catch_end
    if catch is None:
        return StretchEvents(onset=float(stretch.onset.time))
    last = end if ended is None else ended
    return StretchEvents(
        onset=float(stretch.onset.time),
        catch=float(catch.time),
        catch_angle=float(catch.angle),
        catch_speed=float(catch.velocity),
        mean_speed=None if stretch.mean_speed is None else float(stretch.mean_speed),
        peak_end=float(min(catch.time + peak, last.time)),
        catch_end=_time(ended),
        post_catch_end=_time(stretch.post_catch_end),
    )


def _time(moment: Moment | None) -> float | None:
    return None if moment is None else float(moment.time)


def _phases(found: Course) -> tuple[PhaseSpan, ...]:
    # one of no length is left out
    ends = [change.moment for change in found.changes[1:]] + [found.end]
    return tuple(
        PhaseSpan(
            name=change.phase,
            start=float(change.moment.time),
            end=float(end.time),
            start_angle=float(change.moment.angle),
            end_angle=float(end.angle),
        )
        for change, end in zip(found.changes, ends, strict=True)
        if end.time > change.moment.time
    )
