"""Stretches of a recording, their speed and acceleration, and samples used together."""

import math
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from masrel.errors import RecordingError
from masrel.lab.elbow.identification._reading import (
    MIN_TRAVEL,
    Movement,
    Samples,
    even_samples,
)

_Floats = NDArray[np.float64]
_Bools = NDArray[np.bool_]

Pace = Literal["slow", "fast"]

_ORDER = 3  # of the polynomials that are fitted in the window of the filter
_MIN_LENGTH = 7  # of that window, samples

# Reach of the fit of the speed at a catch, to either side, s.
_REACH = 0.1

# A joint that extends slower rests: an encoder's steps make less than this, rad/s.
_MOVING = math.radians(2.0)

# A shorter rest, without going back, does not end a stretch, s.
_MIN_REST = 0.1


def window_length(window: float, period: float) -> int:
    """Return the samples of a filter's window: odd, enough for its polynomial."""
    return max(2 * round(0.5 * window / period) + 1, _MIN_LENGTH)


def differentiate(
    angle: _Floats, period: float, window: float
) -> tuple[_Floats, _Floats, _Floats]:
    """Return smoothed angle, velocity, acceleration, without delay.

    They are those of the cubic fitted to each window (Savitzky and Golay 1964), and of
    the first and last window at the ends; fewer samples than a window are one window.

    >>> t = np.arange(200) / 1000.0
    >>> angle, velocity, acceleration = differentiate(t**2, 0.001, 0.06)
    >>> bool(np.allclose(velocity, 2 * t)), bool(np.allclose(acceleration, 2.0))
    (True, True)
    """
    length = min(window_length(window, period), angle.size - 1 + angle.size % 2)
    order = min(_ORDER, length - 1)
    smooth, velocity, acceleration = (
        savgol_filter(angle, length, order, deriv=deriv, delta=period)
        if deriv <= order
        else np.zeros_like(angle)
        for deriv in range(3)
    )
    return smooth, velocity, acceleration


def filter_alike(
    angle: _Floats, torque: _Floats, period: float, window: float
) -> tuple[_Floats, _Floats, _Floats, _Floats]:
    """Return angle, velocity, acceleration and torque after one filter.

    They are of the inner samples: those with a whole window, but for the first and last
    of them. A weighted mean over a symmetric window (Hann's) commutes with d/dt:
    whatever the hand does, a linear law holds for the means as for the values, so that
    the window can be as long as an encoder's steps at a slow speed need. Noise in a
    regressor would pull b towards 0.

    >>> t = np.arange(1000) / 1000.0
    >>> angle = np.sin(9.0 * t)
    >>> law = 2.0 * 9.0 * np.cos(9.0 * t) + 3.0 * angle
    >>> x, v, _, torque = filter_alike(angle, law, 0.001, 0.25)
    >>> bool(np.allclose(torque, 2.0 * v + 3.0 * x, atol=1e-3))
    True
    """
    weights = np.hanning(window_length(window, period) + 2)[1:-1]
    weights /= weights.sum()
    means = np.convolve(angle, weights, mode="valid")
    resistance = np.convolve(torque, weights, mode="valid")
    velocity = (means[2:] - means[:-2]) / (2.0 * period)
    acceleration = (means[2:] - 2.0 * means[1:-1] + means[:-2]) / period**2
    return means[1:-1], velocity, acceleration, resistance[1:-1]


