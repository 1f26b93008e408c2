"""Many distinct items as arrays: sums exact, and squares of them in floats."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.few_items import FewItems
from masrel.agreement.influence import Linear
from masrel.agreement.tally import SizeGroup, Tally, add_up
from masrel.agreement.weights import Weights

__all__ = ["ManyItems"]

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]

_CANCELLED = 1_000  # times less than its terms, a sum in floats has lost three digits


@dataclass(frozen=True, slots=True)
class ManyItems:
    """Distinct items as arrays: exact group sums, and squares summed in floats."""

    counts: Integers = field(compare=False, repr=False)  # (n_distinct, n_categories)
    times: Integers = field(compare=False, repr=False)  # (n_distinct,)

    @property
    def n_categories(self) -> int:
        """Declared categories."""
        return int(self.counts.shape[1])

    @property
    def sizes(self) -> list[int]:
        """The numbers of ratings of an item that there are, least first."""
        return [int(size) for size in np.unique(self._ratings())]

    def tally(self, weights: Weights) -> Tally:
        """Add the items up."""
        counts, times = self._unbounded()
        sizes = counts.sum(axis=1)
        groups = []
        for size in np.unique(sizes):
            if size == 0:
                continue
            alike = sizes == size
            rows, how_often = counts[alike], times[alike]
            weighed = rows * how_often[:, None]
            n_items, size = int(how_often.sum()), int(size)
            totals = [int(total) for total in weighed.sum(axis=0)]
            if weights.numerators is None:
                disagreement = n_items * size * size - int((weighed * rows).sum())
            else:
                products = (weighed.T @ rows).tolist()  # Σ_i n_ik n_il
                disagreement = sum(
                    v * c
                    for of_v, of_c in zip(weights.numerators, products, strict=True)
                    for v, c in zip(of_v, of_c, strict=True)
                )
            groups.append(SizeGroup(size, n_items, totals, disagreement))
        return add_up(groups, weights)

    def square_sum(
        self, weights: Weights, function: Linear
    ) -> tuple[float, int] | tuple[int, int]:
        """Return Σ_i function(item)² as numerator and denominator.

        Each item is computed in floats, unless its terms cancel; then in integers.
        """
        by_size, slopes = _in_floats(function, weights.denominator, self.n_categories)
        met, at = np.unique(self._ratings(), return_inverse=True)
        nothing = (0.0, 0.0, 0.0)
        parts = np.array([by_size[int(n)] if n else nothing for n in met])
        a, b, e = parts[at.reshape(-1)].T
        counts = self.counts.astype(np.float64)
        v = a * ((counts @ weights.as_floats()) * counts).sum(axis=1)
        value = v + b + e * (counts @ slopes)
        terms = np.abs(v) + np.abs(b) + np.abs(e) * (counts @ np.abs(slopes))
        squares = float((self.times * value * value).sum())
        if float((self.times * terms * terms).sum()) > _CANCELLED**2 * squares:
            rows, times = self.counts.tolist(), self.times.tolist()
            few = FewItems(rows, times, self.n_categories)
            return few.square_sum(weights, function)
        return squares, 1

    def _ratings(self) -> Integers:
        # ratings of each item, (n_distinct,); a row may sum to more than 64 bits hold
        small = int(self.counts.max()) * self.n_categories < 2**62
        sizes: Integers = self.counts.sum(axis=1, dtype=None if small else object)
        return sizes

    def _unbounded(self) -> tuple[Integers, Integers]:
        # Python integers where a sum of squares could pass 64 bits
        largest = int(self._ratings().max()) ** 2 * int(self.times.sum())
        if largest < 2**62:
            return self.counts, self.times
        return self.counts.astype(object), self.times.astype(object)


def _in_floats(
    function: Linear, denominator: int, n_categories: int
) -> tuple[dict[int, tuple[float, float, float]], Floats]:
    # Only ratios of integers become floats: the integers may be too large for one.
    largest = max(map(abs, function.slopes), default=0) or 1
    slopes = np.zeros(n_categories)
    slopes[: len(function.slopes)] = [s / largest for s in function.slopes]
    by_size = {
        size: (
            a * denominator / function.denominator,
            b / function.denominator,
            e * largest / function.denominator,
        )
        for size, (a, b, e) in function.by_size.items()
    }
    return by_size, slopes
