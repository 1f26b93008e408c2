"""An estimate with the interval chosen for its target and its size.

The choice follows the study of coverage in the docs.

Other items. A posterior covers best where there are

- few: less than 10 items, and less than 10 raters;
- rare categories: less than 30 items, and less than half of all, have a rating outside
  the commonest category;
- no spread: leaving out any item changes nothing, or next to nothing.

It is that of the Dirichlet-multinomial model for Fleiss' kappa, Scott's pi and
Krippendorff's alpha, and for every unweighted coefficient where categories are rare,
since chance agreement then hardly depends on who the raters are, or where few items are
graded by more than two, which say more of raters alike than of each pattern. For others
it is that of the table of two raters or of the patterns of any number, as it is for all
above 2000 items. Elsewhere the item jackknife on a logit, its upper end lifted below 30
items.

Other raters. The rater jackknife; without spread the posterior, for those of the model.

Both. What the two of them say, joined.

Other clusters of items. The cluster jackknife on a logit; that it may cover less where
categories are rare is noted.

Items and raters are counted that have a pair of ratings.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from typing import Literal, get_args

import numpy as np

from masrel._input import check_option, refuse
from masrel.agreement import CountedRatings, Label, Metric, WeightsLike
from masrel.agreement._engine import NO_SPREAD, ONE_PAIR, Integers, student_t
from masrel.estimates import (
    _POPULATIONS,
    Estimate,
    Interval,
    IntervalMethod,
    Target,
    _Caution,
    _LongNote,
    _population,
)
from masrel.intervals._question import (
    IntervalProblem,
    Statistic,
    cluster_codes,
    find_entry,
    pose_problem,
    singular,
    warn_small,
)
from masrel.intervals.analytic import _clustered_error, analytic
from masrel.intervals.bootstrap import bootstrap
from masrel.intervals.jackknife import _leave_out, _variance_of_cells, jackknife
from masrel.intervals.posterior import posterior

# Raters alike, what `posterior` takes unless told, or each rater as he or she is
_Model = Literal["alike", "usual", "patterns"]


@dataclass(frozen=True, slots=True)
class _Rule:
    """A rule that chooses an interval."""

    name: str
    many_raters: float  # of whom a model of raters alike is too sure

    def models(self, problem: IntervalProblem, *, few: bool) -> tuple[_Model, ...]:
        """Return whose posterior covers best, few items or rare categories."""
        n, r = problem.n_paired_items, problem.n_paired_raters
        if few:  # two raters have a table of their own
            return ("alike",) if r > 2 else ("usual",)
        if r < self.many_raters or not problem.unweighted:
            return ("alike",)
        # few items do not tell patterns, and the two are sure of different things
        return ("patterns",) if n >= _SEVERAL else ("alike", "patterns")


# Rules by name, the newest last
_RULES = {
    "auto-2026.1": _Rule("auto-2026.1", math.inf),
    "auto-2026.2": _Rule("auto-2026.2", 4),
}

_NEWEST = list(_RULES.values())[-1]

_FEW = 10  # items, and raters, below which a posterior covers best
_SEVERAL = 30  # items, below which a jackknife alone ends too low
_ACCIDENT = 0.003  # of (1 - κ) / ratings: a variance below it is no information
_OUTSIDE = "items with a rating outside the commonest category"
_DRAWS, _TABLE_DRAWS, _SEED = 2_000, 4_000, 1  # always the same, so that they repeat
_MANY = 2_000  # items, above which the model's polynomials take long
_MANY_RATERS = 10  # among whom careless ones are seldom missing
_CARELESS = _Caution(
    "this interval makes no allowance for careless raters when the sample has none; "
    "in simulations with one careless rater in five, 95 % intervals from 5 raters "
    "held the truth in about 70 % of studies"
)


def estimate(
    coefficient: Statistic,
    ratings: object,
    *,
    target: Target,
    method: IntervalMethod = "auto",
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    metric: Metric | None = None,
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
        Population that the interval is about: other items, other raters, or both.
        There is no default.
    method : {"auto", "analytic", "jackknife", "bootstrap", "posterior"}, optional
        Kind of interval; "auto" chooses by target and size. Each rule has a name, such
        as "auto-2026.1", with which it can be used after a newer one exists: the
        interval's `method` names it, and a note says what was chosen and why. The
        functions of the same names have more options.
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
        Source of randomness, for methods that draw.
    clusters : sequence of labels, length n_items, optional
        The cluster of every item, such as the patient of a site: the interval is then
        about other clusters, with `target` "items" and any `method` but "posterior".
        By default each item is independent.

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
    'item jackknife, t(11) on the logit, chosen by auto-2026.2'
    """
    check_option("method", method, get_args(IntervalMethod))
    rule = _NEWEST if method == "auto" else _RULES.get(method)
    entry = find_entry(coefficient, metric)
    check_option("target", target, get_args(Target))
    there_is = entry.interval_target or target
    by_formula = method == "analytic" and there_is == target
    is_own = (
        entry.has_interval and clusters is None and (rule is not None or by_formula)
    )
    refuse(
        (
            is_own and there_is not in (target, "both"),
            f"target: {entry.title} generalises to other {_POPULATIONS[there_is]}: "
            f'needs target "{there_is}", got "{target}"',
        ),
        (
            clusters is not None and method == "posterior",
            'clusters: needs a method other than "posterior"',
        ),
    )
    if is_own and entry.takes_interval:
        kind = "F" if rule is None else rule.name
        entry = replace(entry, function=partial(entry.function, interval=kind))
    is_counted = isinstance(ratings, CountedRatings)
    if entry.formula is not None and not (entry.has_interval or is_counted):
        # coded once, for all that follows
        ratings = entry.code(ratings, categories)
        categories = None  # the ratings have them by now
    result = entry(ratings, categories=categories, weights=weights, level=level)
    if is_own:
        by_rule = rule.name if rule is not None and entry.takes_interval else ""
        return _with_own_target(result, target, by_rule)
    ask = partial(
        pose_problem,
        target=target,
        categories=categories,
        weights=weights,
        level=level,
    )
    if clusters is not None:
        problem = ask(entry, ratings)
        clusters = cluster_codes(problem, clusters)
        if result.reason is None:
            error, _ = _clustered_error(problem, clusters)
            result = replace(result, standard_error=error)
    if rule is not None:
        interval, why = _choose_interval(ask(entry, ratings), rule, clusters)
        by_rule = f"{interval.method}, chosen by {rule.name}"
        interval = replace(interval, target=target, method=by_rule)
        chosen = _LongNote(f"method chosen for {_population(interval)}: {why}")
        interval = replace(interval, notes=(chosen, *interval.notes))
    else:
        function = {
            "analytic": partial(analytic, clusters=clusters),
            "jackknife": partial(jackknife, clusters=clusters),
            "bootstrap": partial(
                bootstrap, n_resamples=n_resamples, rng=rng, clusters=clusters
            ),
            "posterior": partial(posterior, rng=rng),
        }[method]
        interval = function(entry, ratings, **ask.keywords)
    if interval.target != "items" and result.n_raters < _MANY_RATERS:
        interval = replace(interval, notes=(*interval.notes, _CARELESS))
    return replace(result, interval=interval)


