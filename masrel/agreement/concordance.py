"""Lin's concordance correlation coefficient, of two raters or more."""

import math
from collections.abc import Sequence
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._data import complete_values
from masrel.agreement._engine import check_level, undefined
from masrel.agreement._labels import Label
from masrel.estimates import Estimate, Interval

_FEW = 3
"""Items from which on there is an error."""


def lin_ccc(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    level: float = 0.95,
) -> Estimate:
    """Estimate Lin's concordance correlation coefficient.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Numbers, or labels of a declared scale; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order: numbers count by value, text by rank. Needed for
        text.
    level : float, optional
        Level of the interval.

    Returns
    -------
    Estimate
        The coefficient, with its standard error and an interval on Fisher's z that
        generalises to other items. Observed and chance agreement do not exist.

    Raises
    ------
    RatingsError
        If the ratings are not such a table, or text without categories.
    ParameterError
        If the level is not within (0, 1).

    Warns
    -----
    UndefinedStatisticWarning
        If there are fewer than two complete items or raters, or all ratings are the
        same; the value is then ``nan``.

    Notes
    -----
    Of two raters 2 s_xy / (s_x² + s_y² + (x̄ - ȳ)²), with moments over n; the error is
    that of [1]_ with the erratum, over n - 2. Of more raters the overall coefficient of
    [2]_, in which numerators and denominators of all pairs are added up; the error is
    then the delta method's, and the interval a jackknife of items with t. Items with a
    missing rating are left out.

    References
    ----------
    .. [1] Lin, L. I.-K. (1989). A concordance correlation coefficient to evaluate
       reproducibility. Biometrics, 45(1), 255-268. https://doi.org/10.2307/2532051;
       erratum (2000), 56(1), 324-325.
    .. [2] Barnhart, H. X., Haber, M., Song, J. (2002). Overall concordance correlation
       coefficient for evaluating agreement among multiple observers. Biometrics, 58(4),
       1020-1027. https://doi.org/10.1111/j.0006-341X.2002.01020.x

    Examples
    --------
    >>> round(lin_ccc([[1, 2], [3, 3], [5, 7]]).value, 4)
    0.8
    """
    check_level(level)
    values = complete_values(ratings, categories)
    n, k = values.shape
    value, error, interval = math.nan, math.nan, None
    reason = _reason(values)
    if reason is None:
        scaled = _scaled(values)
        value, error = _two(scaled) if k == 2 else _overall(scaled)
        interval = _interval(scaled, value, error, level)
    return Estimate(
        coefficient="lin_ccc",
        weights="identity",
        value=value,
        standard_error=error,
        interval=interval,
        observed=math.nan,
        chance=math.nan,
        n_items=n,
        n_items_paired=n if k > 1 else 0,
        n_raters=k,
        n_categories=len(np.unique(values)) if categories is None else len(categories),
        reason=reason,
    )


def _reason(values: NDArray[np.float64]) -> str | None:
    title = "Lin's concordance"
    if values.shape[0] < 2:
        return undefined(title, "fewer than two items are rated by every rater")
    if values.shape[1] < 2:
        return undefined(title, "fewer than two raters")
    if (values == values[0, 0]).all():
        return undefined(title, "0/0: all ratings are the same")
    return None


def _scaled(values: NDArray[np.float64]) -> NDArray[np.float64]:
    # from a rating, and over a power of two, so that squares are exact or floats
    low = values.min()
    size = int(np.frexp(max(abs(low), abs(values.max())))[1])
    return np.asarray(np.ldexp(values, -size) - np.ldexp(low, -size))


