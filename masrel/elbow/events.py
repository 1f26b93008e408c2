"""The events of a stretch, as roots of its motion: no time stepping.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (2), (4), (6) and Fig. 7.
"""

import math
from dataclasses import dataclass

from masrel.elbow.motion import Motion, first_true
from masrel.elbow.parameters import ElbowParameters
from masrel.errors import ParameterError
from masrel.recording import Phase

__all__ = ["Events", "PhaseSpan", "events", "stretch_end"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseSpan:
    """One phase of a stretch.

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
class Events:
    """When a stretch moves, catches, and goes on; None for what it does not reach.

    Attributes
    ----------
    onset : float or None
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
        The catch ends, s; None when the stretch ends within it.
    post_catch_end : float or None
        Speed falls below ν_th again after the catch, s; None when it does not.
    end : float
        The stretch ends, at its own end or at the end of range, s.
    phases : tuple of PhaseSpan
        The phases in order.
    """

    onset: float | None
    catch: float | None = None
    catch_angle: float | None = None
    catch_speed: float | None = None
    mean_speed: float | None = None
    peak_end: float | None = None
    catch_end: float | None = None
    post_catch_end: float | None = None
    end: float
    phases: tuple[PhaseSpan, ...]


def events(parameters: ElbowParameters, motion: Motion) -> Events:
    """Find the events of a stretch.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The stretch, SI units.

    Returns
    -------
    Events
        Exact to rounding; what the stretch does not reach is None.

    Raises
    ------
    ParameterError
        If the stretch starts at or beyond the end of range.

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
    end = stretch_end(parameters, motion)
    fast = motion.times_above(parameters.speed_threshold)
    if fast is None or fast[0] >= end:
        return Events(onset=None, end=end, phases=_phases(motion, [], end))
    onset, slow = fast[0], min(fast[1], end)
    catch = _catch(parameters, motion, onset, slow)
    if catch is None:
        return Events(onset=onset, end=end, phases=_phases(motion, [], end))
    catch_angle = float(motion.angle(catch))
    released = catch_angle + parameters.catch_travel  # (4): the angle travelled is D
    catch_end = None
    if released < float(motion.angle(end)):
        catch_end = motion.time_at(released)
    post_end = None
    if catch_end is not None and slow < end:
        post_end = max(catch_end, slow)
    changes: list[tuple[Phase, float]] = [("catch", catch)]
    if catch_end is not None:
        changes.append(("post-catch", catch_end))
    if post_end is not None:
        changes.append(("pre-catch", post_end))
    return Events(
        onset=onset,
        catch=catch,
        catch_angle=catch_angle,
        catch_speed=float(motion.velocity(catch)),
        mean_speed=_mean_speed(motion, onset, catch),
        peak_end=min(
            catch + parameters.peak_duration, end if catch_end is None else catch_end
        ),
        catch_end=catch_end,
        post_catch_end=post_end,
        end=end,
        phases=_phases(motion, changes, end),
    )


def stretch_end(parameters: ElbowParameters, motion: Motion) -> float:
    """Return when a stretch ends, at its own end or at the end of range.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint, of which the end of range is used.
    motion : Motion
        The stretch, SI units.

    Returns
    -------
    float
        Time from the start, s.

    Raises
    ------
    ParameterError
        If the stretch starts at or beyond the end of range.

    Examples
    --------
    >>> from masrel.elbow import STANDARD_MODELS, ConstantSpeed
    >>> from math import radians
    >>> stretch = ConstantSpeed(start=radians(46), end=radians(160), speed=radians(50))
    >>> round(stretch_end(STANDARD_MODELS["HM1"], stretch), 12)
    2.0
    """
    if motion.start >= parameters.range_end:
        raise ParameterError(
            "start: needs less than the end of range, "
            f"{math.degrees(parameters.range_end):g} degrees, got "
            f"{math.degrees(motion.start):g} degrees"
        )
    if motion.end > parameters.range_end:
        return motion.time_at(parameters.range_end)  # the joint goes no further
    return motion.duration


def _mean_speed(motion: Motion, onset: float, time: float) -> float:
    # v̄ of (2); at the onset itself its limit, the speed there
    if time == onset:
        return float(motion.velocity(onset))
    return float(motion.angle(time) - motion.angle(onset)) / (time - onset)


def _catch(
    parameters: ElbowParameters, motion: Motion, onset: float, slow: float
) -> float | None:
    # first time in [onset, slow] at which θ > θ_catch(v̄)

    def beyond(time: float) -> bool:
        mean_speed = _mean_speed(motion, onset, time)
        return bool(motion.angle(time) > parameters.catch_angle(mean_speed))

    speed = float(motion.velocity(onset))
    constant = speed == float(motion.velocity(slow))
    if constant and not motion.turning_times(0.0, 1.0, 0.0):
        # v̄ is the speed itself, so θ_catch is one angle, reached in closed form
        if speed <= parameters.speed_threshold or not beyond(slow):
            return None  # Fig. 7 asks for more than ν_th
        angle = parameters.catch_angle(_mean_speed(motion, onset, slow))
        return onset if beyond(onset) else motion.time_at(angle)
    if beyond(onset):
        return onset
    # θ - θ_catch grows as long as v̄ grows, that is until the speed has fallen to v̄;
    # it goes on growing until θ_catch rises faster than θ, and may grow once more
    # when v̄ < ν_L keeps θ_catch in place. Each part has at most one change.
    fastest = _fastest_mean(motion, onset, slow)
    low = onset
    for high in (fastest, _overtaken(parameters, motion, onset, fastest, slow), slow):
        if high > low and beyond(high):
            return first_true(beyond, low, high)
        low = high
    return None


def _fastest_mean(motion: Motion, onset: float, slow: float) -> float:
    # where v̄ is largest: the speed, having peaked, has fallen to it
    def slower(time: float) -> bool:
        return bool(motion.velocity(time) <= _mean_speed(motion, onset, time))

    peak = 0.5 * motion.duration
    low = min(max(peak, onset), slow)
    return first_true(slower, low, slow) if slower(slow) and not slower(low) else slow


def _overtaken(
    parameters: ElbowParameters,
    motion: Motion,
    onset: float,
    fastest: float,
    slow: float,
) -> float:
    # from where, after `fastest`, θ_catch of (2) rises faster than θ: dθ_catch/dt is
    # -α dv̄/dt with dv̄/dt = (ω - v̄)/(t - t_onset), unless v̄ > ν_H keeps θ_catch
    def rises_faster(time: float) -> bool:
        mean_speed = _mean_speed(motion, onset, time)
        speed = float(motion.velocity(time))
        rise = parameters.catch_slope * (mean_speed - speed)
        clamped = mean_speed > parameters.fastest_mean_speed
        return not clamped and rise > speed * (time - onset)

    if rises_faster(slow) and not rises_faster(fastest):
        return first_true(rises_faster, fastest, slow)
    return slow


def _phases(
    motion: Motion, changes: list[tuple[Phase, float]], end: float
) -> tuple[PhaseSpan, ...]:
    # phases begin at 0 and at every change; one of no length is left out
    starts: list[tuple[Phase, float]] = [("pre-catch", 0.0), *changes]
    ends = [time for _, time in changes] + [end]
    return tuple(
        PhaseSpan(
            name=name,
            start=start,
            end=stop,
            start_angle=float(motion.angle(start)),
            end_angle=float(motion.angle(stop)),
        )
        for (name, start), stop in zip(starts, ends, strict=True)
        if stop > start
    )
