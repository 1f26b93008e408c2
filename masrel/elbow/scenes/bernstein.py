"""How often many polynomials change their sign in an interval (Descartes' rule)."""

from math import comb

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.motion import Floats

__all__ = ["sign_changes"]


def sign_changes(
    coefficients: Floats, low: Floats, high: Floats, *, least: float
) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Count the changes of sign of Bernstein coefficients.

    Parameters
    ----------
    coefficients : ndarray, shape (n_coefficients, n_polynomials)
        The constants first.
    low, high : ndarray, shape (n_polynomials,)
        The intervals.
    least : float
        A coefficient smaller than that has no clear sign.

    Returns
    -------
    changes : ndarray of int, shape (n_polynomials,)
        None means no root, one exactly one, more at most as many.
    unclear : ndarray of bool, shape (n_polynomials,)
        Whether a coefficient is without a clear sign.

    Examples
    --------
    x - 1/2 on 0 to 1, and on 0 to 1/4:

    >>> line = np.array([[-0.5, -0.5], [1.0, 1.0]])
    >>> sign_changes(line, np.zeros(2), np.array([1.0, 0.25]), least=1e-9)[0].tolist()
    [1, 0]
    """
    degree = len(coefficients) - 1
    moved = list(coefficients)
    for i in range(degree):
        for j in range(degree - 1, i - 1, -1):
            moved[j] = moved[j] + low * moved[j + 1]
    power = np.ones_like(low)
    for i in range(degree + 1):
        moved[i] = moved[i] * power / comb(degree, i)
        power = power * (high - low)
    bernstein = np.stack(
        [
            sum((comb(i, j) * moved[j] for j in range(1, i + 1)), moved[0])
            for i in range(degree + 1)
        ]
    )
    signs = bernstein > 0.0
    changes = np.count_nonzero(signs[1:] != signs[:-1], axis=0)
    return changes, (np.abs(bernstein) < least).any(axis=0)
