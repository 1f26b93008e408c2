"""Kappas of tables of two ratings: Cohen's, Light's, stratified and pooled.

Sums over items are, of each table t, d_t and n_t, the disagreement of its n_t pairs,
and its margins P_tk and Q_tl. D_o = d/n and D_e = P'VQ/n² of each.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal, get_args

import numpy as np

from masrel._input import check_option, refuse
from masrel.agreement._codes import (
    code_pairs,
    complete_rows,
    count_ratings,
    raters_told_apart,
    side_by_side,
    two_raters,
)
from masrel.agreement._engine import (
    Features,
    Floats,
    Formula,
    Integers,
    divide,
    estimate,
)
from masrel.agreement._labels import Codes, Label
from masrel.agreement._weights import Weights, WeightsLike
from masrel.errors import RatingsError
from masrel.estimates import Estimate

Deletion = Literal["listwise", "pairwise"]
"""Which items count when ratings are missing."""


def _every_two(codes: Codes) -> Integers:
    # columns of every two raters
    return np.array(np.triu_indices(codes.shape[1], 1)).T


def _own_two(codes: Codes) -> Integers:
    # columns of each rater's two ratings
    return np.arange(codes.shape[1]).reshape(-1, 2)


def _features(
    pairs_of: Callable[[Codes], Integers],
    codes: Codes,
    v: Any,
    _repeats: Integers | None = None,
    *,
    listwise: bool = False,
    together: bool = False,
) -> Features:
    # of every table, or of all of them together as one
    if listwise:
        codes = np.where((codes >= 0).all(axis=1, keepdims=True), codes, -1)
    tables, q = codes[:, pairs_of(codes)], len(v)  # (n_rows, n_tables, 2)
    both = (tables >= 0).all(axis=2)
    first, second = tables[both].T
    d = np.zeros(both.shape)
    d[both] = v[first, second]
    starts = q * np.arange(2 * both.shape[1])
    dense = np.hstack([d, both.astype(np.float64)])
    if together:
        starts %= 2 * q
        dense = np.column_stack([d.sum(axis=1), both.sum(axis=1)])
    places = np.maximum(tables, 0).reshape(len(codes), len(starts)) + starts
    chosen = np.repeat(both, 2, axis=1).astype(np.float64)
    return Features(dense.T, places, chosen, q * dense.shape[1])


def _parts(sums: Floats, v: Any) -> tuple[Floats, Floats, Floats, Floats]:
    # of each table d, n (..., n_tables), P and Q (..., n_tables, q)
    n_tables = sums.shape[-1] // (2 + 2 * len(v))
    margins = sums[..., 2 * n_tables :].reshape(*sums.shape[:-1], n_tables, 2, len(v))
    d, n = sums[..., :n_tables], sums[..., n_tables : 2 * n_tables]
    return d, n, margins[..., 0, :], margins[..., 1, :]


def _joined(
    of_d: Floats, of_n: Floats, of_between: Floats, parts: Any, v: Any
) -> Floats:
    # slopes in d, in n and in P'VQ of each table to those in all sums
    _, _, p, q = parts
    of_margins = of_between[..., None, None] * np.stack([q @ v, p @ v], axis=-2)
    flat = of_margins.reshape(*of_d.shape[:-1], 2 * math.prod(p.shape[-2:]))
    return np.concatenate([of_d, of_n, flat], axis=-1)


def _mean_of_tables(sums: Floats, v: Any) -> tuple[Floats, Floats, Floats]:
    # the mean over tables of κ = 1 - n d / P'VQ
    d, n, p, q = parts = _parts(sums, v)
    between, m = ((p @ v) * q).sum(axis=-1), n.shape[-1]
    of_d, of_n = -n / (m * between), -d / (m * between)
    slope = _joined(of_d, of_n, n * d / (m * between**2), parts, v)
    return d / n, between / (n * n), slope


def _stratified(sums: Floats, v: Any) -> tuple[Floats, Floats, Floats]:
    # κ = 1 - Σ_t d_t/n_t / Σ_t P'VQ_t/n_t²: D_o and D_e are means over the strata with
    # a pair, each with margins of its own
    d, n, p, q = parts = _parts(sums, v)
    d_o, d_e = divide(d, n, 0.0), divide(((p @ v) * q).sum(axis=-1), n * n, 0.0)
    all_o, all_e = d_o.sum(axis=-1, keepdims=True), d_e.sum(axis=-1, keepdims=True)
    ratio = all_o / all_e
    once = divide(np.ones_like(n), n, 0.0) / all_e
    of_n = once * (d_o - 2.0 * ratio * d_e)
    slope = _joined(-once, of_n, divide(ratio * once, n, 0.0), parts, v)
    n_used = (n > 0).sum(axis=-1, keepdims=True)
    return all_o / n_used, all_e / n_used, slope


_COHEN = Formula(
    name="cohen_kappa",
    title="Cohen's kappa",
    count=partial(two_raters, title="Cohen's kappa"),
    features=partial(_features, lambda _: np.array([[0, 1]])),
    disagreements=_mean_of_tables,
)
_LIGHT = Formula(
    name="light_kappa",
    title="Light's kappa",
    features=partial(_features, _every_two, listwise=True),
    disagreements=_mean_of_tables,
)
_LIGHT_PAIRWISE = replace(_LIGHT, features=partial(_features, _every_two))
_STRATIFIED = Formula(
    name="stratified_kappa",
    title="stratified kappa",
    features=partial(_features, _own_two),
    disagreements=_stratified,
)
_POOLED_PAIRS = Formula(
    name="pooled_kappa",
    title="pooled kappa",
    features=partial(_features, _own_two, together=True),
    disagreements=_mean_of_tables,
)


def cohen_kappa(
    ratings: object,
    other: object = None,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    population: int | None = None,
) -> Estimate:
    """Estimate Cohen's kappa of two raters, or weighted kappa.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, 2)
        Labels or numbers; None and ``nan`` are missing.
    other : sequence of str, int or float, shape (n_items,), optional
        The labels of the second rater, where `ratings` are those of the first: item by
        item in the same order, of Series by the same index.
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
        If an option is invalid, or the weights do not fit the categories.

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

    The same, a sequence a rater:

    >>> cohen_kappa(["a", "a", "b", "b"], ["a", "b", "b", "b"]).value
    0.5
    """
    return estimate(
        _COHEN,
        side_by_side(ratings, other),
        categories,
        weights,
        population=population,
    )


def light_kappa(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    deletion: Deletion = "listwise",
    population: int | None = None,
) -> Estimate:
    """Estimate Light's kappa: the mean of Cohen's kappa over pairs of raters.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.
    weights : str or array_like, shape (n_categories, n_categories), optional
        How much two categories agree; see `declared_weights`.
    deletion : {"listwise", "pairwise"}, optional
        Use the items that every rater rated, or for each pair of raters those that
        both rated.
    population : int, optional
        Items there are in all, for the finite-population correction.

    Returns
    -------
    Estimate
        The coefficient with its standard error over items; `observed` and `chance`
        are means over pairs of raters.

    Raises
    ------
    RatingsError
        If the ratings are not such a table or of fewer than two raters.
    ParameterError
        If an option is invalid, or the weights do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If kappa is undefined for any pair of raters: no item has both ratings, or
        both used one and the same category throughout. The value is then ``nan``.

    References
    ----------
    .. [1] Light, R. J. (1971). Measures of response agreement for qualitative data.
       Psychological Bulletin, 76(5), 365-377. https://doi.org/10.1037/h0031643

    Examples
    --------
    >>> light_kappa([["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]]).value
    0.5
    """
    check_option("deletion", deletion, get_args(Deletion))
    everybody = count_ratings(ratings, categories)
    counted = raters_told_apart(everybody)
    n_raters = counted.codes.shape[1]
    needed = f"Light's kappa needs at least two raters, got {n_raters}"
    refuse((n_raters < 2, needed), error=RatingsError)
    if deletion == "listwise":
        counted = complete_rows(counted)
    rate = np.flatnonzero((everybody.codes >= 0).any(axis=0))
    return estimate(
        _LIGHT_PAIRWISE if deletion == "pairwise" else _LIGHT,
        counted,
        None,
        weights,
        population=population,
        why=partial(_why_no_mean, rate if len(rate) > 1 else np.arange(n_raters)),
    )


def _why_no_mean(
    columns: Integers, weights: Weights, observed: Floats, expected: Floats
) -> str | None:
    """Return why one of the pairs of raters, in these columns, has no kappa."""
    if weights.reason is not None:
        return weights.reason
    pairs = itertools.combinations(columns.tolist(), 2)
    for (first, second), d_o, d_e in zip(pairs, observed, expected, strict=False):
        of_pair = f"of the raters in columns {first} and {second}"
        if np.isnan(d_o):
            return f"no item has both ratings {of_pair}"
        if d_e == 0.0:
            if weights.tells_apart:
                return f"0/0: there is only one category {of_pair}"
            return weights.no_chance
    return None


def stratified_kappa(
    pairs: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
) -> Estimate:
    """Estimate one kappa over raters who each rated the same items twice.

    Each rater is a stratum with margins of its own. The estimate is
    Σ(p_o - p_e) / Σ(1 - p_e) over strata, so it stays defined when the kappa of one
    rater is not.

    Parameters
    ----------
    pairs : nested sequence or array_like, shape (n_raters, n_items, 2)
        Per rater, the grades of both sessions, items in the same order for every
        rater; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.
    weights : str or array_like, shape (n_categories, n_categories), optional
        How much two categories agree; see `declared_weights`.

    Returns
    -------
    Estimate
        The coefficient; `observed` and `chance` are means over the raters used. The
        standard error takes items as the sample, each with all its raters.

    Raises
    ------
    RatingsError
        If the pairs are not such a table.
    ParameterError
        If the weights are unknown, or do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If no rater has a pair, or every rater used one category throughout.

    Notes
    -----
    A rater without any pair of grades is left out. Pooling the pairs of all raters
    into one Cohen's kappa is another estimand: `pooled_kappa`.

    References
    ----------
    .. [1] Barlow, W., Lai, M.-Y., Azen, S. P. (1991). A comparison of methods for
       calculating a stratified kappa. Statistics in Medicine, 10(9), 1465-1472.
       https://doi.org/10.1002/sim.4780100913

    Examples
    --------
    >>> first = [["a", "a"], ["b", "b"], ["a", "b"]]
    >>> second = [["a", "a"], ["a", "a"], ["a", "a"]]  # kappa alone would be 0/0
    >>> round(stratified_kappa([first, second]).value, 3)
    0.4
    """
    return _of_sessions(_STRATIFIED, pairs, categories, weights)


def pooled_kappa(
    pairs: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
) -> Estimate:
    """Estimate Cohen's kappa of the pairs of all raters together.

    Parameters
    ----------
    pairs : nested sequence or array_like, shape (n_raters, n_items, 2)
        Per rater, the grades of both sessions, items in the same order for every
        rater; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.
    weights : str or array_like, shape (n_categories, n_categories), optional
        How much two categories agree; see `declared_weights`.

    Returns
    -------
    Estimate
        The coefficient. The standard error takes items as the sample, each with the
        pairs of all its raters: pairs of one item are not independent.

    Raises
    ------
    RatingsError
        If the pairs are not such a table.
    ParameterError
        If the weights are unknown, or do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If there is no pair, or every grade is the same.

    Notes
    -----
    Raters who differ in their margins look as if they agreed with themselves beyond
    chance: `stratified_kappa` takes each rater's own margins, and is the one to use
    unless a reader asks for this.

    References
    ----------
    .. [1] Barlow, W., Lai, M.-Y., Azen, S. P. (1991). A comparison of methods for
       calculating a stratified kappa. Statistics in Medicine, 10(9), 1465-1472.
       https://doi.org/10.1002/sim.4780100913

    Examples
    --------
    >>> first = [["a", "a"], ["b", "b"], ["a", "b"]]
    >>> second = [["a", "a"], ["a", "a"], ["a", "a"]]
    >>> round(pooled_kappa([first, second]).value, 3)
    0.571
    """
    return _of_sessions(_POOLED_PAIRS, pairs, categories, weights)


def _of_sessions(
    formula: Formula,
    pairs: object,
    categories: Sequence[Label] | None,
    weights: "WeightsLike",
) -> Estimate:
    """Estimate a kappa of each rater's two gradings."""
    counted = count_ratings(code_pairs(pairs, categories))
    # both of any item; each rater has two columns
    rated = (counted.codes >= 0).reshape(len(counted.codes), -1, 2)
    n_raters = int(rated.all(axis=2).any(axis=0).sum())
    return estimate(formula, counted, None, weights, n_raters=n_raters)
