"""Cohen's kappa: agreement of two raters, each with margins of their own."""

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement.coding import CodedRatings, Label, code_ratings
from masrel.agreement.counts import check_table
from masrel.agreement.kernel import Floats, Kernel, divide
from masrel.agreement.undefined import defined, kappa, ratio
from masrel.errors import RatingsError
from masrel.estimates import Estimate

__all__ = [
    "COHEN_KERNEL",
    "cohen_kappa",
    "cohen_kappa_from_table",
    "pair_features",
    "pair_table",
]


def cohen_kappa(
    ratings: object, *, categories: Sequence[Label] | None = None
) -> Estimate:
    """Estimate Cohen's kappa of two raters.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, 2)
        Labels or numbers; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.

    Returns
    -------
    Estimate
        The coefficient, with its delta-method standard error over items.

    Raises
    ------
    RatingsError
        If the ratings are not such a table or of more than two raters.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has both ratings, or all ratings are in one category; the value
        is then ``nan``.

    Notes
    -----
    Only items with both ratings are used, for agreement and for the margins.

    References
    ----------
    .. [1] Cohen, J. (1960). A coefficient of agreement for nominal scales.
       Educational and Psychological Measurement, 20(1), 37-46.
       https://doi.org/10.1177/001316446002000104

    Examples
    --------
    >>> cohen_kappa([["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]]).value
    0.5
    """
    coded = code_ratings(ratings, categories)
    n_columns = coded.codes.shape[1]
    if n_columns != 2:
        raise RatingsError(
            f"Cohen's kappa needs the ratings of two raters, got {n_columns}"
        )
    return _estimate(pair_table(coded.codes, coded.n_categories))


def cohen_kappa_from_table(table: ArrayLike) -> Estimate:
    """Estimate Cohen's kappa from a contingency table.

    Parameters
    ----------
    table : array_like of int, shape (n_categories, n_categories)
        Items per category of the first (rows) and second rater (columns).

    Returns
    -------
    Estimate
        As of `cohen_kappa`.

    Raises
    ------
    CountsError
        If it is not a square table of counts.

    Warns
    -----
    UndefinedStatisticWarning
        As `cohen_kappa`.

    Examples
    --------
    >>> cohen_kappa_from_table([[1, 1], [0, 2]]).value
    0.5
    """
    return _estimate(check_table(table))


def pair_table(codes: NDArray[np.int64], n_categories: int) -> NDArray[np.int64]:
    """Count the pairs of two columns of codes.

    Parameters
    ----------
    codes : ndarray of int64, shape (n_items, 2)
        Codes of two ratings; pairs with a missing one are left out.
    n_categories : int
        Declared categories.

    Returns
    -------
    ndarray of int64, shape (n_categories, n_categories)
        Items per pair of categories.
    """
    both = codes[(codes >= 0).all(axis=1)]
    flat = both[:, 0] * n_categories + both[:, 1]
    return (
        np.bincount(flat, minlength=n_categories**2)
        .reshape(n_categories, n_categories)
        .astype(np.int64)
    )


def _estimate(table: NDArray[np.int64]) -> Estimate:
    # shape of table: (n_categories, n_categories)
    cells: list[list[int]] = table.tolist()
    n = sum(map(sum, cells))
    observed = chance = None
    if n > 0:
        rows = [sum(row) for row in cells]
        columns = [sum(column) for column in zip(*cells, strict=True)]
        observed = Fraction(sum(cells[k][k] for k in range(len(cells))), n)
        chance = Fraction(sum(r * c for r, c in zip(rows, columns, strict=True)), n * n)
    value = kappa(observed, chance)
    return Estimate(
        coefficient="cohen_kappa",
        weights="identity",
        value=ratio(value),
        standard_error=_standard_error(table, n, observed, chance, value),
        observed=ratio(observed),
        chance=ratio(chance),
        n_items=n,
        n_raters=2 if n else 0,
        n_categories=len(cells),
        reason=defined("Cohen's kappa", observed, chance),
    )


def _standard_error(
    table: NDArray[np.int64],
    n: int,
    observed: Fraction | None,
    chance: Fraction | None,
    value: Fraction | None,
) -> float:
    if n < 2 or observed is None or chance is None or value is None:
        return math.nan
    first = table.sum(axis=1) / n  # margins
    second = table.sum(axis=0) / n
    agree = np.eye(table.shape[0])
    # An item in cell (i, j) moves p_e by p_.i + p_j. - 2 p_e.
    on_chance = second[:, None] + first[None, :] - 2 * float(chance)
    influence = agree - float(observed) - float(1 - value) * on_chance
    influence /= float(1 - chance)
    # n - 1: items are a sample, as for the coefficients of many raters.
    return float(np.sqrt((table * influence**2).sum() / (n * (n - 1))))


def pair_features(codes: NDArray[np.int64], n_categories: int) -> Floats:
    """Return what each pair adds to the sums Cohen's kappa needs.

    Parameters
    ----------
    codes : ndarray of int64, shape (n_items, 2)
        Codes of two ratings, -1 where missing.
    n_categories : int
        Declared categories.

    Returns
    -------
    ndarray, shape (n_items, 2 + 2 n_categories)
        Agreement, presence, and indicators of the two categories; zeros where one
        is missing.
    """
    both = np.logical_and(codes[:, 0] >= 0, codes[:, 1] >= 0)
    agree = both & (codes[:, 0] == codes[:, 1])
    present = both.reshape(-1, 1)
    ranks = np.arange(n_categories)
    first = present & (codes[:, :1] == ranks)
    second = present & (codes[:, 1:] == ranks)
    return np.column_stack([agree, both, first, second]).astype(np.float64)


def _features(coded: CodedRatings) -> Floats:
    return pair_features(coded.codes, coded.n_categories)


def _value(sums: Floats, n_categories: int) -> Floats:
    # sums (..., 2 + 2 n_categories) -> (...); times n² so that all are integers
    agree, n = sums[..., 0], sums[..., 1]
    first = sums[..., 2 : 2 + n_categories]
    second = sums[..., 2 + n_categories :]
    expected = (first * second).sum(axis=-1)
    return divide(n * agree - expected, n * n - expected)


COHEN_KERNEL = Kernel(features=_features, value=_value)
