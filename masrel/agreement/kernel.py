"""How a coefficient is computed from sums over items, many resamples at once.

Every coefficient here is a function of sums over items of a few features of each
item. A resample of items, or leaving one out, only changes the sums; so intervals
need no call per resample.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.coding import CodedRatings

__all__ = ["Floats", "Kernel", "divide"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Kernel:
    """A coefficient as a function of sums of item features.

    Attributes
    ----------
    features : callable
        CodedRatings to an array of shape (n_items, n_features).
    value : callable
        Sums of shape (..., n_features) and the number of categories to values of
        shape (...), ``nan`` where undefined.
    rater_sums : callable or None
        CodedRatings and how often each rater is taken, shape (n_resamples,
        n_raters), to sums of shape (n_resamples, n_features). A rater is never
        paired with a copy of itself. None where raters cannot be resampled.
    """

    features: Callable[[CodedRatings], Floats]
    value: Callable[[Floats, int], Floats]
    rater_sums: Callable[[CodedRatings, Floats], Floats] | None = None


def divide(numerator: Floats, denominator: Floats) -> Floats:
    """Divide, with ``nan`` and no noise where the denominator is 0.

    Parameters
    ----------
    numerator, denominator : ndarray, shape (...)
        What to divide.

    Returns
    -------
    ndarray, shape (...)
        The ratios.
    """
    shape = np.broadcast_shapes(np.shape(numerator), np.shape(denominator))
    out = np.full(shape, np.nan)
    np.divide(numerator, denominator, out=out, where=np.not_equal(denominator, 0))
    return out
