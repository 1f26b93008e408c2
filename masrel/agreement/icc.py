"""What mean squares say: six intraclass correlations, and Robinson's A.

A table with gaps has no mean squares: variances are then estimated by restricted
maximum likelihood, and the interval is read from its profile.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._data import complete_values, rated_part, rating_values
from masrel.agreement._engine import check_level, undefined
from masrel.agreement._labels import Label
from masrel.errors import ParameterError
from masrel.estimates import Estimate, Interval, Significance, Target

if TYPE_CHECKING:
    from masrel.agreement._reml import Components

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

_Numbers = float | NDArray[np.float64]

_SQUARABLE = 400
"""Binary exponent up to which squares, and sums and products of them, are floats."""


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
    _check(form, level)
    values = rated_part(rating_values(ratings, categories))
    if np.isnan(values).any():
        value, interval, reason = _with_gaps(values, form, level)
    else:
        anova = _Anova.of(values)
        reason = _reason(values, anova, form)
        value, interval = math.nan, None
        if reason is None:
            value = anova.value(form)
            interval = _interval(anova, form, level)
    n_items, n_raters = values.shape
    return Estimate(
        coefficient=_NAMES[form],
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


def _n_categories(
    values: NDArray[np.float64], categories: Sequence[Label] | None
) -> int:
    if categories is not None:
        return len(categories)
    return len(np.unique(values[~np.isnan(values)]))


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
    _check(form, 0.5)
    values = complete_values(ratings, categories)
    anova = _Anova.of(values)
    reason = _reason(values, anova, form.replace(",k)", ",1)"))
    statistic = p = math.nan
    df = anova.df(form)
    if reason is None:
        from scipy.special import fdtrc

        error = anova.error(form)
        statistic = math.inf if error == 0.0 else anova.items / error
        p = float(fdtrc(*df, statistic))
    return Significance(
        name="icc_f_test",
        hypothesis="the items do not differ",
        statistic=statistic,
        distribution="F",
        df=df,
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
    n, k = values.shape
    reason, value = None, math.nan
    if n < 2 or k < 2:
        why = "fewer than two items or raters in the items that every rater rated"
        reason = undefined("Robinson's A", why)
    elif (total := anova.ss_items + anova.ss_residual) == 0.0:
        reason = undefined("Robinson's A", "0/0: no variance but between raters")
    else:
        value = anova.ss_items / total
    return Estimate(
        coefficient="robinson_a",
        weights="quadratic",
        value=value,
        standard_error=math.nan,
        observed=math.nan,
        chance=math.nan,
        n_items=n,
        n_items_paired=n if k > 1 else 0,
        n_raters=k,
        n_categories=len(np.unique(values)) if categories is None else len(categories),
        reason=reason,
    )


def _check(form: str, level: float) -> None:
    if form not in get_args(IccForm):
        raise ParameterError(
            f"form: needs one of {', '.join(get_args(IccForm))}, got {form!r}"
        )
    check_level(level)


def _reason(
    values: NDArray[np.float64], anova: "_Anova", form: str = "ICC(1)"
) -> str | None:
    if values.shape[0] < 2:
        return undefined(form, "fewer than two items are rated by every rater")
    if values.shape[1] < 2:
        return undefined(form, "fewer than two raters")
    if anova.items == 0.0 and anova.error(form) == 0.0:
        return undefined(form, "0/0: neither items nor ratings of an item differ")
    if anova.denominator(form) == 0.0:
        return undefined(form, "division by 0: the total variance is estimated as 0")
    return None


@dataclass(frozen=True, slots=True)
class _Anova:
    # mean squares of [1], of items, raters, residual, and within items; sums of squares
    # are times (n k)²; of the ratings over `unit`, 1 unless their squares are no floats
    n: int
    k: int
    items: float
    raters: float
    residual: float
    within: float
    ss_items: float
    ss_residual: float
    unit: float = 1.0

    @classmethod
    def of(cls, values: NDArray[np.float64]) -> "_Anova":
        n, k = values.shape
        if n < 2 or k < 2:
            return cls(n, k, *[math.nan] * 6)
        # Deviations times n k, which are whole, and so exact, for whole ratings; from
        # the first rating, so that a common offset of all costs no digits.
        values, unit = _squarable(values)
        x = values - values[0, 0]
        of_items, of_raters = x.sum(axis=1, keepdims=True), x.sum(axis=0, keepdims=True)
        total = x.sum()
        rows, columns = n * of_items - total, k * of_raters - total
        within = n * (k * x - of_items)
        residual = within - columns
        ss_items = float(k * (rows**2).sum())
        ss_residual = float((residual**2).sum())
        scale = float(n * k) ** 2
        return cls(
            n,
            k,
            ss_items / (scale * (n - 1)),
            float(n * (columns**2).sum()) / (scale * (k - 1)),
            ss_residual / (scale * ((n - 1) * (k - 1))),
            float((within**2).sum()) / (scale * (n * (k - 1))),
            ss_items,
            ss_residual,
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


def _squarable(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Return values whose squares are floats, and the power of two they are over."""
    exponent = int(np.frexp(np.abs(values).max())[1]) - 1
    if -_SQUARABLE < exponent < _SQUARABLE:
        return values, 1.0
    return np.ldexp(values, -exponent), math.ldexp(1.0, exponent)


