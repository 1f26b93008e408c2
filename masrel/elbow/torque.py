"""Torque of a motion at given times or angles, from the exact events.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (1), (3) and (5).
"""

import math
from decimal import Decimal
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from masrel.elbow.events import Events, events
from masrel.elbow.legs import Leg, legs
from masrel.elbow.motion import Floats, Motion
from masrel.elbow.parameters import ElbowParameters
from masrel.elbow.polynomial import ONE, ZERO, exactly, value
from masrel.elbow.roots import cuts
from masrel.errors import ParameterError

__all__ = ["leg_torque", "times_at", "torque", "torque_at"]


def torque(
    parameters: ElbowParameters,
    motion: Motion,
    times: ArrayLike,
    *,
    found: Events | None = None,
) -> Floats:
    """Return the torque of a motion at given times.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units.
    times : array_like, shape (n_times,)
        Times within the motion, s.
    found : Events, optional
        Its events, when they are known already.

    Returns
    -------
    ndarray, shape (n_times,)
        Torque that resists extension, N·m. At the instant of an event the later
        phase holds.

    Raises
    ------
    ParameterError
        If a time is outside the motion, or the motion starts at or beyond the end
        of range.

    Examples
    --------
    HM3 at 92 deg/s before the catch, by (1): 1.26 ω + 3.15 (θ - 30 deg):

    >>> from math import radians
    >>> from masrel.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> round(float(torque(STANDARD_MODELS["HM3"], stretch, [0.5])[0]), 4)
    4.5522
    """
    at = np.atleast_1d(np.asarray(times, dtype=np.float64))
    found = events(parameters, motion) if found is None else found
    if at.size and not (at.min() >= 0.0 and at.max() <= found.end):
        raise ParameterError(
            f"times: need 0 to {found.end:g} s, the end of the stretch, "
            f"got {at.min():g} to {at.max():g} s"
        )
    values = np.empty(at.shape)
    with exactly():
        laid = legs(parameters, motion, found.course)
        starts = np.array([float(leg.start) for leg in laid])
        which = np.searchsorted(starts, at, side="right") - 1
        for i, leg in enumerate(laid):
            mine = which == i
            if mine.any():
                values[mine] = leg_torque(leg, motion, at[mine])
    return values


def leg_torque(leg: Leg, motion: Motion, at: Floats) -> Floats:
    """Return the torque of one law, also at the instant at which the next begins.

    Parameters
    ----------
    leg : Leg
        The law; read within `masrel.elbow.polynomial.exactly`.
    motion : Motion
        The motion.
    at : ndarray, shape (n_times,)
        Times of the leg, s.

    Returns
    -------
    ndarray, shape (n_times,)
        Torque that resists extension, N·m.
    """
    # The origin is a root, known better than a float: what is left of it is taken off
    # the difference of angles, which is small.
    values = np.full(at.shape, float(leg.level))
    if leg.stiffness:
        origin = float(leg.origin)
        left = float(leg.origin - Decimal(origin))
        values += float(leg.stiffness) * (motion.angle(at, origin) - left)
    if leg.damping:
        values += float(leg.damping) * motion.velocity(at)
    if leg.inertia:
        values += float(leg.inertia) * motion.acceleration(at)
    if leg.rise:
        start = float(leg.start)
        since = (at - start) - float(leg.start - Decimal(start))
        share = np.clip(since / float(leg.rise_time), 0.0, 1.0)
        values += float(leg.rise) * (share * share * (3.0 - 2.0 * share))
    return values


def torque_at(parameters: ElbowParameters, motion: Motion, angles: ArrayLike) -> Floats:
    """Return the torque of a motion where it first reaches given angles.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units.
    angles : array_like, shape (n_angles,)
        Angles, rad.

    Returns
    -------
    ndarray, shape (n_angles,)
        Torque that resists extension, N·m.

    Raises
    ------
    ParameterError
        If an angle is not reached, or the motion starts at or beyond the end of
        range.

    Examples
    --------
    >>> from math import radians
    >>> from masrel.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> torque_at(STANDARD_MODELS["HM3"], stretch, [radians(146)]).round(3)
    array([10.984])
    """
    found = events(parameters, motion)
    times = np.minimum(times_at(motion, angles), found.end)
    beyond = np.asarray(angles, dtype=np.float64) > parameters.range_end
    if beyond.any():
        raise ParameterError(
            f"angles: need {math.degrees(parameters.range_end):g} degrees, the end of "
            "range, or less"
        )
    return torque(parameters, motion, times, found=found)


def times_at(motion: Motion, angles: ArrayLike) -> Floats:
    """Return when a motion first reaches given angles.

    Parameters
    ----------
    motion : Motion
        The motion, SI units.
    angles : array_like, shape (n_angles,)
        Angles, rad.

    Returns
    -------
    ndarray, shape (n_angles,)
        Times, s, each the float nearest to the exact one.

    Raises
    ------
    ParameterError
        If an angle is not reached.

    Examples
    --------
    >>> from masrel.elbow import MinimumJerk
    >>> times_at(MinimumJerk(start=0.5, end=2.5, mean_speed=1.0), [0.5, 1.5, 2.5])
    array([0., 1., 2.])
    """
    goals = np.atleast_1d(np.asarray(angles, dtype=np.float64)).tolist()
    with exactly():
        return np.array([_first_time(motion, goal) for goal in goals])


def _first_time(motion: Motion, goal: float) -> float:
    if goal == motion.start:
        return 0.0
    time, angle = ZERO, Decimal(goal)
    for piece in motion.pieces() if math.isfinite(goal) else ():
        above = (piece.angle[0] - angle, *piece.angle[1:])
        for low, high in pairwise(cuts((above,), ZERO, ONE)):
            if high < 1 or (value(above, low) > 0) != (value(above, high) > 0):
                return float(time + high * piece.length)
        time += piece.length
        if abs(value(above, ONE)) < _NEAR:
            return float(time)
    raise ParameterError(
        f"angles: need ones that the motion reaches, got {math.degrees(goal):g} degrees"
    )


_NEAR = Decimal("1e-15")
# rad: the end of a motion, of which `end` is the nearest float
