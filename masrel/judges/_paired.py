"""Tests of paired counts: b items go one way, c the other, of n in all.

In: b, c and n, and the difference p_b - p_c of the hypothesis. Out: Tango's score test
with its interval, and p-values that are exact, or Student's.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import bdtr, gammaln, ndtr, ndtri, stdtr, xlog1py, xlogy

from masrel._input import refuse, shown
from masrel.agreement._engine import Floats, Integers, check_level, undefined

PairedTest = Literal["exact", "score", "t"]
"""Ways to test whether p_b - p_c is less than a bound."""

NO_CHANGE = "0/0: the counts are exactly those of the hypothesis and have no variance"

_TIED = 1e-9  # statistics nearer than this are the same
_PER_SD = 2.0  # places of the nuisance to a standard error of its estimate
_PEAKS = 3  # highest maxima among these that are looked at more closely
_CLOSER = np.linspace(-1.0, 1.0, 9)  # places around one of them
_JOINED = 2.0  # items that differ in clusters wholly alike
_LOWEST_Z = -9.0  # where nothing is rejected
_AT_ONCE = 1 << 22  # probabilities
_SMALLEST = 1e-17  # probability of a count that adds nothing


@dataclass(frozen=True, slots=True, kw_only=True)
class ScoreTest:
    """Tango's test and interval of the difference of two paired shares.

    Attributes
    ----------
    b, c, n : int
        Items that go one way, the other way, and all.
    delta : float
        The difference p_b - p_c of the hypothesis.
    value : float
        (b - c)/n.
    statistic : float
        z, standard normal under the hypothesis; ``nan`` for 0/0.
    p_less, p_greater, p_value : float
        Of the alternatives that p_b - p_c is less than `delta`, that it is greater, and
        that it is either.
    low, high : float
        The interval of p_b - p_c: differences at which the test does not reject.
    level : float
        Nominal level of the interval.
    reason : str or None
        Why the statistic is undefined, or None.
    """

    b: int
    c: int
    n: int
    delta: float
    value: float
    statistic: float
    p_less: float
    p_greater: float
    p_value: float
    low: float
    high: float
    level: float
    reason: str | None = None


def score_test(
    b: int, c: int, n: int, *, delta: float = 0.0, level: float = 0.95
) -> ScoreTest:
    """Test and estimate the difference of two paired shares, by Tango's score.

    Parameters
    ----------
    b, c : int
        Items that go one way, such as those where a human is nearer to the others than
        the judge is, and items that go the other way.
    n : int
        All items, also those that go neither way.
    delta : float, optional
        The difference of their shares p_b - p_c under the hypothesis, within [-1, 1].
    level : float, optional
        Nominal level of the interval.

    Returns
    -------
    ScoreTest
        The statistic, p-values of both sides, and the interval of p_b - p_c.

    Raises
    ------
    ParameterError
        If b, c and n are not such counts, or an option is outside its range.

    Warns
    -----
    UndefinedStatisticWarning
        If the statistic is 0/0, as where no item goes either way and `delta` is 0; the
        interval is there nevertheless.

    Notes
    -----
    At `delta` 0 it is McNemar's test. The statistic is normal for large n only: at a
    nominal 5 % the one-sided test rejects up to 7.1 % of true hypotheses at n = 30,
    which is why `alternative_annotator_test` takes an exact test there.

    References
    ----------
    .. [1] Tango, T. (1998). Equivalence test and confidence interval for the
       difference in proportions for the paired-sample design. Statistics in Medicine,
       17(8), 891-908.
       https://doi.org/10.1002/(SICI)1097-0258(19980430)17:8<891::AID-SIM780>3.0.CO;2-B

    Examples
    --------
    Of 40 items 4 go one way and 2 the other; is the difference less than .1?

    >>> result = score_test(4, 2, 40, delta=0.1)
    >>> round(result.p_less, 4)
    0.2181
    >>> round(result.low, 4), round(result.high, 4)
    (-0.0855, 0.1922)
    """
    check_count("b", b, 0)
    check_count("c", c, 0)
    check_count("n", n)
    refuse((b + c > n, f"n: needs at least b + c = {b} + {c}, got {n}"))
    check_share("delta", delta, -1.0)
    check_level(level)
    b, c, n = int(b), int(c), int(n)
    z, reason = float(tango(b, c, n, delta)), None
    if math.isnan(z):
        reason = undefined("score_test", NO_CHANGE)
    less, greater = float(ndtr(z)), float(ndtr(-z))
    value, quantile = (b - c) / n, float(ndtri(0.5 + 0.5 * level))
    return ScoreTest(
        b=b,
        c=c,
        n=n,
        delta=float(delta),
        value=value,
        statistic=z,
        p_less=less,
        p_greater=greater,
        p_value=2.0 * min(less, greater) if reason is None else math.nan,
        # the interval of c - b is that of b - c the other way round
        low=-_upper_end(c, b, n, quantile),
        high=_upper_end(b, c, n, quantile),
        level=level,
        reason=reason,
    )


def check_count(name: str, count: object, fewest: int = 1) -> None:
    """Check that an argument is a whole number that is large enough."""
    refuse(
        (
            not isinstance(count, int | np.integer) or count < fewest,
            f"{name}: needs a whole number of at least {fewest}, got {shown(count)}",
        )
    )


def check_share(name: str, value: object, lowest: float = 0.0) -> None:
    """Check that an argument is a share, or the difference of two."""
    is_number = isinstance(value, int | float | np.integer | np.floating)
    refuse(
        (
            not (is_number and lowest <= value <= 1.0),  # type: ignore[operator]
            f"{name}: needs [{lowest:g}, 1], got {shown(value)}",
        )
    )


def tango(b: ArrayLike, c: ArrayLike, n: float, delta: float) -> Floats:
    """Return Tango's z of counts, of any shape; ``nan`` for 0/0."""
    if delta < 0.0:
        return -tango(c, b, n, -delta)
    up, down = np.asarray(b, dtype=np.float64), np.asarray(c, dtype=np.float64)
    # q, the estimate of p_c under the hypothesis, is the root of 2n q² + B q + C
    slope = -up - down + (2.0 * n - up + down) * delta  # B
    last = down * delta * (1.0 - delta)  # -C
    root = np.sqrt(slope**2 + 8.0 * n * last)
    with np.errstate(divide="ignore", invalid="ignore"):
        # of two forms of the root, the one that subtracts nothing
        q = np.where(slope > 0.0, 2.0 * last / (slope + root), (root - slope) / 4.0 / n)
        variance = n * (2.0 * q + delta * (1.0 - delta))
        return np.asarray((up - down - n * delta) / np.sqrt(variance))


