"""How often every two raters chose every two categories of an item: counted at once."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._kernel import Integers

_BLOCK = 1 << 14  # distinct items whose categories are spread out at once
_EXACT = 1 << 24  # whole numbers below it are exact in 32 bits


@dataclass(frozen=True, slots=True, kw_only=True)
class PairCounts:
    """Tables of all pairs of raters."""

    # items that rater i put into category k - 1 and rater j into l - 1 are at
    # [i, k, j, l]; category 0 is a missing rating
    tables: Integers = field(compare=False, repr=False)

    @classmethod
    def of(cls, codes: Integers, freq: Integers, n_categories: int) -> "PairCounts":
        """Count distinct rows of codes that occur so often."""
        # Takes codes (n_patterns, n_raters), freq (n_patterns,)
        n_raters, q = codes.shape[1], n_categories
        total = np.zeros((n_raters * q, n_raters * q))
        # a sum over a block of ones is exact in 32 bits, and twice as fast
        dtype = np.float32 if int(freq.sum()) < _EXACT else np.float64
        for start in range(0, len(codes), _BLOCK):
            block = slice(start, start + _BLOCK)
            ones = codes[block, :, None] == np.arange(q, dtype=codes.dtype)
            each = ones.reshape(len(ones), -1).astype(dtype)
            if (freq[block] == 1).all():
                total += each.T @ each  # of a matrix with itself: half the work
            else:
                total += (each * freq[block, None].astype(dtype)).T @ each
        met = np.rint(total).astype(np.int64).reshape(n_raters, q, n_raters, q)
        # a rating without one of the other is what all ratings are less those with
        tables = np.zeros((n_raters, q + 1, n_raters, q + 1), dtype=np.int64)
        tables[:, 1:, :, 1:] = met
        chosen = np.einsum("ikik->ik", met)
        tables[:, 0, :, 1:] = chosen - met.sum(axis=1)
        tables[:, 1:, :, 0] = chosen[:, :, None] - met.sum(axis=3)
        return cls(tables=tables)

    @property
    def n_raters(self) -> int:
        """How many raters there are."""
        return len(self.tables)

    @property
    def n_categories(self) -> int:
        """How many categories there are."""
        return int(self.tables.shape[1]) - 1

    def shared(self) -> Integers:
        """Return how many items each two raters both rated, (n_raters, n_raters)."""
        return np.asarray(self.tables[:, 1:, :, 1:].sum(axis=(1, 3)))

    def of_pair(self, one: int, other: int) -> tuple[Integers, Integers]:
        """Return the distinct rows of two raters, and how often each occurs."""
        table = self.tables[one, :, other, :].copy()
        table[0, 0] = 0  # rated by neither
        rows = np.argwhere(table > 0)
        return rows - 1, table[tuple(rows.T)]

    def pairs(self) -> Iterator[tuple[int, int]]:
        """Return every two raters once."""
        return (
            (i, j) for i in range(self.n_raters) for j in range(i + 1, self.n_raters)
        )

    def confusion(self, others: NDArray[np.bool_]) -> Integers:
        """Return ratings of others (rows) and of each rater (columns) of an item."""
        # others (n_raters, n_raters): whose ratings the raters are held against
        met = self.tables[:, 1:, :, 1:]
        return np.asarray(np.einsum("ikjl,ij->ilk", met, others.astype(np.int64)))
