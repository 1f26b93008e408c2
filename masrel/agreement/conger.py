"""Conger's kappa: raters who are told apart, each with margins of its own.

Sums over items are d and s, the disagreement of the s items with a pair of ratings,
and of each rater g the number n_g of its ratings and n_gk of those in category k.
D_o = d/s, and D_e is that of two raters: the mean of p_g'V p_h, p_g = n_gk/n_g.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from masrel.agreement._engine import (
    WHOLE,
    Features,
    Floats,
    Formula,
    Integers,
    disagreement_within,
    divide,
    estimate,
    over,
)
from masrel.agreement._labels import Codes, Label
from masrel.agreement._rater_sums import crossed_conger, resampled_conger
from masrel.agreement._rows import raters_told_apart
from masrel.agreement._weights import WeightsLike
from masrel.estimates import Estimate


def _features(codes: Codes, v: Any, _repeats: Integers | None = None) -> Features:
    rated, q = codes >= 0, len(v)
    size = rated.sum(axis=1)
    within = disagreement_within(codes, v, None)
    d = within * (WHOLE / np.maximum(size * (size - 1.0), 1.0))
    places = np.maximum(codes, 0) + q * np.arange(codes.shape[1])
    dense = np.vstack([d, (size > 1) * float(WHOLE), rated.T])
    return Features(dense, places, rated.astype(np.float64), q * codes.shape[1])


def _of_raters(sums: Floats, v: Any) -> tuple[Floats, ...]:
    # of each rater: n_g (..., n_raters, 1), p_gk (..., n_raters, q), how often it is
    # taken, and Σ_l v_kl Σ_{h≠g} p_hl; and pairs and D_e (..., 1). A rater without
    # ratings is taken 0 times; where raters are resampled, two have c_g c_h pairs.
    n_raters = (sums.shape[-1] - 2) // (1 + len(v))
    n_g = sums[..., 2 : 2 + n_raters, None]
    n_gk = sums[..., 2 + n_raters :].reshape(*sums.shape[:-1], n_raters, len(v))
    shares = over(n_gk, n_g)
    others = (shares.sum(axis=-2, keepdims=True) - shares) @ v
    taken = over(n_gk.sum(axis=-1, keepdims=True), n_g)
    n_pairs = taken.sum(axis=-2) ** 2 - (taken**2).sum(axis=-2)
    d_e = divide((others * shares).sum(axis=(-1, -2))[..., None], n_pairs)
    return n_g, shares, taken, others, n_pairs, d_e


def _disagreements(sums: Floats, v: Any) -> tuple[Floats, Floats]:
    return divide(sums[..., :1], sums[..., 1:2]), _of_raters(sums, v)[-1]


def _slope(sums: Floats, v: Any) -> Floats:
    n_g, shares, taken, others, n_pairs, d_e = _of_raters(sums, v)
    d_o = divide(sums[..., :1], sums[..., 1:2])
    # 2 Σ_l v_kl Σ_{h≠g} p_hl, less what a rater more adds to the number of pairs
    rest = taken.sum(axis=-2, keepdims=True) - taken
    moves = 2.0 * (others - d_e[..., None] * rest)
    of_k = divide(d_o, d_e**2 * n_pairs)[..., None] * over(moves, n_g)
    of_g = -(of_k * shares).sum(axis=-1, keepdims=True)
    of_d = divide(-1.0 / sums[..., 1:2], d_e)
    flat = [
        part.reshape(*sums.shape[:-1], part.shape[-1] * part.shape[-2])
        for part in (of_g, of_k)
    ]
    return np.concatenate([of_d, -of_d * d_o, *flat], axis=-1)


_CONGER = Formula(
    name="conger_kappa",
    title="Conger's kappa",
    features=_features,
    disagreements=_disagreements,
    slope=_slope,
    rater_sums=resampled_conger,
    crossed_sums=crossed_conger,
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
    with the shares of its own ratings. Of two raters with complete ratings it is
    Cohen's kappa. A rater without any rating has no shares, and is left out.

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
    counted = raters_told_apart(ratings, categories)
    return estimate(_CONGER, counted, weights, population=population)
