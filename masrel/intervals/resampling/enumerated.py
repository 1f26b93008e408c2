"""The values of all resamples with their probabilities, and their quantiles."""

from dataclasses import dataclass, field

import numpy as np

from masrel.agreement.kernel import Floats

__all__ = ["Enumerated", "near", "quantile_of"]

_ROUNDING = 1e-12  # values and probabilities nearer than this are the same


@dataclass(frozen=True, slots=True, kw_only=True)
class Enumerated:
    """All values there are, with their probabilities.

    Attributes
    ----------
    values : ndarray, shape (n_values,)
        Ascending and distinct.
    weights : ndarray, shape (n_values,)
        Their probabilities, which sum to 1.
    upto : ndarray, shape (n_values,)
        The probability of a value at most as large.
    """

    values: Floats = field(compare=False, repr=False)
    weights: Floats = field(compare=False, repr=False)
    upto: Floats = field(compare=False, repr=False)

    @classmethod
    def of(cls, values: Floats, weights: Floats) -> "Enumerated":
        """Sort values and put equal ones together.

        Parameters
        ----------
        values, weights : ndarray, shape (n_resamples,)
            Values, none undefined, and weights of any sum.

        Returns
        -------
        Enumerated
            Distinct values.
        """
        order = np.argsort(values)
        values, weights = values[order], weights[order] / weights.sum()
        if values.size:
            with np.errstate(invalid="ignore"):  # two infinite values are the same
                gaps = np.diff(values)
            least = np.minimum(np.abs(values[1:]), np.abs(values[:-1]))
            apart = gaps > _ROUNDING * np.clip(least, 1.0, 1e300)
            first = np.flatnonzero(np.concatenate([[True], apart]))
            if first.size < values.size:
                values, weights = values[first], np.add.reduceat(weights, first)
        return cls(values=values, weights=weights, upto=np.cumsum(weights))

    def quantile(self, position: float) -> float:
        """Return the quantile at a position, as `quantile_of` has it."""
        return quantile_of(self.values, self.upto, position)

    def share_below(self, value: float) -> float:
        """Return the probability of less than a value, and half that of the value."""
        ends = np.searchsorted(self.values, near(value))
        below, upto = (float(self.upto[at - 1]) if at else 0.0 for at in ends)
        return 0.5 * (below + upto)


def quantile_of(values: Floats, upto: Floats, position: float) -> float:
    """Return the least value whose probability adds up to a position.

    Where it adds up to just that, any value up to the next would do: it is the middle
    of the two, so that mirrored values have mirrored quantiles. This is definition 2 of
    Hyndman and Fan (1996), https://doi.org/10.2307/2684934.

    Parameters
    ----------
    values : ndarray, shape (n_values,)
        Ascending.
    upto : ndarray, shape (n_values,)
        The probability of a value at most as large.
    position : float
        A probability.

    Returns
    -------
    float
        The quantile.

    Examples
    --------
    >>> values, upto = np.array([1.0, 2.0, 4.0]), np.array([0.25, 0.75, 1.0])
    >>> [quantile_of(values, upto, at) for at in (0.2, 0.25, 0.3, 0.75)]
    [1.0, 1.5, 2.0, 3.0]
    """
    last = values.size - 1
    at = min(int(np.searchsorted(upto, position - _ROUNDING)), last)
    value = float(values[at])
    if at < last and abs(float(upto[at]) - position) <= _ROUNDING:
        return 0.5 * (value + float(values[at + 1]))
    return value


def near(value: float) -> tuple[float, float]:
    """Return between which numbers only rounding sets a value apart.

    Parameters
    ----------
    value : float
        Any value.

    Returns
    -------
    tuple of float
        A little less and a little more.
    """
    off = _ROUNDING * max(1.0, abs(value))
    return value - off, value + off
