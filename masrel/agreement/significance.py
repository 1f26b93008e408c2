"""P-values of estimates, and their adjustment for several."""

import math
import sys
from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from masrel.agreement._engine import NO_SPREAD, ONE_PAIR, undefined
from masrel.agreement._labels import is_row, shown
from masrel.agreement.registry import COEFFICIENTS
from masrel.errors import ParameterError
from masrel.estimates import Estimate

Alternative = Literal["two-sided", "greater", "less"]
"""What a p-value is evidence for: that the true value is other, greater or less."""


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
        moves the estimate, which is no certainty.

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

    if alternative not in get_args(Alternative):
        raise ParameterError(
            f"alternative: needs one of {', '.join(get_args(Alternative))}, "
            f"got {alternative!r}"
        )
    _check_estimate(estimate)
    value = _null(estimate, null)
    reason = _why_untestable(estimate)
    if reason is not None:
        undefined(f"p-value of {estimate.coefficient}", reason)
        return math.nan
    t = (estimate.value - value) / estimate.standard_error
    df = estimate.n_items_paired - 1
    if alternative == "two-sided":
        return min(1.0, 2.0 * float(stdtr(df, -abs(t))))
    return float(stdtr(df, -t if alternative == "greater" else t))


def equivalence_p_value(estimate: Estimate, *, low: float, high: float) -> float:
    """Return the p-value of the hypothesis that a coefficient lies outside two values.

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
        As `p_value`.

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
    if not _finite("low", low) < _finite("high", high):
        raise ParameterError(f"low, high: needs low < high, got {low} and {high}")
    above = p_value(estimate, null=low, alternative="greater")
    if math.isnan(above):  # with a warning already
        return math.nan
    return max(above, p_value(estimate, null=high, alternative="less"))


def _null(estimate: Estimate, null: float | None) -> float:
    """Check the value under the hypothesis, 0 if that is what chance gives."""
    if null is None:
        entry = COEFFICIENTS.get(estimate.coefficient)
        if entry is not None and not entry.chance_corrected:
            raise ParameterError(
                f"null: needs a value for {entry.title}: it is not corrected for "
                "chance, so that 0 is not what chance gives"
            )
        return 0.0
    return _finite("null", null)


def _check_estimate(estimate: object) -> None:
    """Check that a result is an estimate."""
    if not isinstance(estimate, Estimate):
        raise ParameterError(
            f"estimate: needs an Estimate, got {type(estimate).__name__}"
        )


_LARGEST = sys.float_info.max


def _finite(name: str, value: float) -> float:
    """Check a number."""
    is_number = isinstance(value, int | float | np.integer | np.floating)
    if not is_number or isinstance(value, bool) or not abs(value) <= _LARGEST:
        raise ParameterError(f"{name}: needs a finite number, got {shown(value)}")
    return float(value)


def _why_untestable(estimate: Estimate) -> str | None:
    """Return why an estimate has no law around it, or None."""
    _check_estimate(estimate)
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
    if not is_row(p_values):
        raise ParameterError(f"p_values: needs a sequence, got {shown(p_values)}")
    p_values = list(p_values)
    for place, p in enumerate(p_values):
        is_number = isinstance(p, int | float | np.number)
        if not (is_number and (math.isnan(p) or 0.0 <= p <= 1.0)):
            raise ParameterError(
                f"p_values: place {place}: needs [0, 1], got {shown(p)}"
            )
    known = [place for place, p in enumerate(p_values) if not math.isnan(p)]
    adjusted, least = [math.nan] * len(p_values), 0.0
    for rank, place in enumerate(sorted(known, key=p_values.__getitem__)):
        least = max(least, min(1.0, (len(known) - rank) * p_values[place]))
        adjusted[place] = least
    return adjusted
