"""Limits of agreement with repeats, with slopes, and of several observers.

In: one row per measurement of an item, and one column per method or observer. Out:
limits with their intervals, for single measurements.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from statistics import NormalDist
from typing import Any, Literal, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray

from masrel._input import check_option, refuse
from masrel.agreement._codes import check_frame, levels, numbers, rated_part
from masrel.agreement._engine import (
    Floats,
    check_level,
    divide,
    student_t,
    undefined,
)
from masrel.agreement.icc import _ROUNDING
from masrel.agreement.measurement import _CHANGE, _error, _variance_ends
from masrel.errors import RatingsError
from masrel.estimates import Estimate, Interval, _Caution

# Whether what is measured of an item stays, or moves from a pair to the next
_Truth = Literal["constant", "varying"]
# Whether limits are of differences, follow what is measured, or are of ratios
_LimitsKind = Literal["difference", "proportional", "ratio"]


@dataclass(frozen=True, slots=True, kw_only=True)
class RepeatedLimits:
    """Limits between which most single differences, or ratios, of two methods lie.

    Attributes
    ----------
    bias : float
        Mean difference, first minus second, each item counting once; or how many times
        the second the first is, by the geometric mean.
    sd : float
        Standard deviation of the difference of two single measurements; of that of
        their logarithms where the kind is ratio; about the line where it is
        proportional.
    low, high : float
        The limits: bias ∓ z sd; ``nan`` when undefined.
    share : float
        Share of the differences that lie between the limits.
    bias_interval, low_interval, high_interval : Interval
        For other items like these, each for itself.
    slope : float
        By how much the difference grows with the mean of both methods, both of
        logarithms where the kind is ratio.
    slope_interval : Interval
        That of the slope, by errors that do not take differences to spread alike.
    average : float
        The mean of both methods at which bias and limits are these; of the kind
        proportional alone they are others elsewhere.
    truth, kind : str
        What was taken to stay the same, and what the limits are of.
    parts : tuple of tuple of float
        What sd² is made of, each with its degrees of freedom: the variance of items'
        mean differences, and what single measurements add to it.
    within : tuple of float
        Variance of repeated measurements of an item by either method; of repeated
        differences where the truth varies; ``nan`` without repeats.
    averages, differences : ndarray, shape (n_items,)
        Mean of both methods, and their difference or ratio, of each item.
    n_items : int
        Items that both measured.
    n_measurements : tuple of int
        Measurements of either method, of all items.
    reason : str or None
        Why they are undefined, or None.
    """

    bias: float
    sd: float
    low: float
    high: float
    share: float
    bias_interval: Interval
    low_interval: Interval
    high_interval: Interval
    slope: float
    slope_interval: Interval
    average: float
    truth: _Truth
    kind: _LimitsKind
    parts: tuple[tuple[float, float], ...]
    within: tuple[float, ...]
    averages: Floats = field(compare=False, repr=False)
    differences: Floats = field(compare=False, repr=False)
    n_items: int
    n_measurements: tuple[int, ...]
    reason: str | None = None

    def at(self, average: float) -> "RepeatedLimits":
        """Return the same where both methods have another mean.

        Parameters
        ----------
        average : float
            The mean of both methods.

        Returns
        -------
        RepeatedLimits
            With the bias, limits and intervals there; the same everywhere unless the
            kind is proportional.
        """
        if self.kind != "proportional" or self.reason is not None:
            return self
        moved = self.slope * (average - self.average)
        return _ended(replace(self, bias=self.bias + moved, average=average))


def limits_with_repeats(
    data: Any,
    *,
    item: str,
    first: str,
    second: str,
    truth: _Truth = "constant",
    kind: _LimitsKind = "difference",
    share: float = 0.95,
    level: float = 0.95,
) -> RepeatedLimits:
    """Estimate the limits of agreement of two methods, which may measure repeatedly.

    Parameters
    ----------
    data : DataFrame
        One row per measurement of an item by either method, or by both.
    item, first, second : str
        Names of the columns of items and of what each method measured; a number that is
        missing was not measured.
    truth : {"constant", "varying"}, optional
        Whether an item has one true value, which either method may measure in rows of
        its own; or each row is a pair measured together, and the true value may change.
    kind : {"difference", "proportional", "ratio"}, optional
        Limits of differences that are the same for all values, of differences that
        follow a line over the mean of both methods, or of ratios, by logarithms.
    share : float, optional
        Share of the differences of single measurements that lie between the limits.
    level : float, optional
        Level of the intervals.

    Returns
    -------
    RepeatedLimits
        Bias, slope and limits with their intervals, for other items like these.

    Raises
    ------
    RatingsError
        If a column is not there or has no numbers, an item has no name, or the kind is
        ratio and a number is not above 0.
    ParameterError
        If `truth` or `kind` is unknown, or the share or the level is not within (0, 1).

    Warns
    -----
    UndefinedStatisticWarning
        If fewer than two items were measured by both methods; for "proportional",
        fewer than three, or items that all have the same mean.

    Notes
    -----
    Differences are taken to be normal, about their mean or a line, and to spread as
    much whatever is measured. With a constant truth the variance of a single difference
    is that of the items' mean differences, and (1 − 1/m) of each method's within items,
    with m the harmonic mean of its measurements of an item [1]_, table I. The intervals
    of the limits combine those of the bias and of each variance (MOVER), with a note
    where numbers of repeats differ so much that they may be too short; the bias itself
    has Student's t. The line is that of items' means by least squares [2]_, its
    slope's error HC3 [3]_. Items that one method did not measure are left out.

    References
    ----------
    .. [1] Zou, G. Y. (2013). Confidence interval estimation for the Bland-Altman limits
       of agreement with multiple observations per individual. Statistical Methods in
       Medical Research, 22(6), 630-642. https://doi.org/10.1177/0962280211402548
    .. [2] Bland, J. M., Altman, D. G. (1999). Measuring agreement in method comparison
       studies. Statistical Methods in Medical Research, 8(2), 135-160.
       https://doi.org/10.1177/096228029900800204
    .. [3] MacKinnon, J. G., White, H. (1985). Some heteroskedasticity-consistent
       covariance matrix estimators with improved finite sample properties. Journal of
       Econometrics, 29(3), 305-325. https://doi.org/10.1016/0304-4076(85)90158-7

    Examples
    --------
    >>> import pandas as pd
    >>> frame = pd.DataFrame({"item": [1, 1, 2, 2, 3, 3], "x": [9, 8, 5, 5, 2, 3],
    ...                       "y": [8, 8, 6, 5, 2, 1]})
    >>> limits = limits_with_repeats(frame, item="item", first="x", second="y")
    >>> print(f"{limits.bias:.2f}, {limits.low:.2f} to {limits.high:.2f}")
    0.33, -1.54 to 2.21
    """
    check_option("truth", truth, get_args(_Truth))
    check_option("kind", kind, get_args(_LimitsKind))
    check_level(share, "share")
    check_level(level)
    codes, n_items, x, y = _measured(data, item, (first, second), truth, kind)
    cells = [_cells(codes, values, n_items) for values in (x, y)]
    chosen = (cells[0][0] > 0.0) & (cells[1][0] > 0.0)
    (_, of_x, _), (_, of_y, _) = (of[:, chosen] for of in cells)
    averages, differences = 0.5 * (of_x + of_y), of_x - of_y  # (n_items,)
    slope, error, flat = _slope(averages, differences)
    n, is_line = len(differences), kind == "proportional"
    reason = flat if is_line or n < 2 else None
    if reason is not None:
        undefined("an estimate of limits of agreement", reason)
    # what is left of differences without the line, where there is one
    lean, df = (slope, n - 2.0) if is_line else (0.0, n - 1.0)
    residuals = differences - lean * averages
    rows = [x - y - 0.5 * lean * (x + y)] if truth == "varying" else [x, y]
    repeats = [_cells(codes, of, n_items)[:, chosen] for of in rows]
    within, parts = zip(*map(_within, repeats), strict=True)
    between = math.nan if reason else n * float(residuals.var()) / df
    nothing = Interval(
        low=math.nan,
        high=math.nan,
        level=level,
        kind="confidence",
        method="MOVER",
        target="items",
        notes=_cautions(within, repeats, between),
    )
    result = _ended(
        RepeatedLimits(
            bias=math.nan if reason else float(differences.mean()),
            sd=math.sqrt(between + sum(part for part, _ in parts)),
            low=math.nan,
            high=math.nan,
            share=share,
            bias_interval=nothing,
            low_interval=nothing,
            high_interval=nothing,
            slope=slope,
            slope_interval=_around(nothing, slope, error, n - 2.0, "HC3, ", flat),
            average=math.nan if reason else float(averages.mean()),
            truth=truth,
            kind=kind,
            parts=((between, df), *parts),
            within=within,
            averages=averages,
            differences=differences,
            n_items=n,
            n_measurements=tuple(int((~np.isnan(values)).sum()) for values in (x, y)),
            reason=reason,
        )
    )
    return _as_ratios(result) if kind == "ratio" else result


def _measured(
    data: Any, item: str, names: tuple[str, str], truth: _Truth, kind: _LimitsKind
) -> tuple[NDArray[np.int64], int, Floats, Floats]:
    """Return the item of each row, how many there are, and both methods' numbers."""
    check_frame(data, (item, *names), "data")
    codes, items = levels(data[item], item)
    x, y = (_values(data, name, kind) for name in names)
    if truth == "varying":  # of pairs, a row without its second says nothing
        x, y = x + 0.0 * y, y + 0.0 * x
    return codes, len(items), x, y


