"""Many distinct items as arrays: sums exact, and squares of them in floats."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.few_items import FewItems
from masrel.agreement.float_sums import float_square_sum, rounded
from masrel.agreement.influence import Linear, RoundedLinear
from masrel.agreement.tally import SizeGroup, Tally, add_up
from masrel.agreement.weights import Weights

__all__ = ["ManyItems"]

Integers = NDArray[np.int64]


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
        """Return Σ_i function(item)² as numerator and denominator."""
        # Each item is computed in floats, unless its terms cancel; then in integers.
        function_in_floats = rounded(function, weights.denominator)
        squares = self.rounded_square_sum(weights, function_in_floats)
        if squares is None:
            rows, times = self.counts.tolist(), self.times.tolist()
            return FewItems(rows, times, self.n_categories).square_sum(
                weights, function
            )
        return squares, 1

    def rounded_square_sum(
        self, weights: Weights, function: RoundedLinear
    ) -> float | None:
        """Return Σ_i function(item)² from floats, or None if its terms cancel."""
        sizes = self._ratings()
        return float_square_sum(self.counts, self.times, sizes, weights, function)

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
