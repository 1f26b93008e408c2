"""Bootstrap intervals over items or raters: exact, or by Monte Carlo."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from statistics import NormalDist
from typing import Literal, cast, get_args

import numpy as np

from masrel.agreement import Label, Metric, WeightsLike
from masrel.agreement._engine import Floats
from masrel.agreement._labels import shown
from masrel.errors import ParameterError
from masrel.estimates import Distribution, Interval, Target
from masrel.intervals._clusters import ClusterSums, clusters_of
from masrel.intervals._problem import (
    ROUNDING,
    Integers,
    IntervalProblem,
    Statistic,
    check_rng,
    pose_problem,
    recorded_generator,
    warn_small,
)
from masrel.intervals._resamples import (
    MAX_ALL,
    Resamples,
    all_resamples,
    count_compositions,
    distinct_features,
    draw_resamples,
)

_Kind = Literal["percentile", "basic", "bca", "studentized"]
"""How the ends of an interval come from resamples."""

_Exact = Literal["auto"] | bool
"""Whether all resamples are taken: always, never, or if there are few enough."""

_NO_SPREAD = 1e-9  # of the standard error of the estimate: rounding, not spread


def bootstrap(
    coefficient: Statistic,
    ratings: object,
    *,
    target: Target,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    metric: Metric | None = None,
    level: float = 0.95,
    n_resamples: int = 10_000,
    kind: _Kind = "percentile",
    exact: _Exact = "auto",
    clusters: object = None,
    rng: np.random.Generator | int | None = None,
) -> Interval:
    """Compute a bootstrap interval.

    Parameters
    ----------
    coefficient : str or callable
        Name of a coefficient, or its public function.
    ratings : nested sequence, array_like or DataFrame
        What the coefficient takes.
    target : {"items", "raters", "both"}
        What a new study would draw anew, and so what is resampled; for "both" items
        and raters, each by themselves [3]_.
    categories : sequence, optional
        The declared scale in order.
    weights : str or array_like, optional
        How much two categories agree; see `declared_weights`.
    metric : str, optional
        Krippendorff's difference function in place of weights; see
        `krippendorff_alpha`, which alone takes one.
    level : float, optional
        Nominal level.
    n_resamples : int, optional
        Resamples where they are drawn, at least 100.
    kind : {"percentile", "basic", "bca", "studentized"}
        How endpoints come from the resamples.
    exact : {"auto", True, False}, optional
        Whether every distinct resample is taken with its probability, instead of
        drawing some: then nothing is random. "auto" does so up to 300 000 of them.
    clusters : sequence of labels, length n_items, optional
        The cluster of every item, for target "items": clusters are drawn whole.
        Several stretches of one haptic model are such a cluster.
    rng : Generator or int, optional
        Where randomness comes from; an integer is recorded as the seed. Without
        it a fresh seed is drawn and recorded. An exact interval needs none.

    Returns
    -------
    Interval
        A confidence interval with the distribution of the coefficient over resamples,
        and the Monte Carlo error of each endpoint if they were drawn; ``nan`` with a
        reason when undefined. "studentized" has no distribution: its ends come from
        ratios, and what "percentile" has is the coefficient's.

    Raises
    ------
    ParameterError
        If an option is invalid, raters of this coefficient cannot be resampled, there
        are too many resamples for `exact` to be True, or not as many labels of clusters
        as items.
    RatingsError
        If the ratings do not fit the coefficient.

    Warns
    -----
    SmallSampleWarning
        Below 16 items or clusters, or 5 raters.
    UndefinedStatisticWarning
        If the estimate is undefined, or has no standard error to studentize by, or all
        resamples are alike.

    Notes
    -----
    Resamples on which the coefficient is undefined, such as one item drawn n times,
    are left out and counted in `n_undefined`; the probabilities of the others are
    scaled up to 1. An exact interval counts distinct resamples there, and a note says
    how probable they are. When raters are resampled, a rater is never paired with a
    copy of itself: such pairs agree always and say nothing. Raters of percent
    agreement, Fleiss' and Conger's kappa, Gwet's AC and Brennan-Prediger's can be.

    A quantile is the least value whose probability adds up to it, and where it adds up
    to just that, the middle between this value and the next. Ties with the estimate
    count half in the bias of BCa. "studentized" divides by the delta-method standard
    error of every resample, from exact derivatives; where that is 0, and the resample
    differs from the estimate, the ratio is infinite.

    The Monte Carlo error is that of the quantile of so many draws.

    References
    ----------
    .. [1] Efron, B., Tibshirani, R. J. (1993). An Introduction to the Bootstrap,
       ch. 12 to 14.
    .. [2] Davison, A. C., Hinkley, D. V. (1997). Bootstrap Methods and their
       Application, ch. 5 and 9.
    .. [3] Owen, A. B. (2007). The pigeonhole bootstrap. Annals of Applied Statistics,
       1(2), 386-411. https://doi.org/10.1214/07-AOAS122

    Examples
    --------
    Of 20 items of three kinds there are 231 different resamples:

    >>> ratings = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]] * 5
    >>> interval = bootstrap("cohen_kappa", ratings, target="items")
    >>> interval.method, interval.distribution.words
    ('percentile bootstrap, exact', 'exact bootstrap distribution, 231 resamples')
    >>> interval.n_resamples, round(interval.low, 3), round(interval.high, 3)
    (None, 0.174, 0.802)

    Drawing some of them instead:

    >>> interval = bootstrap("cohen_kappa", ratings, target="items", exact=False, rng=1)
    >>> interval.seed, interval.n_resamples, interval.low < 0.5 < interval.high
    (1, 10000, True)
    """
    _check_options(kind, exact, n_resamples)
    check_rng(rng)
    problem = pose_problem(
        coefficient,
        ratings,
        target=target,
        categories=categories,
        weights=weights,
        metric=metric,
        level=level,
    )
    units = _units(problem, clusters)
    method = f"{kind} bootstrap{units.words}"
    if kind == "studentized" and units.rows is None:
        raise ParameterError(
            'kind: "studentized" needs the standard error of every resample, which '
            'there is for target "items" alone'
        )
    value, error = problem.value, math.nan
    values = units.values
    reason = "the estimate itself is undefined" if math.isnan(value) else None
    if reason is None and kind == "studentized":
        (error,) = _standard_errors(
            problem, units, units.freqs[0][None].astype(np.float64)
        )
        values = partial(_studentized, problem, units, error)
        if not error > ROUNDING:
            reason = "the estimate has no standard error to studentize by"
    if reason is not None:
        return problem.undefined(reason, method=method, unit=target)
    n_distinct = math.prod(
        count_compositions(int(of.sum()), of.size) for of in units.freqs
    )
    seed = None
    if exact is not False and n_distinct <= MAX_ALL:
        resamples = all_resamples(units.freqs, values, units.width)
        method += ", exact"
        words = f"exact bootstrap distribution, {n_distinct} resamples"
    elif exact is True:
        raise ParameterError(
            f"exact: there are more than {MAX_ALL} distinct resamples, too many; draw "
            "some of them instead"
        )
    else:
        generator, seed = recorded_generator(rng)
        resamples = draw_resamples(
            units.freqs, values, units.width, n_resamples, generator
        )
        n_defined = n_resamples - resamples.n_undefined
        words = f"bootstrap distribution, {n_defined} resamples"
    skew = _acceleration(problem, units) if kind == "bca" else 0.0
    ends = _ends(kind, problem, resamples, error, skew)
    if isinstance(ends, str):
        return problem.undefined(ends, method=method, unit=target)
    (low, high), errors = ends
    notes = (*units.notes, *_notes(resamples, n_distinct, low == high))
    return replace(
        problem.confidence(low, high, method=method, unit=target, notes=notes),
        n_resamples=resamples.n_drawn,
        n_undefined=resamples.n_undefined,
        monte_carlo_error=None if resamples.n_drawn is None else errors,
        seed=seed,
        distribution=None if kind == "studentized" else _distribution(resamples, words),
    )


def _check_options(kind: _Kind, exact: _Exact, n_resamples: int) -> None:
    if kind not in get_args(_Kind):
        raise ParameterError(
            f"kind: needs one of {', '.join(get_args(_Kind))}, got {kind!r}"
        )
    if not (exact is True or exact is False or exact == "auto"):
        raise ParameterError(f'exact: needs "auto", True or False, got {exact!r}')
    is_whole = isinstance(n_resamples, int | np.integer)
    if not is_whole or isinstance(n_resamples, bool) or n_resamples < 100:
        raise ParameterError(
            f"n_resamples: needs a whole number of at least 100, "
            f"got {shown(n_resamples)}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Units:
    """What is drawn: items, clusters, raters, or items and raters by themselves."""

    # how often each distinct unit is there, of one sample or of two
    freqs: tuple[Integers, ...] = field(repr=False)
    # how often each is drawn, (b, n_units) of each sample, to values (b,)
    values: Callable[..., Floats]
    rows: Floats | None = field(default=None, repr=False)  # features of items, clusters
    width: int  # numbers that one resample takes
    notes: tuple[str, ...] = ()  # that they are few
    words: str = ""


def _units(problem: IntervalProblem, clusters: object) -> _Units:
    """Return what is resampled, with a warning where there is little of it."""
    if clusters is not None:
        sums = ClusterSums.of(problem, clusters_of(problem, clusters))
        n = int(sums.known.sum())
        few = warn_small(sums.n_paired, 16, "clusters", n)
        freq = np.ones(n, dtype=np.int64)
        units = _rows_drawn(problem, sums.sums[sums.known], freq, few)
        return replace(units, words=f" of {n} clusters")
    if problem.target == "items":
        few = warn_small(problem.n_paired_items, 16, "items", problem.n_items)
        return _rows_drawn(problem, problem.rows, problem.freq, few)
    n_raters = problem.patterns.codes.shape[1]
    raters = np.ones(n_raters, dtype=np.int64)
    sums_of = problem.rater_sums()  # or an error
    few = warn_small(problem.n_paired_raters, 5, "raters", problem.n_raters)
    if problem.target == "raters":
        return _Units(
            freqs=(raters,),
            values=lambda counts: problem.values(sums_of(counts)),
            width=n_raters + problem.sums.size,
            notes=few,
        )
    few_items = warn_small(problem.n_paired_items, 16, "items", problem.n_items)
    return _Units(
        freqs=(problem.freq, raters),
        values=problem.crossed_values(),
        width=problem.freq.size * (3 * len(problem.v) + 6) + n_raters,
        notes=(*few_items, *few),
        words=" of items and raters",
    )


def _rows_drawn(
    problem: IntervalProblem, rows: Floats, freq: Integers, few: tuple[str, ...]
) -> _Units:
    """Return items or clusters with their features."""
    rows, freq = distinct_features(rows, freq)
    return _Units(
        freqs=(freq,),
        values=lambda counts: problem.values(counts @ rows),
        rows=rows,
        width=freq.size + 4 * rows.shape[1],
        notes=few,
    )


def _acceleration(problem: IntervalProblem, units: _Units) -> float:
    """Return a sixth of the skewness of a sum of what the units move."""
    # of independent samples, with l/n ≈ (n - 1)/n (mean - value without one)
    # [Efron and Tibshirani (1993), (14.15), for one]
    cubes = squares = 0.0
    all_there = [freq.astype(np.float64) for freq in units.freqs]
    for k, freq in enumerate(all_there):
        if units.rows is not None:
            values = problem.values_without(problem.sums, units.rows)
        else:
            without = [np.tile(of, (freq.size, 1)) for of in all_there]
            without[k] = without[k] - np.eye(freq.size)
            values = units.values(*without)
        known = ~np.isnan(values)
        values, freq = values[known], freq[known]
        n = freq.sum()
        if n > 0:
            moves = (n - 1.0) / n * (freq @ values / n - values)
            cubes += float(freq @ moves**3)
            squares += float(freq @ moves**2)
    return cubes / (6.0 * squares**1.5) if squares > 0.0 else 0.0


def _standard_errors(problem: IntervalProblem, units: _Units, counts: Floats) -> Floats:
    """Return the delta-method standard error of each resample, (b,)."""
    rows = cast("Floats", units.rows)
    moves = problem.slopes(counts @ rows) @ rows.T
    moves = np.where(counts > 0.0, moves, 0.0)  # those not drawn have no part
    mean = (counts * moves).sum(axis=-1, keepdims=True) / counts.sum(-1, keepdims=True)
    return np.asarray(np.sqrt((counts * (moves - mean) ** 2).sum(axis=-1)))


def _studentized(
    problem: IntervalProblem, units: _Units, error: float, counts: Floats
) -> Floats:
    """Return how many of its own standard errors each resample is off, (b,)."""
    off = units.values(counts) - problem.value
    errors = _standard_errors(problem, units, counts)
    has_none = errors <= _NO_SPREAD * error
    ratio = off / np.where(has_none, 1.0, errors)
    is_same = np.abs(off) <= _NO_SPREAD * error
    infinite = np.where(is_same, 0.0, np.copysign(np.inf, off))
    return np.where(has_none & ~np.isnan(off), infinite, ratio)


_Ends = tuple[tuple[float, float], tuple[float, float]]
"""The ends of an interval, and their Monte Carlo errors."""


def _ends(
    kind: _Kind,
    problem: IntervalProblem,
    resamples: Resamples,
    error: float,
    skew: float,
) -> _Ends | str:
    """Return the ends, or why there are none."""
    # [1] Efron, B., Tibshirani, R. J. (1993). An Introduction to the Bootstrap.
    # [2] Davison, A. C., Hinkley, D. V. (1997). Bootstrap Methods and their
    # Application.
    values, value = resamples.values, problem.value
    if not (values.size and values[-1] - values[0] > ROUNDING):
        return "every resample gives the same value or none, so there is no spread"
    tail, share = 0.5 * (1.0 - problem.level), 0.5
    levels, pulls = (tail, 1.0 - tail), (0.0, 0.0)
    if kind == "bca":
        share = resamples.share_below(value)
        if not 0.0 < share < 1.0:
            return "all resamples lie on one side of the estimate, so BCa has no bias"
        levels = _bca_levels(problem.level, share, skew)
        step = 1e-4 * min(share, 1.0 - share)
        after, before = (
            np.array(_bca_levels(problem.level, share + by, skew))
            for by in (step, -step)
        )
        pulls = tuple(((after - before) / (2.0 * step)).tolist())
    first, last = (resamples.quantile(at) for at in levels)
    errors = [
        resamples.error(at, pull, share) for at, pull in zip(levels, pulls, strict=True)
    ]
    if kind in ("percentile", "bca"):  # (13.3) and (14.9) of [1]
        return (first, last), (errors[0], errors[1])
    scale = 1.0 if kind == "basic" else error
    mirrored = (scale * errors[1], scale * errors[0])
    if kind == "basic":  # (5.6) of [2]
        return (2.0 * value - last, 2.0 * value - first), mirrored
    return (value - error * last, value - error * first), mirrored  # (12.22) of [1]


def _bca_levels(level: float, share: float, skew: float) -> tuple[float, float]:
    """Return which quantiles of the resamples are the ends of a BCa interval."""
    # [1] Efron, B., Tibshirani, R. J. (1993). An Introduction to the Bootstrap, ch. 14.
    normal = NormalDist()
    bias = normal.inv_cdf(share)  # z0, (14.14) of [1]
    tail = 0.5 * (1.0 - level)
    ends = []
    for z in (normal.inv_cdf(tail), normal.inv_cdf(1.0 - tail)):
        stretch = 1.0 - skew * (bias + z)
        if stretch <= 0.0:  # beyond its pole (14.10) says nothing: the last value
            ends.append(0.0 if bias + z < 0.0 else 1.0)
            continue
        moved = bias + (bias + z) / stretch  # (14.10)
        ends.append(0.5 * math.erfc(-moved / math.sqrt(2.0)))
    return ends[0], ends[1]


def _notes(resamples: Resamples, n_distinct: int, one_value: bool) -> tuple[str, ...]:
    """Return what is to be known of the resamples."""
    notes = []
    if resamples.n_undefined and resamples.n_drawn is None:
        notes.append(
            f"undefined, and left out: {resamples.n_undefined} of {n_distinct} "
            f"distinct resamples, of probability {resamples.p_undefined:.2g}"
        )
    if one_value:
        notes.append(
            "both ends are one value, which many resamples have; that does not make it "
            "certain"
        )
    infinite = float(resamples.weights[np.isinf(resamples.values)].sum())
    if infinite:  # of ratios alone
        notes.append(
            f"resamples of probability {infinite:.2g} have a standard error of 0: "
            "their studentized values are infinite"
        )
    return tuple(notes)


def _distribution(resamples: Resamples, words: str) -> Distribution:
    for array in (resamples.values, resamples.weights):
        array.flags.writeable = False
    return Distribution(
        values=resamples.values,
        weights=resamples.weights,
        continuous=False,
        words=words,
    )
