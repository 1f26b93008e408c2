"""An estimate with the interval that its question and its size call for."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Literal, NoReturn, TypedDict, get_args

import numpy as np

from masrel.agreement import Coefficient, CountedRatings, Label
from masrel.errors import ParameterError
from masrel.estimates import Estimate, Interval, Target
from masrel.intervals._clusters import clustered_error, clusters_of
from masrel.intervals._problem import (
    NO_SUMS,
    Statistic,
    find_entry,
    pose_problem,
)
from masrel.intervals.analytic import analytic
from masrel.intervals.bootstrap import bootstrap
from masrel.intervals.jackknife import jackknife
from masrel.intervals.posterior import posterior

if TYPE_CHECKING:
    from masrel.agreement import Metric, WeightsLike

_Method = Literal["auto", "analytic", "jackknife", "bootstrap", "posterior"]
"""Kinds of intervals; "auto" chooses one by target and size."""

_TOO_MANY = "too many different grades to leave items out one by one"
_MANY_RATERS = 10  # among whom careless ones are seldom missing
_CARELESS = (
    "careless raters are not covered, of whom so few may include none: where one rater "
    "in five is careless, 95 % intervals of 5 raters held in about 70 % of studies"
)

_OTHERS = {"items": "items", "raters": "raters", "both": "items and raters"}


def estimate(
    coefficient: Statistic,
    ratings: object,
    *,
    target: Target,
    method: _Method = "auto",
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    metric: "Metric | None" = None,
    level: float = 0.95,
    n_resamples: int = 10_000,
    rng: np.random.Generator | int | None = None,
    clusters: object = None,
) -> Estimate:
    """Estimate a coefficient with an interval that answers a stated question.

    Parameters
    ----------
    coefficient : str or callable
        Name of a coefficient, or its public function.
    ratings : nested sequence, array_like or DataFrame
        What the coefficient takes.
    target : {"items", "raters", "both"}
        What a new study would draw anew. There is no default.
    method : {"auto", "analytic", "jackknife", "bootstrap", "posterior"}, optional
        Kind of interval; "auto" chooses by target and size, and a note says what and
        why. The functions of the same names have more options.
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
        Resamples of a bootstrap, where they are drawn.
    rng : Generator or int, optional
        Where randomness comes from, for methods that draw.
    clusters : sequence of labels, length n_items, optional
        The cluster of every item, such as the patient of a site: what a new study
        would draw anew, with `target` "items" and `method` "auto", "analytic" or
        "jackknife". Each item by itself when not given.

    Returns
    -------
    Estimate
        The coefficient with its interval; with clusters its standard error is of
        these, too.

    Raises
    ------
    ParameterError
        If an option is invalid, or the coefficient has no such interval.
    RatingsError
        If the ratings do not fit the coefficient.

    Warns
    -----
    SmallSampleWarning
        If the interval rests on too little.
    UndefinedStatisticWarning
        If the estimate or the interval is undefined.

    Examples
    --------
    >>> ratings = [["a", "a", "a"], ["a", "b", "a"], ["b", "b", "b"]] * 4
    >>> result = estimate("fleiss_kappa", ratings, target="items")
    >>> result.interval.method
    'item jackknife, t(11) on the logit'
    """
    if method not in get_args(_Method):
        raise ParameterError(
            f"method: needs one of {', '.join(get_args(_Method))}, got {method!r}"
        )
    entry = find_entry(coefficient, metric)
    if method == "auto" and entry.interval_target not in (None, target):
        _refuse_target(entry, target)
    if entry.formula is None:
        result = entry(ratings, categories=categories, weights=weights, level=level)
    else:
        is_counted = isinstance(ratings, CountedRatings)
        # coded once, for all that follows
        ratings = ratings if is_counted else entry.code(ratings, categories)
        result = entry(ratings, categories=categories, weights=weights)
        categories = None  # the ratings have them by now
    options = _Options(
        target=target, categories=categories, weights=weights, level=level
    )
    if clusters is not None:
        return _clustered(entry, ratings, result, method, clusters, options)
    if method == "auto" and entry.interval_target == target:
        return result
    if method == "auto":
        interval = _chosen(entry, ratings, options)
    elif method == "analytic":
        interval = analytic(entry, ratings, **options)
    elif method == "jackknife":
        interval = jackknife(entry, ratings, **options)
    elif method == "bootstrap":
        interval = bootstrap(
            entry, ratings, n_resamples=n_resamples, rng=rng, **options
        )
    else:
        interval = posterior(entry, ratings, rng=rng, **options)
    few = interval.target != "items" and result.n_raters < _MANY_RATERS
    notes = (*interval.notes, _CARELESS) if few else interval.notes
    return replace(result, interval=replace(interval, notes=notes))


def _clustered(
    entry: Coefficient,
    ratings: object,
    result: Estimate,
    method: _Method,
    clusters: object,
    options: "_Options",
) -> Estimate:
    """Return the estimate with clusters of items as the sample."""
    if method in ("bootstrap", "posterior"):
        raise ParameterError(
            f'clusters: needs method "auto", "analytic" or "jackknife", got "{method}"'
        )
    problem = pose_problem(entry, ratings, **options)
    codes = clusters_of(problem, clusters)
    if method == "analytic":
        interval = analytic(entry, ratings, clusters=codes, **options)
    elif method == "jackknife":
        interval = jackknife(entry, ratings, clusters=codes, **options)
    else:
        # imported here: the other methods load no scipy
        from masrel.intervals._choice import choose_of_clusters

        interval = choose_of_clusters(problem, codes)
        note = "chosen for other clusters of items: left out, on a scale without ends"
        interval = replace(interval, notes=(note, *interval.notes))
    error = result.standard_error
    if result.reason is None:
        error = clustered_error(problem, codes)
    return replace(result, standard_error=error, interval=interval)


def _chosen(entry: Coefficient, ratings: object, options: "_Options") -> Interval:
    from masrel.intervals._choice import choose_interval

    target = options["target"]
    problem = pose_problem(entry, ratings, delta=target == "items", **options)
    if problem.formula is NO_SUMS:
        interval, why = analytic(entry, ratings, **options), _TOO_MANY
    else:
        interval, why = choose_interval(problem, unweighted=problem.unweighted)
    note = f"chosen for other {_OTHERS[target]}: {why}"
    return replace(interval, target=target, notes=(note, *interval.notes))


def _refuse_target(entry: Coefficient, target: str) -> NoReturn:
    if target not in get_args(Target):
        raise ParameterError(
            f"target: needs one of {', '.join(get_args(Target))}, got {target!r}"
        )
    there_is = entry.interval_target
    raise ParameterError(
        f"target: the interval of {entry.title} generalises to other "
        f'{_OTHERS[str(there_is)]}, which is "{there_is}", and it has no other; got '
        f'"{target}"'
    )


class _Options(TypedDict):
    # what every method takes
    target: Target
    categories: Sequence[Label] | None
    weights: "WeightsLike"
    level: float