def _with_own_target(result: Estimate, target: Target, rule: str) -> Estimate:
    """Say of the interval that comes with it who chose it, and what else it is for."""
    interval = result.interval
    if interval is not None and rule:
        interval = replace(interval, method=f"{interval.method}, chosen by {rule}")
        result = replace(result, interval=interval)
    if interval is None or interval.target == target:
        return result
    note = _Caution(
        f"the only interval available is for other {_POPULATIONS[interval.target]}, "
        f"so it is wider than needed for other {_POPULATIONS[target]}"
    )
    return replace(result, interval=replace(interval, notes=(*interval.notes, note)))


def _by_error(problem: IntervalProblem) -> Interval:
    """Compute the interval by the standard error, which needs no item left out."""
    error = problem.item_features.error(problem.slopes(problem.sums), problem.freq)
    df, method = problem.n_paired_items - 1, "delta method, t(n-1)"
    if np.isnan(problem.value):
        reason = "the estimate itself is undefined"
        return problem.undefined(reason, method=method, unit=None)
    if error > 0.0:
        return problem.by_t(error, df, method=method, unit=None)
    return problem.undefined(
        ONE_PAIR if df < 1 else NO_SPREAD, method=method, unit=None
    )


def _choose_interval(
    problem: IntervalProblem, rule: _Rule = _NEWEST, clusters: Integers | None = None
) -> tuple[Interval, str]:
    """Compute the interval that covers best, and say what it is and why."""
    if clusters is not None:
        # no posterior knows of them
        left_out = _leave_out(problem, clusters).interval(lowest=problem.entry.lowest)
        outside, rare = _outside_commonest(problem)
        if left_out.reason is None and rare:
            notes = warn_small(outside, _SEVERAL, _OUTSIDE)
            left_out = replace(left_out, notes=(*notes, *left_out.notes))
        return left_out, "clusters are left out one at a time, on a logit scale"
    if problem.is_too_large and problem.target == "items":
        why = "there are too many different grades to leave items out one by one"
        return _by_error(problem), why
    if problem.entry.shape == "pairs":
        why = "an item is left out with the pairs of all its raters"
        return _leave_out(problem).interval(), why
    if problem.n_paired_items == 0:
        return _leave_out(problem).interval(), "no item has ratings of two raters"
    if problem.target == "both":
        return _other_items_and_raters(problem, rule)
    few = problem.n_paired_items < _FEW and problem.n_paired_raters < _FEW
    outside, rare = _outside_commonest(problem)
    interval = None
    if (few or rare) and problem.target != "raters":
        models = rule.models(problem, few=few)
        interval = reduce(_joined, (_posterior(problem, model) for model in models))
    if interval is None:
        return _jackknife_with_spread(problem)
    if few:
        return (
            interval,
            f"it has the best coverage with few items ({problem.n_paired_items})",
        )
    # below so many no method covers everywhere
    notes = warn_small(outside, 5 if problem.unweighted else _SEVERAL, _OUTSIDE)
    what = singular(_OUTSIDE) if outside == 1 else _OUTSIDE
    why = f"it has the best coverage when categories are rare ({outside} {what})"
    return replace(interval, notes=(*notes, *interval.notes)), why