def _values(data: Any, name: str, kind: _LimitsKind) -> Floats:
    """Return a column as numbers, or as their logarithms."""
    values = numbers(data[name], name)
    is_wrong = (values <= 0.0) & (kind == "ratio")
    refuse(
        (
            is_wrong.any(),
            f"ratings: row {is_wrong.argmax()}, column {name!r}: needs a number above "
            f"0 for ratios, got {values[is_wrong.argmax()]:g}",
        ),
        error=RatingsError,
    )
    return np.log(values) if kind == "ratio" else values


def _cautions(
    within: Sequence[float], repeats: Sequence[Floats], between: float
) -> tuple[_Caution, ...]:
    """Return what to say where numbers of repeats differ much."""
    added = [s2 / of[0] for s2, of in zip(within, repeats, strict=True)]
    # where repeats make items' mean differences vary so unequally, by the SD of what
    # they add to the variance, intervals of 95 % held the limits in less than 93 %
    if len(added[0]) < 2 or not np.sum(added, axis=0).std() > 0.6 * between:
        return ()
    return (
        _Caution(
            "the number of repeats varies a lot between items: the true coverage may "
            "be below the level of the interval"
        ),
    )


def _slope(averages: Floats, differences: Floats) -> tuple[float, float, str | None]:
    """Return the slope of the line, its HC3 error, or why it is undefined."""
    n = len(averages)
    off = averages - averages.sum() / max(n, 1)
    sum_of_squares = max(float(off @ off), 1e-300)
    rest = 1.0 - 1.0 / max(n, 1) - off**2 / sum_of_squares  # 1 - h of [3]
    reason = None
    if n < 3:
        reason = f"fewer than {max(n + 1, 2)} items were measured by both methods"
    elif sum_of_squares <= _ROUNDING**2 * float(averages @ averages):
        reason = "the mean of both methods is the same for all items"
    elif rest.min() < _ROUNDING:
        reason = "the slope depends on a single item"
    if reason is not None:
        return math.nan, math.nan, reason
    slope = float(off @ differences) / sum_of_squares
    residuals = differences - differences.mean() - slope * off
    # Σ x² e² / (1 - h)² over (Σ x²)²
    return (
        slope,
        math.sqrt(float(((off * residuals / rest) ** 2).sum())) / sum_of_squares,
        None,
    )


