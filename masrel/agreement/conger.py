"""Conger's kappa: Cohen's kappa for two or more raters, each with its own margins."""

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from masrel.agreement._counts import coded_items, item_counts
from masrel.agreement._data import CodedRatings, code_ratings
from masrel.agreement._kernel import (
    NO_CHANCE,
    NO_PAIR,
    Floats,
    Kernel,
    Variance,
    check_population,
    check_variance,
    divide,
    standard_error,
    undefined,
    weighted_disagreement,
)
from masrel.agreement._labels import Label
from masrel.agreement.conger_influence import Margins, influence_squares
from masrel.agreement.tally import Observed
from masrel.agreement.weights import WeightName, Weights, declared_weights
from masrel.estimates import Estimate

__all__ = ["CONGER_KERNEL", "conger_kappa"]


def conger_kappa(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightName | ArrayLike" = "identity",
    variance: Variance = "delta",
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
    variance : {"delta", "irrcac"}, optional
        Which standard error; irrCAC's is too large with single ratings.
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
        If an option is none, or the weights do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters, a rater has no rating, or all ratings
        are in one category; the value is then ``nan``.

    Notes
    -----
    Chance agreement is that of two different raters, averaged over all pairs, each
    with the shares of its own ratings. Of two raters with complete ratings it is
    Cohen's kappa. A rater without any rating has no shares, so that the coefficient
    is undefined: leave the rater out.

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
    coded = code_ratings(ratings, categories)
    v = declared_weights(weights, coded.categories, declared=coded.declared)
    check_variance(variance)
    check_population(population, coded.n_items)
    observed = coded_items(coded).tally(v).observed
    margins = Margins.of(coded, v)
    reason = _reason(coded, observed, margins, v)
    value = p_o = p_e = math.nan
    error: float | Callable[[], float] = math.nan
    if observed is not None and v.reason is None:
        d_o, over_o = observed.numerator, observed.denominator
        d_e, over_e = margins.numerator, margins.denominator
        p_o, p_e = (over_o - d_o) / over_o, (over_e - d_e) / over_e
        if reason is None:
            value = (d_e * over_o - d_o * over_e) / (d_e * over_o)
            as_irrcac = variance == "irrcac"
            error = partial(_error, coded, v, observed, margins, as_irrcac, population)
    return Estimate(
        coefficient="conger_kappa",
        weights=v.name,
        value=value,
        standard_error=error,
        observed=p_o,
        chance=p_e,
        n_items=coded.n_items,
        n_raters=coded.n_raters,
        n_categories=coded.n_categories,
        reason=reason,
    )


def _reason(
    coded: CodedRatings, observed: Observed | None, margins: Margins, v: Weights
) -> str | None:
    title = "Conger's kappa"
    if observed is None:
        return undefined(title, NO_PAIR)
    if v.reason is not None:
        return undefined(title, v.reason)
    if len(margins.raters) < coded.codes.shape[1]:
        without = set(range(coded.codes.shape[1])).difference(margins.raters)
        return undefined(title, f"0/0: no ratings in column {min(without)}")
    if margins.numerator == 0:
        return undefined(title, NO_CHANCE)
    return None


def _error(
    coded: CodedRatings,
    v: Weights,
    observed: Observed,
    margins: Margins,
    as_irrcac: bool,
    population: int | None,
) -> float:
    squares = influence_squares(coded, v, observed, margins, as_irrcac)
    return standard_error(squares, 1.0, coded.n_items, population)


def _features(coded: CodedRatings, v: Floats) -> Floats:
    # (n_items, 2 + n_raters (1 + n_categories)): disagreement, whether it has a pair,
    # then for each rater whether it rated and the category
    counts = item_counts(coded).astype(np.float64)
    size = counts.sum(axis=1)
    pairs = np.where(size > 1, size * (size - 1), 1.0)
    apart = np.where(size > 1, weighted_disagreement(counts, v), 0.0) / pairs
    parts = [apart, size > 1]
    for column in coded.codes.T:
        parts += [column >= 0, column[:, None] == np.arange(len(v))]
    return np.column_stack(parts).astype(np.float64)


def _value(sums: Floats, v: Floats) -> Floats:
    # sums (..., 2 + n_raters (1 + n_categories)) -> (...)
    observed = divide(sums[..., 0], sums[..., 1])
    of_raters = sums[..., 2:].reshape(*sums.shape[:-1], -1, 1 + len(v))
    n_ratings = of_raters[..., :1]
    shares = divide(of_raters[..., 1:], n_ratings)  # nan for a rater without any
    total = shares.sum(axis=-2)
    others = total[..., None, :] - shares
    apart = ((others @ v) * shares).sum(axis=(-1, -2))
    r = of_raters.shape[-2]
    return 1.0 - divide(observed, apart / (r * (r - 1)))


CONGER_KERNEL = Kernel(features=_features, value=_value)