def _jackknife_with_spread(problem: IntervalProblem) -> tuple[Interval, str]:
    """Leave items out, or raters, unless that says nothing."""
    n_items, target = problem.n_paired_items, problem.target
    modelled = problem.is_rho
    sizes = (problem.codes >= 0).sum(axis=1)
    n_ratings = int(problem.freq @ np.where(sizes > 1, sizes, 0))
    left_out = _leave_out(problem)
    # an accident of few disagreements gives as much
    accident = _ACCIDENT * (1.0 - problem.value) / n_ratings if modelled else 0.0
    if not left_out.variance > accident:
        interval = None
        if modelled or target == "items":
            interval = _posterior(problem, "usual")
        if interval is None:
            return left_out.interval(), "it uses the spread of the units left out"
        return interval, "leaving any out changes almost nothing, so a model is needed"
    if target == "raters":
        return left_out.interval(), "raters are left out one at a time"
    lowest, per_item = problem.entry.lowest, n_ratings / n_items
    if modelled and per_item > 1.0:
        # An intraclass correlation of r raters is at least -1/(r - 1): its logit is
        # Fisher's transformation, ln[(1 + (r - 1) κ) / (1 - κ)].
        lowest = -1.0 / (per_item - 1.0)
    interval = left_out.interval(lowest=lowest)
    if modelled and n_items < _SEVERAL:
        interval = _lift(problem, interval)
    return interval, "items are left out one at a time, on a logit scale"


def _outside_commonest(problem: IntervalProblem) -> tuple[int, bool]:
    """Count items not all of one category, and say whether they are few."""
    codes = problem.codes  # (n_rows, n_raters)
    rated = codes >= 0
    freq = np.broadcast_to(problem.freq[:, None], codes.shape)
    commonest = np.bincount(codes[rated], weights=freq[rated], minlength=1).argmax()
    is_outside = (rated & (codes != commonest)).any(axis=1)
    outside = int(problem.freq @ (is_outside & (rated.sum(axis=1) >= 2)))
    return outside, outside < _SEVERAL and 2 * outside < problem.n_paired_items


