"""Movements made of others: a part, the way back, one after another."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from operator import attrgetter

from masrel.errors import ParameterError
from masrel.lab.elbow._motion import Motion, Piece, Rows, piece_of, rows_of
from masrel.lab.elbow._polynomials import reversed_from, shifted
from masrel.lab.elbow.motions._prescribed import Hold

__all__ = ["Joined", "Part", "Reversed", "interrupted"]

_SAME_ANGLE = 1e-9
# rad: nearer angles are the same but for rounding, and movements join there


@dataclass(frozen=True, slots=True, kw_only=True)
class Part(Motion):
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

    >>> from masrel.lab.elbow import ConstantSpeed
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

    origin = property(attrgetter("motion.origin"), doc=Motion.origin.__doc__)

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

    def pieces(self) -> list[Piece]:
        """Return the pieces of the whole between the times, the outer ones cut."""
        cut = []
        for piece in self.motion.pieces():
            low = max(self.begin - piece.start, 0.0)
            high = min(self.finish - piece.start, piece.length)
            start = max(piece.start - self.begin, 0.0)
            if low == 0.0 and high == piece.length:
                cut.append(piece._replace(start=start))
            elif low < high:
                cut.append(piece_of(start, high - low, shifted(piece.angle, low)))
        return cut


@dataclass(frozen=True, slots=True, kw_only=True)
class Reversed(Motion):
    """A movement the other way, a `Motion`: from its end to its start.

    Attributes
    ----------
    motion : Motion
        The movement forwards.

    Examples
    --------
    Flexion from 2.5 to 0.5 rad:

    >>> from masrel.lab.elbow import ConstantSpeed
    >>> back = Reversed(motion=ConstantSpeed(start=0.5, end=2.5, speed=1.0))
    >>> back.start, float(back.angle(0.5)), float(back.velocity(0.5))
    (2.5, 2.0, -1.0)
    """

    motion: Motion

    origin = property(attrgetter("motion.origin"), doc=Motion.origin.__doc__)

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

    def pieces(self) -> list[Piece]:
        """Return the pieces from the last to the first, each backwards."""
        start, back = 0.0, []
        for piece in reversed(self.motion.pieces()):
            angle = reversed_from(piece.angle, piece.length)
            back.append(
                Piece(start, piece.length, angle, -piece.fastest, -piece.slowest)
            )
            start = max(self.motion.duration - piece.start, start)
        return back


class Joined(Motion):
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

    >>> from masrel.lab.elbow import ConstantSpeed, Reversed
    >>> there = ConstantSpeed(start=0.5, end=2.5, speed=1.0)
    >>> both = Joined([there, Reversed(motion=there)])
    >>> both.duration, float(both.angle(3.0)), float(both.velocity(3.0))
    (4.0, 1.5, -1.0)
    """

    __slots__ = ("_duration", "_pieces", "_rows", "motions")

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
        self._duration = 0.0
        self._pieces: list[Piece] = []
        for motion in self.motions:
            offset = motion.origin - self.origin
            self._pieces += [
                piece._replace(
                    start=self._duration + piece.start,
                    angle=(piece.angle[0] + offset, *piece.angle[1:]),
                )
                for piece in motion.pieces()
            ]
            self._duration += motion.duration
        self._rows = rows_of(self._pieces)

    @property
    def origin(self) -> float:
        """Angle the pieces count from, rad."""
        return float(self.motions[0].origin)

    @property
    def start(self) -> float:
        """Angle where the first starts, rad."""
        return self.motions[0].start

    @property
    def end(self) -> float:
        """Angle where the last ends, rad."""
        return self.motions[-1].end

    @property
    def duration(self) -> float:
        """How long they take together, s."""
        return self._duration

    def pieces(self) -> list[Piece]:
        """Return the pieces of every movement in turn."""
        return self._pieces

    def rows(self) -> Rows:
        """Return the pieces as arrays."""
        return self._rows


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
