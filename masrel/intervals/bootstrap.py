"""Bootstrap intervals over items or raters: exact, or by Monte Carlo."""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from statistics import NormalDist
from typing import Literal, cast, get_args

import numpy as np

from masrel._input import check_option, refuse
from masrel.agreement import Label, Metric, WeightsLike
from masrel.agreement._codes import read_only
from masrel.agreement._engine import Floats, Integers, recorded_generator
from masrel.agreement._weights import Distances
from masrel.errors import ParameterError
from masrel.estimates import Distribution, Interval, Target, Unit, _Caution
from masrel.intervals._question import (
    ROUNDING,
    IntervalProblem,
    Statistic,
    cluster_codes,
    cluster_sums,
    pose_problem,
    warn_small,
)

# How the ends of an interval come from resamples
_Kind = Literal["percentile", "basic", "bca", "studentized"]

# Whether all resamples are taken: always, never, or if there are few enough
_Exact = Literal["auto"] | bool

_NO_SPREAD = 1e-9  # of the standard error of the estimate: rounding, not spread
_MAX_ALL = 300_000  # distinct resamples that are all taken rather than drawn
_AT_ONCE = 1 << 20  # numbers held at once while values are computed


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
        Population that the interval is about, and so what is resampled: other items,
        other raters, or both; for "both", items and raters separately [3]_.
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

    The Monte Carlo error is that of the quantile of this number of draws.

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
    check_option("kind", kind, get_args(_Kind))
    is_whole = isinstance(n_resamples, int | np.integer)
    refuse(
        (
            not (exact is True or exact is False or exact == "auto"),
            f'exact: needs "auto", True or False, got {exact!r}',
        ),
        (
            not is_whole or isinstance(n_resamples, bool) or n_resamples < 100,
            f"n_resamples: needs a whole number of at least 100, got {n_resamples!r}",
        ),
        (
            kind == "studentized" and target != "items",
            'kind: "studentized" needs the standard error of every resample, so it '
            'needs target "items"',
        ),
    )
    problem = pose_problem(
        coefficient,
        ratings,
        target=target,
        categories=categories,
        weights=weights,
        metric=metric,
        level=level,
    )
    if rng is not None:
        recorded_generator(rng)  # or an error, even where nothing is drawn
    of_items = target == "items" or clusters is not None
    units = _item_units(problem, clusters) if of_items else _rater_units(problem)
    method = f"{kind} bootstrap{units.words}"
    values, error = units.values, math.nan
    unit: Unit = target if clusters is None else "clusters"
    reason = "the estimate itself is undefined" if math.isnan(problem.value) else None
    if reason is None and kind == "studentized":
        error = _standard_errors(
            problem, units, units.freqs[0][None].astype(np.float64)
        )[0]
        values = partial(_studentized, problem, units, error)
        if not error > ROUNDING:
            reason = "the estimate has no standard error to studentize with"
    if reason is not None:
        return problem.undefined(reason, method=method, unit=unit)
    resamples, n_distinct, seed = _resampled(units, values, exact, n_resamples, rng)
    words = f"bootstrap distribution, {n_resamples - resamples.n_undefined} resamples"
    if resamples.n_drawn is None:
        method += ", exact"
        words = f"exact bootstrap distribution, {n_distinct} resamples"
    ends = _ends(kind, problem, units, resamples, error)
    if isinstance(ends, str):
        return problem.undefined(ends, method=method, unit=unit)
    (low, high), errors = ends
    notes = (*units.notes, *_notes(resamples, n_distinct, low == high))
    distribution = None
    if kind != "studentized":
        distribution = Distribution(
            values=read_only(resamples.values),
            weights=read_only(resamples.weights),
            continuous=False,
            words=words,
        )
    return replace(
        problem.confidence(low, high, method=method, unit=unit, notes=notes),
        n_resamples=resamples.n_drawn,
        n_undefined=resamples.n_undefined,
        monte_carlo_error=None if resamples.n_drawn is None else errors,
        seed=seed,
        units_are="drawn",
        distribution=distribution,
    )


