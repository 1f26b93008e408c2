"""From the values of resamples to the ends of an interval."""

import math
from dataclasses import dataclass, field
from statistics import NormalDist
from typing import Literal

import numpy as np

from masrel.agreement.kernel import Floats

__all__ = ["Kind", "Replicates", "bca_levels"]

Kind = Literal["percentile", "basic", "bca"]

_ROUNDING = 1e-12  # values and probabilities nearer than this are the same


@dataclass(frozen=True, slots=True, kw_only=True)
class Replicates:
    """Values of resamples with their probabilities.

    Attributes
    ----------
    values : ndarray, shape (n_values,)
        Ascending, none undefined.
    weights : ndarray, shape (n_values,)
        Their probabilities, which sum to 1.
    upto : ndarray, shape (n_values,)
        The probability of a value at most as large.
    """

    values: Floats = field(compare=False, repr=False)
    weights: Floats = field(compare=False, repr=False)
    upto: Floats = field(compare=False, repr=False)

    @classmethod
    def weighted(cls, values: Floats, weights: Floats) -> "Replicates":
        """Sort values of known probability and put equal ones together.

        Parameters
        ----------
        values, weights : ndarray, shape (n_resamples,)
            Values, none undefined, and weights of any sum.

        Returns
        -------
        Replicates
            Distinct values.
        """
        order = np.argsort(values)
        values, weights = values[order], weights[order] / weights.sum()
        if values.size:
            apart = np.diff(values) > _ROUNDING * np.maximum(1.0, np.abs(values[1:]))
            first = np.flatnonzero(np.concatenate([[True], apart]))
            values, weights = values[first], np.add.reduceat(weights, first)
        return cls(values=values, weights=weights, upto=np.cumsum(weights))

    @classmethod
    def drawn(cls, values: Floats) -> "Replicates":
        """Sort values that were drawn.

        Parameters
        ----------
        values : ndarray, shape (n_resamples,)
            Values, none undefined.

        Returns
        -------
        Replicates
            As many values, each of the same probability.
        """
        n = values.size
        return cls(
            values=np.sort(values),
            weights=np.broadcast_to(1.0 / max(n, 1), (n,)),
            upto=np.arange(1, n + 1) / max(n, 1),
        )

    @property
    def has_spread(self) -> bool:
        """Whether there are two different values."""
        return bool(self.values.size) and bool(self.values[0] < self.values[-1])

    def quantile(self, position: float) -> float:
        """Return the least value whose probability adds up to a position.

        Where it adds up to just that, any value up to the next would do: it is the
        middle of the two, so that the mirror image has the mirrored quantiles. This is
        definition 2 of Hyndman and Fan (1996), https://doi.org/10.2307/2684934.

        Parameters
        ----------
        position : float
            A probability.

        Returns
        -------
        float
            The quantile.
        """
        last = self.values.size - 1
        at = min(int(np.searchsorted(self.upto, position - _ROUNDING)), last)
        value = float(self.values[at])
        if at < last and abs(self.upto[at] - position) <= _ROUNDING:
            return 0.5 * (value + float(self.values[at + 1]))
        return value

    def share_below(self, value: float) -> float:
        """Return the probability of less than a value, and half that of the value.

        Parameters
        ----------
        value : float
            Any value.

        Returns
        -------
        float
            The probability; values are the same if only rounding sets them apart.
        """
        near = _ROUNDING * max(1.0, abs(value))
        ends = np.searchsorted(self.values, [value - near, value + near])
        below, upto = (float(self.upto[at - 1]) if at else 0.0 for at in ends)
        return 0.5 * (below + upto)


def bca_levels(level: float, share: float, skew: float) -> tuple[float, float]:
    """Return which quantiles of the resamples are the ends of a BCa interval.

    Parameters
    ----------
    level : float
        Nominal level.
    share : float
        Probability of a resample below the estimate, ties half, within (0, 1).
    skew : float
        The acceleration.

    Returns
    -------
    tuple of float
        Positions of the low and the high end.

    References
    ----------
    .. [1] Efron, B., Tibshirani, R. J. (1993). An Introduction to the Bootstrap,
       ch. 14.
    """
    normal = NormalDist()
    bias = normal.inv_cdf(share)  # z0, (14.14) of [1]
    tail = 0.5 * (1.0 - level)
    ends = []
    for z in (normal.inv_cdf(tail), normal.inv_cdf(1.0 - tail)):
        stretch = 1.0 - skew * (bias + z)
        if stretch <= 0.0:  # beyond its pole (14.10) says nothing: the last value
            ends.append(0.0 if bias + z < 0.0 else 1.0)
            continue
        moved = bias + (bias + z) / stretch  # (14.10)
        ends.append(0.5 * math.erfc(-moved / math.sqrt(2.0)))
    return ends[0], ends[1]
