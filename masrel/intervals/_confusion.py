"""Which categories of an item meet: tables of all pairs of raters, and their shares."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.agreement import CodedRatings, specific_agreement
from masrel.agreement._engine import Array, Floats, Integers, divide
from masrel.agreement._rows import item_counts

_BLOCK = 1 << 14  # distinct items whose categories are spread out at once
_EXACT = 1 << 24  # whole numbers below it are exact in 32 bits

# [1] Korn, E. L., Graubard, B. I. (1998). Confidence intervals for proportions with
# small expected number of positive counts estimated from survey data. Survey
# Methodology 24, 193-201.


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


def category_arrays(
    codes: Integers,
    freq: Integers,
    counts: PairCounts,
    others: Sequence[int],
    level: float | None,
) -> dict[str, Array]:
    """Return how often each category is used, and how often raters agree on it."""
    chosen = _each_category(codes, others, counts.n_categories)
    met = chosen.sum(axis=1, keepdims=True) - 1.0  # other raters of the item
    same, pairs = chosen * (chosen - 1.0), chosen * np.maximum(met, 0.0)
    table = counts.confusion(_each_other(counts, others))[others].sum(axis=0)
    values = np.array(specific_agreement(table))
    low, high = np.full((2, len(values)), np.nan)
    if level is not None:
        low, high = share_interval(
            level,
            parts=freq @ same,
            wholes=freq @ pairs,
            squares=freq @ same**2,
            products=freq @ (same * pairs),
            whole_squares=freq @ pairs**2,
            n_items=freq @ (pairs > 0.0).astype(np.float64),
        )
    return {
        "category_counts": (freq @ chosen).astype(np.int64),
        "category_values": values,
        "category_low": low,
        "category_high": high,
    }


def confusion_arrays(
    codes: Integers,
    freq: Integers,
    counts: PairCounts,
    others: Sequence[int],
    right: int | None,
    level: float | None,
) -> dict[str, Array]:
    """Return what ratings of others, or of the reference, each rater's ratings met."""
    q = counts.n_categories
    held_against = others if right is None else [right]
    confusion = counts.confusion(_each_other(counts, held_against))[others]
    rows = np.broadcast_to(confusion.sum(axis=2, keepdims=True), confusion.shape)
    shares = divide(confusion.astype(np.float64), rows.astype(np.float64))
    low, high = np.full((2, *confusion.shape), np.nan)  # (n_raters, q, q)
    met = _each_category(codes, held_against, q)
    for place, rater in enumerate(others):
        if level is None:
            break
        mine = _each_category(codes, [rater], q)
        # of other raters, or of the reference: (n_rows, n_categories)
        of_others = met - mine if right is None else met
        mine *= freq[:, None]
        squares = (of_others**2).T @ mine  # Σ a², which is Σ ab
        n_items = ((of_others > 0).T.astype(np.float64) @ mine).sum(axis=1)
        wide = (q, q)  # a row of the table has one whole
        low[place], high[place] = share_interval(
            level,
            parts=confusion[place].astype(np.float64),
            wholes=rows[place].astype(np.float64),
            squares=squares,
            products=squares,
            whole_squares=np.broadcast_to(squares.sum(axis=1)[:, None], wide),
            n_items=np.broadcast_to(n_items[:, None], wide),
        )
    return {
        "confusion": confusion,
        "shares": shares,
        "share_low": low,
        "share_high": high,
    }


def _each_category(codes: Integers, raters: Sequence[int], q: int) -> Floats:
    """Return how many of some raters chose each category, (n_rows, n_categories)."""
    coded = CodedRatings(codes=codes[:, raters], categories=tuple(range(q)))
    return item_counts(coded.codes, coded.n_categories).astype(np.float64)


def _each_other(counts: PairCounts, others: Sequence[int]) -> NDArray[np.bool_]:
    # whose ratings each rater's are held against: of all others
    r = counts.n_raters
    against = np.zeros((r, r), dtype=bool)
    against[:, others] = True
    np.fill_diagonal(against, False)
    return against


def share_interval(
    level: float,
    *,
    parts: Floats,
    wholes: Floats,
    squares: Floats,
    products: Floats,
    whole_squares: Floats,
    n_items: Floats,
) -> tuple[Floats, Floats]:
    """Return Clopper and Pearson's intervals of shares at the effective size [1]."""
    # Takes sums over items of parts a of wholes b: Σ a, Σ b, Σ a², Σ ab, Σ b², and how
    # many items have b > 0; an array has one for each share
    from scipy.special import betaincinv, stdtrit

    share = divide(parts, wholes)
    # Σa/Σb = s varies by Σ (a - s b)² / (Σb)², that of m single ones by s(1 - s)/m
    variance = divide(
        squares - 2.0 * share * products + share * share * whole_squares, wholes**2
    )
    varies = variance > 1e-12 * share * (1.0 - share)
    with np.errstate(invalid="ignore", divide="ignore"):
        size = np.where(varies, share * (1.0 - share) / variance, n_items)
        # the variance is known from the items: by t, not from as many single ones
        upper = 0.5 + 0.5 * level
        many = stdtrit(np.maximum(wholes - 1.0, 1.0), upper)
        few = stdtrit(np.maximum(n_items - 1.0, 1.0), upper)
        size = np.minimum(size * (many / few) ** 2, wholes)
        x = share * size
        low = betaincinv(np.maximum(x, 1e-300), size - x + 1.0, 1.0 - upper)
        high = betaincinv(x + 1.0, np.maximum(size - x, 1e-300), upper)
    low = np.where(share <= 0.0, 0.0, low)
    high = np.where(share >= 1.0, 1.0, high)
    none = np.isnan(share)
    return np.where(none, np.nan, low), np.where(none, np.nan, high)
