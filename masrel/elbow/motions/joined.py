"""Movements one after another."""

import math
from collections.abc import Iterator, Sequence
from decimal import Decimal
from itertools import pairwise

import numpy as np

from masrel.elbow.motion import Floats, Motion
from masrel.elbow.motions.hold import Hold
from masrel.elbow.motions.part import Part
from masrel.elbow.piece import Piece
from masrel.elbow.polynomial import ZERO, exactly
from masrel.errors import ParameterError

__all__ = ["Joined", "interrupted"]

_SAME_ANGLE = 1e-9
# rad: nearer angles are the same but for rounding, and movements join there


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

    >>> from masrel.elbow import ConstantSpeed, Reversed
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