def _two(values: NDArray[np.float64]) -> tuple[float, float]:
    # the coefficient and the error of [1], here without a division by r
    n = len(values)
    x, y = (values - values.mean(axis=0)).T
    shift = float(values[:, 0].mean() - values[:, 1].mean())
    xx, yy, xy = float(x @ x) / n, float(y @ y) / n, float(x @ y) / n
    rho = 2.0 * xy / (xx + yy + shift**2)
    if n < _FEW or xx == 0.0 or yy == 0.0:
        return rho, math.nan
    r2 = min(xy**2 / (xx * yy), 1.0)
    bias = 2.0 * math.sqrt(xx * yy) / (xx + yy + shift**2)  # ρ = r · bias
    u2 = shift**2 / math.sqrt(xx * yy)
    variance = (
        bias**2 * (1.0 - r2) * (1.0 - rho**2)
        + 2.0 * rho**2 * (1.0 - rho) * bias * u2
        - 0.5 * rho**2 * bias**2 * u2**2
    )
    return rho, math.sqrt(max(variance, 0.0) / (n - 2))


def _overall(values: NDArray[np.float64]) -> tuple[float, float]:
    # 1 - Σ (x_j - x_l)² within items over that between them, and its delta method
    n, k = values.shape
    means = values.mean(axis=0)
    x, levels = values - means, means - means.mean()
    within = _within(values)
    # (k - 1) Σ_j σ_j² + Σ_{j<l} (μ_j - μ_l)², and what each item adds to it
    between = k * float((levels**2).sum())
    pull = (k - 1) * (x**2).sum(axis=1) + 2.0 * k * x @ levels
    whole = float(pull.mean()) + between
    ratio = float(within.mean()) / whole
    if n < _FEW:
        return 1.0 - ratio, math.nan
    influence = (within - ratio * (pull + between)) / whole
    return 1.0 - ratio, math.sqrt(float((influence**2).sum()) / (n * (n - 1)))


def _within(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the squared differences of all pairs of raters, added up, of each item."""
    # Σ_{j<l} (x_j - x_l)² = k Σ_j (x_j - x̄)²
    means = values.mean(axis=1, keepdims=True)
    return np.asarray(values.shape[1] * ((values - means) ** 2).sum(axis=1))


def _without_each(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the overall coefficient without each item."""
    n, k = values.shape
    x = values - values.mean()
    within = _within(x)
    means = (x.sum(axis=0) - x) / (n - 1)  # (n, k)
    variances = ((x**2).sum(axis=0) - x**2) / (n - 1) - means**2
    levels = means - means.mean(axis=1, keepdims=True)
    whole = (k - 1) * variances.sum(axis=1) + k * (levels**2).sum(axis=1)
    return np.asarray(1.0 - (within.sum() - within) / (n - 1) / whole)


def _interval(
    values: NDArray[np.float64], value: float, error: float, level: float
) -> Interval:
    n, k = values.shape
    low = high = value
    method, reason = "Fisher's z", None
    if k > 2:
        method = f"item jackknife, t({n - 1}) on Fisher's z"
    if math.isnan(error):
        low = high = math.nan
        reason = "no error: fewer than three items, or a rater without variance"
    elif error > 0.0:
        width = _width(values, value, error, level)
        low, high = (math.tanh(math.atanh(value) + s * width) for s in (-1.0, 1.0))
    return Interval(
        low=low,
        high=high,
        level=level,
        kind="confidence",
        method=method,
        target="items",
        unit="items" if k > 2 else None,
        reason=reason,
    )


def _width(
    values: NDArray[np.float64], value: float, error: float, level: float
) -> float:
    # half of the interval of Fisher's z
    n, k = values.shape
    if k == 2:
        return NormalDist().inv_cdf(0.5 + 0.5 * level) * error / (1.0 - value**2)
    from scipy.special import stdtrit

    limit = np.nextafter(1.0, 0.0)  # without its one disagreement all may be perfect
    z = np.arctanh(np.clip(_without_each(values), -limit, limit))
    error_z = math.sqrt((n - 1) / n * float(((z - z.mean()) ** 2).sum()))
    return float(stdtrit(n - 1, 0.5 + 0.5 * level)) * error_z
