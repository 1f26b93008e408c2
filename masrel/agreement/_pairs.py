"""Tables of pairs of two ratings, and kappa as a ratio of their sums."""

import itertools
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from masrel.agreement._counts import bilinear
from masrel.agreement._data import (
    CodedRatings,
    pairs_of_raters,
    raters_who_rate,
    refuse_measurements,
)
from masrel.agreement._kernel import (
    Array,
    Floats,
    Integers,
    Kernel,
    divide,
)
from masrel.agreement._labels import Codes
from masrel.agreement._weights import MANY, ManyWeights, Weights
from masrel.errors import ParameterError, RatingsError

_MAX_SIDE = 4000  # categories of a table of pairs


def two_raters(coded: CodedRatings, title: str) -> CodedRatings:
    """Return ratings that are of two raters, others without any left out."""
    coded = raters_who_rate(coded)
    n_columns = coded.codes.shape[1]
    if n_columns != 2:
        raise RatingsError(f"{title} needs the ratings of two raters, got {n_columns}")
    return coded


def pair_table(codes: Codes, n_categories: int) -> Integers:
    """Count the pairs of two columns of codes."""
    # codes (n_items, 2) -> (n_categories, n_categories)
    if n_categories > _MAX_SIDE:
        raise ParameterError(
            f"ratings: {n_categories} different grades are too many for a table of "
            "their pairs, which this statistic needs"
        )
    side = n_categories + 1
    # Missing, -1, becomes the last row and column, which is cut off.
    flat = codes[:, 0].astype(np.int32) * side + codes[:, 1] + side + 1
    freq = np.bincount(flat, minlength=side * side).reshape(side, side)
    return freq[1:, 1:].astype(np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class SparsePairs:
    """Pairs of grades so many that a table of them would mostly be zeros."""

    codes: Codes  # (n_items, 2): of the items with both
    is_whole: Array  # (n_rows,): which these are
    n_categories: int


def pairs_of(
    coded: CodedRatings, raters: tuple[int, int], v: Weights
) -> Integers | SparsePairs:
    """Count the pairs of grades of two raters, or keep them as they are."""
    codes = coded.codes[:, raters]
    if v.n_categories <= MANY or v.has_matrix:
        return pair_table(codes, v.n_categories)
    if v.is_exact:
        refuse_measurements(coded)
    is_whole = np.asarray((codes >= 0).all(axis=1))
    return SparsePairs(codes[is_whole], is_whole, v.n_categories)


@dataclass(frozen=True, slots=True)
class PairSums:
    """What kappa of a table of pairs is made of, in integers."""

    # With t the table, n its sum and w the denominator of the weights,
    # D_o = `observed` / (n w) and D_e = `expected` / (n² w).

    n: int
    observed: Any  # Σ_kl v_kl t_kl
    expected: Any  # Σ_kl v_kl t_k. t_.l
    w: int

    @classmethod
    def of(cls, table: Integers | SparsePairs, v: Weights) -> "PairSums":
        """Sum a table of pairs."""
        # Takes table (n_categories, n_categories)
        if isinstance(table, SparsePairs):
            return cls._of_many(table, v)
        cells: list[list[int]] = table.tolist()
        first = list(map(sum, cells))
        second = list(map(sum, zip(*cells, strict=True)))
        n = sum(first)
        observed: Any
        if isinstance(v, ManyWeights):
            observed = float((v.floats * table).sum())
        elif v.numerators is None:
            observed = n - sum([cells[k][k] for k in range(len(cells))])
        else:
            observed = sum(
                x * t
                for of_v, row in zip(v.numerators, cells, strict=True)
                for x, t in zip(of_v, row, strict=True)
            )
        return cls(n, observed, bilinear(v, first, second), v.denominator)

    @classmethod
    def _of_many(cls, pairs: SparsePairs, v: Weights) -> "PairSums":
        first, second = (
            np.bincount(column, minlength=v.n_categories) for column in pairs.codes.T
        )
        n = len(pairs.codes)
        observed = v.operator.pair(pairs.codes[:, 0], pairs.codes[:, 1]).sum().item()
        if v.is_exact:
            return cls(n, int(observed), n * n - int(first @ second), 1)
        return cls(n, observed, bilinear(v, first, second), 1)  # type: ignore[arg-type]

    def ratios(self) -> tuple[tuple[Any, int], tuple[Any, int]]:
        """Return D_o and D_e as numerator and denominator."""
        n, w = self.n, self.w
        return (self.observed, n * w), (self.expected, n * n * w)


class PairSlopes(NamedTuple):
    """What one more item in a cell of a table of pairs moves, times the table's sum."""

    d_o: Any
    d_e: Any
    observed: Array  # (n_categories, n_categories): of D_o
    expected: Array  # (n_categories, n_categories): of D_e

    @classmethod
    def of(cls, table: Integers | SparsePairs, v: Weights, exact: bool) -> "PairSlopes":
        """Return the slopes at a table that is not empty, in floats or fractions."""
        # Takes table (n_categories, n_categories)
        if isinstance(table, SparsePairs):
            return cls._of_many(table, v)
        exact = exact and v.is_exact
        freq = table.astype(object if exact else np.float64)
        # divided, so that the share of a cell that has all pairs is exactly 1
        p = freq / (Fraction(freq.sum()) if exact else freq.sum())
        matrix, first = v.fractions if exact else v.floats, p.sum(axis=1)
        to_second, to_first = matrix.dot(p.sum(axis=0)), first.dot(matrix)
        d_o, d_e = matrix.ravel().dot(p.ravel()), first.dot(to_second)
        # D_e = Σ_kl v_kl p_k. p_.l is bilinear: Σ_m (v_km p_.m + v_ml p_m.) - 2 D_e
        expected = to_second[:, None] + (to_first - 2 * d_e)
        return cls(d_o, d_e, matrix - d_o, expected)

    @classmethod
    def _of_many(cls, pairs: SparsePairs, v: Weights) -> "PairSlopes":
        # (n_pairs,) in place of cells
        first, second = pairs.codes.T
        p, q = (
            np.bincount(column, minlength=v.n_categories) / len(column)
            for column in (first, second)
        )
        between = v.operator.pair(first, second)
        to_second, to_first = v.dot(q, exact=False), v.dot(p, exact=False)
        d_o, d_e = float(between.mean()), float(p @ to_second)
        expected = to_second[first] + to_first[second] - 2.0 * d_e
        return cls(d_o, d_e, between - d_o, expected)

    def influence(self) -> Array:
        """Return the influence on κ = 1 - D_o/D_e of an item in each cell."""
        moved = self.d_o / self.d_e * self.expected - self.observed
        return np.asarray(moved / self.d_e)


def of_pairs(cells: Array, codes: Codes) -> Array:
    """Return what the cells of a table say of pairs; 0 where a rating is missing."""
    # cells (n_categories, n_categories), codes (n_rows, 2) -> (n_rows,)
    q = len(cells)
    padded = np.zeros((q + 1, q + 1), dtype=cells.dtype)
    padded[:q, :q] = cells  # missing, -1, is the last
    return np.asarray(padded[codes[:, 0], codes[:, 1]])


def _features(coded: CodedRatings, v: Floats) -> Floats:
    # (n_items, 2 + 2 n_categories): disagreement, presence, both categories; zeros
    # where a rating is missing
    codes, ranks = coded.codes, np.arange(len(v))
    if not len(v):  # nobody rated anything
        return np.zeros((len(codes), 2))
    both = np.min(codes, axis=1) >= 0
    disagreement = np.where(both, v[codes[:, 0], codes[:, 1]], 0.0)
    first, second = (both[:, None] & (codes[:, [r]] == ranks) for r in (0, 1))
    return np.column_stack([disagreement, both, first, second]).astype(np.float64)


def _value(sums: Floats, v: Floats) -> Floats:
    # sums (..., 2 + 2 n_categories) -> (...); D_o and D_e times n²
    q = len(v)
    first, second = sums[..., 2 : 2 + q], sums[..., 2 + q :]
    expected = ((first @ v) * second).sum(axis=-1)
    return 1.0 - divide(sums[..., 1] * sums[..., 0], expected)


COHEN_KERNEL = Kernel(features=_features, value=_value)
"""Cohen's kappa of two columns of ratings."""


def _pair_features(coded: CodedRatings, pairs: list[Codes], v: Floats) -> list[Floats]:
    """Return the features of several pairs of columns of ratings."""
    # each (n_items, 2 + 2 n_categories)
    return [
        COHEN_KERNEL.features(CodedRatings(codes=pair, categories=coded.categories), v)
        for pair in pairs
    ]


def _light_features(coded: CodedRatings, v: Floats) -> Floats:
    # (n_items, n_pairs (2 + 2 n_categories)): each pair's features in turn, 0 for
    # items that not every rater rated
    whole = np.min(coded.codes, axis=1) >= 0
    codes = np.where(whole[:, None], coded.codes, -1)
    pairs = itertools.combinations(range(codes.shape[1]), 2)
    return np.hstack(_pair_features(coded, [codes[:, pair] for pair in pairs], v))


def _light_value(sums: Floats, v: Floats) -> Floats:
    # sums (..., n_pairs (2 + 2 n_categories)) -> (...)
    of_pairs = sums.reshape(*sums.shape[:-1], -1, 2 + 2 * len(v))
    return np.asarray(COHEN_KERNEL.value(of_pairs, v).mean(axis=-1))


LIGHT_KERNEL = Kernel(features=_light_features, value=_light_value)


def _stratified_features(coded: CodedRatings, v: Floats) -> Floats:
    # (n_items, n_raters (2 + 2 n_categories)): each rater's pair features in turn
    return np.hstack(_pair_features(coded, pairs_of_raters(coded), v))


def _stratified_value(sums: Floats, v: Floats) -> Floats:
    # sums (..., n_raters (2 + 2 n_categories)) -> (...)
    q = len(v)
    parts = sums.reshape(*sums.shape[:-1], -1, 2 + 2 * q)
    n = np.where(parts[..., 1] > 0, parts[..., 1], 1.0)  # no pair adds 0 to both
    first, second = parts[..., 2 : 2 + q], parts[..., 2 + q :]
    expected = ((first @ v) * second).sum(axis=-1) / (n * n)
    return 1.0 - divide((parts[..., 0] / n).sum(axis=-1), expected.sum(axis=-1))


def _pooled_features(coded: CodedRatings, v: Floats) -> Floats:
    # (n_items, 2 + 2 n_categories): sums of an item's pairs, as for Cohen's kappa
    return np.asarray(np.sum(_pair_features(coded, pairs_of_raters(coded), v), axis=0))


STRATIFIED_KERNEL = Kernel(features=_stratified_features, value=_stratified_value)
POOLED_PAIRS_KERNEL = Kernel(features=_pooled_features, value=COHEN_KERNEL.value)
