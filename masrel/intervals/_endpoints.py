"""From the values of resamples to the ends of an interval, and how certain they are."""

import math
from dataclasses import dataclass, field
from statistics import NormalDist
from typing import Literal

import numpy as np

from masrel.agreement._kernel import Floats
from masrel.estimates import Distribution
from masrel.intervals._lattice import Integers
from masrel.intervals._problem import ROUNDING

Kind = Literal["percentile", "basic", "bca", "studentized"]
"""How the ends of an interval come from resamples."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AllResamples:
    """The values of all resamples there are, with their probabilities."""

    # (n_values,): ascending and distinct, none undefined
    values: Floats = field(compare=False, repr=False)
    # (n_values,): their probabilities, which sum to 1
    weights: Floats = field(compare=False, repr=False)
    # (n_values,): the probability of a value at most as large
    cumulative: Floats = field(compare=False, repr=False)
    description: str
    n_resamples: None = None  # none were drawn
    n_undefined: int  # of the distinct resamples
    notes: tuple[str, ...]

    @classmethod
    def of(
        cls, values: Floats, weights: Floats, what: str = "resamples"
    ) -> "AllResamples":
        """Leave out what is undefined, sort values, and put equal ones together."""
        # Takes values, weights (n_resamples,)
        n = values.size
        notes: tuple[str, ...] = ()
        undefined = np.isnan(values)
        n_undefined = int(undefined.sum())
        if n_undefined:
            lost = float(weights[undefined].sum())
            notes = (
                f"undefined, and left out: {n_undefined} of {n} distinct {what}, of "
                f"probability {lost:.2g}",
            )
            values, weights = values[~undefined], weights[~undefined]
        order = np.argsort(values)
        values, weights = values[order], weights[order] / weights.sum()
        if values.size:
            with np.errstate(invalid="ignore"):  # two infinite values are the same
                gaps = np.diff(values)
            smaller = np.minimum(np.abs(values[1:]), np.abs(values[:-1]))
            is_new = gaps > ROUNDING * np.clip(smaller, 1.0, 1e300)
            first = np.flatnonzero(np.concatenate([[True], is_new]))
            if first.size < values.size:
                values, weights = values[first], np.add.reduceat(weights, first)
        return cls(
            values=values,
            weights=weights,
            cumulative=np.cumsum(weights),
            description=f"exact bootstrap distribution, {n} {what}",
            n_undefined=n_undefined,
            notes=notes,
        )

    def quantile(self, position: float) -> float:
        """Return the least value whose probability adds up to a position."""
        # Where it adds up to just that, any value up to the next would do: it is the
        # middle of the two, so that mirrored values have mirrored quantiles. This is
        # definition 2 of Hyndman and Fan (1996), https://doi.org/10.2307/2684934.
        last = self.values.size - 1
        at = min(int(np.searchsorted(self.cumulative, position - ROUNDING)), last)
        value = float(self.values[at])
        if at < last and abs(float(self.cumulative[at]) - position) <= ROUNDING:
            return 0.5 * (value + float(self.values[at + 1]))
        return value

    def share_below(self, value: float) -> float:
        """Return the probability of less than a value, and half that of the value."""
        ends = np.searchsorted(self.values, _around(value))
        below, up_to = (float(self.cumulative[at - 1]) if at else 0.0 for at in ends)
        return 0.5 * (below + up_to)


@dataclass(frozen=True, slots=True, kw_only=True)
class Control:
    """A linear function of a resample, whose distribution is known without drawing."""

    least: int  # the least sum of scores in the table
    # (n_sums,): the probability of a sum at most as large, one sum after the other
    cumulative: Floats = field(compare=False, repr=False)

    def cut(self, position: float) -> tuple[int, float]:
        """Return the sum nearest to a position, and the probability up to it."""
        at = int(np.searchsorted(self.cumulative, position))
        at = min(at, self.cumulative.size - 1)
        if at and position - self.cumulative[at - 1] < self.cumulative[at] - position:
            at -= 1
        return self.least + at, float(self.cumulative[at])


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnResamples:
    """Values that were drawn, with a control whose distribution is known."""

    # Let the values be at most x in a share F of the resamples, and the control at most
    # c in a share H. Of H the expected share is known, and so how far this sample is
    # off: F less β times that is a better share, with β the slope of the one indicator
    # on the other [1]_. The quantile at p is then the quantile of the sample at p + β
    # (H - E H).
    # [1] Davison, A. C., Hinkley, D. V. (1997). Bootstrap Methods and their
    # Application, section 9.3 (control methods).

    # (n_values,): as they were drawn, none undefined
    drawn: Floats = field(compare=False, repr=False)
    # (n_values,): the same, ascending
    values: Floats = field(compare=False, repr=False)
    control: Control | None = field(default=None, compare=False, repr=False)
    # (n_values,): the control on the same resamples
    scores: Integers | None = field(default=None, compare=False, repr=False)
    n_undefined: int = 0  # of those drawn
    notes: tuple[str, ...] = ()

    @property
    def n_resamples(self) -> int:
        """How many were drawn."""
        return self.drawn.size + self.n_undefined

    @property
    def description(self) -> str:
        """What the values are."""
        return f"bootstrap distribution, {self.drawn.size} resamples"

    @property
    def weights(self) -> Floats:
        """The probability of each value, all the same."""
        n = self.drawn.size
        return np.broadcast_to(1.0 / max(n, 1), (n,))

    def quantile(self, position: float) -> float:
        """Return the quantile at a position, as `AllResamples.quantile` has it."""
        miss, _, _ = self._regression(self._up_to_quantile(position), position)
        return self._plain_quantile(position + miss)

    def share_below(self, value: float) -> float:
        """Return the probability of less than a value, and half that of the value."""
        below = self._indicator(value)
        share = float(below.mean())
        miss, _, _ = self._regression(below, share)
        return share - miss

    def error(self, position: float, pull: float, value: float) -> float:
        """Return the Monte Carlo error of a quantile.

        Its position moves by `pull` with the share of resamples below `value`.
        """
        below = self._up_to_quantile(position)
        miss, slope, hit = self._regression(below, position)
        rest = below - slope * hit  # what the control does not explain
        if pull:
            below = self._indicator(value)
            _, slope, hit = self._regression(below, float(below.mean()))
            rest -= pull * (below - slope * hit)
        n = self.drawn.size
        error = float(rest.std()) / math.sqrt(n)
        # The slope of the quantile, from twice as far as a plain sample is off.
        reach = 2.0 * math.sqrt(position * (1.0 - position) / n)
        ends = (max(position + miss - reach, 0.0), min(position + miss + reach, 1.0))
        low, high = (self._plain_quantile(end) for end in ends)
        if not low < high:
            return 0.0
        return error * (high - low) / (ends[1] - ends[0])

    def _plain_quantile(self, position: float) -> float:
        n = self.values.size
        at = min(max(position, 0.0), 1.0) * n
        first = min(max(math.ceil(at - 1e-6), 1), n) - 1
        value = float(self.values[first])
        if first + 1 < n and abs(first + 1 - at) <= 1e-6:
            return 0.5 * (value + float(self.values[first + 1]))
        return value

    def _indicator(self, value: float) -> Floats:
        low, high = _around(value)
        below = (self.drawn < low).astype(np.float64)
        return np.asarray(0.5 * (below + (self.drawn <= high)), dtype=np.float64)

    def _up_to_quantile(self, position: float) -> Floats:
        below = self.drawn <= self._plain_quantile(position)
        return below.astype(np.float64)

    def _regression(
        self, below: Floats, position: float
    ) -> tuple[float, float, Floats]:
        """Return by how much the share below is off, the slope β, and H's indicator."""
        if self.control is None or self.scores is None:
            return 0.0, 0.0, below
        cut, expected = self.control.cut(position)
        hit = (self.scores <= cut).astype(np.float64)
        share = float(hit.mean())
        variance = share * (1.0 - share)
        if variance == 0.0:
            return 0.0, 0.0, hit
        covariance = float(hit @ below) / hit.size - share * float(below.mean())
        slope = covariance / variance
        return slope * (share - expected), slope, hit