def _posterior(problem: IntervalProblem, model: _Model) -> Interval | None:
    """Compute the posterior, one-sided where the estimate is perfect or undefined."""
    # imported here: they load scipy
    from masrel.intervals._dirichlet import (
        alike_interval,
        no_posterior,
        patterns_interval,
    )
    from masrel.intervals._rho import DEFAULT_PRIOR, extended, rho_interval
    from masrel.intervals._two_raters import table_interval, table_refusal

    if no_posterior(problem):
        return None
    small = problem.n_paired_items <= _MANY
    alike = model == "alike" and problem.unweighted and small
    is_rho = model == "usual" and problem.is_rho and small
    one_sided = not problem.value < 1.0
    if (alike and problem.entry.rho) or is_rho:
        interval = rho_interval(problem, DEFAULT_PRIOR, one_sided=one_sided)
    elif alike:
        interval = alike_interval(
            problem, DEFAULT_PRIOR, n_draws=_DRAWS, rng=_SEED, one_sided=one_sided
        )
    elif small and not table_refusal(problem):
        interval = table_interval(
            problem, None, n_draws=_TABLE_DRAWS, rng=_SEED, one_sided=one_sided
        )
    else:
        interval = patterns_interval(
            problem, n_draws=_DRAWS, rng=_SEED, one_sided=one_sided
        )
    return interval if one_sided else extended(problem, interval)


def _joined(one: Interval | None, other: Interval | None) -> Interval | None:
    """Return an interval that holds two of one problem."""
    if one is None or other is None:
        return one
    return replace(
        other,
        low=min(one.low, other.low),
        high=max(one.high, other.high),
        method=f"{one.method}, joined with {other.method}",
        notes=tuple(dict.fromkeys((*one.notes, *other.notes))),
        prior=", or ".join(dict.fromkeys((one.prior, other.prior))),
        distribution=None,
    )


def _lift(problem: IntervalProblem, interval: Interval) -> Interval:
    # An estimate of few items is skewed: low where its error is low, too. The posterior
    # knows, but trusts many raters too much where κ is low; halfway covers with either.
    from masrel.intervals._rho import DEFAULT_PRIOR, METHOD, RhoPosterior

    posterior = RhoPosterior.of(problem.item_counts(), DEFAULT_PRIOR)
    (high,) = posterior.quantiles(0.5 + 0.5 * problem.level)
    if not high > interval.high:
        return interval
    note = (
        f"the upper limit is halfway between the jackknife's, {interval.high:.3f}, "
        f"and the Dirichlet-multinomial posterior's, {high:.3f}: with few items, an "
        "estimate that is low by chance has too small an error"
    )
    return replace(
        interval,
        high=0.5 * (interval.high + high),
        method=f"{interval.method}, upper end lifted halfway to that of a {METHOD}",
        notes=(*interval.notes, note),
        prior=posterior.prior.description,
    )


def _other_items_and_raters(
    problem: IntervalProblem, rule: _Rule
) -> tuple[Interval, str]:
    # Either end is as far from the estimate as other items alone, and as other raters
    # alone, would put it: these distances squared and added, less what both hold of the
    # disagreement of a rater on an item, which is never taken as more than either has.
    # So the variance is below neither; nor is an end inside either interval. With the
    # fewer degrees of freedom of the two, in both, the answer is no surer than either.
    df = min(problem.n_paired_items, problem.n_paired_raters) - 1
    if df < 1:
        nothing = problem.undefined(
            "one item with two ratings does not show how items differ",
            method="items and raters left out",
            unit="both",
        )
        return nothing, "one item"
    common = student_t(problem.level, df) ** 2 * _variance_of_cells(problem)
    parts = (replace(problem, target=of, max_df=df) for of in ("items", "raters"))
    items, raters = (_choose_interval(of, rule)[0] for of in parts)
    why = "it combines the changes from leaving out items and from leaving out raters"
    for part in (items, raters):
        if part.reason is not None:
            return part, why
    if (items.low, items.high) == (raters.low, raters.high):
        return items, why  # nothing moves, and the same model must say what that hides
    ends = np.array([[items.low, items.high], [raters.low, raters.high]])
    of_items, of_raters = np.maximum((ends - problem.value) * (-1.0, 1.0), 0.0) ** 2
    both = np.minimum(of_items, of_raters)
    low, high = np.sqrt(of_items + of_raters - np.minimum(common, both)).tolist()
    interval = problem.confidence(
        problem.value - low,
        problem.value + high,
        method=f"{items.method}, and {raters.method}",
        unit="both",
        notes=[
            _LongNote.of(f"{of}: ", note)
            for of, part in (("items", items), ("raters", raters))
            for note in part.notes
        ],
    )
    return replace(interval, units_are="left out"), why
