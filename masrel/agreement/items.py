"""Distinct items, and the exact sums that coefficients of unnamed raters are made of.

An item is a row of counts: how many raters put it into each category. Items that are
alike are kept once, with how often they occur. Few of them are summed in Python
integers, many in numpy; both give the same sums.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from operator import mul
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.weights import Weights

__all__ = ["FewItems", "ItemTable", "Linear", "ManyItems", "SizeGroup", "item_table"]

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]

_FEW = 4_000  # counts that Python sums about as fast as numpy
_CANCELLED = 1_000  # times less than its terms, a sum in floats has lost three digits


class SizeGroup(NamedTuple):
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


class Linear(NamedTuple):
    """A linear function of an item: a[n] V + b[n] + e[n] Σ_k slopes_k n_k.

    V is the item's disagreement Σ_kl v_kl n_k n_l and n its number of ratings. All
    numbers are integers, to be divided by `denominator`.

    Attributes
    ----------
    by_size : mapping of int to tuple of int
        n to a, b and e.
    slopes : sequence of int, shape (n_categories,)
        The slopes; may be empty where every e is 0.
    denominator : int
        What all is divided by.
    """

    by_size: Mapping[int, tuple[int, int, int]]
    slopes: Sequence[int]
    denominator: int


class _Alike(NamedTuple):
    # distinct items of one number of ratings
    rows: list[Sequence[int]]
    times: list[int]
    squares: list[int]  # Σ_k n_k² of each


@dataclass(frozen=True)
class FewItems:
    """Distinct items as Python integers; all sums are exact.

    Attributes
    ----------
    rows : sequence of sequence of int, shape (n_distinct, n_categories)
        Raters per category.
    times : sequence of int, shape (n_distinct,)
        How often each occurs.
    n_categories : int
        Declared categories.
    """

    rows: Sequence[Sequence[int]]
    times: Sequence[int]
    n_categories: int

    def groups(self, weights: Weights) -> list[SizeGroup]:
        """Return the sums of each number of ratings there is.

        Parameters
        ----------
        weights : Weights
            Disagreement of two categories.

        Returns
        -------
        list of SizeGroup
            By number of ratings, items without any left out.
        """
        if weights.numerators is None:
            return self._plain_groups
        weighted = []
        for group in self._plain_groups:
            alike = self._by_size[group.size]
            v = [weights.disagreement(row, group.size) for row in alike.rows]
            apart = sum(map(mul, alike.times, v))
            weighted.append(group._replace(disagreement=apart))
        return weighted

    def square_sum(self, weights: Weights, function: Linear) -> tuple[int, int]:
        """Return Σ_i function(item)² as numerator and denominator.

        Parameters
        ----------
        weights : Weights
            Disagreement of two categories.
        function : Linear
            A function of an item.

        Returns
        -------
        tuple of int
            Numerator and denominator.
        """
        total = 0
        for size, alike in self._by_size.items():
            a, b, e = function.by_size[size]
            slopes = [e * slope for slope in function.slopes]
            if weights.numerators is None:
                v = [size * size - square for square in alike.squares]
            else:
                v = [weights.disagreement(row, size) for row in alike.rows]
            for row, times, apart in zip(alike.rows, alike.times, v, strict=True):
                value = a * apart + b + sum(map(mul, slopes, row))
                total += times * value * value
        return total, function.denominator**2

    @cached_property
    def _by_size(self) -> dict[int, _Alike]:
        found: dict[int, _Alike] = {}
        for row, times in zip(self.rows, self.times, strict=True):
            size = sum(row)
            if size not in found:
                found[size] = _Alike([], [], [])
            alike = found[size]
            alike.rows.append(row)
            alike.times.append(times)
            alike.squares.append(sum(map(mul, row, row)))
        found.pop(0, None)
        return dict(sorted(found.items()))

    @cached_property
    def _plain_groups(self) -> list[SizeGroup]:
        # identity weights: all pairs of ratings of an item less those alike
        groups = []
        for size, (rows, times, squares) in self._by_size.items():
            n_items = sum(times)
            totals = [
                sum(map(mul, times, column)) for column in zip(*rows, strict=True)
            ]
            apart = n_items * size * size - sum(map(mul, times, squares))
            groups.append(SizeGroup(size, n_items, totals, apart))
        return groups


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

    def square_sum(
        self, weights: Weights, function: Linear
    ) -> tuple[float, int] | tuple[int, int]:
        """Return Σ_i function(item)² as numerator and denominator.

        Each item is computed in floats, unless its terms cancel; then in integers.
        """
        counts = self.counts.astype(np.float64)
        sizes = self._sizes()
        # Only ratios of integers become floats: integers may be too large for one.
        largest = max(map(abs, function.slopes), default=0) or 1
        slopes = np.zeros(self.n_categories)
        slopes[: len(function.slopes)] = [s / largest for s in function.slopes]
        by_size = {
            size: (
                a * weights.denominator / function.denominator,
                b / function.denominator,
                e * largest / function.denominator,
            )
            for size, (a, b, e) in function.by_size.items()
        }
        met, at = np.unique(sizes, return_inverse=True)
        nothing = (0.0, 0.0, 0.0)
        parts = np.array([by_size[int(n)] if n else nothing for n in met])
        a, b, e = parts[at.reshape(-1)].T
        v = a * ((counts @ weights.as_floats()) * counts).sum(axis=1)
        sloped = e * (counts @ slopes)
        value = v + b + sloped
        terms = np.abs(v) + np.abs(b) + np.abs(e) * (counts @ np.abs(slopes))
        squares = float((self.times * value * value).sum())
        if float((self.times * terms * terms).sum()) > _CANCELLED**2 * squares:
            rows, times = self.counts.tolist(), self.times.tolist()
            few = FewItems(rows, times, self.n_categories)
            return few.square_sum(weights, function)
        return squares, 1

    def _sizes(self) -> Integers:
        # ratings of each item, (n_distinct,); a row may sum to more than 64 bits hold
        small = int(self.counts.max()) * self.n_categories < 2**62
        sizes: Integers = self.counts.sum(axis=1, dtype=None if small else object)
        return sizes

    def _unbounded(self) -> tuple[Integers, Integers]:
        # Python integers where a sum of squares could pass 64 bits
        largest = int(self._sizes().max()) ** 2 * int(self.times.sum())
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
