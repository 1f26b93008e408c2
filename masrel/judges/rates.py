"""Rates of a judge, corrected by a few items that humans labelled as well.

In: a judge's grades of many items, and labels of few. Out: the rate of a grade, or a
mean, with an interval for other items like these.
"""

import math
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from masrel._input import check_option, listed, refuse, shown
from masrel.agreement._engine import Floats, check_level, divide, undefined
from masrel.agreement._labels import is_missing
from masrel.errors import RatingsError
from masrel.judges._paired import check_count, check_share
from masrel.judges.annotators import Grades, _by_item

_Number = Any  # a float, or an array of them
_RateMethod = Literal["naive", "rogan_gladen", "prediction_powered", "labels_alone"]
_Assumption = Literal["judge_is_right", "errors_carry_over", "labels_are_random"]
_RateNote = Literal["few_labels", "whole_range"]

_ASSUMPTIONS: dict[_RateMethod, _Assumption] = {
    "naive": "judge_is_right",
    "rogan_gladen": "errors_carry_over",
    "prediction_powered": "labels_are_random",
    "labels_alone": "labels_are_random",
}

# Coverage below 93 % was met only with fewer: docs/evidence/judges.md
_ENOUGH = {"labels": 10, "numbers": 50, "z": 200, "of_both_kinds": 20, "of_a_kind": 5}

