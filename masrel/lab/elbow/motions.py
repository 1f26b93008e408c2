"""Movements of the arm: rows of polynomial pieces, and where they reach what.

Kinds are given by a formula or by samples, and made of others. The formulas of single
stretches take columns in place of their numbers too.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, wraps
from itertools import pairwise
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel._input import check_option, refuse
from masrel.errors import ParameterError
from masrel.lab.elbow._polynomials import (
    Number,
    Polynomial,
    bernstein,
    derivative,
    reversed_from,
    shifted,
    some,
    split_at_roots,
    value,
)

__all__ = [
    "ConstantSpeed",
    "Hold",
    "Interpolation",
    "Joined",
    "MinimumJerk",
    "Motion",
    "Part",
    "Recorded",
    "Reversed",
    "Trapezoid",
    "interrupted",
]

Floats = NDArray[np.float64]


_SAME_ANGLE = 1e-9
# rad: nearer angles are the same but for rounding, and movements join there

Interpolation = Literal["pchip", "linear"]
"""What lies between two samples: a cubic that never overshoots, or a line."""

_UNITS = {"speed": "deg/s", "mean_speed": "deg/s", "acceleration_rate": "deg/s²"}

_SAME_TIME = 1e-12  # s: nearer times are the same but for rounding
_SLACK = 1e-12  # rad, rad/s: by so little less than 0 is 0 but for rounding


class Piece(NamedTuple):
    """A time in which the angle is a polynomial of at most fifth degree."""

    start: float  # s
    length: float  # s
    angle: Polynomial  # rad from the motion's origin, over s since the start
    # between these the speed is, rad/s
    slowest: float
    fastest: float


class Rows(NamedTuple):
    """The same pieces as arrays."""

    start: Floats  # (n_pieces,), s
    angle: Floats  # (n_coefficients, n_pieces)


def rows_of(pieces: Sequence[Piece]) -> Rows:
    """Return some pieces as arrays."""
    width = max(len(piece.angle) for piece in pieces)
    padded = [[*p.angle, *[0.0] * (width - len(p.angle))] for p in pieces]
    return Rows(np.array([p.start for p in pieces]), np.array(padded).T)


class Motion(ABC):
    """A movement as a function of time, made of polynomial pieces; SI units.

    It may go either way and rest. Samples, events and loads come from its pieces.
    """

    __slots__ = ()

    # Every kind has these, as fields or properties of its own; a property here would be
    # the default of a field.
    if TYPE_CHECKING:

        @property
        def start(self) -> float:
            """Angle where it starts, rad."""

        @property
        def end(self) -> float:
            """Angle where it ends, rad."""

        @property
        def duration(self) -> float:
            """How long it takes, s."""

    @property
    def origin(self) -> float:
        """Angle the pieces count from, rad."""
        return self.start

    @abstractmethod
    def pieces(self) -> Sequence[Piece]:
        """Return the pieces in order of time."""

    def rows(self) -> Rows:
        """Return the pieces as arrays."""
        return rows_of(self.pieces())

    def angle(self, time: Floats | float, origin: float = 0.0) -> Floats:
        """Return angles at times within the duration.

        Parameters
        ----------
        time : float or ndarray of any shape
            Times, s.
        origin : float, optional
            Angle to count from, rad. A difference of near angles keeps its digits so,
            which it would lose if `origin` were subtracted afterwards.

        Returns
        -------
        ndarray, shape of `time`
            Angles, rad; the same bits for one time as for many at once.
        """
        first, travel = self._at(time, 0)
        return np.asarray(((self.origin - origin) + first) + travel)

    def velocity(self, time: Floats | float) -> Floats:
        """Return angular velocities at times within the duration.

        Parameters
        ----------
        time : float or ndarray of any shape
            Times, s.

        Returns
        -------
        ndarray, shape of `time`
            Velocities, rad/s, positive in extension; at a jump, the later one.
        """
        return self._at(time, 1)[1]

    def acceleration(self, time: Floats | float) -> Floats:
        """Return angular accelerations at times within the duration.

        Parameters
        ----------
        time : float or ndarray of any shape
            Times, s.

        Returns
        -------
        ndarray, shape of `time`
            Accelerations, rad/s²; at a jump, the later one.
        """
        return self._at(time, 2)[1]

    def _at(self, time: Floats | float, order: int) -> tuple[Floats, Floats]:
        # where the piece of each time begins, rad, and what came since, or a derivative
        rows, times = self.rows(), np.asarray(time)
        place = np.maximum(np.searchsorted(rows.start, times, side="right") - 1, 0)
        since, total = times - rows.start[place], np.zeros(times.shape)
        p: Polynomial = [*0.0 * rows.angle[:1], *rows.angle[1:]]
        for _ in range(order):
            p = derivative(p)
        for column in p[::-1]:
            if np.ndim(column):
                total = total * since + column[place]
        return rows.angle[0][place], total


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stretch(Motion):
    """From one angle to a larger one, at speeds that move the arm."""

    start: float
    end: float

    def __post_init__(self) -> None:
        start, end = self.start, self.end
        if not 0.0 <= start < end <= math.pi:
            raise ParameterError(
                "start, end: need 0 <= start < end <= 180 degrees, got "
                f"{math.degrees(start):g} and {math.degrees(end):g} degrees"
            )
        for name in self.__slots__:  # those that a kind adds
            rate, unit = getattr(self, name), _UNITS[name]
            came = f"got {math.degrees(rate):g} {unit}"
            refuse(
                (
                    not 0.0 < rate < math.inf,
                    f"{name}: needs more than 0 and finite, {came}",
                ),
                (
                    not 1e-30 <= rate <= 1e30,  # whose tenth powers a float holds
                    f"{name}: needs a rate that some motion has, 1e-28 to 1e31 {unit}, "
                    f"{came}",
                ),
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class ConstantSpeed(_Stretch):
    """A stretch at one speed from the first instant to the last, a `Motion`.

    Attributes
    ----------
    start, end : float
        Angles, rad.
    speed : float
        Angular speed, rad/s.

    Raises
    ------
    ParameterError
        If the angles are not in order within 0 to 180 degrees, or the speed is not
        more than 0, or beyond 1e-30 to 1e30 rad/s.

    Examples
    --------
    >>> ConstantSpeed(start=0.5, end=2.5, speed=1.0).duration
    2.0
    """

    speed: float

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return (self.end - self.start) / self.speed

    def pieces(self) -> list[Piece]:
        """Return the one piece, a line."""
        speed = self.speed
        return [Piece(0.0, self.duration, (0.0, speed), speed, speed)]


@dataclass(frozen=True, slots=True, kw_only=True)
class MinimumJerk(_Stretch):
    """A stretch from rest to rest with the least squared jerk, a `Motion`.

    Attributes
    ----------
    start, end : float
        Angles, rad.
    mean_speed : float
        Travel over duration, rad/s; the peak speed is 1.875 times that.

    Raises
    ------
    ParameterError
        As of `ConstantSpeed`.

    References
    ----------
    .. [1] Flash, T., Hogan, N. (1985). The coordination of arm movements. Journal
       of Neuroscience, 5(7), 1688-1703.
       https://doi.org/10.1523/JNEUROSCI.05-07-01688.1985

    Examples
    --------
    >>> motion = MinimumJerk(start=0.5, end=2.5, mean_speed=1.0)
    >>> float(motion.velocity(1.0))
    1.875
    """

    mean_speed: float

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return (self.end - self.start) / self.mean_speed

    def pieces(self) -> list[Piece]:
        """Return the two halves of the quintic of [1].

        Its 10 s³ - 15 s⁴ + 6 s⁵, s the share of the time, is 1/2 + 15/8 x - 5 x³ + 6 x⁵
        with x = s - 1/2, which keeps its digits to the end.
        """
        way, fastest = self.end - self.start, 1.875 * self.mean_speed
        length = self.duration
        third = way / length / length / length
        fifth, half = third / length / length, 0.5 * length
        first = (0.0, 0.0, 0.0, 10.0 * third, -15.0 * third / length, 6.0 * fifth)
        second = (0.5 * way, fastest, 0.0, -5.0 * third, 0.0, 6.0 * fifth)
        return [
            Piece(0.0, half, first, 0.0, fastest),
            Piece(half, half, second, 0.0, fastest),
        ]


@dataclass(frozen=True, slots=True, kw_only=True)
class Trapezoid(_Stretch):
    """A stretch from rest to rest with a trapezoidal speed, a `Motion`.

    Attributes
    ----------
    start, end : float
        Angles, rad.
    speed : float
        Angular speed between the ramps, rad/s.
    acceleration_rate : float
        How fast the speed grows at the start and falls at the end, rad/s².

    Raises
    ------
    ParameterError
        As of `ConstantSpeed`, or if the way is too short to reach the speed: both
        ramps together take speed²/acceleration_rate.

    Examples
    --------
    Ramps of 0.5 s and 0.25 rad each, and 1.5 rad between them:

    >>> Trapezoid(start=0.5, end=2.5, speed=1.0, acceleration_rate=2.0).duration
    2.5
    """

    speed: float
    acceleration_rate: float

    def __post_init__(self) -> None:
        _Stretch.__post_init__(self)
        way = self.end - self.start
        if self.speed**2 > way * self.acceleration_rate * (1.0 + 1e-15):
            min_rate = np.degrees(self.speed**2 / way)
            raise ParameterError(
                f"acceleration_rate: needs {min_rate:g} deg/s² or more to reach "
                f"{np.degrees(self.speed):g} deg/s on the way, got "
                f"{np.degrees(self.acceleration_rate):g} deg/s²"
            )

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        ramp = self.speed / self.acceleration_rate
        return (self.end - self.start) / self.speed + ramp

    def pieces(self) -> list[Piece]:
        """Return the ramp up, the line, if there is one, and the ramp down."""
        way, speed, rate = self.end - self.start, self.speed, self.acceleration_rate
        ramp = speed / rate
        rise, level = 0.5 * speed * ramp, way / speed - ramp
        pieces = [
            Piece(0.0, ramp, (0.0, 0.0, 0.5 * rate), 0.0, speed),
            Piece(ramp, level, (rise, speed), speed, speed),
            Piece(ramp + level, ramp, (way - rise, speed, -0.5 * rate), 0.0, speed),
        ]
        return [piece for piece in pieces if some(piece.length > 0.0)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Hold(Motion):
    """An arm held still, a `Motion`.

    Attributes
    ----------
    start : float
        Where, rad.
    duration : float
        How long, s.

    Raises
    ------
    ParameterError
        If the angle is outside 0 to 180 degrees, or the duration is not more than 0.

    Examples
    --------
    >>> float(Hold(start=0.5, duration=2.0).velocity(1.0))
    0.0
    """

    start: float
    duration: float

    def __post_init__(self) -> None:
        refuse(
            (
                not 0.0 <= self.start <= math.pi,
                f"start: needs 0 to 180 degrees, got {math.degrees(self.start):g}",
            ),
            (
                not 0.0 < self.duration < math.inf,
                f"duration: needs more than 0 s and finite, got {self.duration:g}",
            ),
        )

    @property
    def end(self) -> float:
        """Where, rad."""
        return self.start

    def pieces(self) -> list[Piece]:
        """Return the one piece, a constant."""
        return [Piece(0.0, self.duration, (0.0,), 0.0, 0.0)]


class _Laid(Motion):
    """A movement whose pieces are laid out once."""

    __slots__ = ("_pieces", "_rows", "duration", "end", "origin", "start")

    start: float
    end: float
    origin: float
    duration: float
    _pieces: list[Piece]
    _rows: Rows

    def pieces(self) -> list[Piece]:
        """Return the pieces in order of time."""
        return self._pieces

    def rows(self) -> Rows:
        """Return the pieces as arrays."""
        return self._rows


class Recorded(_Laid):
    """A movement given by samples, evenly spaced or not, a `Motion`.

    Parameters
    ----------
    time : array_like, shape (n_samples,)
        Times, s, each after the one before. The motion begins at the first.
    angle : array_like, shape (n_samples,)
        Angles, rad.
    interpolation : {"pchip", "linear"}, optional
        Between two samples the angle is a cubic whose slopes at the samples are those
        of [1], so that it is monotone where the samples are, or a line.

    Attributes
    ----------
    interpolation : {"pchip", "linear"}
        As asked.

    Raises
    ------
    ParameterError
        If there are fewer than two samples, not as many times as angles, or one that
        is not finite, not in order, or outside 0 to 180 degrees; the message names the
        row, the first being 1.

    References
    ----------
    .. [1] Fritsch, F. N., Butland, J. (1984). A method for constructing local monotone
       piecewise cubic interpolants. SIAM Journal on Scientific and Statistical
       Computing, 5(2), 300-304. https://doi.org/10.1137/0905021

    Examples
    --------
    >>> motion = Recorded(time=[10.0, 11.0, 13.0], angle=[0.5, 1.0, 2.5])
    >>> motion.duration, float(motion.angle(1.0))
    (3.0, 1.0)
    """

    __slots__ = ("interpolation",)

    def __init__(
        self,
        *,
        time: ArrayLike,
        angle: ArrayLike,
        interpolation: Interpolation = "pchip",
    ) -> None:
        check_option("interpolation", interpolation, ("pchip", "linear"))
        times, angles = _checked(time, angle)
        self.interpolation = interpolation
        knots, low = times - times[0], angles - angles[0]
        self.start, self.end = float(angles[0]), float(angles[-1])
        self.origin, self.duration = self.start, float(knots[-1])
        width = np.diff(knots)
        # θ - θ_0 over u, the time since sample i, constant first
        coefficients = np.stack([low[:-1], np.diff(low) / width])
        if interpolation == "pchip":
            from scipy.interpolate import PchipInterpolator  # of recordings alone

            coefficients = PchipInterpolator(knots, low).c[::-1]
        self._rows = Rows(knots[:-1], coefficients)
        speeds = bernstein(derivative(list(coefficients)), width)
        slowest, fastest = np.min(speeds, axis=0), np.max(speeds, axis=0)
        columns = (self._rows.start, width, coefficients.T, slowest, fastest)
        rows = zip(*(column.tolist() for column in columns), strict=True)
        self._pieces = list(map(Piece._make, rows))


def _checked(time: ArrayLike, angle: ArrayLike) -> tuple[Floats, Floats]:
    times = np.array(time, dtype=np.float64)
    angles = np.array(angle, dtype=np.float64)
    if times.ndim != 1 or times.shape != angles.shape or times.size < 2:
        raise ParameterError(
            "time, angle: need two or more samples and as many times as angles, got "
            f"shapes {times.shape} and {angles.shape}"
        )
    for name, column in (("time", times), ("angle", angles)):
        _refuse(~np.isfinite(column), f"{name}: needs finite numbers", column)
    behind = np.diff(times, prepend=-np.inf) <= 1e-30
    _refuse(behind, "time: needs to grow from sample to sample", times)
    outside = (angles < 0.0) | (angles > np.pi)
    _refuse(outside, "angle: needs 0 to 180 degrees", np.degrees(angles))
    return times, angles


def _refuse(wrong: np.ndarray, needed: str, values: Floats) -> None:
    if wrong.any():
        row = int(wrong.argmax())
        raise ParameterError(f"{needed}, got {values[row]:g} in sample {row + 1}")


class Part(_Laid):
    """What a movement does from one time to another, a `Motion`.

    Parameters
    ----------
    motion : Motion
        The whole.
    begin, finish : float
        Times of the whole, s.

    Attributes
    ----------
    motion, begin, finish
        As given.

    Raises
    ------
    ParameterError
        If the times are not in order within the movement.

    Examples
    --------
    A stretch stopped halfway:

    >>> from masrel.lab.elbow import ConstantSpeed
    >>> whole = ConstantSpeed(start=0.5, end=2.5, speed=1.0)
    >>> Part(motion=whole, begin=0.0, finish=1.0).end
    1.5
    """

    __slots__ = ("begin", "finish", "motion")

    def __init__(self, *, motion: Motion, begin: float, finish: float) -> None:
        if not 0.0 <= begin < finish <= motion.duration:
            raise ParameterError(
                f"begin, finish: need 0 <= begin < finish <= {motion.duration:g} s, "
                f"the duration, got {begin:g} and {finish:g} s"
            )
        self.motion, self.begin, self.finish = motion, begin, finish
        self.start, self.end = float(motion.angle(begin)), float(motion.angle(finish))
        self.origin, self.duration = motion.origin, finish - begin
        self._pieces = []
        for piece in motion.pieces():  # those between the times, the outer ones cut
            low = max(begin - piece.start, 0.0)
            high = min(finish - piece.start, piece.length)
            start = max(piece.start - begin, 0.0)
            if low == 0.0 and high == piece.length:
                self._pieces.append(piece._replace(start=start))
            elif low < high:
                angle = shifted(piece.angle, low)
                speeds = bernstein(derivative(angle), high - low)
                cut = Piece(start, high - low, angle, min(speeds), max(speeds))
                self._pieces.append(cut)
        self._rows = rows_of(self._pieces)


class Reversed(_Laid):
    """A movement the other way, a `Motion`: from its end to its start.

    Parameters
    ----------
    motion : Motion
        The movement forwards.

    Attributes
    ----------
    motion : Motion
        As given.

    Examples
    --------
    Flexion from 2.5 to 0.5 rad:

    >>> from masrel.lab.elbow import ConstantSpeed
    >>> back = Reversed(motion=ConstantSpeed(start=0.5, end=2.5, speed=1.0))
    >>> back.start, float(back.angle(0.5)), float(back.velocity(0.5))
    (2.5, 2.0, -1.0)
    """

    __slots__ = ("motion",)

    def __init__(self, *, motion: Motion) -> None:
        self.motion, self.origin = motion, motion.origin
        self.start, self.end, self.duration = motion.end, motion.start, motion.duration
        start, self._pieces = 0.0, []
        for begin, length, angle, slowest, fastest in reversed(motion.pieces()):
            back = reversed_from(angle, length)
            self._pieces.append(Piece(start, length, back, -fastest, -slowest))
            start = max(motion.duration - begin, start)
        self._rows = rows_of(self._pieces)


class Joined(_Laid):
    """Movements one after another, a `Motion`.

    Parameters
    ----------
    motions : sequence of Motion
        The movements; each starts where the one before ends.

    Attributes
    ----------
    motions : tuple of Motion
        The movements.

    Raises
    ------
    ParameterError
        If there are no motions, or one starts elsewhere; the message says which.

    Examples
    --------
    There and back:

    >>> from masrel.lab.elbow import ConstantSpeed, Reversed
    >>> there = ConstantSpeed(start=0.5, end=2.5, speed=1.0)
    >>> both = Joined([there, Reversed(motion=there)])
    >>> both.duration, float(both.angle(3.0)), float(both.velocity(3.0))
    (4.0, 1.5, -1.0)
    """

    __slots__ = ("motions",)

    def __init__(self, motions: Sequence[Motion]) -> None:
        self.motions = tuple(motions)
        if not self.motions:
            raise ParameterError("motions: needs one or more, got none")
        for i, (one, other) in enumerate(pairwise(self.motions)):
            if abs(one.end - other.start) > _SAME_ANGLE:
                raise ParameterError(
                    f"motions[{i + 1}]: needs to start at {math.degrees(one.end):g} "
                    "degrees, where the one before ends, got "
                    f"{math.degrees(other.start):g} degrees"
                )
        self.start, self.end = self.motions[0].start, self.motions[-1].end
        self.origin = self.motions[0].origin
        self.duration, self._pieces = 0.0, []
        for motion in self.motions:
            offset = motion.origin - self.origin
            self._pieces += [
                piece._replace(
                    start=self.duration + piece.start,
                    angle=(piece.angle[0] + offset, *piece.angle[1:]),
                )
                for piece in motion.pieces()
            ]
            self.duration += motion.duration
        self._rows = rows_of(self._pieces)


def interrupted(motion: Motion, *, at: float, pause: float) -> Joined:
    """Stop a movement at once, hold the arm, and go on as if nothing had been.

    Parameters
    ----------
    motion : Motion
        The movement.
    at : float
        When it is stopped, s; within its duration.
    pause : float
        How long the arm is held, s.

    Returns
    -------
    Joined
        The movement with its rest.

    Raises
    ------
    ParameterError
        If `at` is not within the movement, or `pause` is not more than 0.

    Examples
    --------
    >>> from masrel.lab.elbow import ConstantSpeed
    >>> stretch = ConstantSpeed(start=0.5, end=2.5, speed=1.0)
    >>> stopped = interrupted(stretch, at=0.5, pause=3.0)
    >>> stopped.duration, float(stopped.angle(2.0)), float(stopped.angle(4.0))
    (5.0, 1.0, 1.5)
    """
    first = Part(motion=motion, begin=0.0, finish=at)
    rest = Hold(start=first.end, duration=pause)
    last = Part(motion=motion, begin=at, finish=motion.duration)
    return Joined([first, rest, last])


@dataclass(frozen=True, slots=True)
class OneWay:
    """A part of a motion in which the arm extends (1), flexes (-1) or rests (0)."""

    start: float  # s
    length: float  # s
    angle: Polynomial  # rad, over s since its start
    direction: int

    @property
    def end(self) -> float:
        """When it ends, s."""
        return self.start + self.length

    def angle_at(self, time: Number) -> Number:
        """Return the angle at one or many times of the part, rad."""
        return value(self.angle, time - self.start)

    def beyond(self, angle: float, lead: float = 0.0) -> Polynomial:
        """Return θ + lead·ω less an angle, rad."""
        over = [self.angle[0] - angle, *self.angle[1:]]
        for i, speed in enumerate(derivative(self.angle) if lead else ()):
            over[i] += lead * speed
        return over

    def faster(self, speed: float, way: int) -> Polynomial:
        """Return ω one way less a speed, rad/s."""
        over = [way * c for c in derivative(self.angle)]
        over[0] -= speed
        return over

    def reached(self, *levels: Polynomial, after: float = -math.inf) -> float | None:
        """Return when all polynomials are first 0 or more; None if never.

        Not before the time `after`, which counts itself.
        """
        first = max(0.0, after - self.start)
        places = {
            place for level in levels for place in split_at_roots(level, self.length)
        }
        for place in sorted({first, *places}):
            if place >= first and all(_is_met(level, place) for level in levels):
                return self.start + place
        return None


_Found = TypeVar("_Found")


def _once_per_laid(find: Callable[..., _Found]) -> Callable[..., _Found]:
    # a fit asks the same of a recording some thousand times
    kept = lru_cache(maxsize=64)(find)

    @wraps(find)
    def found(motion: Motion, *args: float) -> _Found:
        return (kept if isinstance(motion, _Laid) else find)(motion, *args)

    return found


@_once_per_laid
def one_way(motion: Motion) -> tuple[OneWay, ...]:
    """Return the parts of a motion that go one way, in order."""
    return tuple(_one_way(motion))


def _one_way(motion: Motion) -> Iterator[OneWay]:
    for piece in motion.pieces():
        angle = [motion.origin + piece.angle[0], *piece.angle[1:]]
        for low, high in pairwise(split_at_roots(derivative(angle), piece.length)):
            part = shifted(angle, low) if low else angle
            travel = value(part, high - low) - part[0]
            direction = 0 if abs(travel) < _SLACK else (1 if travel > 0.0 else -1)
            yield OneWay(piece.start + low, high - low, part, direction)


def spans(
    motion: Motion, level: Callable[[OneWay], Polynomial]
) -> list[tuple[float, float]]:
    """Return between which times a polynomial of each part is 0 or more, s."""
    result: list[tuple[float, float]] = []
    for part in one_way(motion):
        values = level(part)
        for low, high in pairwise(split_at_roots(values, part.length)):
            if not _is_met(values, 0.5 * (low + high)):
                continue
            begun, until = part.start + low, part.start + high
            if result and begun - result[-1][1] < _SAME_TIME:
                result[-1] = (result[-1][0], until)
            else:
                result.append((begun, until))
    return result


@_once_per_laid
def movements(motion: Motion, speed: float) -> tuple[tuple[float, float], ...]:
    """Return between which times the arm goes one way at least so fast, s."""
    extends = spans(motion, lambda part: part.faster(speed, 1))
    flexes = spans(motion, lambda part: part.faster(speed, -1))
    return tuple(sorted(extends + flexes))


def latched(
    motion: Motion,
    closes: Callable[[OneWay], Sequence[Polynomial]],
    opens: Callable[[float], float],
) -> list[tuple[float, float]]:
    """Return between which times a latch is closed, s; the last may never open.

    It closes where all polynomials of a part are 0 or more, and opens where the arm is
    back at an angle, of the farthest that it has been since, rad.
    """
    result: list[tuple[float, float]] = []
    closed: float | None = None
    farthest = -math.inf
    for part in one_way(motion):
        since = part.start
        if closed is not None and part.direction < 0:
            opened = part.reached([-c for c in part.beyond(opens(farthest))])
            if opened is not None:
                result.append((closed, opened))
                closed, since, farthest = None, opened, -math.inf
        if closed is None:
            closed = part.reached(*closes(part), after=since)
        if closed is not None and part.direction > 0:
            farthest = max(farthest, float(part.angle_at(part.end)))
    return result if closed is None else [*result, (closed, math.inf)]


def _is_met(level: Polynomial, place: float) -> bool:
    # 0 or more, but for rounding
    return bool(value(level, place) >= -_SLACK)