def _ended(limits: RepeatedLimits) -> RepeatedLimits:
    """Return the limits about the bias, and the ends of them all."""
    ends, (between, df) = limits.low_interval, limits.parts[0]
    # the line turns about the mean of all, where other limits are told
    centre = limits.averages.sum() / max(limits.n_items, 1)
    sum_of_squares = max(float(((limits.averages - centre) ** 2).sum()), 1e-300)
    lever = (
        1.0 / max(limits.n_items, 1) + (limits.average - centre) ** 2 / sum_of_squares
    )
    error = math.sqrt(between * lever)
    low, high, why = _variance_ends([*limits.parts], limits.sd**2, ends.level)
    # the bias's ends are normal ones here, with which the limits held their level from
    # 4 items on
    half = NormalDist().inv_cdf(0.5 + 0.5 * ends.level) * error
    ends = replace(ends, reason=limits.reason or why)
    return replace(
        _about(limits, half, math.sqrt(low), math.sqrt(high), ends),
        bias_interval=_around(ends, limits.bias, error, df, "", limits.reason),
    )


def _about(
    limits: RepeatedLimits, half: float, low: float, high: float, ends: Interval
) -> RepeatedLimits:
    """Return limits about the bias ± half, with an SD between low and high."""
    z = NormalDist().inv_cdf(0.5 + 0.5 * limits.share)
    # MOVER: squared distances of the bias's ends and of z sd's add up
    near = math.hypot(half, z * (limits.sd - low))
    far = math.hypot(half, z * (high - limits.sd))
    lower, upper = limits.bias - z * limits.sd, limits.bias + z * limits.sd
    return replace(
        limits,
        low=lower,
        high=upper,
        low_interval=replace(ends, low=lower - far, high=lower + near),
        high_interval=replace(ends, low=upper - near, high=upper + far),
    )


