"""A recorded movement of a joint in SI units, and what makes it plausible."""

import math
import warnings
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.errors import RecordingError, RecordingWarning

__all__ = ["Movement"]

Floats = NDArray[np.float64]

FEWEST_SAMPLES = 50
"""Shorter is no stretch at any rate that is allowed."""

SLOWEST_RATE_HZ, FASTEST_RATE_HZ = 50.0, 100_000.0
"""Below the first, nothing is left of a peak of 0.1 s; above the second, no evaluator
works."""

ANGLE_RANGE = (math.radians(-30.0), math.radians(210.0))
"""An elbow's range with room for a goniometer that is not zeroed, rad."""

LEAST_TRAVEL = math.radians(15.0)
"""A movement of less is no stretch, rad."""

LARGEST_TORQUE = 100.0
"""No manual stretch of an elbow asks for more, N·m."""

SATURATED_RUN = 10
"""So many equal samples in a row, at the largest torque and nowhere else, are a
sensor at the end of its range."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Movement:
    """Angle and torque of a joint that somebody moves, as recorded.

    Attributes
    ----------
    name : str
        Where it is from: the file.
    time : ndarray, shape (n_samples,)
        Strictly increasing times, s; they need not be even.
    angle : ndarray, shape (n_samples,)
        Angle, 0 at full flexion, growing with extension, rad.
    torque : ndarray, shape (n_samples,)
        Torque that resists extension, N·m.
    velocity : ndarray, shape (n_samples,), or None
        Angular velocity, rad/s. It is compared with the angle's derivative, no more.
    saturated : ndarray of bool, shape (n_samples,)
        Samples at which the torque sensor is at the end of its range.
    simulated : bool
        Whether no joint and no hand was there.
    sha256 : str or None
        Checksum of the file, if it is from one.

    Raises
    ------
    RecordingError
        If the columns differ in length, hold what is not finite, time does not
        increase, or angle and torque cannot be what they are said to be.

    Warns
    -----
    RecordingWarning
        If the torque looks saturated.
    """

    name: str
    time: Floats = field(compare=False, repr=False)
    angle: Floats = field(compare=False, repr=False)
    torque: Floats = field(compare=False, repr=False)
    velocity: Floats | None = field(default=None, compare=False, repr=False)
    saturated: NDArray[np.bool_] = field(init=False, compare=False, repr=False)
    simulated: bool = False
    sha256: str | None = None

    def __post_init__(self) -> None:
        columns = [self.time, self.angle, self.torque]
        if self.velocity is not None:
            columns.append(self.velocity)
        if len({column.shape for column in columns}) != 1 or self.time.ndim != 1:
            raise RecordingError(
                f"{self.name}: columns need one length, got shapes "
                f"{', '.join(str(column.shape) for column in columns)}"
            )
        if not all(np.isfinite(column).all() for column in columns):
            raise RecordingError(f"{self.name}: columns need finite numbers")
        _check_time(self.name, self.time)
        _check_sizes(self.name, self.angle, self.torque)
        object.__setattr__(self, "saturated", _saturated(self.name, self.torque))
        for column in (*columns, self.saturated):
            column.setflags(write=False)


def _check_time(name: str, time: Floats) -> None:
    if time.size < FEWEST_SAMPLES:
        raise RecordingError(
            f"{name}: needs at least {FEWEST_SAMPLES} samples, got {time.size}"
        )
    steps = np.diff(time)
    if not (steps > 0.0).all():
        at = int(np.argmax(steps <= 0.0))
        raise RecordingError(
            f"{name}: time must increase, got {time[at + 1]:.9g} s after "
            f"{time[at]:.9g} s (samples {at} and {at + 1}, counted from 0)"
        )
    rate = 1.0 / float(np.median(steps))
    if not SLOWEST_RATE_HZ <= rate <= FASTEST_RATE_HZ:
        raise RecordingError(
            f"{name}: needs {SLOWEST_RATE_HZ:g} to {FASTEST_RATE_HZ:g} samples a "
            f"second, got {rate:.3g}; is the unit of time right?"
        )


def _check_sizes(name: str, angle: Floats, torque: Floats) -> None:
    low, high = math.degrees(angle.min()), math.degrees(angle.max())
    largest = float(np.abs(torque).max())
    said = f"{name}: got angles from {low:.4g} to {high:.4g} degrees and torques "
    said += f"to {largest:.4g} N·m"
    if largest > LARGEST_TORQUE:
        if high - low < math.degrees(LEAST_TRAVEL) or largest < 180.0:
            raise RecordingError(
                f"{said}; are the columns of angle and torque swapped?"
            )
        raise RecordingError(f"{said}; is the unit of torque right?")
    if angle.min() < ANGLE_RANGE[0] or angle.max() > ANGLE_RANGE[1]:
        raise RecordingError(f"{said}; is the unit of the angle right?")
    if angle.max() - angle.min() < LEAST_TRAVEL:
        needed = math.degrees(LEAST_TRAVEL)
        raise RecordingError(
            f"{said}; a stretch travels {needed:g} degrees or more. Is the unit of the "
            "angle right, and is its column not the torque's?"
        )


def _saturated(name: str, torque: Floats) -> NDArray[np.bool_]:
    # samples of long runs at the largest or smallest torque; long runs elsewhere too
    # mean a coarse or noise-free sensor, not a saturated one
    starts = np.flatnonzero(np.diff(torque, prepend=np.nan) != 0.0)
    lengths = np.diff(starts, append=torque.size)
    long = lengths >= SATURATED_RUN
    extreme = np.isin(torque[starts], (torque.min(), torque.max()))
    extreme &= np.abs(torque[starts]) >= 0.5 * np.abs(torque).max()
    if not (long & extreme).any() or (long & ~extreme).any():
        return np.zeros(torque.size, dtype=np.bool_)
    marked = np.repeat(extreme, lengths)
    limits = ", ".join(f"{value:.4g}" for value in np.unique(torque[marked]))
    warnings.warn(
        f"{name}: the torque stays at {limits} N·m for {int(marked.sum())} samples: "
        "the sensor is saturated; these samples are left out, and a stretch whose "
        "peak they cut off gives no H and Q",
        RecordingWarning,
        stacklevel=4,
    )
    return marked