def state_at_break(
    time: _Floats, angle: _Floats, at: float
) -> tuple[float, float, float]:
    """Return angle, velocity and acceleration when a hand meets resistance.

    At a catch torque steps: angle and velocity are continuous, acceleration is not, and
    a filter that knows nothing of it would put part of the later slowing before it. Two
    cubics that share angle and velocity at the instant are fitted to the 0.1 s before
    and after; the acceleration is the one just before.

    >>> t = np.arange(0.0, 0.4, 0.001)
    >>> angle = t - 2.0 * np.maximum(t - 0.2, 0.0) ** 2
    >>> [round(x, 9) + 0.0 for x in state_at_break(t, angle, 0.2)]
    [0.2, 1.0, 0.0]
    """
    near = (time >= at - _REACH) & (time <= at + _REACH)
    since = (time[near] - at) / _REACH
    early, late = np.minimum(since, 0.0), np.maximum(since, 0.0)
    columns = [np.ones_like(since), since, early**2, late**2, early**3, late**3]
    values = np.linalg.lstsq(np.stack(columns, axis=1), angle[near], rcond=None)[0]
    return (
        float(values[0]),
        float(values[1]) / _REACH,
        2.0 * float(values[2]) / _REACH**2,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """One extension of the joint, from sample `start` of a recording on; SI units."""

    recording: Samples = field(repr=False)
    samples: Samples = field(repr=False)  # of the extension alone
    start: int
    angle: _Floats = field(compare=False, repr=False)  # smoothed, like the next two
    velocity: _Floats = field(compare=False, repr=False)
    acceleration: _Floats = field(compare=False, repr=False)
    pace: Pace
    peak_speed: float
    rest_angle: float  # the smallest of the 0.5 s before


def find_stretches(
    movement: Movement, *, window: float, slow_below: float
) -> tuple[list[Stretch], float]:
    """Return where the joint is extended by 15 degrees or more, and the noise at rest.

    A stretch whose speed stays below `slow_below` is slow. The noise is the standard
    deviation of the torque about a line in each rest of 0.1 s or more, N·m. Refuses a
    recorded velocity that is not the derivative of the angle.
    """
    samples = even_samples(movement)
    angle, velocity, acceleration = differentiate(samples.angle, samples.period, window)
    if movement.velocity is not None:
        recorded = np.interp(samples.time, movement.time, movement.velocity)
        ratio = float(recorded @ velocity) / float(velocity @ velocity)
        if not 0.8 <= ratio <= 1.25:
            raise RecordingError(
                f"{movement.name}: the velocity is {ratio:.3g} times the derivative of "
                "the angle; is its unit right?"
            )
    stretches = []
    for start, stop in _runs(samples, angle, velocity):
        part = slice(start, stop)
        if angle[stop - 1] - angle[start] < MIN_TRAVEL:
            continue
        before = samples.angle[max(0, start - round(0.5 / samples.period)) : start + 1]
        peak_speed = float(velocity[part].max())
        stretches.append(
            Stretch(
                recording=samples,
                samples=samples.cut(part),
                start=start,
                angle=angle[part],
                velocity=velocity[part],
                acceleration=acceleration[part],
                pace="slow" if peak_speed < slow_below else "fast",
                peak_speed=peak_speed,
                rest_angle=float(np.median(before[before <= before.min() + 1e-9])),
            )
        )
    return stretches, _rest_noise(samples, velocity)


def _spans(mask: _Bools) -> list[tuple[int, int]]:
    # first sample of each run that is marked, and the first after it
    edges = np.flatnonzero(np.diff(mask, prepend=False, append=False)).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def _runs(samples: Samples, angle: _Floats, velocity: _Floats) -> list[tuple[int, int]]:
    runs: list[tuple[int, int]] = []
    for start, stop in _spans(velocity > _MOVING):
        if runs and (start - runs[-1][1]) * samples.period < _MIN_REST:
            if angle[start] >= angle[runs[-1][1] - 1] - _MOVING * _MIN_REST:
                runs[-1] = (runs[-1][0], stop)
                continue
        runs.append((start, stop))
    return runs


def _rest_noise(samples: Samples, velocity: _Floats) -> float:
    still = (np.abs(velocity) < 0.5 * _MOVING) & ~samples.in_gap & ~samples.saturated
    squares, df = 0.0, 0
    for start, stop in _spans(still):
        if (stop - start) * samples.period >= _MIN_REST:
            torque = samples.torque[start:stop]
            since = np.arange(torque.size) - 0.5 * (torque.size - 1)
            left = torque - torque.mean()
            left = left - since * (float(since @ left) / float(since @ since))
            squares, df = squares + float(left @ left), df + torque.size - 2
    return math.sqrt(squares / df) if df > 0 else math.nan


class Part(NamedTuple):
    """Samples of a trial that are used, each column of shape (n_samples,), SI units.

    Angle and its derivatives are smoothed within the part, before a catch the torque as
    well; `measured` is the torque as recorded.
    """

    time: _Floats
    angle: _Floats
    velocity: _Floats
    acceleration: _Floats
    jerk: _Floats
    torque: _Floats
    measured: _Floats

    def keep(self, which: _Bools) -> "Part":
        """Return the samples that are marked."""
        return Part(*(column[which] for column in self))

    def then(self, later: "Part") -> "Part":
        """Return both parts as one."""
        return Part(*map(np.concatenate, zip(self, later, strict=True)))


def filtered_part(stretch: Stretch, ends: tuple[int, int], window: float) -> Part:
    """Return the samples between the ends whose window has no gap and is not saturated.

    Angle and torque go through one filter, as a linear law allows.
    """
    samples = stretch.samples
    margin = window_length(window, samples.period) // 2 + 1
    start, stop = ends
    if stop - start <= 2 * margin:
        return part_of(stretch, slice(0, 0))
    part, inner = slice(start, stop), slice(start + margin, stop - margin)
    angle, velocity, acceleration, torque = filter_alike(
        samples.angle[part], samples.torque[part], samples.period, window
    )
    unusable = (samples.in_gap | samples.saturated)[part]
    touched = np.convolve(unusable, np.ones(2 * margin + 1), mode="valid") > 0.5
    whole = Part(
        samples.time[inner],
        angle,
        velocity,
        acceleration,
        _slope(acceleration, samples.period),
        torque,
        samples.torque[inner],
    )
    return whole.keep(~touched)


def part_of(stretch: Stretch, which: slice, *, anew: float | None = None) -> Part:
    """Return samples of a stretch with torque as measured.

    With `anew` the angle is smoothed within the part alone, by a window of so many
    seconds, so that it knows nothing of the motion beyond.
    """
    samples = stretch.samples.cut(which)
    angle, velocity, acceleration = (
        x[which] for x in (stretch.angle, stretch.velocity, stretch.acceleration)
    )
    if anew is not None:
        angle, velocity, acceleration = differentiate(
            samples.angle, samples.period, anew
        )
    jerk, torque = _slope(acceleration, samples.period), samples.torque
    return Part(samples.time, angle, velocity, acceleration, jerk, torque, torque)


def _slope(values: _Floats, period: float) -> _Floats:
    return np.gradient(values, period) if values.size > 1 else np.zeros_like(values)
