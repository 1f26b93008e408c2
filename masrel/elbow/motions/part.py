"""What another movement does for a while, or the other way."""

from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal

import numpy as np

from masrel.elbow.motion import Floats, Motion
from masrel.elbow.piece import Piece
from masrel.elbow.polynomial import ONE, ZERO
from masrel.errors import ParameterError

__all__ = ["Part", "Reversed"]


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