# Why an interval lies below 0, or above 1
_OUTSIDE = {
    "rogan_gladen": (
        "the judge passes fewer items than its false passes alone would give, so its "
        "errors in the labelled items differ from those in the others",
        "the judge passes more items than if all deserved it, so its errors in the "
        "labelled items differ from those in the others",
    ),
    "prediction_powered": (
        ("the judge grades labelled items differently from the others"),
    )
    * 2,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class RateEstimate:
    """A rate, or a mean, that labels and a judge's grades give.

    Attributes
    ----------
    method : {"naive", "rogan_gladen", "prediction_powered", "labels_alone"}
        How it was computed: the judge's own rate, the one corrected for its errors,
        the one of labels that its grades sharpen, or the one of labels alone.
    value, low, high : float
        The rate and its interval, a rate's cut to [0, 1]; ``nan`` when undefined.
    level : float
        Nominal level of the interval.
    n_judged, n_labels : int
        Items that the judge graded, and items with a label.
    interval_method : str
        How the interval was computed.
    assumption : {"judge_is_right", "errors_carry_over", "labels_are_random"}
        What must be true of it: the judge makes no errors; it errs in other items as
        often as in the labelled ones; these were drawn at random from all.
    uncut_low, uncut_high : float
        Ends before they are cut; ``nan`` of what has no bounds.
    power : float
        How much the judge counts beside labels, λ; ``nan`` where it is not defined.
    notes : tuple of {"few_labels", "whole_range"}
        Fewer labels than a coverage of 93 % needs: 10; of numbers that are not all 0 or
        1, 50; of a corrected rate, 20 with 5 of each kind. An interval that is all of
        [0, 1], so that nothing was learnt.
    reason : str or None
        Why the value or the ends are undefined, or None.
    """

    method: _RateMethod
    value: float
    low: float
    high: float
    level: float
    n_judged: int
    n_labels: int
    interval_method: str
    assumption: _Assumption
    uncut_low: float = math.nan
    uncut_high: float = math.nan
    power: float = math.nan
    notes: tuple[_RateNote, ...] = ()
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RateEstimates:
    """Estimates of the rate of a grade, side by side.

    Attributes
    ----------
    rows : tuple of RateEstimate
        One a method.
    default : {"prediction_powered"}
        The method to report.
    grade : hashable
        The grade whose rate it is.
    n_left_out : int
        Labelled items that the judge did not grade.
    sensitivity, specificity : tuple of float and int
        The judge's share of the labelled items with the grade that it gave the grade,
        and of those without that it did not, each with the number of such items.
    """

    rows: tuple[RateEstimate, ...]
    default: _RateMethod
    grade: Hashable
    n_left_out: int
    sensitivity: tuple[float, int]
    specificity: tuple[float, int]


def corrected_rate(
    rate: float,
    n: int,
    *,
    sensitivity: tuple[float, int],
    specificity: tuple[float, int],
    level: float = 0.95,
) -> RateEstimate:
    """Correct a judge's rate for its sensitivity and specificity.

    Parameters
    ----------
    rate : float
        Share of the items that the judge passes.
    n : int
        Items that it judged.
    sensitivity : tuple of float and int
        Share that it passes of labelled items that deserve it, and their number.
    specificity : tuple of float and int
        Share that it fails of labelled items that deserve that, and their number.
    level : float, optional
        Level of the interval.

    Returns
    -------
    RateEstimate
        Rogan and Gladen's rate with Lang and Reiczigel's interval.

    Raises
    ------
    ParameterError
        If a share is outside [0, 1], a number below 1, or sensitivity and specificity
        add up to 1 or less: such a judge gives no information about the rate.

    Warns
    -----
    UndefinedStatisticWarning
        If the interval lies outside [0, 1]: the error rates do not carry over from the
        labelled items, and the ends are ``nan``.

    References
    ----------
    .. [1] Rogan, W. J., Gladen, B. (1978). Estimating prevalence from the results of a
       screening test. American Journal of Epidemiology, 107(1), 71-76.
       https://doi.org/10.1093/oxfordjournals.aje.a112510
    .. [2] Lang, Z., Reiczigel, J. (2014). Confidence limits for prevalence of disease
       adjusted for estimated sensitivity and specificity. Preventive Veterinary
       Medicine, 113(1), 13-22. https://doi.org/10.1016/j.prevetmed.2013.09.015
    .. [3] Lee, C., et al. (2025). How to correctly report LLM-as-a-judge evaluations.
       https://arxiv.org/abs/2511.21140

    Examples
    --------
    The judge passes 40 % of 1000 items, but also 30 % of those that deserve to fail:

    >>> result = corrected_rate(
    ...     0.4, 1000, sensitivity=(0.9, 200), specificity=(0.7, 200)
    ... )
    >>> round(result.value, 3), round(result.low, 3), round(result.high, 3)
    (0.167, 0.056, 0.263)
    """
    check_level(level)
    check_share("rate", rate)
    check_count("n", n)
    for name, pair in (("sensitivity", sensitivity), ("specificity", specificity)):
        refuse(
            (
                not isinstance(pair, tuple | list) or len(pair) != 2,
                f"{name}: needs a share and its number of items, got {shown(pair)}",
            )
        )
        check_share(name, pair[0])
        check_count(name, pair[1])
    total = sensitivity[0] + specificity[0]
    refuse(
        (
            total <= 1.0,
            f"sensitivity, specificity: need a sum above 1, got {total:.4g}, with "
            "which the judge gives no information about the rate",
        )
    )
    return _corrected(rate, n, sensitivity, specificity, level)


def prediction_powered_mean(
    labels: ArrayLike,
    predictions: ArrayLike,
    unlabelled: ArrayLike,
    *,
    power: float | None = None,
    method: Literal["auto", "z"] = "z",
    level: float = 0.95,
) -> RateEstimate:
    """Estimate a mean from labels of few items and predictions of all.

    Parameters
    ----------
    labels : array_like of float, shape (n_labels,)
        What humans say of the labelled items, a random sample of all.
    predictions : array_like of float, shape (n_labels,)
        What the judge says of the same items, in the same order.
    unlabelled : array_like of float, shape (n_unlabelled,)
        What the judge says of the other items.
    power : float, optional
        How much predictions count, λ in [0, 1]; estimated when not given.
    method : {"z", "auto"}, optional
        The interval: "z" is PPI++'s as published, which is too short with few labels,
        of a rare grade up to hundreds of them; "auto" is the one that held its level in
        the study of coverage, and that `rate_estimates` takes.
    level : float, optional
        Level of the interval.

    Returns
    -------
    RateEstimate
        The mean of PPI++ with the interval and λ.

    Raises
    ------
    ParameterError
        If `power`, `method` or `level` is not one of those above.
    RatingsError
        If labels and predictions are not two or more pairs of numbers, or no number is
        unlabelled.

    Warns
    -----
    UndefinedStatisticWarning
        If labels that are not all 0 or 1 are equal, and so are predictions: nothing
        shows how far off they may be, and the ends are ``nan``.

    Notes
    -----
    Of labels and predictions that are all 0 or 1 the automatic interval adds z²
    labelled items in which both, neither and either is 1, a quarter each, to the
    variance and to λ, as Agresti and Coull do for a share, and uses t instead of z.
    Without them an interval has no width if the judge is never wrong in the few
    labelled items. It is cut to [0, 1]. For other numbers it leaves out one labelled
    item at a time, estimates λ again each time, and uses t.

    References
    ----------
    .. [1] Angelopoulos, A. N., Duchi, J. C., Zrnic, T. (2023). PPI++: efficient
       prediction-powered inference. https://arxiv.org/abs/2311.01453
    .. [2] Agresti, A., Coull, B. A. (1998). Approximate is better than "exact" for
       interval estimation of binomial proportions. The American Statistician, 52(2),
       119-126. https://doi.org/10.1080/00031305.1998.10480550

    Examples
    --------
    >>> result = prediction_powered_mean(
    ...     [1, 0, 1, 1, 0, 1, 0, 1, 1, 0],
    ...     [1, 0, 1, 0, 0, 1, 1, 1, 1, 0],
    ...     [1] * 60 + [0] * 40,
    ...     method="auto",
    ... )
    >>> print(f"{result.value:.3f} ({result.low:.3f} to {result.high:.3f})")
    0.600 (0.306 to 0.859)
    """
    check_level(level)
    check_option("method", method, ("auto", "z"))
    check_share("power", 0.0 if power is None else power)
    y, f = _numbers("labels", labels), _numbers("predictions", predictions)
    pool = _numbers("unlabelled", unlabelled)
    n, m = len(y), len(pool)
    refuse(
        (len(f) != n, f"predictions: needs one for each of {n} labels, got {len(f)}"),
        (n < 2, f"labels: needs labels of 2 items or more, got {n}"),
        (m < 1, "unlabelled: needs at least one prediction, got none"),
        error=RatingsError,
    )
    is_z = method == "z"
    if not is_z and all(np.isin(of, (0.0, 1.0)).all() for of in (y, f, pool)):
        moments = _share_moments(n, m, y.mean(), f.mean(), (y * f).mean(), pool.mean())
        return _powered(moments, power, level)
    # numbers less the first: a common offset costs no digits
    shift, y, f, pool = y[0], y - y[0], f - f[0], pool - f[0]
    moments = _Moments(
        n=n,
        m=m,
        y=y.mean(),
        f=f.mean(),
        yy=(y * y).mean(),
        yf=(y * f).mean(),
        ff=(f * f).mean(),
        pool=pool.mean(),
        pool_squared=(pool * pool).mean(),
    )
    value, used = moments.mean(power)
    low, high = (
        moments.ends(used, _quantile(level))
        if is_z
        else moments.jackknife_ends(y, f, power, level)
    )
    why = "all labelled items have the same error"
    title = "the interval of the prediction-powered mean"
    return RateEstimate(
        method="prediction_powered",
        value=float(value + shift),
        low=float(low + shift),
        high=float(high + shift),
        level=level,
        n_judged=n + m,
        n_labels=n,
        interval_method="normal" if is_z else "jackknife",
        assumption="labels_are_random",
        power=float(used),
        notes=("few_labels",) if n < _ENOUGH["z" if is_z else "numbers"] else (),
        reason=undefined(title, why) if np.isnan(low) else None,
    )


def rate_estimates(
    labels: Grades,
    judge: Grades,
    *,
    grade: Hashable,
    level: float = 0.95,
) -> RateEstimates:
    """Estimate how often a grade is right, in four ways side by side.

    Parameters
    ----------
    labels : mapping of item to grade, or Series
        The humans' one grade of each of few items; None and ``nan`` are missing.
    judge : mapping of item to grade, or Series
        The judge's grade of each of many items, those included.
    grade : str, int or float
        The grade whose rate it is, such as "pass".
    level : float, optional
        Level of the intervals.

    Returns
    -------
    RateEstimates
        A row for each: the judge's own rate; Rogan and Gladen's, corrected for the
        judge's errors in the labelled items; the prediction-powered one, which is the
        default; and that of the labels alone.

    Raises
    ------
    ParameterError
        If nobody gave the grade, or the level is not one.
    RatingsError
        If fewer than 2 items have both a label and a grade of the judge.

    Warns
    -----
    UndefinedStatisticWarning
        If all labelled items have the same label, or the judge does no better in them
        than chance: the rate of Rogan and Gladen is ``nan``. Or if its interval lies
        outside [0, 1].

    See Also
    --------
    corrected_rate : The rate from shares.
    prediction_powered_mean : The mean of any numbers.

    Examples
    --------
    >>> judge = {item: "pass" if item % 10 < 6 else "fail" for item in range(500)}
    >>> labels = {item: "pass" if item % 10 < 5 else "fail" for item in range(50)}
    >>> for row in rate_estimates(labels, judge, grade="pass").rows:
    ...     print(f"{row.method}: {row.value:.3f} ({row.low:.3f} to {row.high:.3f})")
    naive: 0.600 (0.556 to 0.642)
    rogan_gladen: 0.500 (0.361 to 0.619)
    prediction_powered: 0.500 (0.409 to 0.601)
    labels_alone: 0.500 (0.363 to 0.637)
    """
    check_level(level)
    human, model = (
        {item: of for item, of in _by_item(grades, name).items() if not is_missing(of)}
        for name, grades in (("labels", labels), ("judge", judge))
    )
    both = [item for item in human if item in model]
    n, m, n_judged = len(both), len(model) - len(both), len(model)
    refuse(
        (n < 2, f"labels: needs 2 items or more that the judge graded too, got {n}"),
        error=RatingsError,
    )
    grades = {*human.values(), *model.values()}
    names = listed(sorted(map(str, grades)))
    refuse((grade not in grades, f"grade: needs one of {names}, got {shown(grade)}"))
    y = np.array([human[item] == grade for item in both], dtype=np.float64)
    f = np.array([model[item] == grade for item in both], dtype=np.float64)
    passed, n_positive = sum(of == grade for of in model.values()), int(y.sum())
    of_both = _share_moments(
        n, m, y.mean(), f.mean(), (y * f).mean(), (passed - f.sum()) / max(m, 1)
    )
    naive = passed / n_judged
    of_judge = _share_moments(n_judged, 0, naive, naive, naive, 0.0)
    # each is divided by 1 where there is none of the kind
    sensitivity = float(y @ f) / max(n_positive, 1), n_positive
    specificity = float((1.0 - y) @ (1.0 - f)) / max(n - n_positive, 1), n - n_positive
    return RateEstimates(
        rows=(
            _powered(of_judge, 0.0, level, "naive"),
            _corrected(naive, n_judged, sensitivity, specificity, level),
            _powered(of_both, None, level),
            _powered(of_both, 0.0, level, "labels_alone"),
        ),
        default="prediction_powered",
        grade=grade,
        n_left_out=len(human) - n,
        sensitivity=sensitivity,
        specificity=specificity,
    )


def label_allocation(
    m: int, rate: float, *, sensitivity: float, specificity: float, pilot: int
) -> float:
    """Return how many of the items to label should be positives.

    Parameters
    ----------
    m : int
        Items to label in all.
    rate : float
        The rate that is expected, in (0, 1).
    sensitivity, specificity : float
        The judge's shares in a pilot, each in [0, 1].
    pilot : int
        Labelled items of each kind in the pilot.

    Returns
    -------
    float
        Positives with which the corrected rate is most precise; the rest of the m items
        are negatives.

    Raises
    ------
    ParameterError
        If an argument is outside its range.

    References
    ----------
    .. [1] Lee, C., et al. (2025). How to correctly report LLM-as-a-judge evaluations.
       https://arxiv.org/abs/2511.21140

    Examples
    --------
    >>> round(label_allocation(200, 0.4, sensitivity=0.9, specificity=0.7, pilot=20))
    61
    """
    check_count("m", m)
    check_count("pilot", pilot)
    check_share("sensitivity", sensitivity)
    check_share("specificity", specificity)
    check_level(rate, "rate")
    # κ of [1]: how much more the specificity varies than the sensitivity
    kappa = (pilot * (1.0 - specificity) + 1.0) / (pilot * (1.0 - sensitivity) + 1.0)
    return m / (1.0 + (1.0 / rate - 1.0) * math.sqrt(kappa))


def labels_needed(
    half_width: float,
    *,
    rate: float,
    sensitivity: float,
    specificity: float,
    n_items: int,
    level: float = 0.95,
) -> int:
    """Return how many of the judged items need a label for a precise rate.

    Parameters
    ----------
    half_width : float
        Half of the width that the interval may have.
    rate : float
        The true rate that is expected, in [0, 1].
    sensitivity, specificity : float
        What is expected of the judge, each in [0, 1].
    n_items : int
        Items that the judge grades; the labelled ones are a random sample of them.
    level : float, optional
        Level of the interval.

    Returns
    -------
    int
        The least number of labels of the prediction-powered rate.

    Raises
    ------
    ParameterError
        If an argument is outside its range, or labels of all items are too few.

    Notes
    -----
    The width is that of the interval at the numbers of items that are expected, so
    that about half of the studies have a wider one.

    Examples
    --------
    >>> labels_needed(0.1, rate=0.8, sensitivity=0.9, specificity=0.8, n_items=1000)
    44
    """
    check_level(level)
    check_level(half_width, "half_width")
    check_share("rate", rate)
    check_share("sensitivity", sensitivity)
    check_share("specificity", specificity)
    check_count("n_items", n_items, 2)
    n = np.arange(2.0, n_items + 1.0)
    passed = rate * sensitivity + (1.0 - rate) * (1.0 - specificity)
    expected = _share_moments(n, n_items - n, rate, passed, rate * sensitivity, passed)
    low, high = expected.padded_ends(None, level)
    widths = (np.clip(high, 0.0, 1.0) - np.clip(low, 0.0, 1.0)) / 2.0
    refuse(
        (
            widths[-1] > half_width,
            f"half_width: needs {widths[-1]:.4g} or more, the half-width with labels "
            f"of all {n_items} items, got {half_width}",
        )
    )
    # one more than the last number that is too few: cutting may narrow a wide interval
    too_few = n[widths > half_width]
    return int(too_few[-1]) + 1 if too_few.size else 2


# -- formulas ------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Moments:
    """Means of labels y and predictions f of n items, and of m others' predictions."""

    n: _Number
    m: _Number
    y: _Number
    f: _Number
    yy: _Number
    yf: _Number
    ff: _Number
    pool: _Number
    pool_squared: _Number

    def mean(self, power: _Number | None = None) -> tuple[_Number, _Number]:
        """Return the mean of PPI++, and λ, which is estimated if not given."""
        if power is None:
            total = self.n + self.m
            centre = (self.n * self.f + self.m * self.pool) / total
            squares = (self.n * self.ff + self.m * self.pool_squared) / total
            variance = np.maximum(squares - centre**2, 0.0) * total / (total - 1.0)
            # λ = cov(Y, F) / ((1 + n/N) var(F)), within [0, 1]
            covariance = self.yf - self.y * self.f
            tuned = divide(self.m * covariance, total * variance, 0.0)
            power = np.clip(tuned, 0.0, 1.0)
        return power * (self.pool - self.f) + self.y, power

    def ends(self, power: _Number, quantile: _Number) -> tuple[_Number, _Number]:
        """Return the mean minus and plus a multiple of its standard error."""
        value, _ = self.mean(power)
        # var(Y - λF)/n + var(λF of the others)/N
        squares = self.yy - 2.0 * power * self.yf + power**2 * self.ff
        of_errors = np.maximum(squares - (self.y - power * self.f) ** 2, 0.0) / self.n
        of_pool = power**2 * (self.pool_squared - self.pool**2)
        half = quantile * np.sqrt(of_errors + of_pool / np.maximum(self.m, 1.0))
        return value - half, value + half

    def padded_ends(
        self, power: _Number | None, level: float
    ) -> tuple[_Number, _Number]:
        """Return the ends of shares to which z² labels are added."""
        z = _quantile(level)
        of_labels = self.n / (self.n + z**2)
        half = (1.0 - of_labels) / 2.0
        y, f = of_labels * self.y + half, of_labels * self.f + half
        both = of_labels * self.yf + half / 2.0
        padded = _share_moments(self.n + z**2, self.m, y, f, both, self.pool)
        _, used = padded.mean(power)
        return padded.ends(used, _quantile(level, self.n - 1.0))

    def jackknife_ends(
        self, y: Floats, f: Floats, power: _Number | None, level: float
    ) -> tuple[_Number, _Number]:
        """Return the ends, each labelled item left out once; ``nan`` without spread."""
        rest = self.n - 1.0
        without = _Moments(
            n=rest,
            m=self.m,
            y=(self.n * self.y - y) / rest,
            f=(self.n * self.f - f) / rest,
            yy=(self.n * self.yy - y**2) / rest,
            yf=(self.n * self.yf - y * f) / rest,
            ff=(self.n * self.ff - f**2) / rest,
            pool=self.pool,
            pool_squared=self.pool_squared,
        )
        values, _ = without.mean(power)
        value, used = self.mean(power)
        of_labels = rest * np.var(values)
        of_pool = used**2 * (self.pool_squared - self.pool**2) / self.m
        error = np.sqrt(of_labels + of_pool) if of_labels else math.nan
        half = _quantile(level, rest) * error
        return value - half, value + half


def _share_moments(
    n: _Number, m: _Number, y: _Number, f: _Number, both: _Number, pool: _Number
) -> _Moments:
    """Return the moments of zeros and ones that are both 1 in a share of items."""
    return _Moments(
        n=n, m=m, y=y, f=f, yy=y, yf=both, ff=f, pool=pool, pool_squared=pool
    )


def _lang_reiczigel(
    p: _Number,
    n: _Number,
    sensitivity: tuple[_Number, _Number],
    specificity: tuple[_Number, _Number],
    z: float,
) -> tuple[_Number, _Number]:
    """Return the ends of the interval of [2] of `corrected_rate`, not cut."""
    (q1, m1), (q0, m0) = sensitivity, specificity
    p, n = (n * p + z**2 / 2.0) / (n + z**2), n + z**2
    q1, m1 = (m1 * q1 + 1.0) / (m1 + 2.0), m1 + 2.0
    q0, m0 = (m0 * q0 + 1.0) / (m0 + 2.0), m0 + 2.0
    slope, v1, v0 = q0 + q1 - 1.0, q1 * (1.0 - q1) / m1, q0 * (1.0 - q0) / m0
    rate = divide(p + q0 - 1.0, slope)
    shift = 2.0 * z**2 * (rate * v1 - (1.0 - rate) * v0)
    # (1 - P)² v0: eq. (4) of [2] prints (1 + P)² by mistake
    variance = p * (1.0 - p) / n + rate**2 * v1 + (1.0 - rate) ** 2 * v0
    half = z * divide(np.sqrt(variance), slope)
    # shrunk towards 1/2 the judge may be no better than chance: any rate is possible
    low = np.where(slope > 0.0, rate + shift - half, -math.inf)
    return low, np.where(slope > 0.0, rate + shift + half, math.inf)


def _corrected(
    rate: float,
    n: int,
    sensitivity: tuple[float, int],
    specificity: tuple[float, int],
    level: float,
) -> RateEstimate:
    """Return the corrected rate, or why it is undefined."""
    (q1, m1), (q0, m0) = sensitivity, specificity
    value = divide(np.array(rate + q0 - 1.0), np.array(q0 + q1 - 1.0))
    ends = _lang_reiczigel(rate, n, sensitivity, specificity, _quantile(level))
    reason = None
    if not (m1 and m0):
        reason = "all labelled items have the same label"
    elif q1 + q0 <= 1.0:
        reason = "the judge does no better than chance in the labelled items"
    are_enough = m1 + m0 >= _ENOUGH["of_both_kinds"]
    return _estimate(
        "rogan_gladen",
        (value, *ends) if reason is None else (math.nan,) * 3,
        level,
        (n, m1 + m0),
        is_few=not are_enough or min(m1, m0) < _ENOUGH["of_a_kind"],
        reason=reason,
    )


def _powered(
    moments: _Moments,
    power: float | None,
    level: float,
    method: _RateMethod = "prediction_powered",
) -> RateEstimate:
    """Return the rate of PPI++; where λ = 0 it is the share of the labels."""
    value, used = moments.mean(power)
    n, m = int(moments.n), int(moments.m)
    return _estimate(
        method,
        (value, *moments.padded_ends(power, level)),
        level,
        (n, 0) if method == "naive" else (n + m, n),
        power=float(used),
        is_few=n < _ENOUGH["labels"],
    )


def _estimate(
    method: _RateMethod,
    numbers: tuple[_Number, ...],
    level: float,
    sizes: tuple[int, int],
    *,
    is_few: bool,
    power: float = math.nan,
    reason: str | None = None,
) -> RateEstimate:
    """Return a rate with its value and ends cut to [0, 1]."""
    _, uncut_low, uncut_high = map(float, numbers)
    value, low, high = np.clip(np.array(numbers), 0.0, 1.0).tolist()
    if uncut_low > 1.0 or uncut_high < 0.0:
        low, high, reason = math.nan, math.nan, _OUTSIDE[method][uncut_low > 1.0]
    if reason:
        undefined("the rate or its interval", reason)
    notes: dict[_RateNote, bool] = {
        "few_labels": is_few,
        "whole_range": (low, high) == (0.0, 1.0),
    }
    return RateEstimate(
        method=method,
        value=value,
        low=low,
        high=high,
        level=level,
        n_judged=sizes[0],
        n_labels=sizes[1],
        interval_method="Lang and Reiczigel" if method == "rogan_gladen" else "padded",
        assumption=_ASSUMPTIONS[method],
        uncut_low=uncut_low,
        uncut_high=uncut_high,
        power=power,
        notes=tuple(note for note, holds in notes.items() if holds),
        reason=reason,
    )


def _quantile(level: float, df: _Number = math.inf) -> _Number:
    """Return the quantile of Student's t, or the normal one, for both ends."""
    return stdtrit(df, 0.5 + 0.5 * level)


# -- checks --------------------------------------------------------------------------


def _numbers(name: str, values: ArrayLike) -> Floats:
    """Return a sequence of numbers as an array."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.array(math.nan)
    if array.ndim != 1 or not np.isfinite(array).all():
        raise RatingsError(f"{name}: needs a sequence of numbers, got {shown(values)}")
    return array
