"""Kappas of an item × rater table: percent, Fleiss, Scott, Brennan, Gwet, Conger.

Sums over items are d, s and P_k: the disagreement d of the s items with a pair of
ratings, and the shares of each item's raters who chose category k, all in `WHOLE`
parts. D_o = d/s, and D_e is a function of p = P / Σ_k P_k alone: a coefficient is its
chance function, which also gives the gradient. v is the disagreement of two categories.
Conger's kappa tells raters apart, each with shares of its own.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from masrel._input import refuse, shown
from masrel.agreement._codes import (
    complete_rows,
    count_items,
    count_ratings,
    item_counts,
    raters_told_apart,
    side_by_side,
    two_raters,
)
from masrel.agreement._engine import (
    WHOLE,
    Features,
    Floats,
    Formula,
    Integers,
    Resampled,
    divide,
    estimate,
    tested,
    undefined,
)
from masrel.agreement._labels import Codes, Label
from masrel.agreement._weights import WeightsLike, declared_weights
from masrel.estimates import Estimate, Significance

_MAX_PAIRS = 1 << 20  # of ratings whose disagreement is looked up at once
_MANY_RATERS = 1000

# From p (..., q) and v to D_e (..., 1) and its gradient (..., q)
_Chance = Callable[[Floats, Any], tuple[Floats, Floats]]


def _no_chance(p: Floats, _v: Any) -> tuple[Floats, Floats]:
    return np.ones((*p.shape[:-1], 1)), np.zeros_like(p)  # 1 - D_o/1: what is observed


def _shared_margins(p: Floats, v: Any) -> tuple[Floats, Floats]:
    others = p @ v
    # 1 - P̄_e = Σ_kl v_kl p_k p_l of Fleiss (1971)
    return (others * p).sum(axis=-1, keepdims=True), 2.0 * others


def _every_category_alike(p: Floats, v: Any) -> tuple[Floats, Floats]:
    mean = v.sum() / len(v) ** 2  # 1 - Σ_kl w_kl / q²
    return np.full((*p.shape[:-1], 1), mean), np.zeros_like(p)


def _hard_items(p: Floats, v: Any) -> tuple[Floats, Floats]:
    # 1 - p_e with p_e = T_w / (q (q - 1)) Σ_k p_k (1 - p_k), T_w = Σ_kl w_kl
    q = len(v)
    if q < 2:  # one category leaves no room for chance: 0/0
        return np.zeros((*p.shape[:-1], 1)), np.zeros_like(p)
    t_w = (q * q - v.sum()) / (q * (q - 1))
    d_e = 1.0 - t_w * (p * (1.0 - p)).sum(axis=-1, keepdims=True)
    # where all weights are 1 and all categories equally frequent it is 0, but rounded
    return np.where(abs(d_e) < 1e-15, 0.0, d_e), -t_w * (1.0 - 2.0 * p)


def _item_features(codes: Codes, v: Any, repeats: Integers | None = None) -> Features:
    # d, s, and the shares of categories of each row
    if repeats is None and codes.shape[1] > max(_MANY_RATERS, len(v)):
        # pairs of so many raters are pairs of categories, counted
        rated = [row[row >= 0] for row in codes]
        repeats = np.array([np.bincount(row, minlength=len(v)) for row in rated])
        codes = np.tile(np.arange(len(v)), (len(codes), 1))
    if repeats is None:
        # so that rows of the same ratings are equal, with what is missing behind
        codes = np.sort(codes, axis=1)[:, ::-1]
    chosen = np.array(codes >= 0 if repeats is None else repeats, dtype=np.float64)
    size, within = chosen.sum(axis=1), np.empty(len(codes))
    step = max(1, _MAX_PAIRS // max(codes.shape[1], 1) ** 2)
    for start in range(0, len(codes), step):
        rows = slice(start, start + step)
        pairs, often = v[codes[rows, :, None], codes[rows, None, :]], chosen[rows]
        # in two steps: one sum over all pairs of many raters is rounded too often
        of_first = np.einsum("igh,ih->ig", pairs, often)
        within[rows] = np.einsum("ig,ig->i", of_first, often)
    d = within * (WHOLE / np.maximum(size * (size - 1.0), 1.0))
    d[size < 2] = 0.0  # also where v is nan
    chosen *= (WHOLE / np.maximum(size, 1.0))[:, None]
    dense = np.array([d, (size > 1) * float(WHOLE)])
    return Features(dense, np.maximum(codes, 0), chosen, len(v))


def _complete_features(
    codes: Codes, v: Any, repeats: Integers | None = None
) -> Features:
    # of the rows that every rater rated
    whole = (codes >= 0).all(axis=1, keepdims=True)
    return _item_features(np.where(whole, codes, -1), v, repeats)


def _disagreements(
    chance: _Chance, sums: Floats, v: Any
) -> tuple[Floats, Floats, Floats]:
    d, s, r = sums[..., :1], sums[..., 1:2], sums[..., 2:].sum(axis=-1, keepdims=True)
    p, d_o = sums[..., 2:] / r, d / s
    d_e, of_p = chance(p, v)
    # ∂κ = -∂D_o / D_e + D_o/D_e² ∂D_e
    of_d = -1.0 / (s * d_e)
    of_e = d_o / (d_e * d_e)
    of_shares = (of_p - (of_p * p).sum(axis=-1, keepdims=True)) * (of_e / r)
    return d_o, d_e, np.concatenate([of_d, -of_d * d_o, of_shares], axis=-1)


def _resampled(codes: Codes, v: Any, freq: Integers | None = None) -> Resampled:
    # in whole units and not in `WHOLE` parts, which ratios do not notice
    if freq is not None:
        return _raters_resampled(codes, v, freq)
    each = (codes[:, :, None] == np.arange(len(v))).astype(np.float64)
    rated = (codes >= 0).astype(np.float64)  # (n_rows, n_raters)

    def sums(rows: Floats, raters: Floats) -> Floats:
        # (b, n_rows), (b, n_raters) -> (b, 2 + q)
        counts = np.tensordot(raters, each, axes=(1, 1))  # (b, n_rows, q)
        n = counts.sum(axis=-1)
        # Copies of a rater agree, and disagree in nothing: only their number goes.
        pairs = n * n - raters**2 @ rated.T
        features = np.empty((*n.shape, 2 + len(v)))
        features[..., 0] = divide(((counts @ v) * counts).sum(axis=-1), pairs, 0.0)
        features[..., 1] = pairs != 0
        features[..., 2:] = divide(counts, n[..., None], 0.0)
        return np.asarray(np.einsum("bi,bif->bf", rows, features))

    return sums


def _raters_resampled(codes: Codes, v: Any, freq: Integers) -> Resampled:
    # the same of fixed rows, many times faster: those that the same raters rated are
    # summed once, pair of raters by pair, and Σ_i v of their categories is a quadratic
    # form in how often each rater is taken
    each = (codes[:, :, None] == np.arange(len(v))).astype(np.float64)
    weighed = each * freq[:, None, None]
    patterns, kind = np.unique(codes >= 0, axis=0, return_inverse=True)
    groups = []
    for k, rated in enumerate(patterns):
        same = kind.ravel() == k
        others = (each[same] @ v).transpose(0, 2, 1)
        both = np.tensordot(weighed[same], others, axes=((0, 2), (0, 1)))
        groups.append((rated, freq[same].sum(), both, weighed[same].sum(axis=0)))

    def sums(_rows: Floats, raters: Floats) -> Floats:
        total = np.zeros((len(raters), 2 + len(v)))
        for rated, n_items, both, chosen in groups:
            of = raters * rated
            n = of.sum(axis=-1)
            pairs = n * n - (of * of).sum(axis=-1)
            total[:, 0] += divide(((of @ both) * of).sum(axis=-1), pairs, 0.0)
            total[:, 1] += n_items * (pairs != 0)
            total[:, 2:] += divide(of @ chosen, n[:, None], 0.0)
        return total

    return sums


def _pooled(name: str, title: str, chance: _Chance) -> Formula:
    """Return the formula of a coefficient by its expected disagreement."""
    return Formula(
        name=name,
        title=title,
        features=_item_features,
        disagreements=partial(_disagreements, chance),
        resampled=_resampled,
    )


_PERCENT = _pooled("percent_agreement", "percent agreement", _no_chance)
_FLEISS = _pooled("fleiss_kappa", "Fleiss' kappa", _shared_margins)
_BRENNAN_PREDIGER = replace(
    _pooled(
        "brennan_prediger", "the Brennan-Prediger coefficient", _every_category_alike
    ),
    needs_categories=True,
)
_GWET = replace(_pooled("gwet_ac", "Gwet's AC", _hard_items), needs_categories=True)
_SCOTT = replace(
    _FLEISS,
    name="scott_pi",
    title="Scott's pi",
    count=partial(two_raters, title="Scott's pi"),
    features=_complete_features,
    resampled=None,
)

# -- Conger: raters who are told apart ----------------------------------------------
#
# Sums over items are d and s as above, and of each rater g the number n_g of its
# ratings and n_gk of those in category k. D_e is that of two raters: the mean of
# p_g'V p_h, p_g = n_gk/n_g.


def _conger_features(
    codes: Codes, v: Any, _repeats: Integers | None = None
) -> Features:
    rated, q = (codes >= 0).astype(np.float64), len(v)
    places = np.maximum(codes, 0) + q * np.arange(codes.shape[1])
    dense = np.vstack([_item_features(codes, v).dense, rated.T])
    return Features(dense, places, rated, q * codes.shape[1])


def _conger_disagreements(sums: Floats, v: Any) -> tuple[Floats, Floats, Floats]:
    d, s, n_raters = sums[..., :1], sums[..., 1:2], (sums.shape[-1] - 2) // (1 + len(v))
    n_g = sums[..., 2 : 2 + n_raters, None]
    n_gk = sums[..., 2 + n_raters :].reshape(*sums.shape[:-1], n_raters, len(v))
    # A rater without ratings is taken 0 times; where raters are resampled, two have
    # c_g c_h pairs.
    shares, taken = (
        divide(n_gk, n_g, 0.0),
        divide(n_gk.sum(axis=-1, keepdims=True), n_g, 0.0),
    )
    n_pairs = taken.sum(axis=-2) ** 2 - (taken**2).sum(axis=-2)
    others = (shares.sum(axis=-2, keepdims=True) - shares) @ v  # Σ_l v_kl Σ_{h≠g} p_hl
    d_o, d_e = d / s, (others * shares).sum(axis=(-1, -2))[..., None] / n_pairs
    # 2 Σ_l v_kl Σ_{h≠g} p_hl, less what a rater more adds to the number of pairs
    rest = taken.sum(axis=-2, keepdims=True) - taken
    moves = 2.0 * (others - d_e[..., None] * rest)
    of_k = (d_o / (d_e**2 * n_pairs))[..., None] * divide(moves, n_g, 0.0)
    of_g = -(of_k * shares).sum(axis=-1)
    of_d = -1.0 / (s * d_e)
    of_k = of_k.reshape(*sums.shape[:-1], n_raters * len(v))
    return d_o, d_e, np.concatenate([of_d, -of_d * d_o, of_g, of_k], axis=-1)


def _conger_resampled(codes: Codes, v: Any, freq: Integers | None = None) -> Resampled:
    pooled, rated = _resampled(codes, v, freq), (codes >= 0).astype(np.float64)
    chosen = (codes[:, :, None] == np.arange(len(v))).astype(np.float64)

    def sums(rows: Floats, raters: Floats) -> Floats:
        # (b, n_rows), (b, n_raters) -> (b, 2 + n_raters (1 + q))
        of_raters = raters[..., None] * np.tensordot(rows, chosen, axes=(1, 0))
        flat = of_raters.reshape(len(rows), -1)
        return np.hstack([pooled(rows, raters)[:, :2], rows @ rated, flat])

    return sums


_CONGER = Formula(
    name="conger_kappa",
    title="Conger's kappa",
    count=raters_told_apart,
    features=_conger_features,
    disagreements=_conger_disagreements,
    resampled=_conger_resampled,
)


def percent_agreement(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    population: int | None = None,
) -> Estimate:
    """Estimate how often two raters of the same item agree.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
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
        The proportion with its standard error over items.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.
    ParameterError
        If an option is invalid, or the weights do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters; the value is then ``nan``.

    Notes
    -----
    Items with fewer than two ratings say nothing about agreement and are left out
    of the mean; they count in the standard error, where the number of usable items
    is itself random.

    References
    ----------
    .. [1] Gwet, K. L. (2014). Handbook of Inter-Rater Reliability, 4th ed., ch. 2.

    Examples
    --------
    >>> percent_agreement([["a", "a"], ["a", "b"]]).value
    0.5
    """
    return estimate(_PERCENT, ratings, categories, weights, population=population)


def fleiss_kappa(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    population: int | None = None,
) -> Estimate:
    """Estimate Fleiss' kappa from an item × rater table.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
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
        If the ratings are not such a table.
    ParameterError
        If an option is invalid, or the weights do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters, or all ratings are in one category;
        the value is then ``nan``.

    Notes
    -----
    With missing ratings, agreement is averaged over items with at least two
    ratings, and a category's share is the mean over items with any rating of the
    share of the item's raters who chose it (Gwet's convention).

    References
    ----------
    .. [1] Fleiss, J. L. (1971). Measuring nominal scale agreement among many
       raters. Psychological Bulletin, 76(5), 378-382.
       https://doi.org/10.1037/h0031619
    .. [2] Gwet, K. L. (2014). Handbook of Inter-Rater Reliability, 4th ed.

    Examples
    --------
    Two raters agree on two items and differ on a third:

    >>> round(fleiss_kappa([["a", "a"], ["b", "b"], ["a", "b"]]).value, 3)
    0.333
    """
    return estimate(_FLEISS, ratings, categories, weights, population=population)


def brennan_prediger(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    population: int | None = None,
) -> Estimate:
    """Estimate Brennan and Prediger's coefficient (PABAK for two categories).

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
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
        If the ratings are not such a table.
    ParameterError
        If an option is invalid, or the weights do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters, or one category is declared; the value
        is then ``nan``.

    Notes
    -----
    Chance agreement is Σ_kl w_kl / q², with q the declared categories, used or not.
    With two categories it is the prevalence-adjusted bias-adjusted kappa, PABAK.
    Missing ratings as in `fleiss_kappa`.

    References
    ----------
    .. [1] Brennan, R. L., Prediger, D. J. (1981). Coefficient kappa: some uses,
       misuses, and alternatives. Educational and Psychological Measurement, 41(3),
       687-699. https://doi.org/10.1177/001316448104100307

    Examples
    --------
    >>> round(brennan_prediger([["a", "a"], ["b", "b"], ["a", "b"]]).value, 3)
    0.333
    """
    return estimate(
        _BRENNAN_PREDIGER, ratings, categories, weights, population=population
    )


def gwet_ac(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    population: int | None = None,
) -> Estimate:
    """Estimate Gwet's AC1, or AC2 with weights.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
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
        If the ratings are not such a table.
    ParameterError
        If an option is invalid, or the weights do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters, or one category is declared; the value
        is then ``nan``.

    Notes
    -----
    Chance agreement is Σ_kl w_kl / (q (q - 1)) · Σ_k p_k (1 - p_k): the declared
    categories count, used or not. It is small when nearly all ratings are in one
    category, where kappa falls towards 0. Missing ratings as in `fleiss_kappa`.

    References
    ----------
    .. [1] Gwet, K. L. (2008). Computing inter-rater reliability and its variance in
       the presence of high agreement. British Journal of Mathematical and
       Statistical Psychology, 61(1), 29-48. https://doi.org/10.1348/000711006X126600

    Examples
    --------
    >>> round(gwet_ac([["a", "a"], ["b", "b"], ["a", "b"]]).value, 3)
    0.333
    """
    return estimate(_GWET, ratings, categories, weights, population=population)


def scott_pi(
    ratings: object,
    other: object = None,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    population: int | None = None,
) -> Estimate:
    """Estimate Scott's pi of two raters.

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
    Only items with both ratings are used; on these it is Fleiss' kappa.

    References
    ----------
    .. [1] Scott, W. A. (1955). Reliability of content analysis: the case of nominal
       scale coding. Public Opinion Quarterly, 19(3), 321-325.
       https://doi.org/10.1086/266577

    Examples
    --------
    >>> round(scott_pi([["a", "a"], ["b", "b"], ["a", "b"]]).value, 3)
    0.333
    >>> round(scott_pi(["a", "b", "a"], ["a", "b", "b"]).value, 3)
    0.333
    """
    return estimate(
        _SCOTT,
        side_by_side(ratings, other),
        categories,
        weights,
        population=population,
    )


def conger_kappa(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    population: int | None = None,
) -> Estimate:
    """Estimate Conger's kappa from an item × rater table.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
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
        If the ratings are not such a table.
    ParameterError
        If an option is invalid, or the weights do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters, or all ratings are in one category; the
        value is then ``nan``.

    Notes
    -----
    Chance agreement is that of two different raters, averaged over all pairs, each
    with the shares of its own ratings. With two raters and complete ratings it is
    Cohen's kappa. A rater without any rating has no shares and is left out.

    References
    ----------
    .. [1] Conger, A. J. (1980). Integration and generalization of kappas for multiple
       raters. Psychological Bulletin, 88(2), 322-328.
       https://doi.org/10.1037/0033-2909.88.2.322
    .. [2] Gwet, K. L. (2014). Handbook of Inter-Rater Reliability, 4th ed., ch. 2.

    Examples
    --------
    >>> conger_kappa([["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]]).value
    0.5
    """
    return estimate(_CONGER, ratings, categories, weights, population=population)


def category_kappa(
    ratings: object,
    category: Label,
    *,
    categories: Sequence[Label] | None = None,
) -> Estimate:
    """Estimate Fleiss' kappa of one category against all others.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing. Counted ratings will do.
    category : str, int or float
        One of the categories.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.

    Returns
    -------
    Estimate
        How well raters tell this category from the rest; `weights` names it, and
        `n_categories` is 2.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.
    ParameterError
        If there is no such category.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has two ratings, or nobody, or everybody, used the category.

    Notes
    -----
    Fleiss' kappa is the mean of these over categories, weighed by p_k (1 - p_k).

    References
    ----------
    .. [1] Fleiss, J. L. (1971). Measuring nominal scale agreement among many raters.
       Psychological Bulletin, 76(5), 378-382. https://doi.org/10.1037/h0031619

    Examples
    --------
    >>> ratings = [["a", "a"], ["b", "b"], ["c", "c"], ["a", "b"]]
    >>> category_kappa(ratings, "c").value
    1.0
    """
    counted = count_ratings(ratings, categories)
    place, codes = _place(category, counted.categories), counted.codes
    of_two = replace(
        counted,
        codes=np.where(codes < 0, codes, codes != place),
        categories=(True, False),
        source=None,
    )
    return replace(
        fleiss_kappa(of_two), coefficient="category_kappa", weights=str(category)
    )


def _place(category: Label, scale: Sequence[Label]) -> int:
    # of a category in the scale
    needed = f"needs one of {', '.join(map(repr, scale))}, got {shown(category)}"
    refuse((category not in scale, f"category: {needed}"))
    return scale.index(category)


def item_disagreement(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
) -> Floats:
    """Return how much the raters of each item disagree.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing. Counted ratings will do.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.
    weights : str or array_like, shape (n_categories, n_categories), optional
        How much two categories agree; see `declared_weights`.

    Returns
    -------
    ndarray, shape (n_items,)
        The mean of 1 - w over the pairs of an item's ratings: 0 where all are alike;
        ``nan`` of fewer than two ratings. Without missing ratings 1 less its mean is
        percent agreement.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.
    ParameterError
        If the weights are unknown, or do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If the scale has no such weights; all are then ``nan``.

    Examples
    --------
    >>> item_disagreement([[1, 1, 1], [1, 1, 3], [2, None, None]]).round(3)
    array([0.   , 0.667,   nan])
    """
    counted = count_ratings(ratings, categories)
    made = declared_weights(weights, counted.categories, declared=counted.declared)
    if made.reason is not None:
        undefined("disagreement on items", made.reason)
    d, has_pair = _item_features(counted.coded.codes, made.v).dense
    return np.where(has_pair > 0.0, d / WHOLE, math.nan)


def fleiss_null(
    ratings: object,
    *,
    category: Label | None = None,
    categories: Sequence[Label] | None = None,
) -> Significance:
    """Test whether Fleiss' kappa is 0, with the standard error under that hypothesis.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; items with a missing rating are left out, and so are raters
        without any.
    category : str, int or float, optional
        Test the kappa of this category against the others instead.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.

    Returns
    -------
    Significance
        The statistic z with its two-sided p-value from the normal. The standard error
        under the hypothesis belongs to this test: it makes no interval.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.
    ParameterError
        If there is no such category.

    Warns
    -----
    UndefinedStatisticWarning
        If no item is complete, there is one rater, or kappa is undefined.

    References
    ----------
    .. [1] Fleiss, J. L., Nee, J. C. M., Landis, J. R. (1979). Large sample variance of
       kappa in the case of different sets of raters. Psychological Bulletin, 86(5),
       974-977. https://doi.org/10.1037/0033-2909.86.5.974

    Examples
    --------
    >>> print(fleiss_null([["a", "a"], ["b", "b"], ["a", "b"], ["b", "b"]]))
    fleiss_null: 0.9333, normal, p = 0.351
    """
    counted = complete_rows(raters_told_apart(ratings, categories))
    counts = item_counts(counted.codes, counted.n_categories)
    counts, n_raters = counts.repeat(counted.freq, axis=0), counted.codes.shape[1]
    if category is not None:
        chosen = counts[:, _place(category, counted.categories)]
        counts = np.column_stack([chosen, n_raters - chosen])
    why = {
        "fewer than two raters": n_raters < 2,
        "no item is rated by every rater": len(counts) == 0,
        "0/0: all ratings are in one category": (counts.sum(axis=0) > 0).sum() < 2,
    }
    statistic, reason = (
        math.nan,
        next((text for text, is_so in why.items() if is_so), None),
    )
    if reason is not None:
        undefined("fleiss_null", reason)
    else:
        value = fleiss_kappa(count_items(counts)).value
        statistic = value / _null_error(counts, n_raters)
    return tested(
        *("fleiss_null", "Fleiss' kappa is 0", "normal", ()),
        n_items=len(counts),
        statistic=statistic,
        reason=reason,
    )


def _null_error(counts: Integers, n_raters: int) -> float:
    """Return the standard error of Fleiss' kappa where kappa is 0."""
    # (12) of Fleiss, Nee and Landis (1979): with p the shares and q = 1 - p,
    #   SE0 = √2 / (Σpq √(N n (n - 1))) · √((Σpq)² - Σ pq (q - p))
    total = counts.sum()
    p = counts.sum(axis=0) / total
    q = (total - counts.sum(axis=0)) / total
    pq = (p * q).sum()
    difference = pq**2 - (p * q * (q - p)).sum()
    return math.sqrt(2.0 * difference / (total * (n_raters - 1))) / float(pq)