def _with_gaps(
    values: NDArray[np.float64], form: IccForm, level: float
) -> tuple[float, Interval | None, str | None]:
    """Return value, interval and reason of a table with missing ratings."""
    from masrel.agreement._icc_profile import icc_ends
    from masrel.agreement._reml import crossed_components, nested_components

    one_way = form.startswith("ICC(1")
    components = (nested_components if one_way else crossed_components)(values)
    if components.reason is not None:
        return math.nan, None, undefined(form, components.reason)
    absolute = form.startswith("ICC(A")
    error = components.residual + (components.raters if absolute else 0.0)
    if components.items == 0.0 and error == 0.0:
        why = "0/0: neither items nor ratings of an item differ"
        return math.nan, None, undefined(form, why)
    k = components.n_raters if form.endswith("k)") else 1
    low, high = icc_ends(components, absolute=absolute, level=level)
    interval = Interval(
        low=_stepped_up(low, k),
        high=_stepped_up(high, k),
        level=level,
        kind="confidence",
        method="REML, profile likelihood",
        target=_target_of(form),
        notes=_gap_notes(components, form),
    )
    return components.items / (components.items + error / k), interval, None


def _gap_notes(components: "Components", form: str) -> tuple[str, ...]:
    """Return what to know of an estimate from a table with gaps."""
    notes = [components.words]
    if form.endswith("k)"):
        mean = components.n_ratings / components.n_items
        notes.append(
            f"k is the {components.n_raters} raters of the table; an item has "
            f"{mean:.3g} ratings on average"
        )
    return tuple(notes)


def _interval(anova: _Anova, form: IccForm, level: float) -> Interval:
    reason = None
    if form.startswith("ICC(A"):
        reason = _without_interval(anova, form)
        low, high = (math.nan, math.nan) if reason else _absolute(anova, level)
        if reason is None and math.isnan(low):
            reason = "Satterthwaite's degrees of freedom are too few"
    else:
        low, high = _ratio(anova, form, level)
    if form.endswith("k)"):
        low, high = _stepped_up(low, anova.k), _stepped_up(high, anova.k)
    return Interval(
        low=low,
        high=high,
        level=level,
        kind="confidence",
        method="F distribution",
        target=_target_of(form),
        reason=reason,
    )


def _target_of(form: IccForm) -> Target:
    """Return what the interval generalises to."""
    # Consistency leaves out what raters differ by in level: their variance is in no
    # mean square of its interval. In the others raters are a sample, too.
    return "items" if form.startswith("ICC(C") else "both"


def _without_interval(anova: _Anova, form: str) -> str | None:
    # why absolute agreement has no interval, or None
    if not anova.denominator("ICC(A,1)") > 0.0:
        return "the total variance is estimated as less than 0"
    if form == "ICC(A,k)" and not anova.denominator(form) > 0.0:
        return "the variance of the raters' mean is estimated as less than 0"
    return None


def _stepped_up(rho: float, k: int) -> float:
    # Spearman and Brown's k ρ / (1 + (k - 1) ρ), which falls to -∞ at ρ = -1/(k - 1);
    # an end of the interval that lies beyond is no bound
    denominator = 1.0 + (k - 1) * rho
    return -math.inf if denominator <= 0.0 else k * rho / denominator


def _ratio(anova: _Anova, form: str, level: float) -> tuple[float, float]:
    # Table 7 of [1]: F over its upper and lower quantiles, for a single rating
    error = anova.error(form)
    if error == 0.0:
        return 1.0, 1.0
    f = anova.items / error
    first, second = anova.df(form)
    upper = 0.5 + 0.5 * level
    lowest = f / _f_quantile(first, second, upper)
    highest = f * _f_quantile(second, first, upper)
    k = anova.k
    return (lowest - 1) / (lowest + k - 1), (highest - 1) / (highest + k - 1)


def _absolute(anova: _Anova, level: float) -> tuple[float, float]:
    rho = anova.value("ICC(A,1)")
    if rho == 1.0:
        return 1.0, 1.0
    squares = (anova.items, anova.raters, anova.residual)
    low, high = _absolute_ends(anova.n, anova.k, squares, rho, level)
    return float(low), float(high)


def _absolute_ends(
    n: int,
    k: int,
    squares: "tuple[_Numbers, _Numbers, _Numbers]",
    rho: "_Numbers",
    level: float,
) -> "tuple[_Numbers, _Numbers]":
    """Return the ends of ICC(A,1) below 1, of one table or of many."""
    # Table 7 of [1], Case 2A and 3A, with Satterthwaite's degrees at ICC(A,1); squares
    # are the mean ones of items, raters and residual, each a number or (...)
    from scipy.special import fdtri

    rows, columns, error = squares
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        a = k * rho / (n * (1 - rho))
        b = 1 + k * rho * (n - 1) / (n * (1 - rho))
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


def _f_quantile(first: float, second: float, share: float) -> float:
    from scipy.special import fdtri

    return float(fdtri(first, second, share))
