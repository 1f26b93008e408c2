"""The catch line of minimum-jerk stretches: θ - (L - α v̄) as polynomials of the place.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equation (2).
"""

import numpy as np

from masrel.elbow.motion import Floats
from masrel.elbow.scenes.table import Joints, Motions

__all__ = ["catch_lines", "horner", "slopes", "zeros_of"]

_MOST_STEPS = 12  # who is not there by then is told by its next correction
_STILL = 1e-14


def catch_lines(joints: Joints, motions: Motions, onset: Floats) -> Floats:
    """Give the coefficients of the lines.

    Parameters
    ----------
    joints : Joints
        The joints.
    motions : Motions
        The stretches.
    onset : ndarray, shape (n_scenes,)
        Places where they move.

    Returns
    -------
    ndarray, shape (6, n_scenes)
        rad, the constants first.
    """
    way = motions.end - motions.start
    moved = joints.catch_slope * motions.speed
    q3 = 6.0 * onset - 15.0
    q2 = onset * q3 + 10.0
    q1 = onset * q2
    return np.stack(
        [
            (motions.start - joints.catch_angle_constant) + moved * (onset * q1),
            moved * q1,
            moved * q2,
            10.0 * way + moved * q3,
            -15.0 * way + moved * 6.0,
            6.0 * way,
        ]
    )


def horner(coefficients: Floats, x: Floats) -> Floats:
    """Evaluate polynomials.

    Parameters
    ----------
    coefficients : ndarray, shape (n_coefficients, n_polynomials)
        The constants first.
    x : ndarray, shape (n_polynomials,)
        One place in each.

    Returns
    -------
    ndarray, shape (n_polynomials,)
        Their values.
    """
    total = coefficients[-1] * x
    for row in coefficients[-2:0:-1]:
        total += row
        total *= x
    total += coefficients[0]
    return np.asarray(total)


def slopes(coefficients: Floats) -> Floats:
    """Differentiate polynomials.

    Parameters
    ----------
    coefficients : ndarray, shape (n_coefficients, n_polynomials)
        The constants first.

    Returns
    -------
    ndarray, shape (n_coefficients - 1, n_polynomials)
        Those of the derivatives.
    """
    powers = np.arange(1, len(coefficients))
    return np.asarray(coefficients[1:] * powers[:, np.newaxis])


def zeros_of(lines: Floats, low: Floats, high: Floats) -> Floats:
    """Find where polynomials rise through 0, by Newton's rule within brackets.

    Parameters
    ----------
    lines : ndarray, shape (n_coefficients, n_polynomials)
        The constants first.
    low, high : ndarray, shape (n_polynomials,)
        Places where they are negative, and where they are not.

    Returns
    -------
    ndarray, shape (n_polynomials,)
        The zeros, to rounding.
    """
    tangents = slopes(lines)
    x = 0.5 * (low + high)
    for _ in range(_MOST_STEPS):
        height = horner(lines, x)
        low, high = np.where(height > 0.0, low, x), np.where(height > 0.0, x, high)
        moved = x - height / horner(tangents, x)
        is_inside = (moved >= low) & (moved <= high)
        moved = np.where(is_inside, moved, 0.5 * (low + high))
        is_done = (np.abs(moved - x) <= _STILL).all()
        x = moved
        if is_done:
            break
    return x
