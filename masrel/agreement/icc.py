"""Coefficients of mean squares: intraclass correlations, Robinson's A, Kendall's W.

The interval of absolute agreement is read from the profile of the restricted
likelihood, which depends on a complete table by its mean squares alone. A table with
gaps has none: there the likelihood gives the variances, too.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from masrel._input import check_option, refuse
from masrel.agreement._codes import complete_values, rated_part, rating_values
from masrel.agreement._engine import (
    NO_SPREAD,
    Features,
    Formula,
    check_level,
    deviations,
    logit_ends,
    measured,
    student_t,
    tested,
    undefined,
)
from masrel.agreement._labels import Codes, Label
from masrel.errors import ParameterError, RatingsError
from masrel.estimates import Estimate, Interval, Significance, Target

IccForm = Literal["ICC(1)", "ICC(1,k)", "ICC(C,1)", "ICC(C,k)", "ICC(A,1)", "ICC(A,k)"]
"""One-way; consistency and absolute agreement; of one rating and of the mean of k."""

# How the interval is made: by the newest rule, by an older, or from F always
_Method = Literal["auto", "auto-2026.1", "auto-2026.2", "F"]

_BY_F = ("F", "auto-2026.1")

# Form, as McGraw and Wong call it, to its name in the register
_ICC_NAMES: dict[IccForm, str] = {
    "ICC(1)": "icc_1",
    "ICC(1,k)": "icc_1k",
    "ICC(C,1)": "icc_c1",
    "ICC(C,k)": "icc_ck",
    "ICC(A,1)": "icc_a1",
    "ICC(A,k)": "icc_ak",
}

# Form to what Shrout and Fleiss call it, and psych
_ICC_ALIASES: dict[IccForm, tuple[str, ...]] = {
    "ICC(1)": ("ICC(1,1)", "ICC1"),
    "ICC(1,k)": ("ICC(k)", "ICC1k"),
    "ICC(C,1)": ("ICC(3,1)", "ICC3"),
    "ICC(C,k)": ("ICC(3,k)", "ICC3k"),
    "ICC(A,1)": ("ICC(2,1)", "ICC2"),
    "ICC(A,k)": ("ICC(2,k)", "ICC2k"),
}

_ROUNDING = 1e-13  # share of the sum of all squares, or their variance, that is none

_ALL_ALIKE = "0/0: there are no differences between items or within them"

_OUTSIDE = (
    "a variance is estimated as less than 0, which the profile likelihood does not "
    "allow; its interval is extended to the value"
)

# Value, interval and why there is none
_Answer = tuple[float, Interval | None, str | None]


def _bare_form(name: object) -> str:
    # ICC(2, k) and icc(2,k), icc_2k and ICC2k; not ICC(2), which is another elsewhere
    return re.sub(r"[\s_-]", "", str(name).lower())


_ICC_FORM_OF: dict[str, IccForm] = {
    _bare_form(name): form
    for form, aliases in _ICC_ALIASES.items()
    for name in (form, _ICC_NAMES[form], *aliases)
}


def _form_of(name: str) -> IccForm:
    """Return the form that has a name."""
    form = _ICC_FORM_OF.get(_bare_form(name), name)
    check_option("form", form, get_args(IccForm))
    return cast(IccForm, form)


def icc(
    ratings: object,
    *,
    form: IccForm | str = "ICC(A,1)",
    categories: Sequence[Label] | None = None,
    level: float = 0.95,
    interval: _Method = "auto",
) -> Estimate:
    """Estimate an intraclass correlation with its interval.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Numbers, or labels of a declared scale; None and ``nan`` are missing.
    form : {"ICC(1)", "ICC(1,k)", "ICC(C,1)", "ICC(C,k)", "ICC(A,1)", "ICC(A,k)"}
        One-way random; two-way consistency; two-way absolute agreement; of a single
        rating or of the mean of all raters. The names of Shrout and Fleiss and of psych
        are understood, too: "ICC(2,1)" and "ICC2" are "ICC(A,1)", "ICC(3,1)" and "ICC3"
        are "ICC(C,1)".
    categories : sequence of str, int or float, optional
        The declared scale in order: numbers count by value, text by rank. Needed for
        text.
    level : float, optional
        Level of the interval.
    interval : {"auto", "auto-2026.1", "F"}, optional
        How the interval is made. "auto" is the newest rule: exact from the F
        distribution for one-way and consistency forms of complete tables, and else from
        the profile likelihood. "F" has for absolute agreement what most programs print,
        which is too short where raters differ in level; so has "auto-2026.1" where no
        rating is missing.

    Returns
    -------
    Estimate
        The coefficient, named after its form: ``"icc_a1"`` is ICC(A,1). Its interval
        generalises to other items and, for absolute agreement and one-way forms, to
        other raters too. There is no delta-method error; observed and chance agreement
        do not exist.

    Raises
    ------
    RatingsError
        If the ratings are not such a table, or text without categories.
    ParameterError
        If an option is invalid, or `interval` is "F" and ratings are missing.

    Warns
    -----
    UndefinedStatisticWarning
        If there are fewer than two items or raters, or no variance, or a total
        variance estimated as 0, or too few ratings to tell the variances from each
        other; the value is then ``nan``.

    Notes
    -----
    A complete table has mean squares. If its total variance is estimated as less
    than 0, which takes items that hardly differ, the formula's value lies outside
    [-1, 1] and there is no interval. If only the variance of items is negative, so is
    the value; the profile likelihood, of variances of 0 or more, leaves it out, and the
    interval is drawn out to it. The interval of ICC(A,k) is that of ICC(A,1) stepped
    up by Spearman and Brown's formula.

    Where ratings are missing, all that there are count: the variances of items, raters
    and residual are estimated by restricted maximum likelihood [3]_, each 0 or more;
    k is the number of raters of the table; the interval is the profile likelihood's,
    and its notes have the variances. Items and raters without any rating are left
    out.

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
    form = _form_of(form)
    check_level(level)
    check_option("interval", interval, get_args(_Method))
    values = rated_part(rating_values(ratings, categories))
    if not np.isnan(values).any():
        value, confidence, reason = _without_gaps(values, form, level, interval)
    elif interval == "F":
        raise ParameterError(
            'interval: "F" needs every rating, but some are missing; use "auto", '
            "or leave out the items with missing ratings"
        )
    else:
        value, confidence, reason = _with_gaps(values, form, level)
    return measured(
        _ICC_NAMES[form], values, categories, value, interval=confidence, reason=reason
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class VarianceComponents:
    """Components of the variance of a rating, and how they were estimated.

    Attributes
    ----------
    items, raters, residual : float
        Variances in the unit of the ratings, squared; ``nan`` when undefined.
    method : {"ANOVA", "REML"}
        From mean squares, or, where ratings are missing, of highest restricted
        likelihood.
    negative : tuple of str
        Which of them mean squares estimate as less than 0, and are 0 here.
    reason : str or None
        Why they are undefined, or None.
    """

    items: float = math.nan
    raters: float = math.nan
    residual: float = math.nan
    method: Literal["ANOVA", "REML"] = "ANOVA"
    negative: tuple[str, ...] = ()
    reason: str | None = None


def variance_components(
    ratings: object, *, categories: Sequence[Label] | None = None
) -> VarianceComponents:
    """Estimate the variances of items, raters and residual, as ICC(A,1) has them.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Numbers, or labels of a declared scale; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order: numbers count by value, text by rank. Needed for
        text.

    Returns
    -------
    VarianceComponents
        The three variances. That of items over their sum is ICC(A,1), unless mean
        squares estimate one as less than 0.

    Raises
    ------
    RatingsError
        If the ratings are not such a table, or text without categories.

    Warns
    -----
    UndefinedStatisticWarning
        If there are fewer than two items or raters, or too few ratings to tell the
        variances from each other.

    References
    ----------
    .. [1] McGraw, K. O., Wong, S. P. (1996), Table 3; see `icc`.

    Examples
    --------
    >>> found = variance_components([[1, 2], [3, 3], [5, 7]])
    >>> round(found.items, 3), round(found.raters, 3), round(found.residual, 3)
    (5.0, 0.333, 0.5)
    """
    values = rated_part(rating_values(ratings, categories))
    fit: Any = _too_few(values)
    has_gaps = bool(np.isnan(values).any())
    method: Literal["ANOVA", "REML"] = "REML" if has_gaps else "ANOVA"
    if has_gaps:
        from masrel.agreement._mixed import components

        fit = components(values, has_raters=True)
    elif fit is None:  # from mean squares to what they are made of
        of = _Anova.of(values)
        fit = replace(
            of,
            items=(of.items - of.residual) / of.k,
            raters=(of.raters - of.residual) / of.n,
        )
    if isinstance(fit, str):
        reason = undefined("the variances of ratings", fit)
        return VarianceComponents(method=method, reason=reason)
    parts = {
        name: getattr(fit, name) * fit.unit**2
        for name in ("items", "raters", "residual")
    }
    none = -_ROUNDING * sum(map(abs, parts.values()))
    return VarianceComponents(
        **{name: max(part, 0.0) for name, part in parts.items()},
        method=method,
        negative=tuple(name for name, part in parts.items() if part < none),
    )


def icc_f_test(
    ratings: object,
    *,
    form: IccForm | str = "ICC(A,1)",
    categories: Sequence[Label] | None = None,
) -> Significance:
    """Test whether items differ at all: F of the items' mean square.

    Parameters
    ----------
    ratings, form, categories : optional
        As for `icc`.

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
    form = _form_of(form)
    values = complete_values(ratings, categories)
    anova = _Anova.of(values)
    reason = _no_variance(values, anova, form)
    statistic = math.nan
    if reason is None:
        error = anova.error(form)
        statistic = math.inf if error == 0.0 else anova.items / error
    return tested(
        *("icc_f_test", "the items do not differ", "F", anova.df(form)),
        n_items=len(values),
        statistic=statistic,
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
        reason = undefined(
            "Robinson's A",
            "the items that every rater rated have fewer than two items or raters",
        )
    elif (total := anova.items + (anova.k - 1) * anova.residual) == 0.0:
        reason = undefined(
            "Robinson's A", "0/0: there is no variance except between raters"
        )
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
    level: float = 0.95,
) -> Estimate:
    """Estimate Kendall's W: how much raters agree on the order of the items.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Numbers, or labels of a declared scale; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; needed for text.
    ties : bool, optional
        Whether to correct for ties; without it W cannot reach 1 when there are any.
    level : float, optional
        Level of the interval.

    Returns
    -------
    Estimate
        W within [0, 1] with its interval for other items, ranked by these raters.
        There is no observed or chance agreement.

    Raises
    ------
    RatingsError
        If the ratings are not such a table, or text without categories.
    ParameterError
        If the level is not within (0, 1).

    Warns
    -----
    UndefinedStatisticWarning
        If there are fewer than two complete items or two raters, or every rater ties
        all items; the value is then ``nan``.

    Notes
    -----
    Items with a missing rating are left out. What the interval holds is W of very many
    such items. The error is of what each item moves W by, itself and by the ranks of
    the others; the interval is Student's t on the logit.

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
    check_level(level)
    values = complete_values(ratings, categories)
    value, error, reason = _w(values, ties=ties)
    return measured(
        "kendall_w",
        values,
        categories,
        value,
        weights="tie-corrected" if ties else "uncorrected",
        standard_error=error,
        interval=None if reason else _w_interval(value, error, len(values), level),
        reason=reason,
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
        As for `kendall_w`.

    Returns
    -------
    Significance
        Friedman's m (n - 1) W with n - 1 degrees of freedom; approximate below some
        8 items.

    Raises
    ------
    RatingsError
        As for `kendall_w`.

    Warns
    -----
    UndefinedStatisticWarning
        As for `kendall_w`.

    Examples
    --------
    >>> print(kendall_w_test([[1, 1, 2], [2, 3, 1], [3, 2, 3]]))
    kendall_w_test: 2.667, chi-squared(2), p = 0.264
    """
    values = complete_values(ratings, categories)
    n, m = values.shape
    w, _, reason = _w(values, ties=ties)
    return tested(
        *("kendall_w_test", "the raters' orders are unrelated", "chi-squared"),
        df=(float(max(n - 1, 0)),),
        n_items=n,
        statistic=m * (n - 1) * w,
        reason=reason,
    )


@dataclass(frozen=True, slots=True)
class _Anova:
    # mean squares of [1], of items, raters, residual, and within items, in unit², of
    # one table or of many
    n: Any
    k: int
    items: Any
    raters: Any
    residual: Any
    within: Any
    unit: float = 1.0

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

    @classmethod
    def of_sums(cls, sums: NDArray[Any]) -> "_Anova":
        # sums of _features, (..., 3 + k)
        n, of_items, squares, *of_raters = np.moveaxis(sums, -1, 0)
        k, total = len(of_raters), sum(of_raters)
        parts = np.stack([
            n * of_items - total**2,
            k * sum(x**2 for x in of_raters) - total**2,
            n * (k * squares - of_items),
        ])  # fmt: skip
        parts[abs(parts) <= _ROUNDING * abs(n * k * squares)] = 0.0
        rows, columns, within = parts / (n * k)
        rest = (within - columns) / ((n - 1) * (k - 1))
        return cls(
            n, k, rows / (n - 1), columns / (k - 1), rest, within / (n * (k - 1))
        )

    def error(self, form: str) -> Any:
        return self.within if form.startswith("ICC(1") else self.residual

    def df(self, form: str) -> tuple[float, float]:
        one_way = form.startswith("ICC(1")
        error = self.n * (self.k - 1) if one_way else (self.n - 1) * (self.k - 1)
        return float(self.n - 1), float(error)

    def denominator(self, form: str) -> Any:
        # denominators of Table 4 of [1]
        of_raters = self.raters - self.residual if form.startswith("ICC(A") else 0.0
        if form.endswith("k)"):
            return self.items + of_raters / self.n
        error = (self.k - 1) * self.error(form)
        return self.items + error + self.k * of_raters / self.n

    def value(self, form: str) -> Any:
        return (self.items - self.error(form)) / self.denominator(form)


def _features(
    codes: Codes, values: NDArray[np.float64], _repeats: object = None
) -> Features:
    """Return of every item: 1, its sum squared, the sum of squares, each rating."""
    rated = codes >= 0
    some, none = rated.any(axis=1), np.empty((len(codes), 0))
    refuse(
        (
            (some & ~rated.all(axis=1)).any(),
            "ratings: for an ICC with items left out, drawn, or in clusters every "
            "rating is needed, but some are missing: leave out the items that not "
            "every rater rated; without clusters the ICC's own interval uses all "
            "ratings",
        ),
        error=RatingsError,
    )
    x = np.append(values, 0.0)[codes]  # a rater without any rating adds nothing
    dense = np.vstack([some, x.sum(axis=1) ** 2, (x * x).sum(axis=1), x.T])
    return Features(dense, none.astype(np.int64), none, 0)


def _disagreements(
    form: IccForm, sums: NDArray[Any], _values: object
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return D_o and D_e, for the value 1 - D_o/D_e, and its slope."""
    anova = _Anova.of_sums(sums)
    d_e = anova.denominator(form)[..., None]
    d_o = d_e - (anova.items - anova.error(form))[..., None]
    steps = sums[..., None, :] + 1e-30j * np.eye(sums.shape[-1])  # no rounding
    return d_o, d_e, _Anova.of_sums(steps).value(form).imag * 1e30


# The coefficients of complete tables as functions of sums over items
_ICC_FORMULAS = {
    form: Formula(
        name=name,
        title=form,
        features=_features,
        disagreements=partial(_disagreements, form),
    )
    for form, name in _ICC_NAMES.items()
}


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


def _without_gaps(
    values: NDArray[np.float64], form: IccForm, level: float, method: _Method
) -> _Answer:
    """Return value, interval and reason by mean squares."""
    anova = _Anova.of(values)
    reason = _no_variance(values, anova, form)
    if reason is None and anova.denominator(form) == 0.0:
        reason = undefined(form, "division by 0: the total variance is estimated as 0")
    if reason is not None:
        return math.nan, None, reason
    value, notes = anova.value(form), list[str]()
    by_f = method in _BY_F or not form.startswith("ICC(A")
    low, high, reason = _ends(anova, form, level, by_f)
    if not by_f and not low <= value <= high and reason is None:
        low, high, notes = min(low, value), max(high, value), [_OUTSIDE]
    interval = Interval(
        low=low,
        high=high,
        level=level,
        kind="confidence",
        method="F distribution" if by_f else "profile likelihood",
        target=_icc_target(form),
        notes=tuple(notes),
        reason=reason,
    )
    return value, interval, None


def _ends(
    anova: _Anova, form: IccForm, level: float, by_f: bool
) -> tuple[float, float, str | None]:
    """Return the ends of the interval, or why they are undefined."""
    from scipy.special import fdtri

    k, error, upper = anova.k, anova.error(form), 0.5 + 0.5 * level
    absolute = form.startswith("ICC(A")
    if error == 0.0 and not (absolute and anova.raters > 0.0):
        return 1.0, 1.0, None
    if absolute:
        for of, what in (
            ("ICC(A,1)", "total variance"),
            (form, "variance of the raters' mean"),
        ):
            if not anova.denominator(of) > 0.0:
                return math.nan, math.nan, f"the {what} is estimated as less than 0"
        if by_f:
            low, high = _f_ends(anova, level)
        else:
            from masrel.agreement._profile import profile_ends

            squares = anova.items, anova.raters, anova.residual
            low, high = map(float, profile_ends(anova.n, k, squares, level))
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


def _f_ends(anova: _Anova, level: float) -> tuple[float, float]:
    """Return the ends of ICC(A,1) by F; ``nan`` without any."""
    # Table 7 of [1], Case 2A and 3A, with Satterthwaite's degrees at ICC(A,1)
    from scipy.special import fdtri

    n, k, rho = anova.n, anova.k, anova.value("ICC(A,1)")
    rows, columns, error = anova.items, anova.raters, anova.residual
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
    holds = f_low >= 1.0 and f_high >= 1.0
    return (float(low), float(high)) if holds else (math.nan, math.nan)


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
    k = fit.n_raters if form.endswith("k)") else 1
    note = (
        f"the mean is of k = {k} ratings, one per rater; an item has "
        f"{fit.n_ratings / fit.n_items:.3g} ratings on average"
    )
    low, high = fit.icc_ends(absolute=absolute, level=level)
    interval = Interval(
        low=_stepped_up(low, k),
        high=_stepped_up(high, k),
        level=level,
        kind="confidence",
        method="REML, profile likelihood",
        target=_icc_target(form),
        notes=(fit.words, note) if form.endswith("k)") else (fit.words,),
    )
    return fit.items / (fit.items + error / k), interval, None


def _icc_target(form: IccForm) -> Target:
    """Return what the interval generalises to."""
    # Consistency leaves out what raters differ by in level: their variance is in no
    # mean square of its interval. In the others raters are a sample, too.
    return "items" if form.startswith("ICC(C") else "both"


def _stepped_up(rho: float, k: int) -> float:
    # Spearman and Brown's k ρ / (1 + (k - 1) ρ), which falls to -∞ at ρ = -1/(k - 1);
    # an end of the interval that lies beyond is no bound
    denominator = 1.0 + (k - 1) * rho
    return -math.inf if denominator <= 0.0 else k * rho / denominator


def _w(values: NDArray[np.float64], *, ties: bool) -> tuple[float, float, str | None]:
    """Return W and its standard error, or why it is undefined."""
    n, m = values.shape
    if why := _too_few(values):
        return math.nan, math.nan, undefined("Kendall's W", why)
    columns = [
        np.unique(column, return_inverse=True, return_counts=True)[1:]
        for column in values.T
    ]
    # ranks less their mean, doubled, so that those of ties are whole: items below, less
    # items above; S is then four times as large
    ranks = [(2 * np.cumsum(freq) - freq - n)[place] for place, freq in columns]
    sums = np.sum(ranks, axis=0)
    # 12 S / (m² (n³ - n) - m ΣT), as in Kendall (1948), in whole numbers of any size
    denominator = m**2 * (n**3 - n)
    if ties:
        denominator -= m * sum(t**3 - t for _, freq in columns for t in freq.tolist())
    if denominator == 0:
        why = "0/0: every rater gives all items the same rating"
        return math.nan, math.nan, undefined("Kendall's W", why)
    w = 3 * sum(s**2 for s in sums.tolist()) / denominator

    def above(of: NDArray[Any], place: NDArray[np.intp]) -> NDArray[np.float64]:
        # Σ over the items above each, and half of those tied with it
        by_place = np.bincount(place, of)
        return np.asarray((of.sum() - np.cumsum(by_place) + by_place / 2.0)[place])

    # What an item moves S by: itself, and the ranks of the items above it. Where there
    # are ties it moves the spread of each rater's ranks likewise.
    moves = sums.astype(float) ** 2
    for rank, (place, _) in zip(ranks, columns, strict=True):
        moves += 4.0 * above(sums, place)
        if ties:
            moves -= w * m * (rank.astype(float) ** 2 + 4.0 * above(rank, place))
    # √[n² Σ u² / ((n - 1)(n - 2))], which covers as leaving items out one by one does
    scale = 3.0 * n / denominator / math.sqrt((n - 1) * (n - 2)) if n > 2 else math.nan
    return w, scale * float(np.linalg.norm(moves - moves.mean())), None


def _w_interval(w: float, error: float, n: int, level: float) -> Interval:
    """Return an interval symmetric on the logit."""
    is_inside, low, high = 0.0 < w < 1.0 and error > _ROUNDING, math.nan, math.nan
    if is_inside:
        low, high = logit_ends(w, student_t(level, n - 1) * error)
    return Interval(
        low=low,
        high=high,
        level=level,
        kind="confidence",
        method=f"delta method, t({n - 1}) on the logit",
        target="items",
        reason=None if is_inside else NO_SPREAD,
    )
