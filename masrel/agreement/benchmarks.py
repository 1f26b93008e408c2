"""Tests of estimates, and words for their values with probabilities."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from masrel._input import check_option, refuse, shown
from masrel.agreement._engine import (
    NO_SPREAD,
    ONE_PAIR,
    Floats,
    check_level,
    undefined,
)
from masrel.agreement._labels import is_row
from masrel.agreement.registry import COEFFICIENTS
from masrel.errors import ParameterError
from masrel.estimates import Estimate

Alternative = Literal["two-sided", "greater", "less"]
"""The alternative of a test: the true value is different, greater or less."""

BandScale = Literal["landis_koch", "altman", "fleiss", "cicchetti"]
"""Whose words."""

# Lower ends, best first, and whether a value equal to it is in the band. The last band
# goes down to the end of the parameter space.
_SCALES: dict[str, tuple[tuple[float, bool, str], ...]] = {
    "landis_koch": (  # poor below 0, slight to 0.20, fair 0.21 to 0.40, ...
        (0.8, False, "almost perfect"),
        (0.6, False, "substantial"),
        (0.4, False, "moderate"),
        (0.2, False, "fair"),
        (0.0, True, "slight"),
        (-1.0, True, "poor"),
    ),
    "altman": (  # poor to 0.20, fair 0.21 to 0.40, ...
        (0.8, False, "very good"),
        (0.6, False, "good"),
        (0.4, False, "moderate"),
        (0.2, False, "fair"),
        (-1.0, True, "poor"),
    ),
    "fleiss": (  # poor below 0.40, excellent above 0.75
        (0.75, False, "excellent"),
        (0.4, True, "intermediate to good"),
        (-1.0, True, "poor"),
    ),
    "cicchetti": (  # poor below 0.40, fair 0.40 to 0.59, good 0.60 to 0.74, ...
        (0.75, True, "excellent"),
        (0.6, True, "good"),
        (0.4, True, "fair"),
        (-1.0, True, "poor"),
    ),
}


def p_value(
    estimate: Estimate,
    *,
    null: float | None = None,
    alternative: Alternative = "two-sided",
) -> float:
    """Return the p-value of the hypothesis that a coefficient is some value.

    Parameters
    ----------
    estimate : Estimate
        With its delta-method standard error, items as the sample.
    null : float, optional
        The value under the hypothesis; 0 for coefficients that are corrected for
        chance. Others have no such value and need one.
    alternative : {"two-sided", "greater", "less"}, optional
        What a small p-value is evidence for. "greater" than the value that is just
        too low shows non-inferiority.

    Returns
    -------
    float
        Of t = (value - null) / standard error, by Student's t with n - 1 degrees of
        freedom, n the items with a pair of ratings, accurate to the far tail; ``nan``
        where it is undefined.

    Raises
    ------
    ParameterError
        If an option is invalid, or no `null` is given for a coefficient that is not
        corrected for chance.

    Warns
    -----
    UndefinedStatisticWarning
        If the estimate or its standard error is undefined, or the error is 0: no item
        moves the estimate, which does not make it certain.

    Notes
    -----
    The standard error is that of the estimate and not that under the hypothesis; for
    the latter see `fleiss_null`. `equivalence_p_value` tests that a coefficient lies
    between two values.

    Examples
    --------
    Is kappa, 0.4 here, other than 0? Is it greater than 0.2?

    >>> from masrel.agreement import cohen_kappa, count_table
    >>> kappa = cohen_kappa(count_table([[20, 5], [10, 15]]))
    >>> round(p_value(kappa), 4)
    0.003
    >>> round(p_value(kappa, null=0.2, alternative="greater"), 4)
    0.0627
    """
    from scipy.special import stdtr  # loaded only when a p-value is asked for

    check_option("alternative", alternative, get_args(Alternative))
    value = 0.0 if null is None else _finite("null", null)
    reason = _why_untestable(estimate)
    entry = COEFFICIENTS.get(estimate.coefficient)
    if null is None and entry is not None and not entry.chance_corrected:
        raise ParameterError(
            f"null: needs a value for {entry.title}: it is not corrected for chance, "
            "so chance does not give 0"
        )
    if reason is not None:
        undefined(f"p-value of {estimate.coefficient}", reason)
        return math.nan
    t = (estimate.value - value) / estimate.standard_error
    df = estimate.n_items_paired - 1
    if alternative == "two-sided":
        return min(1.0, 2.0 * float(stdtr(df, -abs(t))))
    return float(stdtr(df, -t if alternative == "greater" else t))


def equivalence_p_value(estimate: Estimate, *, low: float, high: float) -> float:
    """Return the p-value of the hypothesis that a coefficient is outside two values.

    Parameters
    ----------
    estimate : Estimate
        With its delta-method standard error, items as the sample.
    low, high : float
        Ends between which values count as equivalent.

    Returns
    -------
    float
        The larger of two one-sided p-values: that the coefficient is at most `low`,
        and that it is at least `high`. Below 0.05 the 90 % interval by the same
        standard error lies between them. ``nan`` where it is undefined.

    Raises
    ------
    ParameterError
        If the ends are not finite numbers in ascending order.

    Warns
    -----
    UndefinedStatisticWarning
        As for `p_value`.

    References
    ----------
    .. [1] Schuirmann, D. J. (1987). A comparison of the two one-sided tests procedure
       and the power approach for assessing the equivalence of average
       bioavailability. Journal of Pharmacokinetics and Biopharmaceutics, 15(6),
       657-680. https://doi.org/10.1007/BF01068419

    Examples
    --------
    >>> from masrel.agreement import cohen_kappa, count_table
    >>> kappa = cohen_kappa(count_table([[20, 5], [10, 15]]))
    >>> round(equivalence_p_value(kappa, low=0.1, high=0.7), 4)
    0.0117
    """
    is_reversed = not _finite("low", low) < _finite("high", high)
    refuse((is_reversed, f"low, high: needs low < high, got {low} and {high}"))
    above = p_value(estimate, null=low, alternative="greater")
    if math.isnan(above):  # with a warning already
        return math.nan
    return max(above, p_value(estimate, null=high, alternative="less"))


def _finite(name: str, value: float) -> float:
    """Check a number."""
    is_number = isinstance(value, int | float | np.integer | np.floating)
    is_finite = is_number and not isinstance(value, bool) and abs(value) < math.inf
    refuse((not is_finite, f"{name}: needs a finite number, got {shown(value)}"))
    return float(value)


def _why_untestable(estimate: Estimate) -> str | None:
    """Return why an estimate has no law around it, or None."""
    got = type(estimate).__name__
    is_estimate = isinstance(estimate, Estimate)
    refuse((not is_estimate, f"estimate: needs an Estimate, got {got}"))
    if math.isnan(estimate.value):
        return estimate.reason or "the estimate itself is undefined"
    if estimate.standard_error == 0.0:
        return NO_SPREAD
    if estimate.n_items_paired == 1:
        return ONE_PAIR
    return "it has no standard error" if math.isnan(estimate.standard_error) else None


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p-values of several hypotheses, adjusted by Holm's method.

    Parameters
    ----------
    p_values : sequence of float, shape (n_tests,)
        The p-values of the family; ``nan`` where a test is undefined, which then
        counts for none of them.

    Returns
    -------
    list of float, shape (n_tests,)
        In the same order, ``nan`` where there was none: the hypotheses of those at
        most α can be rejected with a probability of at most α to reject a true one,
        however the tests depend on each other.

    Raises
    ------
    ParameterError
        If a p-value is outside [0, 1].

    References
    ----------
    .. [1] Holm, S. (1979). A simple sequentially rejective multiple test procedure.
       Scandinavian Journal of Statistics, 6(2), 65-70.
       https://www.jstor.org/stable/4615733

    Examples
    --------
    Three times the least, twice the next, and once the largest; none is less than one
    before it:

    >>> holm([0.03, 0.01, 0.02])
    [0.04, 0.03, 0.04]
    """
    p, ascending = _checked_p_values(p_values)
    steps = p[ascending] * np.arange(len(ascending), 0, -1)
    p[ascending] = np.maximum.accumulate(np.minimum(steps, 1.0))
    return list(map(float, p))