def _as_ratios(limits: RepeatedLimits) -> RepeatedLimits:
    """Return limits of ratios for those of differences of logarithms."""
    ratios: dict[str, Any] = {
        name: math.exp(getattr(limits, name))
        for name in ("bias", "low", "high", "average")
    }
    for name in ("bias_interval", "low_interval", "high_interval"):
        ratios[name] = _exponential(getattr(limits, name))
    return replace(
        limits,
        **ratios,
        averages=np.exp(limits.averages),
        differences=np.exp(limits.differences),
    )


def _around(
    ends: Interval, value: float, error: float, df: float, kind: str, reason: str | None
) -> Interval:
    """Return the interval by Student's t, in other things like one."""
    half = student_t(ends.level, df) * error
    return replace(
        ends,
        low=value - half,
        high=value + half,
        method=f"{kind}t({df:g})",
        notes=(),
        reason=reason,
    )


def _cells(codes: NDArray[np.intp], values: Floats, n_items: int) -> Floats:
    """Return how often each item was measured, its mean, and squares about it."""
    # -> (3, n_items)
    there = ~np.isnan(values)
    codes, values = codes[there], values[there]
    n = np.bincount(codes, minlength=n_items).astype(np.float64)
    # of floats: a sum of no values is one of whole numbers
    means = divide(np.bincount(codes, values, n_items).astype(np.float64), n)
    squares = np.bincount(codes, (values - means[codes]) ** 2, n_items)
    return np.array([n, means, squares])


def _within(cells: Floats) -> tuple[float, tuple[float, float]]:
    """Return the variance within, and what of it single ones add, with its df."""
    n, _, squares = cells
    df = float(n.sum()) - len(n)
    if not df:  # each was measured once
        return math.nan, (0.0, 1.0)
    variance = float(squares.sum()) / df
    # all but 1/m is not in the means, m the harmonic mean of n
    return variance, ((1.0 - float((1.0 / n).mean())) * variance, df)


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitsWithMean:
    """Limits of agreement with the mean of several observers.

    Attributes
    ----------
    limit : Estimate
        Distance of the limits from the mean: z √((k − 1)/k) standard errors, with k
        observers.
    share : float
        Share of the measurements that lie between the limits.
    sem, mdc : Estimate
        Standard error of a single measurement, and 1.96 √2 of it: what chance exceeds
        in 5 % of the differences of two single measurements of the same.
    within : float
        Variance of repeated measurements of an item by an observer; ``nan`` without.
    averages, differences : ndarray, shape (n_places,)
        Of each item and observer the mean of all observers, and the observer's own
        mean minus that.
    n_measurements : int
        Number of measurements of all items by all observers.

    Notes
    -----
    Each estimate has its interval, for other items and observers, or the reason why it
    is undefined; its `n_raters` are the observers.
    """

    limit: Estimate
    share: float
    sem: Estimate
    mdc: Estimate
    within: float
    averages: Floats = field(compare=False, repr=False)
    differences: Floats = field(compare=False, repr=False)
    n_measurements: int