def _around(value: float) -> tuple[float, float]:
    """Return between which numbers only rounding sets a value apart."""
    off = ROUNDING * max(1.0, abs(value))
    return value - off, value + off


Resamples = AllResamples | DrawnResamples


def distribution_of(resamples: Resamples) -> Distribution:
    """Return the values of resamples with their probabilities."""
    values, weights = resamples.values, resamples.weights
    for array in (values, weights):
        array.flags.writeable = False
    return Distribution(
        values=values,
        weights=weights,
        continuous=False,
        words=resamples.description,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Ends:
    """The ends of an interval."""

    low: float
    high: float
    errors: tuple[float, float] | None  # of Monte Carlo; None if nothing was drawn


@dataclass(frozen=True, slots=True, kw_only=True)
class EndpointRule:
    """How the ends come from resamples."""

    # [1] Efron, B., Tibshirani, R. J. (1993). An Introduction to the Bootstrap.
    # [2] Davison, A. C., Hinkley, D. V. (1997). Bootstrap Methods and their
    # Application.

    kind: Kind
    level: float
    value: float  # the estimate
    error: float = math.nan  # its standard error, where it is studentized
    skew: float = 0.0  # the acceleration of BCa

    def ends(self, resamples: Resamples) -> Ends | str:
        """Return the ends, or why there are none."""
        values = resamples.values
        if not (values.size and values[-1] - values[0] > ROUNDING):
            return "every resample gives the same value or none, so there is no spread"
        tail = 0.5 * (1.0 - self.level)
        levels, pulls = (tail, 1.0 - tail), (0.0, 0.0)
        if self.kind == "bca":
            share = resamples.share_below(self.value)
            if not 0.0 < share < 1.0:
                return (
                    "all resamples lie on one side of the estimate, so BCa has no bias"
                )
            levels = bca_levels(self.level, share, self.skew)
            pulls = self._pulls(share)
        first, last = (resamples.quantile(at) for at in levels)
        errors = None
        if isinstance(resamples, DrawnResamples):
            of_first, of_last = (
                resamples.error(at, pull, self.value)
                for at, pull in zip(levels, pulls, strict=True)
            )
            errors = (of_first, of_last)
        if self.kind in ("percentile", "bca"):  # (13.3) and (14.9) of [1]
            return Ends(low=first, high=last, errors=errors)
        return self._mirrored(first, last, errors)

    def _pulls(self, share: float) -> tuple[float, float]:
        """Return how fast the levels of BCa move with the share below the estimate."""
        step = 1e-4 * min(share, 1.0 - share)
        after = bca_levels(self.level, share + step, self.skew)
        before = bca_levels(self.level, share - step, self.skew)
        low, high = ((a - b) / (2 * step) for a, b in zip(after, before, strict=True))
        return low, high

    def _mirrored(
        self, first: float, last: float, errors: tuple[float, float] | None
    ) -> Ends:
        value, error = self.value, self.error
        back = None if errors is None else errors[::-1]
        if self.kind == "basic":  # (5.6) of [2]
            return Ends(low=2 * value - last, high=2 * value - first, errors=back)
        return Ends(  # (12.22) of [1]
            low=value - error * last,
            high=value - error * first,
            errors=None if back is None else (error * back[0], error * back[1]),
        )


def bca_levels(level: float, share: float, skew: float) -> tuple[float, float]:
    """Return which quantiles of the resamples are the ends of a BCa interval."""
    # [1] Efron, B., Tibshirani, R. J. (1993). An Introduction to the Bootstrap, ch. 14.
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
