"""Measurements: their standard error, limits of agreement, and concordance."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from statistics import NormalDist
from typing import Literal, get_args

import numpy as np

from masrel._input import check_option, refuse
from masrel.agreement._codes import (
    complete_values,
    rated_part,
    rating_values,
    read_only,
    side_by_side,
)
from masrel.agreement._engine import (
    NO_SPREAD,
    Floats,
    check_level,
    deviations,
    measured,
    student_t,
    undefined,
)
from masrel.agreement._labels import Label
from masrel.agreement.icc import _ROUNDING, _Anova, _too_few
from masrel.errors import RatingsError
from masrel.estimates import Estimate, Interval

_VarianceParts = list[tuple[float, float]]
"""The parts of a variance, each with its degrees of freedom."""

ErrorKind = Literal["agreement", "consistency"]
"""Whether average differences between raters count as error."""

# From the error of one rating to the change of two that chance exceeds in 5 %
_CHANGE = 1.96 * math.sqrt(2.0)

_FEW = 3  # items from which on Lin's concordance has an error


_NODES, _FARTHEST = 96, 8.5
"""Of Gauss and Legendre's rule over what the mean can be: nodes, and standard errors
beyond which there is nothing to add."""


def sem(
    ratings: object,
    *,
    kind: ErrorKind = "agreement",
    categories: Sequence[Label] | None = None,
    level: float = 0.95,
) -> Estimate:
    """Estimate the standard error of measurement of one rating.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Numbers, or labels of a declared scale; None and ``nan`` are missing.
    kind : {"agreement", "consistency"}, optional
        Whether what raters differ by on average counts as error.
    categories : sequence of str, int or float, optional
        The declared scale in order: numbers count by value, text by rank. Needed for
        text.
    level : float, optional
        Level of the interval.

    Returns
    -------
    Estimate
        The standard deviation of the error, in the units of the ratings, named
        ``"sem"`` or ``"sem_consistency"``, with its interval. That of agreement
        generalises to other items and raters, that of consistency to other items.

    Raises
    ------
    RatingsError
        If the ratings are not such a table, or text without categories.
    ParameterError
        If the kind is unknown, or the level is not within (0, 1).

    Warns
    -----
    UndefinedStatisticWarning
        If there are fewer than two items or raters, or too few ratings to tell raters
        from the residual; the value is then ``nan``.

    Notes
    -----
    The square root of σ²_raters + σ²_residual, or of σ²_residual alone. A complete
    table has them from mean squares, one with gaps from restricted maximum likelihood,
    as `icc`. The interval of consistency is that of χ²; that of agreement the modified
    large-sample interval of a sum of two mean squares [2]_. With gaps the mean squares
    and their degrees of freedom are those of the complete table that would estimate
    the variances as well.

    References
    ----------
    .. [1] de Vet, H. C. W., Terwee, C. B., Knol, D. L., Bouter, L. M. (2006). When to
       use agreement versus reliability measures. Journal of Clinical Epidemiology,
       59(10), 1033-1039. https://doi.org/10.1016/j.jclinepi.2005.10.015
    .. [2] Graybill, F. A., Wang, C.-M. (1980). Confidence intervals on nonnegative
       linear combinations of variances. Journal of the American Statistical
       Association, 75(372), 869-873. https://doi.org/10.1080/01621459.1980.10477565

    Examples
    --------
    >>> print(f"{sem([[1, 2], [3, 3], [5, 7]], kind='consistency').value:.4f}")
    0.7071
    """
    return _error(ratings, "sem", 1.0, kind, categories, level)


def mdc(
    ratings: object,
    *,
    kind: ErrorKind = "agreement",
    categories: Sequence[Label] | None = None,
    level: float = 0.95,
) -> Estimate:
    """Estimate the minimal detectable change, MDC95, of two single ratings.

    Parameters
    ----------
    ratings, kind, categories, level : optional
        As for `sem`.

    Returns
    -------
    Estimate
        1.96 √2 standard errors of measurement, named ``"mdc"`` or
        ``"mdc_consistency"``, with its interval: of an item that has not changed, 95 %
        of the differences between two ratings are smaller.

    Raises
    ------
    RatingsError, ParameterError
        As for `sem`.

    Warns
    -----
    UndefinedStatisticWarning
        As for `sem`.

    References
    ----------
    .. [1] de Vet, H. C. W., et al. (2006); see `sem`.

    Examples
    --------
    >>> print(f"{mdc([[1, 2], [3, 3], [5, 7]], kind='consistency').value:.4f}")
    1.9600
    """
    return _error(ratings, "mdc", _CHANGE, kind, categories, level)


def _error(
    ratings: object,
    name: str,
    factor: float,
    kind: ErrorKind,
    categories: Sequence[Label] | None,
    level: float,
    more: _VarianceParts | None = None,
) -> Estimate:
    # more: what else adds up to the variance
    check_option("kind", kind, get_args(ErrorKind))
    check_level(level)
    values = rated_part(rating_values(ratings, categories))
    variance_parts = _variance_parts(values, kind)
    value, interval, reason = math.nan, None, None
    if isinstance(variance_parts, str):
        titles = {
            "sem": "the standard error of measurement",
            "mdc": "MDC95",
            "limit": "the limit of agreement with the mean",
        }
        reason = undefined(titles[name], variance_parts)
    else:
        parts, unit, notes = variance_parts
        parts = parts + [(square / unit**2, df) for square, df in more or ()]
        scale, variance = factor * unit, sum(square for square, _ in parts)
        value = scale * math.sqrt(variance)
        low, high, why = _variance_ends(parts, variance, level)
        method = "χ²" if kind == "consistency" else "modified large sample, χ²"
        interval = Interval(
            low=scale * math.sqrt(low),
            high=scale * math.sqrt(high),
            level=level,
            kind="confidence",
            method=f"REML, {method}" if notes else method,
            target="items" if kind == "consistency" else "both",
            notes=notes,
            reason=why,
        )
    name = name if kind == "agreement" else f"{name}_{kind}"
    return measured(name, values, categories, value, interval=interval, reason=reason)


def _variance_parts(
    values: Floats, kind: ErrorKind
) -> tuple[_VarianceParts, float, tuple[str, ...]] | str:
    """Return what adds up to the error's variance, its unit and notes, or why not."""
    n, k = values.shape
    if n < 2 or k < 2:
        return "fewer than two items" if n < 2 else "fewer than two raters"
    if not np.isnan(values).any():
        anova, df = _Anova.of(values), (k - 1.0, (n - 1.0) * (k - 1.0))
        return _parts(kind, anova.raters, anova.residual, df, n), anova.unit, ()
    from masrel.agreement._mixed import components

    fit = components(values, has_raters=True)
    if isinstance(fit, str):
        return fit
    # Of the complete table that would say as much. With covariance V of the variances,
    # m = -V_ee / V_re makes σ²_e + m σ²_r and σ²_e uncorrelated; of a complete table it
    # is its number of items.
    m, df = 1.0, (k - 1.0, math.inf)
    of_raters = fit.residual + fit.raters
    if fit.likelihood is not None:
        information = fit.likelihood.information(fit.ratios)
        v = 2.0 * fit.residual**2 * np.linalg.inv(information)
        # no more than all items, whatever rounding leaves of a tiny V_re
        m = float(v[2, 2] / max(-v[1, 2], v[2, 2] / n))
        of_raters = fit.residual + m * fit.raters
        noise = float(m**2 * v[1, 1] - v[2, 2])
        df = 2.0 * of_raters**2 / noise, float(2.0 * fit.residual**2 / v[2, 2])
    return _parts(kind, of_raters, fit.residual, df, m), fit.unit, (fit.words,)