def benjamini_yekutieli(p_values: Sequence[float]) -> list[float]:
    """Return p-values adjusted for the false discovery rate.

    Parameters
    ----------
    p_values : sequence of float, shape (n_tests,)
        The p-values of the family; ``nan`` where a test is undefined, which then
        counts for none of them.

    Returns
    -------
    list of float, shape (n_tests,)
        In the same order, ``nan`` where there was none: of the hypotheses of those at
        most α, an expected share of at most α is true, however the tests depend on
        each other.

    Raises
    ------
    ParameterError
        If a p-value is outside [0, 1].

    References
    ----------
    .. [1] Benjamini, Y., Yekutieli, D. (2001). The control of the false discovery rate
       in multiple testing under dependency. Annals of Statistics, 29(4), 1165-1188.
       https://doi.org/10.1214/aos/1013699998, theorem 1.3

    Examples
    --------
    With 1 + 1/2 + 1/3 for three tests: three times the least, 3/2 of the next, and
    once the largest; none is larger than one after it:

    >>> [round(p, 4) for p in benjamini_yekutieli([0.03, 0.01, 0.02])]
    [0.055, 0.055, 0.055]
    """
    p, ascending = _checked_p_values(p_values)
    steps = p[ascending] / _yekutieli_bounds(len(ascending))
    p[ascending[::-1]] = np.minimum.accumulate(np.minimum(steps[::-1], 1.0))
    return list(map(float, p))


