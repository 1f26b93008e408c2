"""The values of all resamples with their probabilities, and their quantiles."""

from dataclasses import dataclass, field

import numpy as np

from masrel.agreement._kernel import Floats

__all__ = ["Enumerated", "near", "quantile_of"]

_ROUNDING = 1e-12  # values and probabilities nearer than this are the same


@dataclass(frozen=True, slots=True, kw_only=True)
class Enumerated:
    """All values there are, with their probabilities."""

    # (n_values,): ascending and distinct
    values: Floats = field(compare=False, repr=False)
    # (n_values,): their probabilities, which sum to 1
    weights: Floats = field(compare=False, repr=False)
    # (n_values,): the probability of a value at most as large
    upto: Floats = field(compare=False, repr=False)

    @classmethod
    def of(cls, values: Floats, weights: Floats) -> "Enumerated":
        """Sort values and put equal ones together."""
        # Takes values, weights (n_resamples,)
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
    """Return the least value whose probability adds up to a position."""
    # Where it adds up to just that, any value up to the next would do: it is the middle
    # of the two, so that mirrored values have mirrored quantiles. This is definition 2
    # of Hyndman and Fan (1996), https://doi.org/10.2307/2684934.
    # Takes values (n_values,), upto (n_values,)
    last = values.size - 1
    at = min(int(np.searchsorted(upto, position - _ROUNDING)), last)
    value = float(values[at])
    if at < last and abs(float(upto[at]) - position) <= _ROUNDING:
        return 0.5 * (value + float(values[at + 1]))
    return value


def near(value: float) -> tuple[float, float]:
    """Return between which numbers only rounding sets a value apart."""
    off = _ROUNDING * max(1.0, abs(value))
    return value - off, value + off