def _parts(
    kind: ErrorKind, raters: float, residual: float, df: tuple[float, float], m: float
) -> _VarianceParts:
    # of mean squares, that of raters being the residual's and m times their variance
    if kind == "consistency":
        return [(residual, df[1])]
    return [(raters / m, df[0]), ((1.0 - 1.0 / m) * residual, df[1])]


def _variance_ends(
    parts: _VarianceParts, variance: float, level: float
) -> tuple[float, float, str | None]:
    """Return the ends of a sum of mean squares, each with its df, or why not."""
    # Graybill and Wang (1980), eq. (1.3) and (1.4); of a single part those of χ²
    from scipy.special import chdtri

    down = up = 0.0
    for square, df in parts:
        if square == 0.0:
            continue
        shrink = 1.0 - df / float(chdtri(df, 0.5 - 0.5 * level))
        stretch = df / float(chdtri(df, 0.5 + 0.5 * level)) - 1.0
        if shrink < 0.0 or stretch < 0.0:  # the mean of χ² is beyond its quantile
            why = "the level is too low: the interval would not contain the estimate"
            return math.nan, math.nan, why
        down += (shrink * square) ** 2
        up += (stretch * square) ** 2
    return max(variance - math.sqrt(down), 0.0), variance + math.sqrt(up), None


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitsOfAgreement:
    """Limits between which most differences of two raters lie.

    Attributes
    ----------
    mean, sd : float
        Mean and standard deviation of the differences, first minus second.
    lower, upper : float
        The limits: mean ∓ z sd; ``nan`` when undefined.
    share : float
        Share of the differences that lie between the limits.
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
    averages: Floats = field(compare=False, repr=False)
    differences: Floats = field(compare=False, repr=False)
    n_items: int
    reason: str | None = None


def limits_of_agreement(
    ratings: object,
    other: object = None,
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
    other : sequence of str, int or float, shape (n_items,), optional
        The labels of the second rater, where `ratings` are those of the first: item by
        item in the same order, of Series by the same index.
    categories : sequence of str, int or float, optional
        The declared scale in order: numbers count by value, text by rank. Needed for
        text.
    share : float, optional
        Share of the differences that lie between the limits.
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
    check_level(share, "share")
    check_level(level)
    values = complete_values(side_by_side(ratings, other), categories)
    needed = "limits of agreement: need the ratings of two raters, got"
    refuse(
        (values.shape[1] != 2, f"{needed} {values.shape[1]}: choose two"),
        error=RatingsError,
    )
    first, second = values[:, 0], values[:, 1]
    differences = read_only(first - second)
    averages = read_only(first + 0.5 * (second - first))
    n, z = len(differences), NormalDist().inv_cdf(0.5 + 0.5 * share)
    mean = sd = math.nan
    reason, widths = None, [math.nan] * 5
    if n < 2:
        reason = undefined(
            "an estimate of limits of agreement",
            "fewer than two items are rated by both raters",
        )
    else:
        mean, sd = float(differences.mean()), float(differences.std(ddof=1))
        widths = _widths(n, share, level)
    middle, near, far, inner, outer = (width * sd for width in widths)
    interval = partial(
        Interval, level=level, kind="confidence", target="items", reason=reason
    )
    of_limit = partial(interval, method=f"noncentral t({n - 1})")
    return LimitsOfAgreement(
        mean=mean,
        sd=sd,
        lower=mean - z * sd,
        upper=mean + z * sd,
        share=share,
        mean_interval=interval(
            low=mean - middle, high=mean + middle, method=f"t({n - 1})"
        ),
        lower_interval=of_limit(low=mean - far, high=mean - near),
        upper_interval=of_limit(low=mean + near, high=mean + far),
        inner=(mean - inner, mean + inner),
        outer=(mean - outer, mean + outer),
        averages=averages,
        differences=differences,
        n_items=n,
        reason=reason,
    )


def _widths(n: int, share: float, level: float) -> list[float]:
    """Return how many standard deviations from the mean the ends are."""
    # of the mean; near and far of a limit; inner and outer of both
    from scipy.special import nctdtrit, stdtrit

    df, root, tail = n - 1, math.sqrt(n), 0.5 - 0.5 * level
    shift = root * NormalDist().inv_cdf(0.5 + 0.5 * share)
    return [
        float(stdtrit(df, 1.0 - tail)) / root,
        float(nctdtrit(df, shift, tail)) / root,
        float(nctdtrit(df, shift, 1.0 - tail)) / root,
        _tolerance_factor(n, share, tail),
        _tolerance_factor(n, share, 1.0 - tail),
    ]


def _tolerance_factor(n: int, share: float, confidence: float) -> float:
    """Return k for which mean ∓ k sd hold a share with such confidence."""
    from scipy.optimize import brentq
    from scipy.special import chdtr, chndtrix

    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    off = 0.5 * _FARTHEST * (nodes + 1.0)  # of the mean, in its standard errors
    density = _FARTHEST * weights * np.exp(-0.5 * off**2) / math.sqrt(2.0 * math.pi)
    # r² for which a standard normal lies within off ∓ r in such a share
    squares = chndtrix(share, 1, off**2 / n)

    def excess(log_k: float) -> float:
        # the standard deviation is at least r / k
        lacks = density @ chdtr(n - 1, (n - 1) * squares * math.exp(-2.0 * log_k))
        return 1.0 - float(lacks) - confidence

    return math.exp(brentq(excess, -50.0, 50.0, xtol=1e-14, rtol=1e-15))


def lin_ccc(
    ratings: object,
    other: object = None,
    *,
    categories: Sequence[Label] | None = None,
    level: float = 0.95,
) -> Estimate:
    """Estimate Lin's concordance correlation coefficient.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Numbers, or labels of a declared scale; None and ``nan`` are missing.
    other : sequence of str, int or float, shape (n_items,), optional
        The labels of the second rater, where `ratings` are those of the first: item by
        item in the same order, of Series by the same index.
    categories : sequence of str, int or float, optional
        The declared scale in order: numbers count by value, text by rank. Needed for
        text.
    level : float, optional
        Level of the interval.

    Returns
    -------
    Estimate
        The coefficient, with its standard error and an interval on Fisher's z that
        generalises to other items. Observed and chance agreement do not exist.

    Raises
    ------
    RatingsError
        If the ratings are not such a table, or text without categories.
    ParameterError
        If the level is not within (0, 1).

    Warns
    -----
    UndefinedStatisticWarning
        If there are fewer than two complete items or raters, or all ratings are the
        same; the value is then ``nan``.

    Notes
    -----
    For two raters 2 s_xy / (s_x² + s_y² + (x̄ - ȳ)²), with moments over n; the error is
    that of [1]_ with the erratum, over n - 2. For more raters: the overall coefficient
    of [2]_, in which numerators and denominators of all pairs are added up; the error
    is then the delta method's, and the interval a jackknife of items with t. Items with
    a missing rating are left out.

    References
    ----------
    .. [1] Lin, L. I.-K. (1989). A concordance correlation coefficient to evaluate
       reproducibility. Biometrics, 45(1), 255-268. https://doi.org/10.2307/2532051;
       erratum (2000), 56(1), 324-325.
    .. [2] Barnhart, H. X., Haber, M., Song, J. (2002). Overall concordance correlation
       coefficient for evaluating agreement among multiple observers. Biometrics, 58(4),
       1020-1027. https://doi.org/10.1111/j.0006-341X.2002.01020.x

    Examples
    --------
    >>> round(lin_ccc([[1, 2], [3, 3], [5, 7]]).value, 4)
    0.8
    """
    check_level(level)
    values = complete_values(side_by_side(ratings, other), categories)
    value, error, interval = math.nan, math.nan, None
    reason = _too_few(values)
    if reason is None and values.min() == values.max():
        reason = "0/0: all ratings are the same"
    if reason is not None:
        undefined("Lin's concordance", reason)
    else:
        scaled, _ = deviations(values)
        value, error, without = _concordance(scaled)
        interval = _interval(scaled, value, error, without, level)
    return measured(
        "lin_ccc",
        values,
        categories,
        value,
        standard_error=error,
        interval=interval,
        reason=reason,
    )


def _concordance(values: Floats) -> tuple[float, float, Floats]:
    """Return the coefficient, its error, and the coefficient without each item."""
    # 1 - Σ (x_j - x_l)² within items over that between them, and its delta method
    n, k = values.shape
    means = values.mean(axis=0)
    x, levels = values - means, means - means.mean()
    # Σ_{j<l} (x_j - x_l)² = k Σ_j (x_j - x̄)² of each item
    within = k * ((values - values.mean(axis=1, keepdims=True)) ** 2).sum(axis=1)
    # (k - 1) Σ_j σ_j² + Σ_{j<l} (μ_j - μ_l)², and what each item adds to it
    between = k * float((levels**2).sum())
    squares = (x**2).sum(axis=1)
    pull = (k - 1) * squares + 2.0 * k * x @ levels
    whole = float(pull.mean()) + between
    ratio = float(within.mean()) / whole
    # without an item the raters' means move, too
    moved = (squares - x.sum(axis=1) ** 2) / (n - 1) ** 2
    wholes = (pull.sum() - pull) / (n - 1) + between + moved
    wholes[wholes < _ROUNDING * whole] = math.nan  # all ratings are the same then
    without = 1.0 - (within.sum() - within) / (n - 1) / wholes
    error = math.nan
    if n >= _FEW and k == 2:
        error = _error_of_two(values, 1.0 - ratio)
    elif n >= _FEW:
        influence = (within - ratio * (pull + between)) / whole
        error = math.sqrt(float((influence**2).sum()) / (n * (n - 1)))
    return 1.0 - ratio, error, without


def _error_of_two(values: Floats, rho: float) -> float:
    # that of [1], here without a division by r
    (xx, xy), (_, yy) = np.cov(values.T, ddof=0)
    if xx == 0.0 or yy == 0.0:
        return math.nan
    shift2 = float(np.diff(values.mean(axis=0))[0] ** 2)
    r2 = min(xy**2 / (xx * yy), 1.0)
    bias = 2.0 * math.sqrt(xx * yy) / (xx + yy + shift2)  # ρ = r · bias
    u2 = shift2 / math.sqrt(xx * yy)
    variance = (
        bias**2 * (1.0 - r2) * (1.0 - rho**2)
        + 2.0 * rho**2 * (1.0 - rho) * bias * u2
        - 0.5 * rho**2 * bias**2 * u2**2
    )
    return math.sqrt(max(variance, 0.0) / (len(values) - 2))


def _interval(
    values: Floats, value: float, error: float, without: Floats, level: float
) -> Interval:
    """Return the interval, on Fisher's z."""
    n, k = values.shape
    reason = None
    if math.isnan(error):
        reason = "no error: fewer than three items, or a rater without variance"
    elif abs(value) < 1.0 and error < 1e-15:  # of rounding
        reason = NO_SPREAD
    low = high = value if reason is None else math.nan
    if reason is None and abs(value) < 1.0:
        z = math.atanh(value)
        if k == 2:
            normal = NormalDist()
            width = normal.inv_cdf(0.5 + 0.5 * level) * error / (1.0 - value**2)
        else:
            limit = np.nextafter(1.0, 0.0)  # without an item all may be perfect
            each = np.arctanh(np.clip(without, -limit, limit))
            if np.isnan(each).any():
                reason = (
                    "it is undefined with one item left out, because all ratings are "
                    "then the same"
                )
            width = student_t(level, n - 1) * math.sqrt((n - 1) * float(each.var()))
        low, high = math.tanh(z - width), math.tanh(z + width)
    return Interval(
        low=low,
        high=high,
        level=level,
        kind="confidence",
        method="Fisher's z" if k == 2 else f"item jackknife, t({n - 1}) on Fisher's z",
        target="items",
        unit=None if k == 2 else "items",
        reason=reason,
    )
