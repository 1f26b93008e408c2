"""Values of resamples with their probabilities: of all there are, or of some drawn."""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._engine import Floats
from masrel.intervals._problem import ROUNDING, Integers, blocks

MAX_ALL = 300_000
"""Distinct resamples that are all taken rather than drawn."""

_SORTED = 2_000  # rows that are sorted column by column
_AT_ONCE = 1 << 20  # numbers held at once while values are computed


@dataclass(frozen=True, slots=True, kw_only=True)
class Resamples:
    """Distinct values, ascending, with their probabilities."""

    values: Floats = field(repr=False)  # none undefined
    weights: Floats = field(repr=False)  # sum to 1
    cumulative: Floats = field(repr=False)
    n_drawn: int | None  # None if all were taken
    n_undefined: int
    p_undefined: float  # their probability

    @classmethod
    def of(cls, values: Floats, weights: Floats | None = None) -> "Resamples":
        """Leave out what is undefined, sort values, and put equal ones together."""
        # values, weights (n_resamples,); without weights they are drawn
        n_drawn = values.size if weights is None else None
        weights = np.ones(values.size) if weights is None else weights
        known = ~np.isnan(values)
        n_undefined = values.size - int(known.sum())
        lost = float(weights[~known].sum() / max(weights.sum(), 1.0))
        values, weights = values[known], weights[known] / weights[known].sum()
        order = np.argsort(values)
        values, weights = values[order], weights[order]
        if values.size:
            with np.errstate(invalid="ignore"):  # two infinite values are the same
                gaps = np.diff(values)
            smaller = np.minimum(np.abs(values[1:]), np.abs(values[:-1]))
            is_new = gaps > ROUNDING * np.clip(smaller, 1.0, 1e300)
            first = np.flatnonzero(np.concatenate([[True], is_new]))
            values, weights = values[first], np.add.reduceat(weights, first)
        return cls(
            values=values,
            weights=weights,
            cumulative=np.cumsum(weights),
            n_drawn=n_drawn,
            n_undefined=n_undefined,
            p_undefined=lost,
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
        off = ROUNDING * max(1.0, abs(value))
        ends = np.searchsorted(self.values, (value - off, value + off))
        below, up_to = (float(self.cumulative[at - 1]) if at else 0.0 for at in ends)
        return 0.5 * (below + up_to)

    def error(self, position: float, pull: float = 0.0, share: float = 0.5) -> float:
        """Return the Monte Carlo error of a quantile of what was drawn.

        Its position moves by `pull` with the share of resamples below the estimate.
        """
        # Var[1(x ≤ q) - pull 1(x < estimate)], as the two are nested
        joint = min(position, share) - position * share
        n, plain = max(self.n_drawn or 1, 1), position * (1.0 - position)
        variance = plain - 2.0 * pull * joint + pull**2 * share * (1.0 - share)
        off = math.sqrt(max(variance, 0.0) / n)
        # times the slope of the quantile, from twice as far as it is off by itself
        reach = 2.0 * math.sqrt(plain / n)
        ends = max(position - reach, 0.0), min(position + reach, 1.0)
        low, high = (self.quantile(end) for end in ends)
        return off * (high - low) / (ends[1] - ends[0]) if low < high else 0.0


def distinct_features(rows: Floats, freq: Integers) -> tuple[Floats, Integers]:
    """Put items, or clusters, with equal features together."""
    if len(rows) <= _SORTED:
        distinct, kind = np.unique(rows, axis=0, return_inverse=True)
    else:
        # Equal rows have equal polynomials at any place, others hardly ever: sorting
        # these copies no millions of rows.
        key = np.zeros(len(rows))
        for column in rows.T:
            key = key * 0.7390851332151607 + column
        _, first, kind = np.unique(key, return_index=True, return_inverse=True)
        distinct = rows[first]
        if any((distinct[kind[at]] != rows[at]).any() for at in blocks(len(rows))):
            return rows, freq
    return distinct, np.bincount(kind.ravel(), weights=freq).astype(np.int64)


def count_compositions(n: int, n_units: int) -> int:
    """Return how many distinct resamples of n there are of some distinct units."""
    fewer = min(n, n_units - 1)
    # of so many they are more than anybody counts
    return math.comb(n + n_units - 1, fewer) if fewer < 30 else 10**15


def compositions(freq: Integers) -> tuple[NDArray[np.int32], Floats]:
    """Return how often each unit is in every resample, and its probability."""
    # freq (n_units,) -> (n_resamples, n_units), (n_resamples,)
    # n! Π share^t / t! in logarithms, so that no n over- or underflows.
    n = int(freq.sum())
    steps = np.log(np.maximum(np.arange(n + 1), 1))
    factorials = np.cumsum(steps, dtype=np.longdouble).astype(np.float64)
    left = np.array([n], dtype=np.int32)  # draws that are left to the next units
    logs = np.array([factorials[n]])
    columns: list[NDArray[np.int32]] = []
    for share in freq[:-1] / n:
        n_choices = left + 1
        parent = np.repeat(np.arange(left.size), n_choices)
        first = np.cumsum(n_choices) - n_choices
        drawn = (np.arange(parent.size) - first[parent]).astype(np.int32)
        columns = [column[parent] for column in columns] + [drawn]
        left = left[parent] - drawn
        logs = logs[parent] + (drawn * math.log(share) - factorials[drawn])
    logs = logs + (left * math.log(freq[-1] / n) - factorials[left])
    return np.column_stack([*columns, left]), np.exp(logs)


def all_resamples(
    freqs: Sequence[Integers], values: Callable[..., Floats], width: int
) -> Resamples:
    """Take every distinct resample once, of each sample by itself."""
    counts, weights = zip(*map(compositions, freqs), strict=True)
    places = np.array(list(itertools.product(*(range(len(of)) for of in counts))))
    of_blocks = [
        values(
            *(of[at].astype(np.float64) for of, at in zip(counts, block.T, strict=True))
        )
        for block in np.array_split(places, 1 + len(places) * width // _AT_ONCE)
    ]
    probabilities = [of[at] for of, at in zip(weights, places.T, strict=True)]
    return Resamples.of(np.concatenate(of_blocks), np.prod(probabilities, axis=0))


def draw_resamples(
    freqs: Sequence[Integers],
    values: Callable[..., Floats],
    width: int,
    n_resamples: int,
    generator: np.random.Generator,
) -> Resamples:
    """Draw as many of each sample as there are, with replacement."""
    size = max(1, _AT_ONCE // width)
    of_blocks = [
        values(
            *(
                generator.multinomial(
                    of.sum(), of / of.sum(), size=min(size, n_resamples - start)
                ).astype(np.float64)
                for of in freqs
            )
        )
        for start in range(0, n_resamples, size)
    ]
    return Resamples.of(np.concatenate(of_blocks))
