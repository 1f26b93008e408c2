"""What mean squares say: intraclass correlations, Robinson's A, and W, of ranks.

A table with gaps has no mean squares: variances are then estimated by restricted
maximum likelihood, and the interval is read from its profile.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from masrel._input import check_option
from masrel.agreement._codes import complete_values, rated_part, rating_values
from masrel.agreement._engine import (
    check_level,
    deviations,
    measured,
    undefined,
)
from masrel.agreement._labels import Label
from masrel.estimates import Estimate, Interval, Significance, Target

IccForm = Literal["ICC(1)", "ICC(1,k)", "ICC(C,1)", "ICC(C,k)", "ICC(A,1)", "ICC(A,k)"]
"""One-way; consistency and absolute agreement; of one rating and of the mean of k."""

_NAMES: dict[IccForm, str] = {
    "ICC(1)": "icc_1",
    "ICC(1,k)": "icc_1k",
    "ICC(C,1)": "icc_c1",
    "ICC(C,k)": "icc_ck",
    "ICC(A,1)": "icc_a1",
    "ICC(A,k)": "icc_ak",
}
"""Form to its name in the register."""

_ALL_ALIKE = "0/0: neither items nor ratings of an item differ"

_Answer = tuple[float, Interval | None, str | None]
"""Value, interval and why there is none."""


def icc(
    ratings: object,
    *,
    form: IccForm = "ICC(A,1)",
    categories: Sequence[Label] | None = None,
    level: float = 0.95,
) -> Estimate:
    """Estimate an intraclass correlation with its interval.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Numbers, or labels of a declared scale; None and ``nan`` are missing.
    form : {"ICC(1)", "ICC(1,k)", "ICC(C,1)", "ICC(C,k)", "ICC(A,1)", "ICC(A,k)"}
        One-way random; two-way consistency; two-way absolute agreement; of a single
        rating or of the mean of all raters.
    categories : sequence of str, int or float, optional
        The declared scale in order: numbers count by value, text by rank. Needed for
        text.
    level : float, optional
        Level of the interval.

    Returns
    -------
    Estimate
        The coefficient, named after its form: ``"icc_a1"`` is ICC(A,1). The interval,
        from the F distribution, or from the profile likelihood where ratings are
        missing, generalises to other items and, for absolute agreement and one-way
        forms, to other raters too. There is no delta-method error; observed and chance
        agreement do not exist.

    Raises
    ------
    RatingsError
        If the ratings are not such a table, or text without categories.
    ParameterError
        If the form is unknown, or the level is not within (0, 1).

    Warns
    -----
    UndefinedStatisticWarning
        If there are fewer than two items or raters, or no variance, or a total
        variance estimated as 0, or too few ratings to tell the variances from each
        other; the value is then ``nan``.

    Notes
    -----
    A complete table has mean squares. Where its total variance is estimated as less
    than 0, which takes items that hardly differ, the formula's value lies outside
    [-1, 1] and there is no interval. The interval of ICC(A,k) is that of ICC(A,1)
    stepped up by Spearman and Brown's formula.

    Where ratings are missing, all that there are count: the variances of items, raters
    and residual are estimated by restricted maximum likelihood [3]_, each 0 or more;
    k is the number of raters of the table; the interval is the profile likelihood's,
    and its notes have the variances. Items and raters without any rating are no part
    of it.

    References
    ----------
    .. [1] McGraw, K. O., Wong, S. P. (1996). Forming inferences about some intraclass
       correlation coefficients. Psychological Methods, 1(1), 30-46, Tables 4 and 7.
       https://doi.org/10.1037/1082-989X.1.1.30
    .. [2] Shrout, P. E., Fleiss, J. L. (1979). Intraclass correlations: uses in
       assessing rater reliability. Psychological Bulletin, 86(2), 420-428.
       https://doi.org/10.1037/0033-2909.86.2.420
    .. [3] Patterson, H. D., Thompson, R. (1971). Recovery of inter-block information
       when block sizes are unequal. Biometrika, 58(3), 545-554.
       https://doi.org/10.1093/biomet/58.3.545

    Examples
    --------
    Table 2 of [2], six items and four judges:

    >>> table = [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8],
    ...          [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]]
    >>> [round(icc(table, form=form).value, 2) for form in ("ICC(1)", "ICC(A,1)")]
    [0.17, 0.29]

    The same without three of its ratings:

    >>> table[0][1] = table[3][2] = table[5][0] = None
    >>> round(icc(table).value, 2)
    0.3
    """
    check_option("form", form, get_args(IccForm))
    check_level(level)
    values = rated_part(rating_values(ratings, categories))
    answer = _with_gaps if np.isnan(values).any() else _without_gaps
    value, interval, reason = answer(values, form, level)
    return measured(
        _NAMES[form], values, categories, value, interval=interval, reason=reason
    )


def icc_f_test(
    ratings: object,
    *,
    form: IccForm = "ICC(A,1)",
    categories: Sequence[Label] | None = None,
) -> Significance:
    """Test whether items differ at all: F of the items' mean square.

    Parameters
    ----------
    ratings, form, categories : optional
        As of `icc`.

    Returns
    -------
    Significance
        F with its degrees of freedom; over the error within items for one-way forms,
        over the residual for the others.

    Raises
    ------
    RatingsError
        If the ratings are not such a table, or text without categories.
    ParameterError
        If the form is unknown.

    Warns
    -----
    UndefinedStatisticWarning
        If there are fewer than two complete items or raters, or no variance.

    Notes
    -----
    Items with a missing rating are left out: F is exact for complete tables alone.

    References
    ----------
    .. [1] McGraw, K. O., Wong, S. P. (1996), Table 8; see `icc`.

    Examples
    --------
    >>> table = [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8],
    ...          [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]]
    >>> print(icc_f_test(table))
    icc_f_test: 11.03, F(5, 15), p = 0.000135
    """
    check_option("form", form, get_args(IccForm))
    values = complete_values(ratings, categories)
    anova = _Anova.of(values)
    reason = _no_variance(values, anova, form)
    statistic = p = math.nan
    if reason is None:
        from scipy.special import fdtrc

        error = anova.error(form)
        statistic = math.inf if error == 0.0 else anova.items / error
        p = float(fdtrc(*anova.df(form), statistic))
    return Significance(
        name="icc_f_test",
        hypothesis="the items do not differ",
        statistic=statistic,
        distribution="F",
        df=anova.df(form),
        p_value=p,
        n_items=len(values),
        reason=reason,
    )


def robinson_a(
    ratings: object, *, categories: Sequence[Label] | None = None
) -> Estimate:
    """Estimate Robinson's A.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Numbers, or labels of a declared scale; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; needed for text.

    Returns
    -------
    Estimate
        A within [0, 1]. It has no delta-method error, observed or chance agreement.

    Raises
    ------
    RatingsError
        If the ratings are not such a table, or text without categories.

    Warns
    -----
    UndefinedStatisticWarning
        If there are fewer than two complete items or raters, or no variance; the
        value is then ``nan``.

    Notes
    -----
    Items with a missing rating are left out. A = SS_items / (SS_items + SS_residual):
    a rater who is always one grade higher loses nothing.

    References
    ----------
    .. [1] Robinson, W. S. (1957). The statistical measurement of agreement. American
       Sociological Review, 22(1), 17-25. https://doi.org/10.2307/2088760

    Examples
    --------
    >>> robinson_a([[1, 2], [2, 3], [3, 4]]).value
    1.0
    """
    values = complete_values(ratings, categories)
    anova = _Anova.of(values)
    reason, value = None, math.nan
    if min(values.shape) < 2:
        why = "fewer than two items or raters in the items that every rater rated"
        reason = undefined("Robinson's A", why)
    elif (total := anova.items + (anova.k - 1) * anova.residual) == 0.0:
        reason = undefined("Robinson's A", "0/0: no variance but between raters")
    else:
        value = anova.items / total  # squares over (n - 1)
    return measured(
        "robinson_a", values, categories, value, weights="quadratic", reason=reason
    )


def kendall_w(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    ties: bool = True,
) -> Estimate:
    """Estimate how far raters put the items into the same order.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Numbers, or labels of a declared scale; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; needed for text.
    ties : bool, optional
        Whether to correct for ties; without it W cannot reach 1 when there are any.

    Returns
    -------
    Estimate
        W within [0, 1]. It has no delta-method error, observed or chance agreement.

    Raises
    ------
    RatingsError
        If the ratings are not such a table, or text without categories.

    Warns
    -----
    UndefinedStatisticWarning
        If there are fewer than two complete items or two raters, or every rater ties
        all items; the value is then ``nan``.

    Notes
    -----
    Items with a missing rating are left out.

    References
    ----------
    .. [1] Kendall, M. G., Babington Smith, B. (1939). The problem of m rankings.
       Annals of Mathematical Statistics, 10(3), 275-287.
       https://doi.org/10.1214/aoms/1177732186
    .. [2] Kendall, M. G. (1948). Rank Correlation Methods, ch. 6.

    Examples
    --------
    >>> kendall_w([[1, 1, 2], [2, 3, 1], [3, 2, 3]]).value
    0.4444444444444444
    """
    values = complete_values(ratings, categories)
    value, reason = _w(values, ties=ties)
    weights = "tie-corrected" if ties else "uncorrected"
    return measured(
        "kendall_w", values, categories, value, weights=weights, reason=reason
    )


def kendall_w_test(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    ties: bool = True,
) -> Significance:
    """Test whether the raters' orders are unrelated, by Friedman's chi-squared.

    Parameters
    ----------
    ratings, categories, ties : optional
        As of `kendall_w`.

    Returns
    -------
    Significance
        Friedman's m (n - 1) W with n - 1 degrees of freedom; approximate below some
        8 items.

    Raises
    ------
    RatingsError
        As `kendall_w`.

    Warns
    -----
    UndefinedStatisticWarning
        As `kendall_w`.

    Examples
    --------
    >>> print(kendall_w_test([[1, 1, 2], [2, 3, 1], [3, 2, 3]]))
    kendall_w_test: 2.667, chi-squared(2), p = 0.264
    """
    values = complete_values(ratings, categories)
    n, m = values.shape
    w, reason = _w(values, ties=ties)
    statistic = p = math.nan
    if reason is None:
        from scipy.special import chdtrc

        statistic = m * (n - 1) * w
        p = float(chdtrc(n - 1, statistic))
    return Significance(
        name="kendall_w_test",
        hypothesis="the raters' orders are unrelated",
        statistic=statistic,
        distribution="chi-squared",
        df=(float(max(n - 1, 0)),),
        p_value=p,
        n_items=n,
        reason=reason,
    )


@dataclass(frozen=True, slots=True)
class _Anova:
    # mean squares of [1], of items, raters, residual, and within items, in unit²
    n: int
    k: int
    items: float
    raters: float
    residual: float
    within: float
    unit: float

    @classmethod
    def of(cls, values: NDArray[np.float64]) -> "_Anova":
        n, k = values.shape
        if n < 2 or k < 2:
            return cls(n, k, *[math.nan] * 5)
        # deviations times n k are whole, and so exact, for whole ratings
        x, unit = deviations(values)
        of_items, of_raters = x.sum(axis=1, keepdims=True), x.sum(axis=0, keepdims=True)
        rows, columns = n * of_items - x.sum(), k * of_raters - x.sum()
        within = n * (k * x - of_items)
        scale = float(n * k) ** 2
        return cls(
            n,
            k,
            float(k * (rows**2).sum() / (scale * (n - 1))),
            float(n * (columns**2).sum() / (scale * (k - 1))),
            float(((within - columns) ** 2).sum() / (scale * ((n - 1) * (k - 1)))),
            float((within**2).sum() / (scale * (n * (k - 1)))),
            unit,
        )

    def error(self, form: str) -> float:
        return self.within if form.startswith("ICC(1") else self.residual

    def df(self, form: str) -> tuple[float, float]:
        one_way = form.startswith("ICC(1")
        error = self.n * (self.k - 1) if one_way else (self.n - 1) * (self.k - 1)
        return float(self.n - 1), float(error)

    def denominator(self, form: str) -> float:
        # denominators of Table 4 of [1]
        of_raters = self.raters - self.residual if form.startswith("ICC(A") else 0.0
        if form.endswith("k)"):
            return self.items + of_raters / self.n
        error = (self.k - 1) * self.error(form)
        return self.items + error + self.k * of_raters / self.n

    def value(self, form: str) -> float:
        return (self.items - self.error(form)) / self.denominator(form)


def _too_few(values: NDArray[np.float64]) -> str | None:
    if values.shape[0] < 2:
        return "fewer than two items are rated by every rater"
    return "fewer than two raters" if values.shape[1] < 2 else None


def _no_variance(
    values: NDArray[np.float64], anova: _Anova, form: IccForm
) -> str | None:
    # why there is neither a correlation nor an F, with a warning
    why = _too_few(values)
    if why is None and anova.items == 0.0 and anova.error(form) == 0.0:
        why = _ALL_ALIKE
    return None if why is None else undefined(form, why)


def _without_gaps(values: NDArray[np.float64], form: IccForm, level: float) -> _Answer:
    """Return value, interval and reason by mean squares."""
    anova = _Anova.of(values)
    reason = _no_variance(values, anova, form)
    if reason is None and anova.denominator(form) == 0.0:
        why = "division by 0: the total variance is estimated as 0"
        reason = undefined(form, why)
    if reason is not None:
        return math.nan, None, reason
    low, high, reason = _ends(anova, form, level)
    interval = Interval(
        low=low,
        high=high,
        level=level,
        kind="confidence",
        method="F distribution",
        target=_target_of(form),
        reason=reason,
    )
    return anova.value(form), interval, None


def _ends(
    anova: _Anova, form: IccForm, level: float
) -> tuple[float, float, str | None]:
    """Return the ends of the interval, and why there are none."""
    from scipy.special import fdtri

    k, error, upper = anova.k, anova.error(form), 0.5 + 0.5 * level
    absolute = form.startswith("ICC(A")
    if error == 0.0 and not (absolute and anova.raters > 0.0):
        return 1.0, 1.0, None
    if absolute:
        if not anova.denominator("ICC(A,1)") > 0.0:
            return math.nan, math.nan, "the total variance is estimated as less than 0"
        if not anova.denominator(form) > 0.0:
            why = "the variance of the raters' mean is estimated as less than 0"
            return math.nan, math.nan, why
        squares = (anova.items, anova.raters, anova.residual)
        rho = anova.value("ICC(A,1)")
        low, high = map(float, _absolute_ends(anova.n, k, squares, rho, level))
    else:
        # Table 7 of [1]: F over its upper and lower quantiles, for a single rating
        first, second = anova.df(form)
        lowest = anova.items / error / float(fdtri(first, second, upper))
        highest = anova.items / error * float(fdtri(second, first, upper))
        low, high = ((f - 1) / (f + k - 1) for f in (lowest, highest))
    if math.isnan(low):
        return low, high, "Satterthwaite's degrees of freedom are too few"
    if form.endswith("k)"):
        low, high = _stepped_up(low, k), _stepped_up(high, k)
    return low, high, None


def _absolute_ends(
    n: int, k: int, squares: tuple[Any, Any, Any], rho: Any, level: float
) -> tuple[Any, Any]:
    """Return the ends of ICC(A,1), of one table or of many; ``nan`` without any."""
    # Table 7 of [1], Case 2A and 3A, with Satterthwaite's degrees at ICC(A,1); squares
    # are the mean ones of items, raters and residual, each a number or (...)
    from scipy.special import fdtri

    rows, columns, error = squares
    # times (1 - ρ), so that ρ may be 1
    a, b = k * rho / n, (1 - rho) + k * rho * (n - 1) / n
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        df = np.divide(
            (a * columns + b * error) ** 2,
            (a * columns) ** 2 / (k - 1) + (b * error) ** 2 / ((n - 1) * (k - 1)),
        )
        upper = 0.5 + 0.5 * level
        rest = k * columns + (k * n - k - n) * error
        f_low, f_high = fdtri(n - 1, df, upper), fdtri(df, n - 1, upper)
        low = n * (rows - f_low * error) / (f_low * rest + n * rows)
        high = n * (f_high * rows - error) / (rest + n * f_high * rows)
    # nan, or the ends would leave ρ out
    holds = (f_low >= 1.0) & (f_high >= 1.0)
    return np.where(holds, low, np.nan), np.where(holds, high, np.nan)


def _with_gaps(values: NDArray[np.float64], form: IccForm, level: float) -> _Answer:
    """Return value, interval and reason by restricted maximum likelihood."""
    from masrel.agreement._mixed import components

    fit = components(values, has_raters=not form.startswith("ICC(1"))
    if isinstance(fit, str):
        return math.nan, None, undefined(form, fit)
    absolute = form.startswith("ICC(A")
    error = fit.residual + (fit.raters if absolute else 0.0)
    if fit.items == 0.0 and error == 0.0:
        return math.nan, None, undefined(form, _ALL_ALIKE)
    k, notes = 1, [fit.words]
    if form.endswith("k)"):
        k = fit.n_raters
        notes.append(
            f"k is the {k} raters of the table; an item has "
            f"{fit.n_ratings / fit.n_items:.3g} ratings on average"
        )
    low, high = fit.icc_ends(absolute=absolute, level=level)
    interval = Interval(
        low=_stepped_up(low, k),
        high=_stepped_up(high, k),
        level=level,
        kind="confidence",
        method="REML, profile likelihood",
        target=_target_of(form),
        notes=tuple(notes),
    )
    return fit.items / (fit.items + error / k), interval, None


def _target_of(form: IccForm) -> Target:
    """Return what the interval generalises to."""
    # Consistency leaves out what raters differ by in level: their variance is in no
    # mean square of its interval. In the others raters are a sample, too.
    return "items" if form.startswith("ICC(C") else "both"


def _stepped_up(rho: float, k: int) -> float:
    # Spearman and Brown's k ρ / (1 + (k - 1) ρ), which falls to -∞ at ρ = -1/(k - 1);
    # an end of the interval that lies beyond is no bound
    denominator = 1.0 + (k - 1) * rho
    return -math.inf if denominator <= 0.0 else k * rho / denominator


def _w(values: NDArray[np.float64], *, ties: bool) -> tuple[float, str | None]:
    """Return W, or why there is none."""
    n, m = values.shape
    if why := _too_few(values):
        return math.nan, undefined("Kendall's W", why)
    # ranks are doubled, so that those of ties are whole, and S four times as large
    sums, tied = np.zeros(n, dtype=np.int64), 0
    for column in values.T:
        _, place, freq = np.unique(column, return_inverse=True, return_counts=True)
        # the mean rank of a tie, doubled: those below twice, then t + 1
        sums += (2 * (np.cumsum(freq) - freq) + freq + 1)[place]
        tied += sum(t**3 - t for t in freq.tolist())
    # 12 S / (m² (n³ - n) - m ΣT), as in Kendall (1948), in whole numbers of any size
    numerator = 3 * sum((s - m * (n + 1)) ** 2 for s in sums.tolist())
    whole = m**2 * (n**3 - n)
    denominator = whole - m * tied if ties else whole
    if denominator == 0:
        why = "0/0: every rater gives all items one rating"
        return math.nan, undefined("Kendall's W", why)
    return numerator / denominator, None
