"""Bland and Altman's limits of agreement, with exact intervals."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._data import complete_values
from masrel.agreement._engine import undefined
from masrel.agreement._labels import Label
from masrel.errors import ParameterError, RatingsError
from masrel.estimates import Interval

_NODES = 96
"""Of Gauss and Legendre's rule over what the mean can be."""

_FARTHEST = 8.5
"""Standard errors from the mean beyond which there is nothing to add."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitsOfAgreement:
    """Between which bounds the differences of two raters lie.

    Attributes
    ----------
    mean, sd : float
        Mean and standard deviation of the differences, first less second.
    lower, upper : float
        The limits: mean ∓ z sd; ``nan`` when undefined.
    share : float
        Of the differences that are to lie between the limits.
    mean_interval, lower_interval, upper_interval : Interval
        Exact intervals, each for itself.
    inner, outer : tuple of float
        Bounds of both limits together: a share of the differences lies within the
        inner and outside the outer ones with probability (1 - level) / 2 each.
    averages, differences : ndarray, shape (n_items,)
        Mean and difference of the two ratings of each item.
    n_items : int
        Items that both raters rated.
    reason : str or None
        Why they are undefined, or None.
    """

    mean: float
    sd: float
    lower: float
    upper: float
    share: float
    mean_interval: Interval
    lower_interval: Interval
    upper_interval: Interval
    inner: tuple[float, float]
    outer: tuple[float, float]
    averages: NDArray[np.float64] = field(compare=False, repr=False)
    differences: NDArray[np.float64] = field(compare=False, repr=False)
    n_items: int
    reason: str | None = None


def limits_of_agreement(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    share: float = 0.95,
    level: float = 0.95,
) -> LimitsOfAgreement:
    """Estimate the limits of agreement of two raters.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, 2)
        Numbers, or labels of a declared scale; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order: numbers count by value, text by rank. Needed for
        text.
    share : float, optional
        Of the differences that are to lie between the limits.
    level : float, optional
        Level of the intervals.

    Returns
    -------
    LimitsOfAgreement
        Mean difference and limits with their intervals, for other items like these.

    Raises
    ------
    RatingsError
        If the ratings are not such a table, or text without categories.
    ParameterError
        If the share or the level is not within (0, 1).

    Warns
    -----
    UndefinedStatisticWarning
        If fewer than two items have both ratings.

    Notes
    -----
    Differences are taken to be normal, with the same mean and spread whatever is
    rated, and each item to be rated once by each rater. The interval of a limit is
    exact: its ends are quantiles of a noncentral t; those of both limits together are
    factors of tolerance [2]_. Items with a missing rating are left out.

    References
    ----------
    .. [1] Bland, J. M., Altman, D. G. (1999). Measuring agreement in method comparison
       studies. Statistical Methods in Medical Research, 8(2), 135-160.
       https://doi.org/10.1177/096228029900800204
    .. [2] Carkeet, A. (2015). Exact parametric confidence intervals for Bland-Altman
       limits of agreement. Optometry and Vision Science, 92(3), e71-e80.
       https://doi.org/10.1097/OPX.0000000000000513

    Examples
    --------
    >>> limits = limits_of_agreement([[9, 8], [5, 7], [4, 4], [8, 7]])
    >>> print(f"{limits.mean:.2f}, {limits.lower:.2f} to {limits.upper:.2f}")
    0.00, -2.77 to 2.77
    """
    for name, value in (("share", share), ("level", level)):
        if not 0.0 < value < 1.0:
            raise ParameterError(f"{name}: needs (0, 1), got {value}")
    values = complete_values(ratings, categories)
    if values.shape[1] != 2:
        raise RatingsError(
            "limits of agreement: need the ratings of two raters, got "
            f"{values.shape[1]}: choose two"
        )
    first, second = values[:, 0], values[:, 1]
    differences, averages = first - second, first + 0.5 * (second - first)
    for array in (differences, averages):
        array.setflags(write=False)
    return _limits(averages, differences, share, level)


def _limits(
    averages: NDArray[np.float64],
    differences: NDArray[np.float64],
    share: float,
    level: float,
) -> LimitsOfAgreement:
    n = len(differences)
    mean = sd = math.nan
    reason, widths = None, _Widths(math.nan, math.nan, math.nan, math.nan, math.nan)
    if n < 2:
        reason = undefined(
            "the limits of agreement", "fewer than two items are rated by both raters"
        )
    else:
        mean, sd = float(differences.mean()), float(differences.std(ddof=1))
        widths = _widths(n, share, level)
    z = _normal_quantile(share)

    def interval(low: float, high: float, method: str) -> Interval:
        return Interval(
            low=mean + low * sd,
            high=mean + high * sd,
            level=level,
            kind="confidence",
            method=method,
            target="items",
            reason=reason,
        )

    near, far = widths.near, widths.far
    return LimitsOfAgreement(
        mean=mean,
        sd=sd,
        lower=mean - z * sd,
        upper=mean + z * sd,
        share=share,
        mean_interval=interval(-widths.mean, widths.mean, f"t({n - 1})"),
        lower_interval=interval(-far, -near, f"noncentral t({n - 1})"),
        upper_interval=interval(near, far, f"noncentral t({n - 1})"),
        inner=(mean - widths.inner * sd, mean + widths.inner * sd),
        outer=(mean - widths.outer * sd, mean + widths.outer * sd),
        averages=averages,
        differences=differences,
        n_items=n,
        reason=reason,
    )


@dataclass(frozen=True, slots=True)
class _Widths:
    """How many standard deviations from the mean the ends are."""

    mean: float
    near: float
    far: float
    inner: float
    outer: float


def _normal_quantile(share: float) -> float:
    from statistics import NormalDist

    return NormalDist().inv_cdf(0.5 + 0.5 * share)


def _widths(n: int, share: float, level: float) -> _Widths:
    from scipy.special import nctdtrit, stdtrit

    df, root, tail = n - 1, math.sqrt(n), 0.5 - 0.5 * level
    shift = root * _normal_quantile(share)
    return _Widths(
        float(stdtrit(df, 1.0 - tail)) / root,
        float(nctdtrit(df, shift, tail)) / root,
        float(nctdtrit(df, shift, 1.0 - tail)) / root,
        _tolerance_factor(n, share, tail),
        _tolerance_factor(n, share, 1.0 - tail),
    )


def _tolerance_factor(n: int, share: float, confidence: float) -> float:
    """Return k for which mean ∓ k sd hold a share with such confidence."""
    from scipy.special import chdtr

    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    off = 0.5 * _FARTHEST * (nodes + 1.0)  # of the mean, in its standard errors
    density = _FARTHEST * weights * np.exp(-0.5 * off**2) / math.sqrt(2.0 * math.pi)
    half = _half_width(off / math.sqrt(n), share)
    df = n - 1

    def confidence_of(k: float) -> float:
        # the standard deviation is at least half / k
        return 1.0 - float(density @ chdtr(df, df * (half / k) ** 2))

    low = high = float(half[0])
    while confidence_of(low) > confidence:
        low *= 0.5
    while confidence_of(high) < confidence:
        high *= 2.0
    for _ in range(100):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        if confidence_of(middle) < confidence:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def _half_width(off: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """Return r for which a standard normal lies within off ∓ r in such a share."""
    from scipy.special import ndtr, ndtri

    r = off + float(ndtri(0.5 + 0.5 * share))  # at least as far as it has to be
    for _ in range(50):
        beyond = ndtr(off + r) - ndtr(off - r) - share
        slope = np.exp(-0.5 * (off + r) ** 2) + np.exp(-0.5 * (off - r) ** 2)
        step = beyond * math.sqrt(2.0 * math.pi) / slope
        r = r - step
        if np.abs(step).max() < 1e-15 * r.max():
            break
    return np.asarray(r)
