"""The result of a test of a hypothesis, and p-values of estimates."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from masrel.errors import ParameterError
from masrel.estimates import Estimate


@dataclass(frozen=True, slots=True, kw_only=True)
class Significance:
    """A test of a hypothesis; never an interval.

    Attributes
    ----------
    name : str
        Name of the function that computed it, such as ``"bowker"``.
    hypothesis : str
        What is tested, in words.
    statistic : float
        The test statistic; ``nan`` when undefined.
    distribution : str
        Its distribution under the hypothesis, such as ``"chi-squared"``.
    df : tuple of float
        Degrees of freedom of it; empty where it has none.
    p_value : float
        Two-sided where there are two sides, within [0, 1].
    n_items : int
        Items it rests on.
    reason : str or None
        Why it is undefined, or None.
    """

    name: str
    hypothesis: str
    statistic: float
    distribution: str
    df: tuple[float, ...]
    p_value: float
    n_items: int
    reason: str | None = None

    def __str__(self) -> str:
        if self.reason is not None:
            return f"{self.name}: undefined ({self.reason})"
        degrees = ", ".join(f"{df:g}" for df in self.df)
        of = f"({degrees})" if degrees else ""
        return (
            f"{self.name}: {self.statistic:.4g}, {self.distribution}{of}, "
            f"p = {self.p_value:.3g}"
        )


def p_value(estimate: Estimate) -> float:
    """Return the two-sided p-value of the hypothesis that a coefficient is 0.

    Parameters
    ----------
    estimate : Estimate
        With its delta-method standard error, items as the sample.

    Returns
    -------
    float
        P(|t| ≥ |value / standard error|) with n - 1 degrees of freedom, accurate to
        the far tail; 0 for an error of 0 and a value that is not, ``nan`` where the
        estimate or its error is undefined.

    Notes
    -----
    The standard error is that of the estimate and not that under the hypothesis; for
    the latter see `fleiss_null`.

    Examples
    --------
    >>> from masrel.agreement import cohen_kappa_from_table
    >>> round(p_value(cohen_kappa_from_table([[20, 5], [10, 15]])), 4)
    0.003
    """
    from scipy.special import stdtr  # loaded only when a p-value is asked for

    if math.isnan(estimate.value) or math.isnan(estimate.standard_error):
        return math.nan
    if estimate.standard_error == 0.0:
        return 1.0 if estimate.value == 0.0 else 0.0
    t = abs(estimate.value / estimate.standard_error)
    return min(1.0, 2.0 * float(stdtr(estimate.n_items - 1, -t)))


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
    for place, p in enumerate(p_values):
        if not (math.isnan(p) or 0.0 <= p <= 1.0):
            raise ParameterError(f"p_values: place {place}: needs [0, 1], got {p}")
    known = [place for place, p in enumerate(p_values) if not math.isnan(p)]
    adjusted, least = [math.nan] * len(p_values), 0.0
    for rank, place in enumerate(sorted(known, key=p_values.__getitem__)):
        least = max(least, min(1.0, (len(known) - rank) * p_values[place]))
        adjusted[place] = least
    return adjusted
