"""Stretches of a recording, their speed and acceleration, and samples used together."""

import math
from dataclasses import dataclass, field, fields
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from masrel.errors import RecordingError
from masrel.lab.elbow.identification._reading import MIN_TRAVEL, Movement, Samples

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
    length = window_length(window, period)
    weights = np.hanning(length + 2)[1:-1]
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
    design = np.stack(columns, axis=1)
    values = np.linalg.lstsq(design, angle[near], rcond=None)[0]
    return (
        float(values[0]),
        float(values[1]) / _REACH,
        2.0 * float(values[2]) / _REACH**2,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """One extension of the joint: samples `start` to before `stop` of a recording."""

    samples: Samples
    start: int
    stop: int
    angle: _Floats = field(compare=False, repr=False)  # smoothed, like the next two
    velocity: _Floats = field(compare=False, repr=False)
    acceleration: _Floats = field(compare=False, repr=False)
    pace: Pace

    @property
    def time(self) -> _Floats:
        """Return the times of its samples, s."""
        return self.samples.time[self.start : self.stop]

    @property
    def raw_angle(self) -> _Floats:
        """Return the angles as the encoder reads them, rad."""
        return self.samples.angle[self.start : self.stop]

    @property
    def torque(self) -> _Floats:
        """Return the torque, N·m."""
        return self.samples.torque[self.start : self.stop]

    @property
    def in_gap(self) -> _Bools:
        """Return which samples are in a gap."""
        return self.samples.in_gap[self.start : self.stop]

    @property
    def saturated(self) -> _Bools:
        """Return the samples whose torque is cut off."""
        return self.samples.saturated[self.start : self.stop]

    @property
    def peak_speed(self) -> float:
        """Return the largest speed, rad/s."""
        return float(self.velocity.max())

    @property
    def rest_angle(self) -> float:
        """Return the angle where it starts, rad: the smallest of the 0.5 s before."""
        first = max(0, self.start - round(0.5 / self.samples.period))
        before = self.samples.angle[first : self.start + 1]
        return float(np.median(before[before <= before.min() + 1e-9]))


def find_stretches(
    samples: Samples, *, window: float, slow_below: float
) -> tuple[list[Stretch], float]:
    """Return where the joint is extended by 15 degrees or more, and the noise at rest.

    A stretch whose speed stays below `slow_below` is slow. The noise is the standard
    deviation of the torque about a line in each rest of 0.1 s or more, N·m.
    """
    angle, velocity, acceleration = differentiate(samples.angle, samples.period, window)
    stretches = []
    for start, stop in _runs(samples, angle, velocity):
        if angle[stop - 1] - angle[start] < MIN_TRAVEL:
            continue
        part = slice(start, stop)
        pace: Pace = "slow" if velocity[part].max() < slow_below else "fast"
        stretches.append(
            Stretch(
                samples=samples,
                start=start,
                stop=stop,
                angle=angle[part],
                velocity=velocity[part],
                acceleration=acceleration[part],
                pace=pace,
            )
        )
    return stretches, _rest_noise(samples, velocity)


def _rest_noise(samples: Samples, velocity: _Floats) -> float:
    still = (np.abs(velocity) < 0.5 * _MOVING) & ~samples.in_gap & ~samples.saturated
    edges = np.flatnonzero(np.diff(still, prepend=False, append=False))
    squares, df = 0.0, 0
    for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if (stop - start) * samples.period >= _MIN_REST:
            torque = samples.torque[start:stop]
            since = np.arange(torque.size) - 0.5 * (torque.size - 1)
            left = torque - torque.mean()
            left = left - since * (float(since @ left) / float(since @ since))
            squares, df = squares + float(left @ left), df + torque.size - 2
    return math.sqrt(squares / df) if df > 0 else math.nan


def check_velocity(movement: Movement, samples: Samples, window: float) -> None:
    """Refuse a recorded velocity that is not the derivative of the angle."""
    if movement.velocity is None:
        return
    _, velocity, _ = differentiate(samples.angle, samples.period, window)
    recorded = np.interp(samples.time, movement.time, movement.velocity)
    ratio = float(recorded @ velocity) / float(velocity @ velocity)
    if not 0.8 <= ratio <= 1.25:
        raise RecordingError(
            f"{movement.name}: the velocity is {ratio:.3g} times the derivative of the "
            "angle; is its unit right?"
        )


def _runs(samples: Samples, angle: _Floats, velocity: _Floats) -> list[tuple[int, int]]:
    moving = np.concatenate([[False], velocity > _MOVING, [False]])
    edges = np.flatnonzero(np.diff(moving.astype(np.int8)))
    runs: list[tuple[int, int]] = []
    shortest = _MIN_REST / samples.period
    for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if runs and start - runs[-1][1] < shortest:
            if angle[start] >= angle[runs[-1][1] - 1] - _MOVING * _MIN_REST:
                runs[-1] = (runs[-1][0], stop)
                continue
        runs.append((start, stop))
    return runs


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """Samples of a trial that are used, each column of shape (n_samples,), SI units.

    Angle and its derivatives are smoothed within the part, before a catch the torque as
    well; `measured` is the torque as recorded.
    """

    time: _Floats = field(compare=False, repr=False)
    angle: _Floats = field(compare=False, repr=False)
    velocity: _Floats = field(compare=False, repr=False)
    acceleration: _Floats = field(compare=False, repr=False)
    jerk: _Floats = field(compare=False, repr=False)
    torque: _Floats = field(compare=False, repr=False)
    measured: _Floats = field(compare=False, repr=False)

    def keep(self, which: _Bools) -> "Part":
        """Return the samples that are marked."""
        return Part(**{each.name: getattr(self, each.name)[which] for each in _COLUMNS})

    def then(self, later: "Part") -> "Part":
        """Return both parts as one."""
        pairs = {
            f.name: (getattr(self, f.name), getattr(later, f.name)) for f in _COLUMNS
        }
        return Part(**{name: np.concatenate(pair) for name, pair in pairs.items()})


_COLUMNS = fields(Part)


def filtered_part(
    stretch: Stretch, unusable: _Bools, ends: tuple[int, int], window: float
) -> Part:
    """Return the samples between the ends whose window holds nothing unusable.

    Angle and torque go through one filter, as a linear law allows.
    """
    period = stretch.samples.period
    margin = window_length(window, period) // 2 + 1
    start, stop = ends
    if stop - start <= 2 * margin:
        return part_of(stretch, slice(0, 0))
    angle, torque = stretch.raw_angle[start:stop], stretch.torque[start:stop]
    smooth, velocity, acceleration, resistance = filter_alike(
        angle, torque, period, window
    )
    inner = slice(start + margin, stop - margin)
    reach = np.ones(2 * margin + 1)
    touched = np.convolve(unusable[start:stop], reach, mode="valid") > 0.5
    whole = Part(
        time=stretch.time[inner],
        angle=smooth,
        velocity=velocity,
        acceleration=acceleration,
        jerk=_slope(acceleration, period),
        torque=resistance,
        measured=stretch.torque[inner],
    )
    return whole.keep(~touched)


def part_of(stretch: Stretch, which: slice, *, anew: float | None = None) -> Part:
    """Return samples of a stretch with torque as measured.

    With `anew` the angle is smoothed within the part alone, by a window of so many
    seconds, so that it knows
    nothing of the motion beyond.
    """
    angle, velocity, acceleration = (
        values[which]
        for values in (stretch.angle, stretch.velocity, stretch.acceleration)
    )
    if anew is not None:
        angle, velocity, acceleration = differentiate(
            stretch.raw_angle[which], stretch.samples.period, anew
        )
    return Part(
        time=stretch.time[which],
        angle=angle,
        velocity=velocity,
        acceleration=acceleration,
        jerk=_slope(acceleration, stretch.samples.period),
        torque=stretch.torque[which],
        measured=stretch.torque[which],
    )


def _slope(values: _Floats, period: float) -> _Floats:
    return np.gradient(values, period) if values.size > 1 else np.zeros_like(values)
