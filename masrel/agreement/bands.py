"""Words for values of kappa, with the probability that the true value earns them."""

import math
from dataclasses import dataclass
from typing import Literal, get_args

from masrel.errors import ParameterError
from masrel.estimates import Estimate

__all__ = ["Band", "BandScale", "bands", "benchmark"]

BandScale = Literal["landis_koch", "altman", "fleiss", "cicchetti"]
"""Whose words."""

# Lower ends, best first; the last band goes down to the end of the parameter space.
_SCALES: dict[str, tuple[tuple[float, str], ...]] = {
    "landis_koch": (
        (0.8, "almost perfect"),
        (0.6, "substantial"),
        (0.4, "moderate"),
        (0.2, "fair"),
        (0.0, "slight"),
        (-1.0, "poor"),
    ),
    "altman": (
        (0.8, "very good"),
        (0.6, "good"),
        (0.4, "moderate"),
        (0.2, "fair"),
        (-1.0, "poor"),
    ),
    "fleiss": ((0.75, "excellent"), (0.4, "intermediate to good"), (-1.0, "poor")),
    "cicchetti": (
        (0.75, "excellent"),
        (0.6, "good"),
        (0.4, "fair"),
        (-1.0, "poor"),
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Band:
    """A band of values with its word.

    Attributes
    ----------
    low, high : float
        Its ends; a value equal to `high` belongs to the band above in all scales but
        the first, whose bands are 0.61 to 0.80 and so on.
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
        undefined.

    Raises
    ------
    ParameterError
        If the scale is none.

    Notes
    -----
    Gwet's interval membership probability [1]_: the normal law around the estimate,
    cut to [-1, 1]. The words themselves [2-5]_ are conventions and no more.

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
    >>> from masrel.agreement import cohen_kappa_from_table
    >>> found = bands(cohen_kappa_from_table([[20, 5], [10, 15]]))
    >>> [(band.word, round(band.cumulative, 2)) for band in found[:3]]
    [('almost perfect', 0.0), ('substantial', 0.06), ('moderate', 0.5)]
    """
    if scale not in get_args(BandScale):
        raise ParameterError(
            f"scale: needs one of {', '.join(get_args(BandScale))}, got {scale!r}"
        )
    found, high, cumulative = [], 1.0, 0.0
    for low, word in _SCALES[scale]:
        inside = _probability(estimate, low, high)
        cumulative += inside
        found.append(
            Band(
                low=low,
                high=high,
                word=word,
                probability=inside,
                cumulative=min(cumulative, 1.0),
            )
        )
        high = low
    return tuple(found)


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
        The word; ``"undefined"`` where the estimate or its error is.

    Raises
    ------
    ParameterError
        If the scale is none, or the level is not within (0, 1).

    Examples
    --------
    >>> from masrel.agreement import cohen_kappa_from_table
    >>> benchmark(cohen_kappa_from_table([[20, 5], [10, 15]]))
    'slight'
    """
    if not 0.0 < level < 1.0:
        raise ParameterError(f"level: needs (0, 1), got {level}")
    found = bands(estimate, scale=scale)
    if math.isnan(found[-1].cumulative):
        return "undefined"
    return next((b.word for b in found if b.cumulative >= level), found[-1].word)


def _probability(estimate: Estimate, low: float, high: float) -> float:
    value, error = estimate.value, estimate.standard_error
    if math.isnan(value) or math.isnan(error):
        return math.nan
    if error == 0.0:  # no doubt at all, as far as the error goes
        return 1.0 if low < value <= high or value == low == -1.0 else 0.0
    from scipy.special import ndtr

    def between(first: float, second: float) -> float:
        # in the tail where the difference of two small numbers is exact
        if first > value:
            return float(ndtr((value - first) / error) - ndtr((value - second) / error))
        return float(ndtr((second - value) / error) - ndtr((first - value) / error))

    return between(low, high) / between(-1.0, 1.0)
