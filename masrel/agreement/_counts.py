"""Distinct items and distinct rows of ratings, each with how often it occurs.

An item of unnamed raters is a row of counts: how many raters put it into each
category. Sums over items are whole numbers, and exact.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from operator import mul
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._data import FEW, CodedRatings, check_scale, code_ratings
from masrel.agreement._labels import Codes, Label, has_doubtful_text, label_rows
from masrel.agreement._weights import MANY, ManyWeights, Weights

if TYPE_CHECKING:
    from masrel.agreement._many_grades import ItemsOfManyGrades

Array = NDArray[Any]
Integers = NDArray[np.int64]

_FEW_PLACES = 1 << 15  # ratings times categories that are counted one by one
_FEW_ROWS = 1 << 10  # rows for which one call costs less than a few for each rater
_MAX_KEYS = 1 << 22  # keys that are counted in a table rather than sorted
_MAX_SORTED = 20_000  # items that are sorted to find those alike
_BLOCK = 1 << 16  # items counted at once, so that they stay in the cache
_MAX_SMALL = 1 << 16  # keys that are counted by products of floats; < 2^24, so exact
# Ratings that are multiplied at once: they stay in the cache, and BLAS, which may take
# from 460 800 on, starts no threads, which wait for each other where cores are shared.
_SMALL_BLOCK = 1 << 17


class SizeGroup(NamedTuple):
    """Sums over the items that have the same number of ratings.

    Whole numbers; floats by weights of many categories.
    """

    size: int  # ratings of each item, at least 1
    n_items: int
    totals: Any  # (n_categories,): ratings per category
    disagreement: Any  # Σ_i Σ_kl v_kl n_ik n_il, times the denominator of the weights


class SufficientStatistics(NamedTuple):
    """What the value of a coefficient of unnamed raters depends on."""

    groups: list[SizeGroup]  # items by their number of ratings
    n_rated: int  # items with at least one rating
    n_usable: int  # items with at least two
    # D_o, the mean over usable items of Σ_kl v_kl n_ik n_il / (n_i (n_i - 1)), is
    # `observed` / `denominator`; the denominator is 0 if no item is usable
    observed: Any
    denominator: int
    # p_k, the mean over rated items of the part of their raters who chose category k,
    # is `marginals`_k / `total`
    marginals: Any
    total: int


class ItemArrays(NamedTuple):
    """Distinct items with their disagreement, in floats or exactly."""

    counts: Array  # (n_distinct, n_categories)
    freq: Array  # (n_distinct,)
    size: Any  # ratings of each, (n_distinct,); a number where all have as many
    disagreement: Array  # (n_distinct,): Σ_kl v_kl n_k n_l


@dataclass(slots=True, eq=False)
class DistinctItems:
    """Distinct rows of counts with how often each occurs; items without ratings go."""

    # Few, or too large for sums in 64 bits, are lists of Python's integers; many are
    # arrays.
    rows: list[tuple[int, ...]] | Integers  # (n_distinct, n_categories)
    freq: list[int] | Integers  # (n_distinct,)
    n_categories: int
    _groups: list[SizeGroup] | None = None  # where they are known, and no rows are
    _sums: SufficientStatistics | None = None  # of identity weights
    _arrays: ItemArrays | None = None

    @classmethod
    def of_arrays(cls, rows: Integers, freq: Integers | None = None) -> "DistinctItems":
        """Take rows in an array, once each unless it is said how often."""
        if freq is None:
            freq = np.ones(len(rows), dtype=np.int64)
        rated = rows.any(axis=1)
        if not rated.all():
            rows, freq = rows[rated], freq[rated]
        q = rows.shape[1]
        max_size = q * int(rows.max(initial=0))
        if rows.size <= FEW or max_size**2 * int(freq.sum()) >= 2**62:
            return cls(list(map(tuple, rows.tolist())), freq.tolist(), q)
        return cls(rows, freq, q)

    @classmethod
    def of_counts(cls, counts: Integers) -> "DistinctItems":
        """Put equal rows of a table of counts together."""
        # Takes counts (n_items, n_categories)
        base = int(counts.max()) + 1
        if counts.size > FEW and base ** counts.shape[1] <= _MAX_KEYS:
            freq = np.bincount(counts @ base ** np.arange(counts.shape[1]))
            keys = np.flatnonzero(freq)
            return cls.of_arrays(digits(keys, base, counts.shape[1]), freq[keys])
        return cls.of_arrays(counts)

    @classmethod
    def of_codes(cls, coded: CodedRatings) -> "DistinctItems":
        """Count the raters of each category, and put equal items together."""
        codes, q = coded.codes, len(coded.categories)
        n_items, n_raters = codes.shape
        if codes.size <= FEW:
            counter = Counter(map(tuple, item_counts(coded).tolist()))
            counter.pop((0,) * q, None)
            return cls(list(counter), list(counter.values()), q)
        # An item is one number: Σ over its raters of (n_raters + 1) to the power code.
        base = n_raters + 1
        n_keys = base**q
        is_sorted = n_keys < 2**62 and n_items <= _MAX_SORTED
        if not is_sorted and n_keys > _max_keys(n_items):
            return cls.of_arrays(item_counts(coded))
        most = min(_MAX_SMALL, n_items // 10)  # rows that are counted before items
        if q**n_raters <= most and (small := _small_rows(codes, q, most)) is not None:
            return cls.of_patterns(replace(coded, codes=small[0]), small[1])
        keys, freq = _count_keys(
            n_items, lambda at: _item_keys(codes[at], base, q), n_keys
        )
        return cls.of_arrays(digits(keys, base, q), freq)

    @classmethod
    def of_patterns(cls, coded: CodedRatings, often: Integers) -> "DistinctItems":
        """Count the raters of each category of rows that occur so often each."""
        codes, q = coded.codes, len(coded.categories)
        base = codes.shape[1] + 1
        if base**q >= 2**62:
            return cls.of_arrays(item_counts(coded), often)
        keys, at = np.unique(_item_keys(codes, base, q), return_inverse=True)
        freq = np.bincount(at, often).astype(np.int64)  # floats, exact to 2^53
        return cls.of_arrays(digits(keys, base, q), freq)

    def sums(self, v: Weights) -> SufficientStatistics:
        """Add the items up."""
        if v.numerators is None and self._sums is not None:
            return self._sums
        groups = self._groups
        if groups is None:
            groups = sum_groups(self.rows, self.freq, v)
        n_rated = n_usable = observed = 0
        multiple = 1  # of n (n - 1) for every number of ratings n
        for size, n_items, _, disagreement in groups:
            n_rated += n_items
            if size > 1:
                pairs = size * (size - 1)
                common = math.lcm(multiple, pairs)
                observed *= common // multiple
                observed += disagreement * (common // pairs)
                n_usable, multiple = n_usable + n_items, common
        if len(groups) == 1:
            marginals, total = groups[0].totals, n_rated * groups[0].size
        else:
            common = math.lcm(*[group.size for group in groups])
            weighed = [[t * (common // g.size) for t in g.totals] for g in groups]
            marginals = list(map(sum, zip(*weighed, strict=True)))
            marginals = marginals or [0] * self.n_categories
            total = n_rated * common
        denominator = n_usable * multiple
        sums = SufficientStatistics(
            groups, n_rated, n_usable, observed, denominator, marginals, total
        )
        if v.numerators is None:
            self._sums = sums
        return sums

    def arrays(self, v: Weights, exact: bool) -> ItemArrays:
        """Return the items as floats, or as whole numbers and fractions."""
        if v.numerators is None and self._arrays is not None and not exact:
            return self._arrays
        dtype = object if exact else np.float64
        counts, freq = np.array(self.rows, dtype), np.array(self.freq, dtype)
        groups = self.sums(v).groups
        if exact or len(groups) > 1:
            size = counts.sum(axis=1)
        else:  # as a rule: everybody rated everything
            size = float(groups[0].size)
        if isinstance(v, ManyWeights):
            others = counts.astype(np.float64) @ v.distances
        elif exact and v.numerators is None:  # Σ_l v_kl n_l is n - n_k; no matrix
            others = size[:, None] - counts
        else:
            # `dot` does what @ does, in half the time for a few items.
            others = counts.dot(v.fractions if exact else v.floats)
        disagreement = (others * counts).sum(axis=1)
        arrays = ItemArrays(counts, freq, size, disagreement)
        if v.numerators is None and not exact:
            self._arrays = arrays
        return arrays


def sum_groups(
    rows: list[tuple[int, ...]] | Integers, freq: list[int] | Integers, v: Weights
) -> list[SizeGroup]:
    """Add up items by their number of ratings."""
    # Takes rows (n_distinct, n_categories), freq (n_distinct,)
    groups = []
    if isinstance(v, ManyWeights):
        rows, freq = np.asarray(rows), np.asarray(freq)
    if isinstance(rows, list) and isinstance(freq, list):
        sizes = list(map(sum, rows))
        for size in sorted(set(sizes)):
            of, often = rows, freq
            if sizes.count(size) < len(sizes):
                of = [row for row, n in zip(rows, sizes, strict=True) if n == size]
                often = [f for f, n in zip(freq, sizes, strict=True) if n == size]
            n_items = sum(often)
            totals = [sum(map(mul, often, column)) for column in zip(*of, strict=True)]
            if v.numerators is None:
                agreeing = [sum(map(mul, row, row)) for row in of]
                disagreement = n_items * size * size - sum(map(mul, often, agreeing))
            else:
                between = [bilinear(v, row, row) for row in of]
                disagreement = sum(map(mul, often, between))
            groups.append(SizeGroup(size, n_items, totals, disagreement))
        return groups
    rows, freq = np.asarray(rows), np.asarray(freq)
    ratings = rows.sum(axis=1)
    # the sizes there are; `np.unique` loads masked arrays
    for size in np.flatnonzero(np.bincount(ratings)).tolist():
        same = ratings == size
        of, often = rows[same], freq[same]
        weighed = of * often[:, None]
        n_items, totals = int(often.sum()), weighed.sum(axis=0).tolist()
        if v.numerators is None:
            disagreement = n_items * size * size - int((weighed * of).sum())
        elif isinstance(v, ManyWeights):
            others = of.astype(np.float64) @ v.distances
            disagreement = ((others * of).sum(axis=1) @ often).item()
        else:  # Σ_kl v_kl Σ_i n_ik n_il
            products = (weighed.T @ of).tolist()
            disagreement = sum(
                sum(map(mul, *both))
                for both in zip(v.numerators, products, strict=True)
            )
        groups.append(SizeGroup(size, n_items, totals, disagreement))
    return groups


def bilinear(v: Weights, x: Sequence[int], y: Sequence[int]) -> Any:
    """Return Σ_kl v_kl x_k y_l of whole numbers, times the denominator of v.

    Of many categories it is a float, and so may x and y be.
    """
    if isinstance(v, ManyWeights) or isinstance(x, np.ndarray):
        first = np.asarray(x, np.float64)
        second = first if y is x else np.asarray(y, np.float64)
        return v.operator.between(first, second)
    if v.numerators is None:
        agreeing = sum(map(mul, x, y))
        return sum(x) * sum(y) - agreeing
    return sum(
        n * sum(map(mul, row, y)) for row, n in zip(v.numerators, x, strict=True) if n
    )


def item_counts(coded: CodedRatings) -> Integers:
    """Count the raters of each category, item by item."""
    # -> (n_items, n_categories)
    (n_items, n_raters), q = coded.codes.shape, len(coded.categories)
    if coded.codes.size * q <= _FEW_PLACES:
        width = q + 1  # code -1 is the first
        places = coded.codes + (width * np.arange(n_items)[:, None] + 1)
        counted = np.bincount(places.ravel(), minlength=width * n_items)
        return np.asarray(counted.reshape(n_items, width)[:, 1:], dtype=np.int64)
    if q <= n_raters:
        parts = [(coded.codes == k).sum(axis=1) for k in range(q)]
        return np.column_stack(parts)
    counts = np.zeros((n_items, q), dtype=np.int64)
    every = np.arange(n_items)
    for column in coded.codes.T:
        rated = column >= 0
        counts[every[rated], column[rated]] += 1  # an item once a column
    return counts


def distinct_rows(codes: Codes, n_categories: int) -> tuple[Integers, Integers]:
    """Put equal rows of codes together: the rows, and how often each occurs."""
    # codes (n_items, n_raters) -> (n_distinct, n_raters), (n_distinct,)
    n_items, n_raters = codes.shape
    base = n_categories + 1
    n_keys = base**n_raters  # a row is one number with n_raters digits
    if n_keys > 2**62:
        rows, freq = np.unique(codes, axis=0, return_counts=True)
        return rows.astype(np.int64), freq.astype(np.int64)
    if n_items <= _FEW_ROWS:
        powers = base ** np.arange(n_raters, dtype=np.int64)
        keys = (codes.astype(np.int64) + 1) @ powers
        order = keys.argsort()
        ascending = keys[order]
        is_last = np.ones(n_items, dtype=bool)  # of those with the same key
        np.not_equal(ascending[1:], ascending[:-1], out=is_last[:-1])
        (last,) = is_last.nonzero()
        freq = last + 1
        freq[1:] -= freq[:-1]  # numpy sees that they overlap
        return codes[order[last]].astype(np.int64), freq
    most = min(_MAX_SMALL, n_items // 2)
    if n_categories**n_raters <= most:
        small = _small_rows(codes, n_categories, most)
        if small is not None:
            return small
    keys, freq = _count_keys(n_items, lambda at: _row_keys(codes[at], base), n_keys)
    return digits(keys, base, n_raters) - 1, freq


def _small_rows(
    codes: Codes, n_categories: int, most: int
) -> tuple[Integers, Integers] | None:
    # distinct rows and how often each occurs, by their keys; None if those are many
    n_raters = codes.shape[1]
    lowest = -1 if codes.min() < 0 else 0  # a missing rating is a digit of its own
    base = n_categories - lowest
    n_keys = base**n_raters
    if n_keys > most:
        return None
    keys, freq = _count_keys(
        len(codes), lambda at: _small_keys(codes[at], lowest, base), n_keys
    )
    return digits(keys, base, n_raters) + lowest, freq


def _small_keys(codes: Codes, lowest: int, base: int) -> Integers:
    # Σ_r (code_r - lowest) base^r as a product of floats, each sum of which is a whole
    # number below 2^24
    n_items, n_raters = codes.shape
    powers = (base ** np.arange(n_raters, dtype=np.int64)).astype(np.float32)
    offset = -lowest * powers.sum()
    keys = np.empty(n_items, dtype=np.int64)
    block = max(1, min(1 << 14, _SMALL_BLOCK // n_raters))
    for start in range(0, n_items, block):
        rows = slice(start, start + block)
        keys[rows] = codes[rows].astype(np.float32) @ powers + offset
    return keys


def _count_keys(
    n_items: int, keys_of: Callable[[slice], Integers], n_keys: int
) -> tuple[Integers, Integers]:
    # distinct keys, which are less than n_keys, and how often each occurs
    if n_keys > _max_keys(n_items):
        keys, freq = np.unique(keys_of(slice(None)), return_counts=True)
        return keys, freq.astype(np.int64)
    table = np.zeros(n_keys, dtype=np.int64)
    for at in range(0, n_items, _BLOCK):
        table += np.bincount(keys_of(slice(at, at + _BLOCK)), minlength=n_keys)
    present = np.flatnonzero(table)
    return present, table[present]


def _max_keys(n_items: int) -> int:
    # that are counted in a table rather than sorted
    return min(_MAX_KEYS, 16 * n_items)


def digits(keys: Integers, base: int, n_digits: int) -> Integers:
    """Return the digits of keys, (n_keys, n_digits), the last most significant."""
    return keys[:, None] // base ** np.arange(n_digits, dtype=np.int64) % base


def _item_keys(codes: Codes, base: int, n_categories: int) -> Integers:
    powers = base ** np.arange(n_categories + 1, dtype=np.int64)
    powers[-1] = 0  # code -1 is the last entry
    if base**n_categories < 2**31:
        powers = powers.astype(np.int32)
    keys = powers[codes[:, 0]]
    for column in codes.T[1:]:
        keys += powers[column]
    return keys


def _row_keys(codes: Codes, base: int) -> Integers:
    # Σ_r (code_r + 1) base^r, by Horner's rule
    keys = codes[:, -1].astype(np.int64) + 1
    for column in codes.T[-2::-1]:
        keys *= base
        keys += column
        keys += 1
    return keys


@dataclass(slots=True, kw_only=True, eq=False)
class CountedRatings:
    """Ratings with their distinct items counted, for several coefficients at once.

    Attributes
    ----------
    categories : tuple of str, int or float
        Declared categories in order.
    items : DistinctItems
        Distinct items with how often each occurs.
    n_raters : int
        Raters with at least one rating.
    source : CodedRatings, callable or None
        The ratings, or a call that gives them; None where only counts are known.
    declared : bool
        False if nobody declared the categories, and they are the labels met.
    """

    categories: tuple[Label, ...]
    items: "DistinctItems | ItemsOfManyGrades"
    n_raters: int
    source: CodedRatings | Callable[[], CodedRatings] | None
    declared: bool = True

    @property
    def coded(self) -> CodedRatings | None:
        """The ratings; None where only counts are known, and not who rated what."""
        if callable(self.source):
            self.source = self.source()
        return self.source


def count_ratings(
    ratings: object, categories: Sequence[Label] | None = None
) -> CountedRatings:
    """Check ratings once, and count distinct items once, for several coefficients.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.

    Returns
    -------
    CountedRatings
        What every coefficient takes in place of ratings.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.

    Warns
    -----
    RatingsWarning
        As `code_ratings`.

    Examples
    --------
    >>> from masrel.agreement import fleiss_kappa, gwet_ac
    >>> counted = count_ratings([["a", "a"], ["b", "b"], ["a", "b"]])
    >>> fleiss_kappa(counted).value == gwet_ac(counted).value
    True
    """
    if isinstance(ratings, CountedRatings):
        if categories is not None and categories is not ratings.categories:
            check_scale(ratings.categories, categories)
        return ratings
    few = ratings
    if type(ratings) is np.ndarray and ratings.ndim == 2 and ratings.size <= FEW:
        few = ratings.tolist()
    if isinstance(few, list) and len(few) <= FEW:
        rows, scale = label_rows(few, categories)
        counter = None
        is_text = categories is None and scale and isinstance(scale[0], str)
        if not (is_text and has_doubtful_text(scale)):
            counter = _count_complete(rows, scale)
        if counter is not None:
            return CountedRatings(
                categories=scale,
                declared=categories is not None,
                items=DistinctItems(list(counter), list(counter.values()), len(scale)),
                n_raters=len(rows[0]),
                source=partial(code_ratings, rows, categories),
            )
    coded = code_ratings(ratings, categories)
    items: DistinctItems | ItemsOfManyGrades
    if len(coded.categories) <= MANY:
        items = DistinctItems.of_codes(coded)
    else:
        from masrel.agreement import _many_grades  # it takes the types of this module

        items = _many_grades.ItemsOfManyGrades(coded)
    return CountedRatings(
        categories=coded.categories,
        declared=coded.declared,
        items=items,
        n_raters=coded.n_raters,
        source=coded,
    )


def _count_complete(
    rows: list[list[object]], scale: tuple[Label, ...]
) -> dict[tuple[int, ...], int] | None:
    # few labels of a scale of few, without codes; None if one is missing or no label
    n_raters = len(rows[0])
    if len(rows) * n_raters > FEW or len(scale) > n_raters:
        return None
    freq: dict[tuple[int, ...], int] = {}
    try:
        for row in rows:
            item = tuple(map(row.count, scale))
            freq[item] = freq.get(item, 0) + 1
    except (ArithmeticError, TypeError, ValueError):  # neither equal nor unequal
        return None
    return freq if set(map(sum, freq)) == {n_raters} else None