def _upper_end(b: int, c: int, n: int, quantile: float) -> float:
    """Return the largest difference whose z is at least the lower quantile."""
    low, high = (b - c) / n, 1.0
    if b == n:
        return high
    while low < (middle := 0.5 * (low + high)) < high:  # z falls as delta grows
        if tango(b, c, n, middle) < -quantile:
            high = middle
        else:
            low = middle
    return low


# -- p-values that the difference is less ----------------------------------------------


def p_less(b: int, c: int, n: int, delta: float, test: PairedTest) -> float:
    """Return the p-value of p_b - p_c ≥ delta against its being less."""
    z = tango(b, c, n, delta)
    if test == "exact":  # ordered by z, of the nuisance where it is largest
        bound = float(np.nan_to_num(z, nan=0.0, neginf=-math.inf))
        region = lower_region(bound, n, delta)
        return maximum(partial(region_share, region, delta), n, delta)
    if test == "score":
        return float(ndtr(z))
    # Student's, of b ones, c minus ones and zeros
    mean = (b - c) / n
    variance = (n * (b + c) - (b - c) ** 2) / (n * n * max(n - 1, 1))  # of the mean
    if variance > 0.0:
        return float(stdtr(n - 1, (mean - delta) / math.sqrt(variance)))
    return math.nan if mean == delta else float(mean > delta)


def rejected(
    n: int, delta: float, bound: float, test: Literal["exact", "score"]
) -> Integers:
    """Return, for each c, the largest b with a p-value of at most a bound; -1 for none.

    Of the exact test it is a region of the score test with another bound of z.
    """
    # -> (n + 1,)
    if test == "score":
        return lower_region(float(ndtri(bound)), n, delta)
    low, high = _LOWEST_Z, 0.0
    inner, outer = (lower_region(z, n, delta) for z in (low, high))
    while high - low > _TIED and (outer - inner).sum() > 1:
        middle = 0.5 * (low + high)
        region = lower_region(middle, n, delta)
        if maximum(partial(region_share, region, delta), n, delta) <= bound:
            low, inner = middle, region
        else:
            high, outer = middle, region
    return inner


