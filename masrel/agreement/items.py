"""Distinct items, and the exact sums that coefficients of unnamed raters are made of.

An item is a row of counts: how many raters put it into each category. Items that are
alike are kept once, with how often they occur. Few of them are summed in Python
integers, many in numpy; both give the same sums.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.weights import Weights

__all__ = ["FewItems", "ItemTable", "Linear", "ManyItems", "SizeGroup", "item_table"]

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]

_FEW = 4_000  # counts that Python sums about as fast as numpy


@dataclass(frozen=True, slots=True)
class SizeGroup:
    """Sums over the items that have the same number of ratings.

    Attributes
    ----------
    size : int
        Ratings of each item, at least 1.
    n_items : int
        How many items.
    totals : list of int, shape (n_categories,)
        Ratings per category.
    disagreement : int
        Σ_i Σ_kl v_kl n_ik n_il, times the denominator of the weights.
    """

    size: int
    n_items: int
    totals: list[int]
    disagreement: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Linear:
    """A linear function of an item: a[n] V + b[n] + e[n] Σ_k slopes_k n_k.

    V is the item's disagreement Σ_kl v_kl n_k n_l and n its number of ratings. All
    numbers are integers, to be divided by `denominator`.
    """

    by_size: Mapping[int, tuple[int, int, int]]
    slopes: Sequence[int]
    denominator: int


@dataclass(frozen=True, slots=True)
class FewItems:
    """Distinct items as Python integers; all sums are exact."""

    rows: Sequence[Sequence[int]]
    times: Sequence[int]
    n_categories: int

    def groups(self, weights: Weights) -> list[SizeGroup]:
        """Return the sums of each number of ratings there is."""
        found: dict[int, list[list[int]]] = {}
        for row, times in zip(self.rows, self.times, strict=True):
            size = sum(row)
            if size:
                v = weights.disagreement(row, size) if size > 1 else 0
                found.setdefault(size, []).append(
                    [times, times * v, *[times * n for n in row]]
                )
        groups = []
        for size, parts in sorted(found.items()):
            n_items, disagreement, *totals = map(sum, zip(*parts, strict=True))
            groups.append(SizeGroup(size, n_items, totals, disagreement))
        return groups

    def square_sum(self, weights: Weights, function: Linear) -> tuple[int, int]:
        """Return Σ_i function(item)² as numerator and denominator."""
        total = 0
        for row, times in zip(self.rows, self.times, strict=True):
            size = sum(row)
            if size:
                a, b, e = function.by_size[size]
                value = b
                if a and size > 1:
                    value += a * weights.disagreement(row, size)
                if e:
                    slopes = function.slopes
                    value += e * sum([n * s for n, s in zip(row, slopes, strict=True)])
                total += times * value * value
        return total, function.denominator**2


@dataclass(frozen=True, slots=True)
class ManyItems:
    """Distinct items as arrays: exact group sums, and squares summed in floats."""

    counts: Integers = field(compare=False, repr=False)  # (n_distinct, n_categories)
    times: Integers = field(compare=False, repr=False)  # (n_distinct,)

    @property
    def n_categories(self) -> int:
        """Declared categories."""
        return int(self.counts.shape[1])

    def groups(self, weights: Weights) -> list[SizeGroup]:
        """Return the sums of each number of ratings there is."""
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
        return groups

    def square_sum(self, weights: Weights, function: Linear) -> tuple[float, int]:
        """Return Σ_i function(item)² and 1; each item is computed in floats."""
        counts = self.counts.astype(np.float64)
        sizes = self.counts.sum(axis=1)
        v = weights.denominator * ((counts @ weights.as_floats()) * counts).sum(axis=1)
        place = {size: i for i, size in enumerate(function.by_size)}
        parts = np.array(
            [
                [part / function.denominator for part in abe]
                for abe in function.by_size.values()
            ]
        )
        rated = sizes > 0
        at = np.array([place[int(size)] for size in np.unique(sizes[rated])])
        a, b, e = parts[at[np.unique(sizes[rated], return_inverse=True)[1]]].T
        sloped = counts[rated] @ np.array([float(s) for s in function.slopes])
        value = a * v[rated] + b + e * sloped
        return float((self.times[rated] * value * value).sum()), 1

    def _unbounded(self) -> tuple[Integers, Integers]:
        # Python integers where a sum of squares could pass 64 bits
        largest = int(self.counts.sum(axis=1).max()) ** 2 * int(self.times.sum())
        if largest < 2**62:
            return self.counts, self.times
        return self.counts.astype(object), self.times.astype(object)


ItemTable = FewItems | ManyItems
"""Distinct items with how often each occurs."""


def item_table(counts: Integers, times: Integers | None = None) -> ItemTable:
    """Choose how distinct items are kept.

    Parameters
    ----------
    counts : ndarray of int64, shape (n_rows, n_categories)
        Raters per category.
    times : ndarray of int64, shape (n_rows,), optional
        How often each row occurs; once each unless given.

    Returns
    -------
    FewItems or ManyItems
        The table.
    """
    if counts.size <= _FEW:
        how_often = [1] * len(counts) if times is None else times.tolist()
        return FewItems(counts.tolist(), how_often, counts.shape[1])
    if times is None:
        times = np.ones(len(counts), dtype=np.int64)
    return ManyItems(counts, times)
