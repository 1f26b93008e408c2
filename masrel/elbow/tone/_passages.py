"""A motion as parts that go one way, and when something is first reached on them."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.polynomial import polynomial

from masrel.elbow.motion import Floats, Motion

_NODES = np.array([0.0, 0.095, 0.345, 0.655, 0.905, 1.0])
_SOLVE = np.linalg.inv(np.vander(_NODES, increasing=True))
_ROUNDING = 1e-12  # rad: what is left of a coefficient that should be 0
_SAME_TIME = 1e-12  # s: nearer times are the same but for rounding
_SLACK = 1e-12  # rad, rad/s: by so little less than 0 is 0 but for rounding


@dataclass(frozen=True, slots=True)
class OneWay:
    """A part of a motion in which the arm extends (1), flexes (-1) or rests (0)."""

    start: float  # s
    length: float  # s
    angle: Floats  # coefficients in the share of `length` that has passed, rad
    direction: int

    @property
    def end(self) -> float:
        """When it ends, s."""
        return self.start + self.length

    @property
    def velocity(self) -> Floats:
        """Coefficients of the angular velocity, rad/s."""
        return _derivative(self.angle) / self.length

    def angle_at(self, time: float) -> float:
        """Return the angle at a time of the part, rad."""
        return float(self.angles_at(np.array(time)))

    def angles_at(self, times: Floats) -> Floats:
        """Return the angles at times of the part, rad."""
        shares = (times - self.start) / self.length
        return np.asarray(polynomial.polyval(shares, self.angle), dtype=np.float64)

    def reached(self, *levels: Floats, after: float = -math.inf) -> float | None:
        """Return when all polynomials in the share are first 0 or more; None if never.

        Not before the time `after`, which counts itself.
        """
        first = max(0.0, (after - self.start) / self.length)
        shares = [share for level in levels for share in _roots(level) if share > first]
        for share in [first, *sorted(shares)]:
            if share <= 1.0 and all(_is_met(level, share) for level in levels):
                return self.start + share * self.length
        return None


def one_way(motion: Motion) -> Iterator[OneWay]:
    """Give the parts of a motion that go one way, in order."""
    start = 0.0
    for piece in motion.pieces():
        length = float(piece.length)
        nodes = np.minimum(start + _NODES * length, motion.duration)
        # at its last node the piece, not the next one: an angle does not jump
        angle = _SOLVE @ motion.angle(nodes)
        angle[1:][np.abs(angle[1:]) < _ROUNDING] = 0.0
        turns = [share for share in _roots(_derivative(angle)) if share < 1.0]
        bounds = [0.0, *(share for share in turns if share > 0.0), 1.0]
        for low, high in pairwise(bounds):
            if low == high:
                continue
            travel = np.diff(polynomial.polyval(np.array([low, high]), angle))[0]
            yield OneWay(
                start=start + low * length,
                length=(high - low) * length,
                angle=_stretched(angle, low, high),
                direction=int(np.sign(travel)) if abs(travel) > _ROUNDING else 0,
            )
        start += length


def spans(
    motion: Motion, level: Callable[[OneWay], Floats]
) -> list[tuple[float, float]]:
    """Return between which times a polynomial of each part is 0 or more, s."""
    result: list[tuple[float, float]] = []
    for part in one_way(motion):
        values = level(part)
        for low, high in pairwise([0.0, *_roots(values), 1.0]):
            if low == high or not _is_met(values, 0.5 * (low + high)):
                continue
            begun = part.start + low * part.length
            until = part.start + high * part.length
            if result and begun - result[-1][1] < _SAME_TIME:
                result[-1] = (result[-1][0], until)
            else:
                result.append((begun, until))
    return result


def beyond(angle: float) -> Callable[[OneWay], Floats]:
    """Return the polynomial that is 0 or more beyond an angle, rad, for `spans`."""

    def level(part: OneWay) -> Floats:
        over = part.angle.copy()
        over[0] -= angle
        return over

    return level


def movements(motion: Motion, speed: float) -> list[tuple[float, float]]:
    """Return between which times the arm goes one way at least so fast, s."""
    extends, flexes = (_faster(way, speed) for way in (1, -1))
    return sorted(spans(motion, extends) + spans(motion, flexes))


def _faster(way: int, speed: float) -> Callable[[OneWay], Floats]:
    def level(part: OneWay) -> Floats:
        above = way * part.velocity
        above[0] -= speed
        return above

    return level


def _derivative(angle: Floats) -> Floats:
    return np.asarray(polynomial.polyder(angle), dtype=np.float64)


def _is_met(level: Floats, share: float) -> bool:
    # 0 or more, but for rounding
    return bool(polynomial.polyval(share, level) >= -_SLACK)


def _stretched(angle: Floats, low: float, high: float) -> Floats:
    # coefficients in the share of the part from `low` to `high`
    if low == 0.0 and high == 1.0:
        return angle
    shifted = polynomial.Polynomial(angle)(polynomial.Polynomial([low, high - low]))
    return np.asarray(shifted.coef, dtype=np.float64)


def _roots(level: Floats) -> list[float]:
    # real roots within [0, 1], in order, each after two steps of Newton's rule
    size = float(np.abs(level).max(initial=0.0))
    trimmed = np.asarray(polynomial.polytrim(level, _SLACK), dtype=np.float64)
    if trimmed.size < 2:
        return []
    slope = _derivative(trimmed)
    shares = []
    for root in polynomial.polyroots(trimmed):
        if abs(root.imag) > 1e-6:
            continue
        share = float(root.real)
        for _ in range(2):
            steep = polynomial.polyval(share, slope)
            if abs(steep) > 1e-9 * size:
                share -= float(polynomial.polyval(share, trimmed) / steep)
        if -1e-12 <= share <= 1.0 + 1e-12:
            shares.append(min(max(share, 0.0), 1.0))
    return sorted(shares)