def p_less_of_clusters(d: Integers, clusters: Integers, delta: float) -> float:
    """Return the p-value of items that may be alike in a cluster, by Tango's score.

    Counts are divided by their design effect (Rao and Scott), and z has Student's
    distribution with as many degrees of freedom as clusters less 1. Few items that
    differ tell next to nothing of how alike clusters are: two more, of clusters wholly
    alike, are joined to them.
    """
    # d (n_items,): 1, -1 or 0; clusters (n_items,): codes
    n, sizes = len(d), np.bincount(clusters)
    sums, sizes = np.bincount(clusters, d)[sizes > 0], sizes[sizes > 0]
    b, c, n_clusters = int((d == 1).sum()), int((d == -1).sum()), len(sizes)
    if n_clusters < 2:
        return math.nan
    between = float(((sums - d.mean() * sizes) ** 2).sum())
    between *= n_clusters / (n_clusters - 1)
    by_item = b + c - (b - c) ** 2 / n
    effect = max(between / by_item, 1.0) if by_item > 0.0 else 1.0
    weight = _JOINED / (_JOINED + b + c)
    effect += weight * (float((sizes**2).sum()) / n - effect)
    z = tango(b / effect, c / effect, n / effect, delta)
    return float(stdtr(n_clusters - 1, z))


def lower_region(z: float, n: int, delta: float) -> Integers:
    """Return, for each c, the largest b whose statistic is at most z; -1 for none.

    z grows with b and falls with c, so that these are all outcomes that speak against
    the hypothesis as much as z does; and therefore their share of all is largest where
    p_b - p_c is just delta [1]_.
    """
    # -> (n + 1,)
    c = np.arange(n + 1)
    low, high = np.full(n + 1, -1), n - c
    while (low < high).any():
        middle = (low + high + 1) // 2
        value = np.nan_to_num(tango(middle, c, n, delta), nan=0.0, neginf=-math.inf)
        is_in = value <= z + _TIED
        low, high = np.where(is_in, middle, low), np.where(is_in, high, middle - 1)
    return low


def region_share(largest: Integers, delta: float, q: Floats) -> Floats:
    """Return the probability of b ≤ largest[c] where p_c = q and p_b = q + delta."""
    # largest (n + 1,), q (n_places,) -> (n_places,)
    n = len(largest) - 1
    c = np.arange(n + 1)
    ways = gammaln(n + 1) - gammaln(c + 1) - gammaln(n - c + 1)
    share = np.exp(ways + xlogy(c, q[:, None]) + xlog1py(n - c, -q[:, None]))
    place, count = np.nonzero((share > _SMALLEST) & (largest >= 0))
    # b given c is binomial, of the items that are left
    p = np.minimum((q + delta) / (1.0 - q), 1.0)[place]
    parts = share[place, count] * bdtr(largest[count], n - count, p)
    return np.asarray(np.bincount(place, parts, len(q)), dtype=np.float64)


def maximum(share: Callable[[Floats], Floats], n: int, delta: float) -> float:
    """Return the largest value of a function of q, from 0 to (1 - delta)/2.

    It is a mean over binomial counts, so that on the scale of angles it cannot have
    maxima much narrower than their standard error, which the first places show.
    """
    n_steps = math.ceil(_PER_SD * math.pi * math.sqrt(n))
    angles = np.linspace(0.0, 0.5 * math.pi, n_steps + 1)

    def at(angles: Floats) -> Floats:
        q = 0.5 * (1.0 - delta) * np.sin(angles) ** 2
        parts = np.array_split(q, 1 + q.size * n // _AT_ONCE)
        return np.concatenate([share(part) for part in parts])

    values = at(angles)
    padded = np.concatenate([[-1.0], values, [-1.0]])
    peaks = np.flatnonzero((values >= padded[:-2]) & (values >= padded[2:]))
    highest = peaks[np.argsort(values[peaks])[-_PEAKS:]]
    centres, step, best = angles[highest], angles[1], float(values.max())
    for _ in range(4):
        near = np.clip(centres[:, None] + step * _CLOSER, 0.0, 0.5 * math.pi)
        values = at(near.ravel()).reshape(near.shape)  # (n_peaks, n_places)
        centres = near[np.arange(len(near)), values.argmax(axis=1)]
        step, best = step * _CLOSER[5], max(best, float(values.max()))
    return min(best, 1.0)
