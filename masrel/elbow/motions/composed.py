"""Movements made of others: a rest, a part, the way back, one after another."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise

import numpy as np

from masrel.elbow.motion import Floats, Motion
from masrel.elbow.piece import Piece
from masrel.elbow.polynomial import ONE, ZERO, exactly
from masrel.errors import ParameterError

__all__ = ["Hold", "Joined", "Part", "Reversed", "interrupted"]

_SAME_ANGLE = 1e-9
# rad: nearer angles are the same but for rounding, and movements join there


@dataclass(frozen=True, slots=True, kw_only=True)
class Hold:
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
        if not 0.0 <= self.start <= math.pi:
            raise ParameterError(
                f"start: needs 0 to 180 degrees, got {math.degrees(self.start):g}"
            )
        if not 0.0 < self.duration < math.inf:
            raise ParameterError(
                f"duration: needs more than 0 s and finite, got {self.duration:g}"
            )

    @property
    def end(self) -> float:
        """Where, rad."""
        return self.start

    def angle(self, time: Floats | float, origin: float = 0.0) -> Floats:
        """Angle, rad."""
        return np.full(np.shape(time), self.start - origin)

    def velocity(self, time: Floats | float) -> Floats:
        """Angular velocity, rad/s."""
        return np.zeros(np.shape(time))

    def acceleration(self, time: Floats | float) -> Floats:
        """Angular acceleration, rad/s²."""
        return np.zeros(np.shape(time))

    def pieces(self) -> Iterator[Piece]:
        """Give the one piece, a constant."""
        yield Piece(length=Decimal(self.duration), angle=(Decimal(self.start),))


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """What a movement does from one time to another, a `Motion`.

    Attributes
    ----------
    motion : Motion
        The whole.
    begin, finish : float
        Times of the whole, s.

    Raises
    ------
    ParameterError
        If the times are not in order within the movement.

    Examples
    --------
    A stretch stopped halfway:

    >>> from masrel.elbow import ConstantSpeed
    >>> whole = ConstantSpeed(start=0.5, end=2.5, speed=1.0)
    >>> Part(motion=whole, begin=0.0, finish=1.0).end
    1.5
    """

    motion: Motion
    begin: float
    finish: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.begin < self.finish <= self.motion.duration:
            raise ParameterError(
                "begin, finish: need 0 <= begin < finish <= "
                f"{self.motion.duration:g} s, the duration, got {self.begin:g} and "
                f"{self.finish:g} s"
            )

    @property
    def start(self) -> float:
        """Angle where it starts, rad."""
        return float(self.motion.angle(self.begin))

    @property
    def end(self) -> float:
        """Angle where it ends, rad."""
        return float(self.motion.angle(self.finish))

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return self.finish - self.begin

    def angle(self, time: Floats | float, origin: float = 0.0) -> Floats:
        """Angle at times since `begin`, rad."""
        return self.motion.angle(self._of_whole(time), origin)

    def velocity(self, time: Floats | float) -> Floats:
        """Angular velocity at times since `begin`, rad/s."""
        return self.motion.velocity(self._of_whole(time))

    def acceleration(self, time: Floats | float) -> Floats:
        """Angular acceleration at times since `begin`, rad/s²."""
        return self.motion.acceleration(self._of_whole(time))

    def _of_whole(self, time: Floats | float) -> Floats:
        return np.minimum(np.asarray(time) + self.begin, self.finish)

    def pieces(self) -> Iterator[Piece]:
        """Give the pieces of the whole between the times, the outer ones cut."""
        begin, finish = Decimal(self.begin), Decimal(self.finish)
        if self.finish == self.motion.duration:
            finish = Decimal("Infinity")  # the end itself, not its nearest float
        since = ZERO
        for piece in self.motion.pieces():
            low = max(ZERO, (begin - since) / piece.length)
            high = min(ONE, (finish - since) / piece.length)
            if low < high:
                whole = low == ZERO and high == ONE
                yield piece if whole else piece.part(low, high)
            since += piece.length
            if since >= finish:
                return


@dataclass(frozen=True, slots=True, kw_only=True)
class Reversed:
    """A movement the other way, a `Motion`: from its end to its start.

    Attributes
    ----------
    motion : Motion
        The movement forwards.

    Examples
    --------
    Flexion from 2.5 to 0.5 rad:

    >>> from masrel.elbow import ConstantSpeed
    >>> back = Reversed(motion=ConstantSpeed(start=0.5, end=2.5, speed=1.0))
    >>> back.start, float(back.angle(0.5)), float(back.velocity(0.5))
    (2.5, 2.0, -1.0)
    """

    motion: Motion

    @property
    def start(self) -> float:
        """Angle where it starts, rad."""
        return self.motion.end

    @property
    def end(self) -> float:
        """Angle where it ends, rad."""
        return self.motion.start

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return self.motion.duration

    def angle(self, time: Floats | float, origin: float = 0.0) -> Floats:
        """Angle at times within the duration, rad."""
        return self.motion.angle(self.motion.duration - np.asarray(time), origin)

    def velocity(self, time: Floats | float) -> Floats:
        """Angular velocity, rad/s."""
        return -self.motion.velocity(self.motion.duration - np.asarray(time))

    def acceleration(self, time: Floats | float) -> Floats:
        """Angular acceleration, rad/s²."""
        return self.motion.acceleration(self.motion.duration - np.asarray(time))

    def pieces(self) -> Iterator[Piece]:
        """Give the pieces from the last to the first, each backwards."""
        for piece in reversed(list(self.motion.pieces())):
            yield piece.part(ONE, ZERO)


class Joined:
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
        If there is none, or one starts elsewhere; the message says which.

    Examples
    --------
    There and back:

    >>> from masrel.elbow import ConstantSpeed
    >>> there = ConstantSpeed(start=0.5, end=2.5, speed=1.0)
    >>> both = Joined([there, Reversed(motion=there)])
    >>> both.duration, float(both.angle(3.0)), float(both.velocity(3.0))
    (4.0, 1.5, -1.0)
    """

    __slots__ = ("_low", "_starts", "duration", "motions")

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
        with exactly():
            starts = [ZERO]
            for motion in self.motions:
                starts.append(sum((p.length for p in motion.pieces()), starts[-1]))
            self.duration = float(starts.pop())
            self._starts = np.array([float(start) for start in starts])
            # what the floats leave of the exact starts
            self._low = [float(start - Decimal(float(start))) for start in starts]

    @property
    def start(self) -> float:
        """Angle where the first starts, rad."""
        return self.motions[0].start

    @property
    def end(self) -> float:
        """Angle where the last ends, rad."""
        return self.motions[-1].end

    def angle(self, time: Floats | float, origin: float = 0.0) -> Floats:
        """Angle at times within the duration, rad."""
        out = np.empty(np.shape(time))
        for motion, mine, local in self._places(time):
            out[mine] = motion.angle(local, origin)
        return out

    def velocity(self, time: Floats | float) -> Floats:
        """Angular velocity at times within the duration, rad/s."""
        out = np.empty(np.shape(time))
        for motion, mine, local in self._places(time):
            out[mine] = motion.velocity(local)
        return out

    def acceleration(self, time: Floats | float) -> Floats:
        """Angular acceleration at times within the duration, rad/s²."""
        out = np.empty(np.shape(time))
        for motion, mine, local in self._places(time):
            out[mine] = motion.acceleration(local)
        return out

    def _places(
        self, time: Floats | float
    ) -> Iterator[tuple[Motion, np.ndarray, Floats]]:
        # each movement, which of the times are its, and these since its start
        times = np.asarray(time, dtype=np.float64)
        at = np.searchsorted(self._starts, times, side="right") - 1
        for i, motion in enumerate(self.motions):
            mine = np.asarray(at == i)
            if mine.any():
                local = (times[mine] - self._starts[i]) - self._low[i]
                yield motion, mine, np.clip(local, 0.0, motion.duration)

    def pieces(self) -> Iterator[Piece]:
        """Give the pieces of every movement in turn."""
        for motion in self.motions:
            yield from motion.pieces()


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
    >>> from masrel.elbow import ConstantSpeed
    >>> stretch = ConstantSpeed(start=0.5, end=2.5, speed=1.0)
    >>> stopped = interrupted(stretch, at=0.5, pause=3.0)
    >>> stopped.duration, float(stopped.angle(2.0)), float(stopped.angle(4.0))
    (5.0, 1.0, 1.5)
    """
    first = Part(motion=motion, begin=0.0, finish=at)
    rest = Hold(start=first.end, duration=pause)
    last = Part(motion=motion, begin=at, finish=motion.duration)
    return Joined([first, rest, last])