def limits_with_mean(
    data: Any,
    *,
    item: str,
    observers: Sequence[str],
    share: float = 0.95,
    level: float = 0.95,
) -> LimitsWithMean:
    """Estimate how far single measurements lie from the mean of several observers.

    Parameters
    ----------
    data : DataFrame
        One row a measurement of an item by some or all observers.
    item : str
        Name of the column of items.
    observers : sequence of str
        Names of the columns of what each observer measured; a number that is missing
        was not measured.
    share : float, optional
        Share of the measurements that lie between the limits.
    level : float, optional
        Level of the intervals.

    Returns
    -------
    LimitsWithMean
        The limits, and standard error of measurement and minimal detectable change of
        the same variances, with intervals for other items and observers.

    Raises
    ------
    RatingsError
        If a column is not there or has no numbers, or an item has no name.
    ParameterError
        If the share or the level is not within (0, 1).

    Warns
    -----
    UndefinedStatisticWarning
        If there are fewer than two items or observers, or too few measurements to tell
        observers from the rest.

    Notes
    -----
    A measurement is item, observer and the rest, all normal. The variance of its error
    is that of `sem`, of the items' means by each observer, and of repeats (1 − 1/m) of
    the variance within, m their harmonic mean [2]_; from the mean of k observers a
    measurement lies √((k − 1)/k) of that [1]_. All intervals are those of a sum of mean
    squares (see `sem`).

    References
    ----------
    .. [1] Christensen, H. S., Borgbjerg, J., Børty, L., Bøgsted, M. (2020). On Jones et
       al.'s method for extending Bland-Altman plots to limits of agreement with the
       mean for multiple observers. BMC Medical Research Methodology, 20, 304.
       https://doi.org/10.1186/s12874-020-01182-w
    .. [2] Christensen, H. S., Bøgsted, M., Borgbjerg, J. (2025). A statistical note on
       extending Christensen's limits of agreement with the mean.
       https://arxiv.org/abs/2508.16250

    Examples
    --------
    >>> import pandas as pd
    >>> frame = pd.DataFrame({"item": [1, 2, 3], "a": [1, 3, 5], "b": [2, 3, 7],
    ...                       "c": [2, 4, 6]})
    >>> limits = limits_with_mean(frame, item="item", observers=["a", "b", "c"])
    >>> print(f"±{limits.limit.value:.2f}, SEM {limits.sem.value:.2f}")
    ±1.19, SEM 0.75
    """
    check_level(share, "share")
    check_level(level)
    check_frame(data, (item, *observers), "data")
    codes, items = levels(data[item], item)
    cells = [_cells(codes, numbers(data[of], of), len(items)) for of in observers]
    rated = rated_part(np.array([of[1] for of in cells]).reshape(-1, len(items)).T)
    # every item by every observer as if it were an item
    repeats = np.concatenate([np.zeros((3, 0)), *cells], axis=1)
    within, part = _within(repeats[:, repeats[0] > 0.0])
    # [1]: of √((k - 1)/k) standard errors is a measurement from the mean of k observers
    z, k = NormalDist().inv_cdf(0.5 + 0.5 * share), rated.shape[1]
    factors = {
        "sem": 1.0,
        "mdc": _CHANGE,
        "limit": z * math.sqrt(1.0 - 1.0 / max(k, 1)),
    }
    errors = {
        name: _error(rated, name, factor, "agreement", None, level, [part])
        for name, factor in factors.items()
    }
    centre = np.nanmean(rated, axis=1, keepdims=True) + 0.0 * rated
    return LimitsWithMean(
        **errors,
        share=share,
        within=within,
        averages=centre[~np.isnan(centre)],
        differences=(rated - centre)[~np.isnan(centre)],
        n_measurements=int(repeats[0].sum()),
    )


_Limits = TypeVar("_Limits", RepeatedLimits, LimitsWithMean)
_OF_MEAN = ("limit", "sem", "mdc")


