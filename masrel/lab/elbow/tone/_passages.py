"""A motion as parts that go one way, and when something is first reached on them."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from masrel.lab.elbow._motion import Motion
from masrel.lab.elbow._polynomials import (
    Number,
    Polynomial,
    derivative,
    shifted,
    split_at_roots,
    value,
)

_SAME_TIME = 1e-12  # s: nearer times are the same but for rounding
_SLACK = 1e-12  # rad, rad/s: by so little less than 0 is 0 but for rounding


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


def one_way(motion: Motion) -> Iterator[OneWay]:
    """Give the parts of a motion that go one way, in order."""
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


def movements(motion: Motion, speed: float) -> list[tuple[float, float]]:
    """Return between which times the arm goes one way at least so fast, s."""
    extends = spans(motion, lambda part: part.faster(speed, 1))
    return sorted(extends + spans(motion, lambda part: part.faster(speed, -1)))


def negative(level: Sequence[Number]) -> Polynomial:
    """Return what is 0 or more where a polynomial is 0 or less."""
    return [-c for c in level]


def _is_met(level: Polynomial, place: float) -> bool:
    # 0 or more, but for rounding
    return bool(value(level, place) >= -_SLACK)
