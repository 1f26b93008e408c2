"""Bootstrap intervals over items or raters: exact, or by Monte Carlo."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Literal, get_args

import numpy as np

from masrel.agreement import Label, Metric, WeightsLike
from masrel.agreement._labels import shown
from masrel.errors import ParameterError
from masrel.estimates import Interval, Target
from masrel.intervals._alpha_bootstraps import (
    check_alpha,
    hayes_interval,
    hold_expected,
)
from masrel.intervals._endpoints import (
    EndpointRule,
    Kind,
    Resamples,
    distribution_of,
)
from masrel.intervals._problem import (
    ROUNDING,
    IntervalProblem,
    Statistic,
    check_rng,
    pose_problem,
    recorded_generator,
)
from masrel.intervals._resamples import DrawBudget, all_resamples, draw_resamples
from masrel.intervals._units import CrossedUnits, SamplingUnits, sampling_units

_Kind = Literal[Kind, "krippendorff", "hayes"]
"""The same, and the bootstraps of alpha of other programs."""

_Exact = Literal["auto"] | bool
"""Whether all resamples are taken: always, never, or if there are few enough."""


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
    tolerance: float | None = None,
    max_resamples: int = 10_000_000,
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
        and raters, each by themselves [5]_.
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
    kind : {"percentile", "basic", "bca", "studentized", "krippendorff", "hayes"}
        How endpoints come from the resamples. The last two are bootstraps of
        Krippendorff's alpha by other programs; see Notes.
    exact : {"auto", True, False}, optional
        Whether every distinct resample is taken with its probability, instead of
        drawing some: then nothing is random. "auto" does so up to 300 000 resamples, or
        different sums of features; 60 000 resamples for "studentized". True also takes
        up to a million resamples, 300 000 for "studentized".
    clusters : sequence of labels, length n_items, optional
        The cluster of every item, for target "items": clusters are drawn whole.
        Several stretches of one haptic model are such a cluster.
    tolerance : float, optional
        The largest Monte Carlo error of an end: resamples are drawn until it is met.
    max_resamples : int, optional
        How many are drawn for it at most.
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
    ConvergenceError
        If `tolerance` takes more than `max_resamples`; it says how many more.

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

    "krippendorff" takes the percentiles of resampled items, too, but holds the
    disagreement by chance as it is in all ratings, and so does the R package
    krippendorffsalpha by its method "customary" [3]_. "hayes" draws pairs of values in
    place of items, corrects the result, and takes order statistics as the macro KALPHA
    does [4]_: it takes pairs of one item for independent, and stops narrowing with many
    items. Both need target "items" and are here so that their intervals can be
    repeated.

    What is drawn has a linear function of the resample as its control: its distribution
    is computed, and says how far the sample is off [2]_. The Monte Carlo error is what
    the control leaves.

    References
    ----------
    .. [1] Efron, B., Tibshirani, R. J. (1993). An Introduction to the Bootstrap,
       ch. 12 to 14.
    .. [2] Davison, A. C., Hinkley, D. V. (1997). Bootstrap Methods and their
       Application, ch. 5 and 9.
    .. [3] Hughes, J. (2021). krippendorffsalpha: an R package for measuring agreement
       using Krippendorff's alpha coefficient. R Journal, 13(1), 413-425.
       https://doi.org/10.32614/RJ-2021-046
    .. [4] Hayes, A. F., Krippendorff, K. (2007). Answering the call for a standard
       reliability measure for coding data. Communication Methods and Measures, 1(1),
       77-89. https://doi.org/10.1080/19312450709336664
    .. [5] Owen, A. B. (2007). The pigeonhole bootstrap. Annals of Applied Statistics,
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
    budget = DrawBudget(
        n_resamples=n_resamples, tolerance=tolerance, max_resamples=max_resamples
    )
    _check_options(kind, exact, budget)
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
    method = f"{kind} bootstrap"
    if kind == "hayes":
        check_alpha(problem, kind)
        _check_hayes(exact, clusters, tolerance)
        return hayes_interval(problem, n_resamples, rng)
    if kind == "krippendorff":
        check_alpha(problem, kind)
        problem = hold_expected(problem)
        method, kind = "percentile bootstrap, chance held", "percentile"
    units = sampling_units(problem, clusters)
    method += units.words
    rule = _endpoint_rule(problem, units, kind)
    reason = None
    if math.isnan(rule.value):
        reason = "the estimate itself is undefined"
    elif kind == "studentized" and not rule.error > ROUNDING:
        reason = "the estimate has no standard error to studentize by"
    if reason is not None:
        return problem.undefined(reason, method=method, unit=target)
    resamples, seed = _resamples(units, rule, exact, budget, rng)
    if resamples.n_resamples is None:
        method += ", exact"
    ends = rule.ends(resamples)
    if isinstance(ends, str):
        return problem.undefined(ends, method=method, unit=target)
    notes, distribution = (*units.notes, *resamples.notes), None
    if ends.low == ends.high:
        notes += (
            "both ends are one value, which many resamples have; that does not make it "
            "certain",
        )
    if kind == "studentized":  # ratios to standard errors, no values of the coefficient
        notes += _infinite_ratios(resamples)
    else:
        distribution = distribution_of(resamples)
    return replace(
        problem.confidence(
            ends.low, ends.high, method=method, unit=target, notes=notes
        ),
        n_resamples=resamples.n_resamples,
        n_undefined=resamples.n_undefined,
        monte_carlo_error=ends.errors,
        seed=seed,
        distribution=distribution,
    )


def _check_hayes(exact: _Exact, clusters: object, tolerance: float | None) -> None:
    named = {"exact": exact is True, "clusters": clusters is not None}
    named["tolerance"] = tolerance is not None
    for name, is_named in named.items():
        if is_named:
            raise ParameterError(
                f'{name}: does not go with kind="hayes", which draws pairs of values'
            )


def _check_options(kind: _Kind, exact: _Exact, budget: DrawBudget) -> None:
    if kind not in get_args(_Kind):
        raise ParameterError(
            f"kind: needs one of {', '.join(get_args(_Kind))}, got {kind!r}"
        )
    if not (exact is True or exact is False or exact == "auto"):
        raise ParameterError(f'exact: needs "auto", True or False, got {exact!r}')
    for name, count, minimum in (
        ("n_resamples", budget.n_resamples, 100),
        ("max_resamples", budget.max_resamples, 1),
    ):
        is_whole = isinstance(count, int | np.integer) and not isinstance(count, bool)
        if not is_whole or count < minimum:
            raise ParameterError(
                f"{name}: needs a whole number of at least {minimum}, "
                f"got {shown(count)}"
            )
    tolerance = budget.tolerance
    if tolerance is not None and not (
        isinstance(tolerance, int | float | np.number) and tolerance > 0.0
    ):
        raise ParameterError(
            f"tolerance: needs a number above 0, got {shown(tolerance)}"
        )
    if budget.max_resamples < budget.n_resamples:
        raise ParameterError(
            f"max_resamples: needs at least the {budget.n_resamples} of n_resamples, "
            f"got {budget.max_resamples}"
        )


def _endpoint_rule(
    problem: IntervalProblem, units: SamplingUnits | CrossedUnits, kind: Kind
) -> EndpointRule:
    rule = EndpointRule(kind=kind, level=problem.level, value=problem.value)
    if kind == "bca" and not math.isnan(rule.value):
        return replace(rule, skew=units.acceleration())
    if kind == "studentized" and not math.isnan(rule.value):
        if isinstance(units, CrossedUnits):
            raise ParameterError(
                'kind: "studentized" needs the standard error of every resample, which '
                'there is for target "items" or "raters" alone'
            )
        (error,) = units.standard_errors(units.freq[None].astype(np.float64))
        return replace(rule, error=float(error))
    return rule


def _resamples(
    units: SamplingUnits | CrossedUnits,
    rule: EndpointRule,
    exact: _Exact,
    budget: DrawBudget,
    rng: np.random.Generator | int | None,
) -> tuple[Resamples, int | None]:
    """Take all resamples, or draw some and return the seed that repeats them."""
    statistic = None
    if rule.kind == "studentized" and isinstance(units, SamplingUnits):
        statistic = partial(units.studentized, value=rule.value, error=rule.error)
    if exact is not False:
        resamples = all_resamples(units, statistic, insist=exact is True)
        if resamples is not None:
            return resamples, None
    generator, seed = recorded_generator(rng)
    return draw_resamples(units, statistic, rule, budget, generator), seed


def _infinite_ratios(resamples: Resamples) -> tuple[str, ...]:
    """Return a note of resamples that cannot be studentized, if there are any."""
    share = float(resamples.weights[np.isinf(resamples.values)].sum())
    if not share:
        return ()
    return (
        f"resamples of probability {share:.2g} have a standard error of 0: their "
        "studentized values are infinite",
    )
