"""Cohen's kappa: agreement of two raters, each with margins of their own."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement.coding import CodedRatings, Codes, Label, code_ratings
from masrel.agreement.counts import check_table, column_categories
from masrel.agreement.kernel import Floats, Kernel, divide
from masrel.agreement.standard_error import check_population, standard_error
from masrel.agreement.undefined import NO_CHANCE, NO_PAIR, undefined
from masrel.agreement.weights import WeightName, Weights, declared_weights
from masrel.errors import RatingsError
from masrel.estimates import Estimate

__all__ = [
    "COHEN_KERNEL",
    "PairSums",
    "cohen_kappa",
    "cohen_kappa_from_table",
    "pair_table",
    "two_raters",
]

Table = NDArray[np.int64]


def cohen_kappa(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightName | ArrayLike" = "identity",
    population: int | None = None,
) -> Estimate:
    """Estimate Cohen's kappa of two raters, or weighted kappa.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, 2)
        Labels or numbers; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.
    weights : str or array_like, shape (n_categories, n_categories), optional
        How much two categories agree; see `declared_weights`.
    population : int, optional
        Items there are in all, for the finite-population correction.

    Returns
    -------
    Estimate
        The coefficient with its standard error over items.

    Raises
    ------
    RatingsError
        If the ratings are not such a table or not of two raters.
    ParameterError
        If an option is none, or the weights do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has both ratings, or all ratings are in one category; the value
        is then ``nan``.

    Notes
    -----
    Only items with both ratings are used, for agreement and for the margins. The
    standard error is that of Fleiss, Cohen and Everitt [2]_, over n - 1.

    References
    ----------
    .. [1] Cohen, J. (1960). A coefficient of agreement for nominal scales.
       Educational and Psychological Measurement, 20(1), 37-46.
       https://doi.org/10.1177/001316446002000104
    .. [2] Fleiss, J. L., Cohen, J., Everitt, B. S. (1969). Large sample standard
       errors of kappa and weighted kappa. Psychological Bulletin, 72(5), 323-327.
       https://doi.org/10.1037/h0028106

    Examples
    --------
    >>> cohen_kappa([["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]]).value
    0.5
    """
    coded = two_raters(code_ratings(ratings, categories), "Cohen's kappa")
    v = declared_weights(weights, coded.categories, declared=coded.declared)
    return _estimate(pair_table(coded.codes, coded.n_categories), v, population)


def cohen_kappa_from_table(
    table: ArrayLike,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightName | ArrayLike" = "identity",
    population: int | None = None,
) -> Estimate:
    """Estimate Cohen's kappa from a contingency table.

    Parameters
    ----------
    table : array_like of int, shape (n_categories, n_categories)
        Items per category of the first (rows) and second rater (columns).
    categories, weights, population : optional
        As of `cohen_kappa`; categories are 1 to n_categories unless given.

    Returns
    -------
    Estimate
        As of `cohen_kappa`.

    Raises
    ------
    CountsError
        If it is not a square table of counts.
    ParameterError
        As `cohen_kappa`.

    Warns
    -----
    UndefinedStatisticWarning
        As `cohen_kappa`.

    Examples
    --------
    >>> cohen_kappa_from_table([[1, 1], [0, 2]]).value
    0.5
    """
    checked = check_table(table)
    labels = column_categories(categories, len(checked))
    return _estimate(checked, declared_weights(weights, labels), population)


def two_raters(coded: CodedRatings, title: str) -> CodedRatings:
    """Return ratings that are of two raters.

    Parameters
    ----------
    coded : CodedRatings
        Any ratings.
    title : str
        Who asks, for the message.

    Returns
    -------
    CodedRatings
        The same.

    Raises
    ------
    RatingsError
        If there are more or fewer columns than two.
    """
    n_columns = coded.codes.shape[1]
    if n_columns != 2:
        raise RatingsError(f"{title} needs the ratings of two raters, got {n_columns}")
    return coded


def pair_table(codes: Codes, n_categories: int) -> Table:
    """Count the pairs of two columns of codes.

    Parameters
    ----------
    codes : ndarray of int, shape (n_items, 2)
        Codes of two ratings; pairs with a missing one are left out.
    n_categories : int
        Declared categories.

    Returns
    -------
    ndarray of int64, shape (n_categories, n_categories)
        Items per pair of categories.
    """
    side = n_categories + 1
    # Missing, -1, becomes the last row and column, which is cut off.
    flat = codes[:, 0].astype(np.int32) * side + codes[:, 1] + side + 1
    times = np.bincount(flat, minlength=side * side).reshape(side, side)
    return times[1:, 1:].astype(np.int64)


@dataclass(frozen=True, slots=True)
class PairSums:
    """What kappa of a table of pairs is made of, in integers.

    With t the table and n its sum, D_o = `above` / (n · w) and D_e = `below` /
    (n² · w), where w is the denominator of the weights.
    """

    cells: list[list[int]]
    n: int
    above: int  # Σ_kl v_kl t_kl
    below: int  # Σ_kl v_kl t_k. t_.l
    to_second: list[int]  # Σ_l v_kl t_.l
    to_first: list[int]  # Σ_k v_kl t_k.

    @classmethod
    def of(cls, table: Table, v: Weights) -> "PairSums":
        """Sum a table of pairs.

        Parameters
        ----------
        table : ndarray of int64, shape (n_categories, n_categories)
            Items per pair of categories.
        v : Weights
            Disagreement of two categories.

        Returns
        -------
        PairSums
            Its sums.
        """
        cells: list[list[int]] = table.tolist()
        first = [sum(row) for row in cells]
        second = [sum(column) for column in zip(*cells, strict=True)]
        n = sum(first)
        to_second = v.products(second)
        if v.numerators is None:
            above = n - sum([cells[k][k] for k in range(len(cells))])
        else:
            above = sum(
                [
                    sum([x * t for x, t in zip(of_v, row, strict=True) if t])
                    for of_v, row in zip(v.numerators, cells, strict=True)
                ]
            )
        below = sum([t * vt for t, vt in zip(first, to_second, strict=True)])
        return cls(cells, n, above, below, to_second, v.products(first))

    def influence(self, k: int, l: int, v: Weights) -> int:  # noqa: E741 - as in the formula
        """Return the influence of an item in cell (k, l), times `below`² / n.

        An item moves D_o by v_kl - D_o, and D_e by Σ_m (v_km p_.m + v_ml p_m.) - 2 D_e.
        """
        if v.numerators is None:
            own = 0 if k == l else 1
        else:
            own = v.numerators[k][l]
        margins = self.to_second[k] + self.to_first[l]
        raised = self.n * self.above * margins
        return raised - self.n * own * self.below - self.above * self.below


def _estimate(table: Table, v: Weights, population: int | None) -> Estimate:
    # shape of table: (n_categories, n_categories)
    found = PairSums.of(table, v)
    n = found.n
    check_population(population, n)
    reason = None
    if n == 0:
        reason = undefined("Cohen's kappa", NO_PAIR)
    elif v.reason is not None:
        reason = undefined("Cohen's kappa", v.reason)
    elif found.below == 0:
        reason = undefined("Cohen's kappa", NO_CHANCE)
    value = observed = chance = math.nan
    error: float | Callable[[], float] = math.nan
    if n and v.reason is None:
        w = v.denominator
        observed = (n * w - found.above) / (n * w)
        chance = (n * n * w - found.below) / (n * n * w)
        if reason is None:
            value = (found.below - n * found.above) / found.below
            error = partial(_error, found, v, population)
    return Estimate(
        coefficient="cohen_kappa",
        weights=v.name,
        value=value,
        standard_error=error,
        observed=observed,
        chance=chance,
        n_items=n,
        n_raters=2 if n else 0,
        n_categories=len(table),
        reason=reason,
    )


def _error(found: PairSums, v: Weights, population: int | None) -> float:
    squares = sum(
        t * found.influence(k, l, v) ** 2
        for k, row in enumerate(found.cells)
        for l, t in enumerate(row)  # noqa: E741 - k, l as in the formula
        if t
    )
    return standard_error(squares * found.n**2, found.below**4, found.n, population)


def _features(coded: CodedRatings, v: Floats) -> Floats:
    # (n_items, 2 + 2 n_categories): disagreement, presence, both categories; zeros
    # where a rating is missing
    codes, ranks = coded.codes, np.arange(len(v))
    both = np.min(codes, axis=1) >= 0
    apart = np.where(both, v[codes[:, 0], codes[:, 1]], 0.0)
    first, second = (both[:, None] & (codes[:, [r]] == ranks) for r in (0, 1))
    return np.column_stack([apart, both, first, second]).astype(np.float64)


def _value(sums: Floats, v: Floats) -> Floats:
    # sums (..., 2 + 2 n_categories) -> (...); D_o and D_e times n²
    q = len(v)
    first, second = sums[..., 2 : 2 + q], sums[..., 2 + q :]
    expected = ((first @ v) * second).sum(axis=-1)
    return 1.0 - divide(sums[..., 1] * sums[..., 0], expected)


COHEN_KERNEL = Kernel(features=_features, value=_value)