def _yekutieli_bounds(m: int) -> Floats:
    """Return what the smallest of m p-values, the next, … are at most, over α."""
    ranks = np.arange(1, m + 1)
    return np.asarray(ranks / (m * (1.0 / ranks).sum()))  # theorem 1.3


def _checked_p_values(p_values: Sequence[float]) -> tuple[Floats, NDArray[np.intp]]:
    """Return p-values, and the places of those that are known, ascending."""
    refuse((not is_row(p_values), f"p_values: needs a sequence, got {shown(p_values)}"))
    p_values = list(p_values)
    for place, p in enumerate(p_values):
        is_number = isinstance(p, int | float | np.number)
        is_in = is_number and (math.isnan(p) or 0.0 <= p <= 1.0)
        refuse(
            (
                not is_in,
                f"p_values: place {place}: needs a number in [0, 1], got {shown(p)}",
            )
        )
    checked = np.array(p_values, dtype=float)
    return checked, np.argsort(checked)[: int((~np.isnan(checked)).sum())]


@dataclass(frozen=True, slots=True, kw_only=True)
class Band:
    """A band of values with its word.

    Attributes
    ----------
    low, high : float
        Its ends. Which band a value at an end belongs to is as published: below for
        0.2, 0.4, 0.6 and 0.8 of Landis and Koch and of Altman and for 0.75 of Fleiss,
        above for the others. It matters for `strength`.
    word : str
        Its name.
    probability : float
        Probability that the true value lies in it.
    cumulative : float
        Probability that the true value lies in it or in a better one.
    """

    low: float
    high: float
    word: str
    probability: float
    cumulative: float


