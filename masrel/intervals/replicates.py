"""Values of resamples and their quantiles: all of them, or some that were drawn."""

import math
from dataclasses import dataclass, field

import numpy as np

from masrel.agreement.kernel import Floats
from masrel.intervals.control import Control
from masrel.intervals.lattice import Integers

__all__ = ["Drawn", "Enumerated"]

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
        """Return the quantile at a position, by `quantile_of`."""
        return quantile_of(self.values, self.upto, position)

    def share_below(self, value: float) -> float:
        """Return the probability of less than a value, and half that of the value."""
        ends = np.searchsorted(self.values, _around(value))
        below, upto = (float(self.upto[at - 1]) if at else 0.0 for at in ends)
        return 0.5 * (below + upto)


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """Values that were drawn, with a control whose distribution is known.

    Attributes
    ----------
    values : ndarray, shape (n_values,)
        As they were drawn, none undefined.
    ordered : ndarray, shape (n_values,)
        The same, ascending.
    control : Control or None
        A linear function of the resample that goes with the values.
    scores : ndarray of int64, shape (n_values,), or None
        Its values on the same resamples.

    Notes
    -----
    Let the values be at most x in a share F of the resamples, and the control at most c
    in a share H. Of H the expected share is known, and so how far this sample is off:
    F less β times that is a better share, with β the slope of the one indicator on the
    other [1]_. The quantile at p is then the quantile of the sample at p + β (H - E H).

    References
    ----------
    .. [1] Davison, A. C., Hinkley, D. V. (1997). Bootstrap Methods and their
       Application, section 9.3 (control methods).
    """

    values: Floats = field(compare=False, repr=False)
    ordered: Floats = field(compare=False, repr=False)
    control: Control | None = field(default=None, compare=False, repr=False)
    scores: Integers | None = field(default=None, compare=False, repr=False)

    @property
    def weights(self) -> Floats:
        """The probability of each value, all the same."""
        n = self.values.size
        return np.broadcast_to(1.0 / max(n, 1), (n,))

    def quantile(self, position: float) -> float:
        """Return the quantile at a position, by `quantile_of`."""
        return self._plain(position + self._miss(position)[0])

    def share_below(self, value: float) -> float:
        """Return the probability of less than a value, and half that of the value."""
        below = self._indicator(value)
        share = float(below.mean())
        return share - self._missed(below, share)[0]

    def error(self, position: float, pull: float, value: float) -> float:
        """Return the Monte Carlo error of a quantile.

        Parameters
        ----------
        position : float
            Its position.
        pull : float
            How fast the position moves with the share of resamples below `value`.
        value : float
            The estimate.

        Returns
        -------
        float
            The standard error of the position times the slope of the quantile there.
        """
        miss, rest = self._miss(position)
        if pull:
            below = self._indicator(value)
            rest = rest - pull * self._missed(below, float(below.mean()))[1]
        n = self.values.size
        error = float(rest.std()) / math.sqrt(n)
        # The slope of the quantile, from twice as far as a plain sample is off.
        reach = 2.0 * math.sqrt(position * (1.0 - position) / n)
        ends = (max(position + miss - reach, 0.0), min(position + miss + reach, 1.0))
        low, high = (self._plain(end) for end in ends)
        if not low < high:
            return 0.0
        return error * (high - low) / (ends[1] - ends[0])

    def _plain(self, position: float) -> float:
        n = self.ordered.size
        at = min(max(position, 0.0), 1.0) * n
        first = min(max(math.ceil(at - 1e-6), 1), n) - 1
        value = float(self.ordered[first])
        if first + 1 < n and abs(first + 1 - at) <= 1e-6:
            return 0.5 * (value + float(self.ordered[first + 1]))
        return value

    def _indicator(self, value: float) -> Floats:
        low, high = _around(value)
        below = (self.values < low).astype(np.float64)
        return np.asarray(0.5 * (below + (self.values <= high)), dtype=np.float64)

    def _miss(self, position: float) -> tuple[float, Floats]:
        below = (self.values <= self._plain(position)).astype(np.float64)
        return self._missed(below, position)

    def _missed(self, below: Floats, position: float) -> tuple[float, Floats]:
        # by how much the share below is off, and what the control does not say of each
        if self.control is None or self.scores is None:
            return 0.0, below
        cut, share = self.control.cut(position)
        hit = (self.scores <= cut).astype(np.float64)
        seen = float(hit.mean())
        spread = seen * (1.0 - seen)
        if spread == 0.0:
            return 0.0, below
        slope = (float(hit @ below) / hit.size - seen * float(below.mean())) / spread
        return slope * (seen - share), below - slope * hit


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


def _around(value: float) -> tuple[float, float]:
    near = _ROUNDING * max(1.0, abs(value))
    return value - near, value + near
