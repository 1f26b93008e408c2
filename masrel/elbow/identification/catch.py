"""One catch: when, where and how fast, and how far it goes."""

from dataclasses import dataclass

import numpy as np

from masrel.elbow.identification.kinematics import state_at_break
from masrel.elbow.identification.stretches import Stretch
from masrel.elbow.parameters import ElbowParameters

__all__ = ["Catch", "Places", "catch_at", "fast_part"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Catch:
    """The catch of one stretch.

    Attributes
    ----------
    time : float
        Its start, midway between two samples, s.
    angle, speed, acceleration : float
        There, rad, rad/s and (just before) rad/s².
    mean_speed : float
        Mean speed from movement onset, v̄ of (2), rad/s.
    speed_gain : float
        How fast that mean grew with the angle there, dv̄/dθ, 1/s.
    end : float or None
        Time of its end, s; None if the stretch ends within it.
    travel : float
        Angle travelled during it, rad: up to its end or the stretch's.
    mean_catch_speed : float
        Mean speed during it, v̄_c of (4), rad/s.
    within_peak : bool
        Whether it ends before the peak does.
    residual_sd : float
        Standard deviation of torque about the law of the change points, N·m.
    """

    time: float
    angle: float
    speed: float
    acceleration: float
    mean_speed: float
    speed_gain: float
    end: float | None
    travel: float
    mean_catch_speed: float
    within_peak: bool
    residual_sd: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Places:
    """Samples of a stretch at which something happens.

    Attributes
    ----------
    onset, catch : int
        Movement onset, and first of the catch.
    end : int or None
        First after the catch, or None if it does not end.
    stop : int
        First that is slow again.
    """

    onset: int
    catch: int
    end: int | None
    stop: int


def fast_part(stretch: Stretch, limit: float, window: float) -> tuple[int, int]:
    """Find the part of a stretch in which it can catch.

    Parameters
    ----------
    stretch : Stretch
        A fast stretch.
    limit : float
        ν_th, rad/s.
    window : float
        Length of the filter's window, s.

    Returns
    -------
    tuple of two int
        Sample of movement onset, and the first at which the hand is slow again.
    """
    velocity = stretch.velocity
    fastest = int(np.argmax(velocity))
    slow = np.flatnonzero(velocity[fastest:] < limit)
    stop = fastest + int(slow[0]) if slow.size else velocity.size
    # the filter sees a hand stop half a window late or early
    stop = max(fastest, stop - round(0.5 * window / stretch.samples.period))
    return int(np.argmax(velocity >= limit)), stop


def catch_at(
    stretch: Stretch, places: Places, constants: ElbowParameters, residual_sd: float
) -> Catch:
    """Read motion and travel of a catch off its stretch.

    Parameters
    ----------
    stretch : Stretch
        The stretch.
    places : Places
        Where in it the catch is.
    constants : ElbowParameters
        ν_th and ΔT_peak.
    residual_sd : float
        Standard deviation of torque about the law of the change points, N·m.

    Returns
    -------
    Catch
        The catch.
    """
    time, period = stretch.time, stretch.samples.period
    instant = float(time[places.catch]) - 0.5 * period  # between two samples
    reach = slice(stretch.start, stretch.start + places.stop)
    angle, speed, acceleration = state_at_break(
        stretch.samples.time[reach], stretch.samples.angle[reach], instant
    )
    onset, onset_angle = _crossing(stretch, places.onset, constants.speed_threshold)
    mean_speed = (angle - onset_angle) / (instant - onset)
    end = None if places.end is None else float(time[places.end]) - 0.5 * period
    last = float(time[places.stop - 1]) if end is None else end
    travel = float(np.interp(last, time, stretch.angle)) - angle
    peak_end = instant + constants.peak_duration
    return Catch(
        time=instant,
        angle=angle,
        speed=speed,
        acceleration=acceleration,
        mean_speed=mean_speed,
        # d/dθ of (θ - θ_on)/(t - t_on), with dt = dθ/ω
        speed_gain=(1.0 - mean_speed / speed) / (instant - onset),
        end=end,
        travel=travel,
        mean_catch_speed=travel / (last - instant),
        within_peak=end is not None and end < peak_end - 2.0 * period,
        residual_sd=residual_sd,
    )


def _crossing(stretch: Stretch, place: int, limit: float) -> tuple[float, float]:
    # time and angle at which the speed reaches the limit, between two samples
    if place == 0:
        return float(stretch.time[0]), float(stretch.angle[0])
    low, high = stretch.velocity[place - 1], stretch.velocity[place]
    time = float(stretch.time[place]) - stretch.samples.period * float(
        (high - limit) / (high - low)
    )
    return time, float(np.interp(time, stretch.time, stretch.angle))