def bands(estimate: Estimate, *, scale: BandScale = "landis_koch") -> tuple[Band, ...]:
    """Return each band of a scale with the probability of the true value in it.

    Parameters
    ----------
    estimate : Estimate
        A coefficient with its standard error.
    scale : {"landis_koch", "altman", "fleiss", "cicchetti"}, optional
        Publication whose words are used.

    Returns
    -------
    tuple of Band
        Best first. Probabilities are ``nan`` where the estimate or its error is
        undefined, or the error is 0.

    Raises
    ------
    ParameterError
        If the scale is unknown.

    Warns
    -----
    UndefinedStatisticWarning
        If there are no probabilities. An error of 0 means that no item moves the
        estimate, which does not make it certain.

    Notes
    -----
    Gwet's interval membership probability [1]_: the normal distribution around the
    estimate, cut to [-1, 1], or at 1 only for an estimate below -1, which weights and
    few ratings allow. The words themselves [2]_ to [5]_ are conventions and no more.

    References
    ----------
    .. [1] Gwet, K. L. (2014). Handbook of Inter-Rater Reliability, 4th ed., ch. 6.
    .. [2] Landis, J. R., Koch, G. G. (1977). Biometrics, 33(1), 159-174.
       https://doi.org/10.2307/2529310
    .. [3] Altman, D. G. (1991). Practical Statistics for Medical Research, p. 404.
    .. [4] Fleiss, J. L. (1981). Statistical Methods for Rates and Proportions, 2nd
       ed., p. 218.
    .. [5] Cicchetti, D. V., Sparrow, S. A. (1981). American Journal of Mental
       Deficiency, 86(2), 127-137.

    Examples
    --------
    >>> from masrel.agreement import cohen_kappa, count_table
    >>> every = bands(cohen_kappa(count_table([[20, 5], [10, 15]])))
    >>> [(band.word, round(band.cumulative, 2)) for band in every[:3]]
    [('almost perfect', 0.0), ('substantial', 0.06), ('moderate', 0.5)]
    """
    check_option("scale", scale, _SCALES)
    reason = _why_untestable(estimate)
    if reason is not None:
        undefined(f"band of {estimate.coefficient}", reason)
    every: list[Band] = []
    high, better = 1.0, 0.0
    least = -math.inf if estimate.value < -1.0 else -1.0
    whole = math.nan if reason else _between(estimate, least, 1.0)
    for low, _, word in _SCALES[scale]:
        end = low if low > -1.0 else least
        inside = math.nan if reason else _between(estimate, end, high) / whole
        better = min(better + inside, 1.0) if not reason else math.nan
        every.append(
            Band(low=end, high=high, word=word, probability=inside, cumulative=better)
        )
        high = low
    return tuple(every)


def strength(value: float, *, scale: BandScale = "landis_koch") -> str:
    """Return the word of a scale for a value, whatever its standard error.

    Parameters
    ----------
    value : float
        A coefficient.
    scale : {"landis_koch", "altman", "fleiss", "cicchetti"}, optional
        Publication whose words are used.

    Returns
    -------
    str
        The word; ``"undefined"`` for ``nan``.

    Raises
    ------
    ParameterError
        If the scale is unknown.

    Examples
    --------
    >>> strength(0.4), strength(0.41)
    ('fair', 'moderate')
    """
    check_option("scale", scale, _SCALES)
    is_number = isinstance(value, int | float | np.number)
    refuse((not is_number, f"value: needs a number, got {shown(value)}"))
    if value != value:
        return "undefined"
    steps = _SCALES[scale]
    reached = (
        word for low, closed, word in steps if value > low or (closed and value == low)
    )
    return next(reached, steps[-1][2])


def benchmark(
    estimate: Estimate, *, scale: BandScale = "landis_koch", level: float = 0.95
) -> str:
    """Return the highest band that the true value reaches with a stated probability.

    Parameters
    ----------
    estimate : Estimate
        A coefficient with its standard error.
    scale : {"landis_koch", "altman", "fleiss", "cicchetti"}, optional
        Publication whose words are used.
    level : float, optional
        Cumulative probability that is needed.

    Returns
    -------
    str
        The word; ``"undefined"`` where the estimate or its error is, or the error is 0.

    Raises
    ------
    ParameterError
        If the scale is unknown, or the level is not within (0, 1).

    Warns
    -----
    UndefinedStatisticWarning
        As for `bands`.

    Notes
    -----
    Items are the sample and their number is large: the law is normal, as of `bands`.
    An interval knows better: the word that the true value reaches with 95 % by it is
    the `strength` of the lower end of that interval at level 0.9, or of a one-sided
    bound at 0.95.

    Examples
    --------
    >>> from masrel.agreement import cohen_kappa, count_table
    >>> benchmark(cohen_kappa(count_table([[20, 5], [10, 15]])))
    'slight'
    """
    check_level(level)
    every = bands(estimate, scale=scale)
    if math.isnan(every[-1].cumulative):
        return "undefined"
    return next((b.word for b in every if b.cumulative >= level), every[-1].word)


def _between(estimate: Estimate, low: float, high: float) -> float:
    # probability of [low, high] under the normal distribution, taken in the tail where
    # the difference of two small numbers is exact
    from scipy.special import ndtr

    value, error = estimate.value, estimate.standard_error
    side = -1.0 if low > value else 1.0
    ends = ndtr(side * (np.array([low, high]) - value) / error)
    return float(abs(ends[1] - ends[0]))
