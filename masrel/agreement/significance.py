"""The result of a test of a hypothesis, and p-values of estimates."""

import math
from dataclasses import dataclass

from masrel.agreement._kernel import undefined
from masrel.estimates import Estimate

__all__ = ["Significance", "chi_squared", "p_value"]


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
        Its law under the hypothesis, such as ``"chi-squared"``.
    df : tuple of float
        Degrees of freedom of that law; empty where it has none.
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
        law = f"{self.distribution}({degrees})" if degrees else self.distribution
        return f"{self.name}: {self.statistic:.4g}, {law}, p = {self.p_value:.3g}"


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


def chi_squared(
    name: str,
    hypothesis: str,
    above: float,
    below: int,
    df: int,
    n_items: int,
) -> Significance:
    """Refer a ratio of two ratings' changes to the chi-squared law."""
    from scipy.special import chdtrc

    if below == 0:  # an empty sum is 0; of no degrees of freedom it says nothing
        statistic, p = 0.0 if df == 0 else math.nan, math.nan
        reason = undefined(name, "0/0: no item changed")
    else:
        statistic, reason = above / below, None
        p = float(chdtrc(df, statistic))
    return Significance(
        name=name,
        hypothesis=hypothesis,
        statistic=statistic,
        distribution="chi-squared",
        df=(float(df),),
        p_value=p,
        n_items=n_items,
        reason=reason,
    )
