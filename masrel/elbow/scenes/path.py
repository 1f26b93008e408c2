"""Kinds of motion as functions of time, and their integrals.

Minimum jerk in shares x of the duration: the way is P(x) = 10x³ - 15x⁴ + 6x⁵.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from masrel.elbow.motion import Floats
from masrel.elbow.scenes.course import Motions

__all__ = ["Path", "constant_path", "quintic_path"]

_Law = Callable[[Floats], Floats]


@dataclass(frozen=True, slots=True, kw_only=True)
class Path:
    """A kind of motion as functions of time, for one column of times.

    Attributes
    ----------
    travel : callable
        Angle gone since the start, rad.
    velocity : callable
        rad/s.
    acceleration : callable
        rad/s².
    is_steady : bool
        Whether the velocity is constant.
    travel_integral : callable
        ∫ travel dt from the start, rad s.
    square_integral : callable
        ∫ velocity² dt from the start, rad²/s.
    turning : callable
        From a stiffness and a damping, the time before which stiffness · travel +
        damping · velocity rises and after which it falls, s.
    """

    travel: _Law
    velocity: _Law
    acceleration: _Law
    is_steady: bool
    travel_integral: _Law
    square_integral: _Law
    turning: Callable[[Floats, Floats], Floats]


def constant_path(motions: Motions) -> Path:
    """Return the functions of stretches at constant speed.

    Parameters
    ----------
    motions : Motions
        The stretches.

    Returns
    -------
    Path
        Their functions.
    """
    speed = motions.speed
    return Path(
        travel=lambda t: speed * t,
        velocity=lambda t: speed + 0.0 * t,
        acceleration=lambda t: 0.0 * t,
        is_steady=True,
        travel_integral=lambda t: 0.5 * speed * t * t,
        square_integral=lambda t: speed * speed * t,
        turning=lambda k, _: np.full(k.shape, np.inf),
    )


def quintic_path(motions: Motions) -> Path:
    """Return the functions of minimum-jerk stretches.

    Parameters
    ----------
    motions : Motions
        The stretches.

    Returns
    -------
    Path
        Their functions.
    """
    way, speed = motions.end - motions.start, motions.speed
    total = way / speed
    return Path(
        travel=lambda t: way * _way(t / total),
        velocity=lambda t: speed * _pace(t / total),
        acceleration=lambda t: speed / total * _gain(t / total),
        is_steady=False,
        travel_integral=lambda t: total * way * _way_integral(t / total),
        square_integral=lambda t: way * speed * _square_integral(t / total),
        turning=lambda k, b: total * _turn(k, 2.0 * b / total),
    )


def _way(x: Floats) -> Floats:
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))  # P


def _pace(x: Floats) -> Floats:
    rest = x * (1.0 - x)
    return 30.0 * rest * rest  # P'


def _gain(x: Floats) -> Floats:
    return 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)  # P''


def _way_integral(x: Floats) -> Floats:
    power = x * x * x * x
    return power * (2.5 + x * (x - 3.0))


def _square_integral(x: Floats) -> Floats:
    # 900 ∫ x⁴ (1 - x)⁴
    power = x * x * x * x * x
    inner = 900 / 5 + x * (-600.0 + x * (5400 / 7 + x * (-450.0 + x * 100.0)))
    return np.asarray(power * inner)


def _turn(k: Floats, c: Floats) -> Floats:
    # k x (1 - x) + c (1 - 2x) = 0, without cancellation
    root = np.sqrt(k * k + 4.0 * c * c)
    with np.errstate(divide="ignore", invalid="ignore"):
        x = np.where(
            k > 2.0 * c,
            (k - 2.0 * c + root) / (2.0 * k),
            2.0 * c / (2.0 * c - k + root),
        )
    return np.where(root > 0.0, x, 0.5)
