"""Error in the units of the ratings: of one measurement, and of a change."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._data import rated_part, rating_values
from masrel.agreement._engine import check_level, undefined
from masrel.agreement._labels import Label
from masrel.agreement.icc import _Anova, _n_categories
from masrel.errors import ParameterError
from masrel.estimates import Estimate, Interval

if TYPE_CHECKING:
    from masrel.agreement._reml import Components

ErrorKind = Literal["agreement", "consistency"]
"""Whether what raters differ by on average is error, or not."""

_CHANGE = 1.96 * math.sqrt(2.0)
"""From the error of one rating to the change of two that chance exceeds in 5 %."""


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
        As of `sem`.

    Returns
    -------
    Estimate
        1.96 √2 standard errors of measurement, named ``"mdc"`` or
        ``"mdc_consistency"``, with its interval: of an item that has not changed, 95 %
        of the differences between two ratings are smaller.

    Raises
    ------
    RatingsError, ParameterError
        As `sem`.

    Warns
    -----
    UndefinedStatisticWarning
        As `sem`.

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
) -> Estimate:
    if kind not in get_args(ErrorKind):
        raise ParameterError(
            f"kind: needs one of {', '.join(get_args(ErrorKind))}, got {kind!r}"
        )
    check_level(level)
    values = rated_part(rating_values(ratings, categories))
    squares, reason = _squares(values)
    title = {"sem": "the standard error of measurement", "mdc": "MDC95"}[name]
    value, interval = math.nan, None
    if squares is None:
        reason = undefined(title, str(reason))
    else:
        scale = factor * squares.unit
        value = scale * math.sqrt(squares.variance(kind))
        interval = _interval(squares, kind, scale, level)
    n_items, n_raters = values.shape
    return Estimate(
        coefficient=name if kind == "agreement" else f"{name}_{kind}",
        weights="identity",
        value=value,
        standard_error=math.nan,
        interval=interval,
        observed=math.nan,
        chance=math.nan,
        n_items=n_items,
        n_items_paired=int(((~np.isnan(values)).sum(axis=1) > 1).sum()),
        n_raters=n_raters,
        n_categories=_n_categories(values, categories),
        reason=reason,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Squares:
    """Mean squares of raters and residual, in unit², and what they make together."""

    raters: float
    residual: float
    df_raters: float
    df_residual: float
    n: float  # items of a rater: the first is residual + n times that of raters
    together: float  # the variances of raters and residual
    unit: float
    notes: tuple[str, ...] = ()

    def variance(self, kind: ErrorKind) -> float:
        """Return the variance of the error."""
        return self.together if kind == "agreement" else self.residual


def _squares(values: NDArray[np.float64]) -> tuple[_Squares | None, str | None]:
    # the squares, or why there are none
    n, k = values.shape
    if n < 2 or k < 2:
        return None, "fewer than two items" if n < 2 else "fewer than two raters"
    if np.isnan(values).any():
        from masrel.agreement._reml import crossed_components

        components = crossed_components(values)
        if components.reason is not None:
            return None, components.reason
        return _equivalent(components), None
    anova = _Anova.of(values)
    return _Squares(
        raters=anova.raters,
        residual=anova.residual,
        df_raters=k - 1.0,
        df_residual=(n - 1.0) * (k - 1.0),
        n=float(n),
        together=anova.within,  # (MS_raters + (n - 1) MS_residual) / n
        unit=anova.unit,
    ), None


def _equivalent(components: "Components") -> _Squares:
    """Return the squares of the complete table that would say as much."""
    # With covariance V of the variances, n = -V_ee / V_re makes σ²_e + n σ²_r and σ²_e
    # uncorrelated; of a complete table it is its number of items.
    c, v = components, components.covariance
    n, df_raters, df_residual = 1.0, c.n_raters - 1.0, math.inf
    if c.residual > 0.0:
        # no more than all items, whatever rounding leaves of a tiny V_re
        n = float(v[2, 2] / max(-v[1, 2], v[2, 2] / c.n_items))
        df_residual = float(2.0 * c.residual**2 / v[2, 2])
        noise = float(n**2 * v[1, 1] - v[2, 2])
        df_raters = 2.0 * (c.residual + n * c.raters) ** 2 / noise
    return _Squares(
        raters=c.residual + n * c.raters,
        residual=c.residual,
        df_raters=df_raters,
        df_residual=df_residual,
        n=n,
        together=c.raters + c.residual,
        unit=c.unit,
        notes=(c.words,),
    )


def _interval(
    squares: _Squares, kind: ErrorKind, scale: float, level: float
) -> Interval:
    parts = [(squares.residual, squares.df_residual)]
    if kind == "agreement":
        share = 1.0 / squares.n
        parts = [
            (share * squares.raters, squares.df_raters),
            ((1.0 - share) * squares.residual, squares.df_residual),
        ]
    low, high, reason = _ends(parts, squares.variance(kind), level)
    method = "χ²" if kind == "consistency" else "modified large sample, χ²"
    return Interval(
        low=scale * math.sqrt(low),
        high=scale * math.sqrt(high),
        level=level,
        kind="confidence",
        method=f"REML, {method}" if squares.notes else method,
        target="items" if kind == "consistency" else "both",
        notes=squares.notes,
        reason=reason,
    )


def _ends(
    parts: list[tuple[float, float]], variance: float, level: float
) -> tuple[float, float, str | None]:
    # Equations (1.3) and (1.4) of [2]; of a single part they are those of χ².
    from scipy.special import chdtri

    down = up = 0.0
    for square, df in parts:
        if square == 0.0:
            continue
        shrink = 1.0 - df / float(chdtri(df, 0.5 - 0.5 * level))
        stretch = df / float(chdtri(df, 0.5 + 0.5 * level)) - 1.0
        if shrink < 0.0 or stretch < 0.0:  # the mean of χ² is beyond its quantile
            why = "the level is too low: the ends would leave the estimate out"
            return math.nan, math.nan, why
        down += (shrink * square) ** 2
        up += (stretch * square) ** 2
    return max(variance - math.sqrt(down), 0.0), variance + math.sqrt(up), None
