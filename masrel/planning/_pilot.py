"""What a pilot's ratings say of the study that is planned."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from masrel.agreement import Label, WeightsLike, code_ratings
from masrel.errors import RatingsError, UndefinedStatisticWarning
from masrel.estimates import Estimate, Target
from masrel.intervals import estimate

__all__ = ["Pilot", "pilot"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pilot:
    """A pilot, as a plan takes it.

    Attributes
    ----------
    estimate : Estimate
        The coefficient with its interval, which says how little a pilot may know.
    categories : tuple of str, int or float
        The scale.
    prevalences : tuple of float
        Share of each category among the ratings.
    p_missing : float
        Share of the item × rater table without a rating.
    """

    estimate: Estimate
    categories: tuple[Label, ...]
    prevalences: tuple[float, ...]
    p_missing: float


def pilot(
    coefficient: str,
    ratings: object,
    *,
    target: Target,
    weights: WeightsLike = "identity",
    categories: Sequence[Label] | None = None,
    level: float = 0.95,
) -> Pilot:
    """Return what a pilot's ratings say of the study that is planned.

    Parameters
    ----------
    coefficient : str
        Name in the register.
    ratings : array_like or DataFrame, shape (n_items, n_raters)
        The pilot's ratings, as the coefficient takes them.
    target : {"items", "raters", "both"}
        What a new study would draw anew.
    weights : str or Weights, optional
        As of the coefficient.
    categories : sequence of str, int or float, optional
        The scale in order; the categories met unless given.
    level : float, optional
        Of the interval.

    Returns
    -------
    Pilot
        Coefficient, prevalences and share of missing ratings.

    Raises
    ------
    RatingsError
        If the ratings are no table of them, or the coefficient is undefined in them.
    ParameterError
        If an option does not fit the coefficient.

    Examples
    --------
    >>> made = pilot("fleiss_kappa", [[0, 0], [0, 1], [1, 1], [1, 1]], target="items")
    >>> round(made.estimate.value, 3), made.prevalences, made.p_missing
    (0.467, (0.375, 0.625), 0.0)
    """
    coded = code_ratings(ratings, categories)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)  # it is an error
        result = estimate(
            coefficient, coded, target=target, weights=weights, level=level
        )
    if result.reason is not None:
        raise RatingsError(f"pilot: {coefficient} is undefined in it: {result.reason}")
    codes = coded.codes
    counts = np.bincount(codes[codes >= 0], minlength=len(coded.categories))
    return Pilot(
        estimate=result,
        categories=tuple(coded.categories),
        prevalences=tuple((counts / counts.sum()).tolist()),
        p_missing=float((codes < 0).mean()),
    )