def limits_by_clusters(
    data: Any,
    measure: Callable[[Any], _Limits],
    *,
    clusters: str,
    level: float = 0.95,
) -> _Limits:
    """Estimate limits of agreement whose intervals are for other clusters of items.

    Parameters
    ----------
    data : DataFrame
        Rows as `limits_with_repeats` or `limits_with_mean` takes them.
    measure : callable
        Takes rows like these and returns what either of the two returns, not of the
        kind proportional.
    clusters : str
        Name of the column of clusters, such as patients with several measured joints.
        Items of one cluster may be alike; clusters are independent.
    level : float, optional
        Level of the intervals.

    Returns
    -------
    RepeatedLimits or LimitsWithMean
        What `measure` returns of all rows, with intervals for other clusters like
        these, measured by the same methods or observers.

    Raises
    ------
    RatingsError
        If the column is not there, a row has no cluster, or there is one cluster only.
    ParameterError
        If the limits follow a line, or `level` is not within (0, 1).

    Notes
    -----
    Clusters are left out one at a time. The bias, the slope and the logarithm of the
    standard deviation have Student's t with one degree of freedom fewer than there are
    clusters; limits combine the bias and the standard deviation as those of
    `limits_with_repeats` do.

    Examples
    --------
    >>> import pandas as pd
    >>> rows = [(k, k // 2, 7 * k % 11, 7 * k % 11 + k // 2 % 3) for k in range(20)]
    >>> frame = pd.DataFrame(rows, columns=["eye", "patient", "y", "x"])
    >>> def measure(rows):
    ...     return limits_with_repeats(rows, item="eye", first="x", second="y")
    >>> ends = limits_by_clusters(frame, measure, clusters="patient").high_interval
    >>> round(ends.low, 2), round(ends.high, 2)
    (1.82, 3.41)
    """
    check_level(level)
    check_frame(data, (clusters,), "data")
    codes, names = levels(data[clusters], clusters)
    needed = f"clusters: needs two or more, because each is left out, got {len(names)}"
    refuse((len(names) < 2, needed), error=RatingsError)
    # of all rows, and without each cluster
    results: list[Any] = [measure(data[codes != k]) for k in range(-1, len(names))]
    is_of_pairs = isinstance(results[0], RepeatedLimits)
    result: _Limits = (_of_pairs if is_of_pairs else _of_observers)(results, level)
    return result


def _of_observers(results: list[Any], level: float) -> Any:
    """Return limits with the mean, by those of all rows and without each cluster."""
    logs = [[_log(getattr(of, name).value) for name in _OF_MEAN] for of in results]
    ends = zip(_OF_MEAN, map(_exponential, _left_out(logs, level)), strict=True)
    return replace(
        results[0],
        **{name: replace(getattr(results[0], name), interval=of) for name, of in ends},
    )


def _of_pairs(results: list[Any], level: float) -> Any:
    """Return limits of two methods, by those of all rows and without each cluster."""
    limits: RepeatedLimits = results[0]
    refuse(
        (
            limits.kind == "proportional",
            "measure: needs limits that do not follow a line",
        )
    )
    is_ratio = limits.kind == "ratio"
    rows = [
        [_log(of.bias) if is_ratio else of.bias, _log(of.sd), of.slope]
        for of in results
    ]
    bias, of_log, slope = _left_out(rows, level)
    sd = _exponential(of_log)
    result = _about(
        replace(limits, bias=rows[0][0], bias_interval=bias, slope_interval=slope),
        *(0.5 * (bias.high - bias.low), sd.low, sd.high),
        replace(bias, reason=bias.reason or sd.reason),
    )
    if not is_ratio:
        return result
    same = ("average", "averages", "differences")  # they are ratios already
    return replace(_as_ratios(result), **{name: getattr(limits, name) for name in same})


def _log(value: float) -> float:
    return math.log(value) if value > 0.0 else math.nan


def _exponential(ends: Interval) -> Interval:
    return replace(ends, low=math.exp(ends.low), high=math.exp(ends.high))


def _left_out(rows: list[list[float]], level: float) -> list[Interval]:
    """Return intervals of numbers, from those of all rows and without each cluster."""
    # of rows, each with the numbers of all and of one cluster less
    n = len(rows) - 1
    errors = np.sqrt((n - 1) * np.var(rows[1:], axis=0))  # (n - 1)/n Σ (θ_i - mean)²
    ends = Interval(
        low=math.nan,
        high=math.nan,
        level=level,
        kind="confidence",
        method="",
        target="items",
        unit="clusters",
        units_are="left out",
    )
    why = "it is undefined when one of the clusters is left out"
    return [
        _around(
            *(ends, value, error, n - 1, "cluster jackknife, "),
            why if math.isnan(value + error) else None,
        )
        for value, error in zip(rows[0], errors.tolist(), strict=True)
    ]
