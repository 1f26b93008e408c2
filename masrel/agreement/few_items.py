"""Few distinct items: every sum in Python integers, and so exact."""

from collections.abc import Sequence
from operator import mul
from typing import NamedTuple

import numpy as np

from masrel.agreement.float_sums import float_square_sum
from masrel.agreement.influence import Linear, RoundedLinear
from masrel.agreement.tally import SizeGroup, Tally, add_up
from masrel.agreement.weights import Weights, identity_weights

__all__ = ["FewItems"]


class _Alike(NamedTuple):
    # distinct items of one number of ratings
    rows: list[Sequence[int]]
    times: list[int]
    squares: list[int]  # Σ_k n_k² of each


class FewItems:
    """Distinct items as Python integers; all sums are exact."""

    # Takes rows (n_distinct, n_categories), times (n_distinct,)

    __slots__ = ("_by_size", "_tally", "n_categories", "rows", "sizes", "times")

    def __init__(
        self, rows: list[Sequence[int]], times: list[int], n_categories: int
    ) -> None:
        self.rows = rows
        self.times = times
        self.n_categories = n_categories
        sizes = list(map(sum, rows))
        self.sizes = sorted(set(sizes))
        self._by_size = _alike(rows, times, sizes, self.sizes)
        groups = [_plain_group(size, alike) for size, alike in self._by_size.items()]
        self._tally = add_up(groups, identity_weights(n_categories))

    def tally(self, weights: Weights) -> Tally:
        """Add the items up."""
        if weights.numerators is None:
            return self._tally
        weighted = []
        for group in self._tally.groups:
            alike = self._by_size[group.size]
            v = [weights.disagreement(row, group.size) for row in alike.rows]
            apart = sum(map(mul, alike.times, v))
            weighted.append(group._replace(disagreement=apart))
        return add_up(weighted, weights)

    def square_sum(self, weights: Weights, function: Linear) -> tuple[int, int]:
        """Return Σ_i function(item)² as numerator and denominator."""
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

    def rounded_square_sum(
        self, weights: Weights, function: RoundedLinear
    ) -> float | None:
        """Return Σ_i function(item)² from floats, or None if its terms cancel."""
        counts = np.array(self.rows, dtype=np.int64)
        times = np.array(self.times, dtype=np.int64)
        sizes = np.array(list(map(sum, self.rows)), dtype=object)
        return float_square_sum(counts, times, sizes, weights, function)


def _alike(
    rows: list[Sequence[int]], times: list[int], sizes: list[int], met: list[int]
) -> dict[int, _Alike]:
    # by number of ratings, least first; items without any are left out
    squares = [sum(map(mul, row, row)) for row in rows]
    if len(met) == 1 and met[0]:  # as a rule: everybody rated everything
        return {met[0]: _Alike(rows, times, squares)}
    found = {size: _Alike([], [], []) for size in met if size}
    for i, size in enumerate(sizes):
        if size:
            found[size].rows.append(rows[i])
            found[size].times.append(times[i])
            found[size].squares.append(squares[i])
    return found


def _plain_group(size: int, alike: _Alike) -> SizeGroup:
    # identity weights: all pairs of ratings of an item less those alike
    rows, times, squares = alike
    n_items = sum(times)
    totals = [sum(map(mul, times, column)) for column in zip(*rows, strict=True)]
    apart = n_items * size * size - sum(map(mul, times, squares))
    return SizeGroup(size, n_items, totals, apart)
