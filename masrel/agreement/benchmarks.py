"""Words for values of kappa, with the probability that the true value earns them."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from masrel.agreement._engine import check_level, undefined
from masrel.agreement._labels import shown
from masrel.agreement.significance import _why_untestable
from masrel.errors import ParameterError
from masrel.estimates import Estimate

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
        That the true value lies in it.
    cumulative : float
        That the true value lies in it or in a better one.
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
        Whose words.

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
        estimate, which is no certainty.

    Notes
    -----
    Gwet's interval membership probability [1]_: the normal distribution around the
    estimate, cut to [-1, 1], or at 1 only for an estimate below -1, which weights and
    few ratings allow. The words themselves [2-5]_ are conventions and no more.

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
    steps = _steps(scale)
    reason = _why_untestable(estimate)
    if reason is not None:
        undefined(f"band of {estimate.coefficient}", reason)
    every: list[Band] = []
    high, better = 1.0, 0.0
    for low, _, word in steps:
        end = -math.inf if low == -1.0 > estimate.value else low
        inside, cumulative = _probabilities(estimate, end, high, better)
        band = Band(
            low=end, high=high, word=word, probability=inside, cumulative=cumulative
        )
        every.append(band)
        high, better = low, cumulative
    return tuple(every)


def strength(value: float, *, scale: BandScale = "landis_koch") -> str:
    """Return the word of a scale for a value, whatever its standard error.

    Parameters
    ----------
    value : float
        A coefficient.
    scale : {"landis_koch", "altman", "fleiss", "cicchetti"}, optional
        Whose words.

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
    steps = _steps(scale)
    if not isinstance(value, int | float | np.number):
        raise ParameterError(f"value: needs a number, got {shown(value)}")
    if value != value:
        return "undefined"
    reached = (
        word for low, closed, word in steps if value > low or (closed and value == low)
    )
    return next(reached, steps[-1][2])


def _steps(scale: str) -> tuple[tuple[float, bool, str], ...]:
    if scale not in _SCALES:
        raise ParameterError(f"scale: needs one of {', '.join(_SCALES)}, got {scale!r}")
    return _SCALES[scale]


def benchmark(
    estimate: Estimate, *, scale: BandScale = "landis_koch", level: float = 0.95
) -> str:
    """Return the best word that the estimate earns with a stated probability.

    Parameters
    ----------
    estimate : Estimate
        A coefficient with its standard error.
    scale : {"landis_koch", "altman", "fleiss", "cicchetti"}, optional
        Whose words.
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
        As `bands`.

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


def _probabilities(
    estimate: Estimate, low: float, high: float, better: float
) -> tuple[float, float]:
    # of a band, and of it and the better ones, whose probability is `better`
    value, error = estimate.value, estimate.standard_error
    if math.isnan(value) or not error > 0.0:
        return math.nan, math.nan
    every = _between(value, error, -math.inf if value < -1.0 else -1.0, 1.0)
    inside = _between(value, error, low, high) / every
    return inside, min(better + inside, 1.0)


def _between(value: float, error: float, low: float, high: float) -> float:
    # probability of [low, high] under the normal distribution, taken in the tail where
    # the difference of two small numbers is exact
    from scipy.special import ndtr

    if low > value:
        return float(ndtr((value - low) / error) - ndtr((value - high) / error))
    return float(ndtr((high - value) / error) - ndtr((low - value) / error))
