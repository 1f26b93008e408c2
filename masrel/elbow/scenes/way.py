"""Minimum jerk in shares: how much of the way is gone in how much of the duration.

A place x is a share of the duration. The share of the way is P(x) = 10x³ - 15x⁴ + 6x⁵,
and the mean speed since x_on the overall one times Q(x) = (P(x) - P(x_on))/(x - x_on).
"""

import numpy as np

from masrel.elbow.scenes.course import Flags
from masrel.elbow.scenes.digits import Digits
from masrel.elbow.scenes.twofold import Twofold

__all__ = ["mean_share", "places_of", "way_share"]


def way_share(x: Twofold) -> Twofold:
    """Give the share of the way at places.

    Parameters
    ----------
    x : Twofold
        The places.

    Returns
    -------
    Twofold
        P(x).
    """
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


def mean_share(x: Twofold, onset: Twofold) -> Twofold:
    """Give the mean speed since a place over the overall one.

    Parameters
    ----------
    x, onset : Twofold
        The places.

    Returns
    -------
    Twofold
        Q(x), by dividing P by x - x_on, so that nothing cancels.
    """
    q3 = 6.0 * onset - 15.0
    q2 = onset * q3 + 10.0
    q1 = onset * q2
    return onset * q1 + x * (q1 + x * (q2 + x * (q3 + 6.0 * x)))


def places_of(
    share: Twofold, digits: Digits, slowness: float = 1.0
) -> tuple[Twofold, Flags]:
    """Find the places where shares of the way are gone.

    Parameters
    ----------
    share : Twofold
        Shares of the way.
    digits : Digits
        What to compute with.
    slowness : float, optional
        How much of `digits.least_rest` is needed.

    Returns
    -------
    place : Twofold
        Shares of the duration, where `share` lies between 0 and 1.
    settled : ndarray of bool
        Whether each is right to these digits.
    """
    near = np.minimum(share.high, 1.0 - share.high)
    x = np.cbrt(0.1 * near)
    for _ in range(2):
        x = np.cbrt(near / (10.0 + x * (6.0 * x - 15.0)))
    for _ in range(4):
        rest = x * (1.0 - x)
        x = x - (x * x * x * (10.0 + x * (6.0 * x - 15.0)) - near) / (
            30.0 * rest * rest
        )
    place = digits.number(np.where(share.high > 0.5, 1.0 - x, x))
    for _ in range(digits.n_corrections):
        rest = place.high * (1.0 - place.high)
        step = (way_share(place) - share).high / (30.0 * rest * rest)
        place = place - step
    settled = np.abs(step) < digits.settled * np.abs(place.high)
    return place, np.asarray(settled & (rest > slowness * digits.least_rest))