def _resampled(
    units: "_Units",
    values: Callable[..., Floats],
    exact: _Exact,
    n_resamples: int,
    rng: np.random.Generator | int | None,
) -> tuple["_Resamples", int, int | None]:
    """Return values of resamples, how many distinct ones there are, and the seed."""
    n_distinct = 1
    for freq in units.freqs:
        n, others = int(freq.sum()), freq.size - 1
        # of more than 30 they are more than anybody takes, and not counted any further
        n_distinct *= math.comb(n + others, min(n, others, 30))
    refuse(
        (
            exact is True and n_distinct > _MAX_ALL,
            f"exact: there are more than {_MAX_ALL} distinct resamples, too many; draw "
            "some of them instead",
        )
    )
    if exact is False or n_distinct > _MAX_ALL:
        generator, seed = recorded_generator(rng)
        size = max(1, _AT_ONCE // units.width)
        of_blocks = [
            values(
                *(
                    generator.multinomial(
                        of.sum(), of / of.sum(), size=min(size, n_resamples - start)
                    ).astype(np.float64)
                    for of in units.freqs
                )
            )
            for start in range(0, n_resamples, size)
        ]
        return _Resamples.of(np.concatenate(of_blocks)), n_distinct, seed
    # every distinct resample once, of each sample by itself
    counts, weights = zip(*map(_compositions, units.freqs), strict=True)
    places = np.indices([len(of) for of in counts]).reshape(len(counts), -1)
    n_blocks = 1 + n_distinct * units.width // _AT_ONCE
    of_blocks = [
        values(*(of[at] * 1.0 for of, at in zip(counts, block, strict=True)))
        for block in np.array_split(places, n_blocks, axis=1)
    ]
    probabilities = [of[at] for of, at in zip(weights, places, strict=True)]
    taken = _Resamples.of(np.concatenate(of_blocks), np.prod(probabilities, axis=0))
    return taken, n_distinct, None


# -- what is drawn ---------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Units:
    """What is drawn: items, clusters, raters, or items and raters separately."""

    # how often each distinct unit is there, of one sample or of two
    freqs: tuple[Integers, ...] = field(repr=False)
    # how often each is drawn, (b, n_units) of each sample, to values (b,)
    values: Callable[..., Floats]
    # the values without one of the units, of each sample, (n_units,)
    without: Callable[[], tuple[Floats, ...]]
    rows: Floats | None = field(default=None, repr=False)  # features of items, clusters
    width: int  # numbers that one resample takes
    notes: tuple[str, ...]  # that they are few
    words: str = ""


def _item_units(problem: IntervalProblem, clusters: object) -> _Units:
    """Return items, or clusters of them, with a warning where there are few."""
    rows, freq, words = problem.features(problem.codes), problem.freq, ""
    if clusters is None:
        few = warn_small(problem.n_paired_items, 16, "items", problem.n_items)
    else:
        rows, known, n_paired = cluster_sums(problem, cluster_codes(problem, clusters))
        freq = known.astype(np.int64)
        few = warn_small(n_paired, 16, "clusters", int(freq.sum()))
        words = f" of {freq.sum()} clusters"
    rows, freq = _distinct_features(rows, freq)
    return _Units(
        freqs=(freq,),
        values=lambda counts: problem.values(counts @ rows),
        without=lambda: (problem.values(problem.sums - rows),),
        rows=rows,
        width=freq.size + 4 * rows.shape[1],
        notes=few,
        words=words,
    )


def _rater_units(problem: IntervalProblem) -> _Units:
    """Return raters, or items and raters, with a warning where there are few."""
    formula, v, (fewest, most) = problem.formula, problem.v, problem.entry.n_raters
    if isinstance(v, Distances):
        raise ParameterError(
            f"target: raters cannot be resampled with {len(v)} different grades; use "
            "the jackknife, which leaves them out"
        )
    if formula.resampled is None or most == fewest:
        raise ParameterError(
            f"target: raters of {problem.entry.title} cannot be resampled without "
            "pairing a rater with a copy of itself"
        )
    is_item = problem.freq > 0
    codes, freq = problem.codes[is_item], problem.freq[is_item]
    few = warn_small(problem.n_paired_raters, 5, "raters", problem.n_raters)
    of_raters = formula.resampled(codes, v, freq)

    def values(taken: Floats) -> Floats:
        items = np.broadcast_to(1.0 * freq, (len(taken), len(freq)))
        return problem.values(of_raters(items, taken))

    raters = _Units(
        freqs=(np.ones(codes.shape[1], dtype=np.int64),),
        values=values,
        without=lambda: (values(1.0 - np.eye(codes.shape[1])),),
        width=freq.size + codes.shape[1] + problem.sums.size,
        notes=few,
    )
    if problem.target == "raters":
        return raters
    few_items = warn_small(problem.n_paired_items, 16, "items", problem.n_items)
    rows, sums_of = problem.features(codes), formula.resampled(codes, v)
    return _Units(
        freqs=(freq, *raters.freqs),
        values=lambda items, taken: problem.values(sums_of(items, taken)),
        without=lambda: (problem.values(problem.sums - rows), *raters.without()),
        width=freq.size * (3 * len(v) + 6) + codes.shape[1],
        notes=(*few_items, *few),
        words=" of items and raters",
    )


def _distinct_features(rows: Floats, freq: Integers) -> tuple[Floats, Integers]:
    """Put items, or clusters, with equal features together; those of none go."""
    rows, freq = rows[freq > 0], freq[freq > 0]
    _, first, places = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    often = np.bincount(places.ravel(), freq).astype(np.int64)
    order = np.argsort(first)  # as they come: features, which are rounded, decide none
    return rows[first[order]], often[order]


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


# -- the ends --------------------------------------------------------------------------


def _ends(
    kind: _Kind,
    problem: IntervalProblem,
    units: _Units,
    resamples: "_Resamples",
    error: float,
) -> tuple[tuple[float, float], tuple[float, float]] | str:
    """Return the ends and their Monte Carlo errors, or why they are undefined."""
    # [1] Efron, B., Tibshirani, R. J. (1993). An Introduction to the Bootstrap.
    # [2] Davison, A. C., Hinkley, D. V. (1997). Bootstrap Methods and their
    # Application.
    values, value = resamples.values, problem.value
    if not (values.size and values[-1] - values[0] > ROUNDING):
        return "there is no spread, because every resample gives the same value or none"
    tail, share = 0.5 * (1.0 - problem.level), 0.5
    positions, pulls = [tail, 1.0 - tail], [0.0, 0.0]
    if kind == "bca":
        share = resamples.share_below(value)
        if not 0.0 < share < 1.0:
            return (
                "BCa has no bias correction, because all resamples lie on one side of "
                "the estimate"
            )
        normal, skew = NormalDist(), _acceleration(units)
        bias = normal.inv_cdf(share)  # z0, (14.14) of [1]
        for k, z in enumerate(map(normal.inv_cdf, positions)):
            stretch = 1.0 - skew * (bias + z)
            if stretch <= 0.0:  # beyond its pole (14.10) says nothing: the last value
                positions[k] = 0.0 if bias + z < 0.0 else 1.0
                continue
            moved = bias + (bias + z) / stretch  # (14.10)
            positions[k] = 0.5 * math.erfc(-moved / math.sqrt(2.0))
            # the derivative of this in the share of resamples below the estimate
            slope = (1.0 + stretch**-2.0) * normal.pdf(moved)
            pulls[k] = slope / normal.pdf(bias)
    first, last = map(resamples.quantile, positions)
    off, off_last = map(resamples.error, positions, pulls, (share, share))
    if kind in ("percentile", "bca"):  # (13.3) and (14.9) of [1]
        return (first, last), (off, off_last)
    if kind == "basic":  # (5.6) of [2]
        return (2.0 * value - last, 2.0 * value - first), (off_last, off)
    # (12.22) of [1]
    mirrored = (error * off_last, error * off)
    return (value - error * last, value - error * first), mirrored


def _acceleration(units: _Units) -> float:
    """Return a sixth of the skewness of a sum of what the units move."""
    # of independent samples, with l/n ≈ (n - 1)/n (mean - value without one)
    # [Efron and Tibshirani (1993), (14.15), for one]
    cubes = squares = 0.0
    for freq, values in zip(units.freqs, units.without(), strict=True):
        known = ~np.isnan(values)
        values, freq = values[known], freq[known]
        n = max(int(freq.sum()), 1)
        moves = (n - 1.0) / n * (freq @ values / n - values)
        cubes += float(freq @ moves**3)
        squares += float(freq @ moves**2)
    return cubes / (6.0 * squares**1.5) if squares > 0.0 else 0.0


def _notes(
    resamples: "_Resamples", n_distinct: int, one_value: bool
) -> tuple[str, ...]:
    """Return what is to be known of the resamples."""
    notes = []
    if resamples.n_undefined and resamples.n_drawn is None:
        notes.append(
            f"undefined and left out: {resamples.n_undefined} of {n_distinct} "
            f"distinct resamples, with probability {resamples.p_undefined:.2g}"
        )
    if one_value:
        notes.append(
            _Caution(
                "both limits are the same value, which many resamples have; this does "
                "not make it certain"
            )
        )
    infinite = float(resamples.weights[np.isinf(resamples.values)].sum())
    if infinite:  # of ratios alone
        notes.append(
            f"resamples with probability {infinite:.2g} have a standard error of 0, "
            "so their studentized values are infinite"
        )
    return tuple(notes)


# -- values of resamples with their probabilities --------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _Resamples:
    """Distinct values, ascending, with their probabilities."""

    values: Floats = field(repr=False)  # none undefined
    weights: Floats = field(repr=False)  # sum to 1
    cumulative: Floats = field(repr=False)
    n_drawn: int | None  # None if all were taken
    n_undefined: int
    p_undefined: float  # their probability

    @classmethod
    def of(cls, values: Floats, weights: Floats | None = None) -> "_Resamples":
        """Leave out what is undefined, sort values, and put equal ones together."""
        # values, weights (n_resamples,); without weights they are drawn
        n_drawn = values.size if weights is None else None
        weights = np.ones(values.size) if weights is None else weights
        n_undefined = int(np.isnan(values).sum())
        order = np.argsort(values)  # what is undefined comes last
        order, undefined = np.split(order, [values.size - n_undefined])
        lost = float(weights[undefined].sum() / max(weights.sum(), 1.0))
        values, weights = values[order], weights[order] / weights[order].sum()
        is_new = np.ones(values.size, dtype=bool)
        with np.errstate(invalid="ignore"):  # two infinite values are the same
            smaller = np.clip(np.minimum(abs(values[1:]), abs(values[:-1])), 1.0, 1e300)
            is_new[1:] = np.diff(values) > ROUNDING * smaller
        first = np.flatnonzero(is_new)
        values, weights = values[first], np.add.reduceat(weights, first)
        return cls(
            values=values,
            weights=weights,
            cumulative=np.cumsum(weights),
            n_drawn=n_drawn,
            n_undefined=n_undefined,
            p_undefined=lost,
        )

    def quantile(self, position: float) -> float:
        """Return the least value whose probability adds up to a position."""
        # Where it adds up to just that, any value up to the next would do: it is the
        # middle of the two, so that mirrored values have mirrored quantiles. This is
        # definition 2 of Hyndman and Fan (1996), https://doi.org/10.2307/2684934.
        last = self.values.size - 1
        at = min(int(np.searchsorted(self.cumulative, position - ROUNDING)), last)
        value = float(self.values[at])
        if at < last and abs(float(self.cumulative[at]) - position) <= ROUNDING:
            return 0.5 * (value + float(self.values[at + 1]))
        return value

    def share_below(self, value: float) -> float:
        """Return the probability of less than a value, and half that of the value."""
        off = ROUNDING * max(1.0, abs(value))
        ends = np.searchsorted(self.values, (value - off, value + off))
        below, up_to = (float(self.cumulative[at - 1]) if at else 0.0 for at in ends)
        return 0.5 * (below + up_to)

    def error(self, position: float, pull: float = 0.0, share: float = 0.5) -> float:
        """Return the Monte Carlo error of a quantile of what was drawn.

        Its position moves by `pull` with the share of resamples below the estimate.
        """
        # Var[1(x ≤ q) - pull 1(x < estimate)], as the two are nested
        joint = min(position, share) - position * share
        n, plain = max(self.n_drawn or 1, 1), position * (1.0 - position)
        variance = plain - 2.0 * pull * joint + pull**2 * share * (1.0 - share)
        off = math.sqrt(max(variance, 0.0) / n)
        # times the slope of the quantile, from twice as far as it is off by itself
        reach = 2.0 * math.sqrt(plain / n)
        ends = max(position - reach, 0.0), min(position + reach, 1.0)
        low, high = (self.quantile(end) for end in ends)
        return off * (high - low) / (ends[1] - ends[0]) if low < high else 0.0


def _compositions(freq: Integers) -> tuple[Integers, Floats]:
    """Return how often each unit is in every resample, and its probability."""
    # freq (n_units,) -> (n_resamples, n_units), (n_resamples,)
    n, size = int(freq.sum()), freq.size
    # n draws in a row, with a bar wherever those of the next unit begin
    bars = itertools.combinations(range(n + size - 1), size - 1)
    flat = np.fromiter(itertools.chain.from_iterable(bars), dtype=np.int64)
    bars_at = flat.reshape(-1, size - 1) if size > 1 else np.empty((1, 0), np.int64)
    counts = np.diff(bars_at, axis=1, prepend=-1, append=n + size - 1) - 1
    # n! Π share^t / t! in logarithms, so that no n over- or underflows
    steps = np.log(np.maximum(np.arange(n + 1), 1))
    factorials = np.cumsum(steps, dtype=np.longdouble).astype(np.float64)
    logs = counts * np.log(freq / n) - factorials[counts]
    return counts, np.exp(factorials[n] + logs.sum(axis=1))
