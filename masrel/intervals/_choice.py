"""Which interval answers a question at its size, by the study of coverage in the docs.

Where few items, or no disagreement, leave nothing to resample, Fleiss' kappa and what
estimates the same fall back on the Dirichlet-multinomial posterior, and other
coefficients of two raters on that of their table.
"""

import math
from dataclasses import replace

import numpy as np

from masrel.estimates import Interval
from masrel.intervals._problem import IntervalProblem
from masrel.intervals._rho import (
    DEFAULT_PRIOR,
    RhoPosterior,
    default_rho_interval,
    lower_bound_of_rho,
)
from masrel.intervals._two_raters import applies_to, default_table_interval
from masrel.intervals.jackknife import (
    _interval_around_estimate,
    _jackknife_variance,
    _JackknifeVariance,
    _variance_of_cells,
)

_FEW = 10  # items, and raters, below which a posterior covers best
_SEVERAL = 30  # items, below which a jackknife alone ends too low
_ACCIDENT = 0.003  # of (1 - κ) / ratings: a variance below it is no information


def choose_interval(
    problem: IntervalProblem, *, modelled: bool
) -> tuple[Interval, str]:
    """Compute the interval that covers best, and say what it is and why."""
    # modelled: whether the Dirichlet-multinomial model answers for the coefficient
    # Items and raters are counted that have a pair of ratings.
    target, n_items = problem.target, problem.n_paired_items
    n_raters = problem.n_paired_raters
    if problem.entry.shape == "pairs":
        why = "items leave with the pairs of all their raters"
        return _interval_around_estimate(problem, _jackknife_variance(problem)), why
    if n_items == 0:
        why = "no item has ratings of two raters"
        return _interval_around_estimate(problem, _jackknife_variance(problem)), why
    if target == "both":
        return _other_items_and_raters(problem, modelled)
    is_small = modelled and n_items < _FEW and n_raters < _FEW
    if target == "items" and is_small:
        why = f"few items ({n_items}) and raters, where it covers best"
        return default_rho_interval(problem), why
    of_two = target == "items" and problem.n_raters == 2
    tabular = of_two and not modelled and applies_to(problem)
    if tabular and n_items < _FEW:
        why = f"few items ({n_items}), where it covers best"
        return default_table_interval(problem), why
    jackknifed = _jackknife_variance(problem)
    sizes = (problem.patterns.codes >= 0).sum(axis=1)
    n_ratings = int(problem.freq @ np.where(sizes > 1, sizes, 0))
    # an accident of few disagreements gives as much
    accident = _ACCIDENT * (1.0 - problem.value) / n_ratings if modelled else 0.0
    if not jackknifed.variance > accident:
        return _without_spread(problem, modelled, tabular, jackknifed)
    if target == "raters":
        why = "raters left out, one at a time"
        return _interval_around_estimate(problem, jackknifed), why
    lowest, per_item = problem.entry.lowest, n_ratings / n_items
    if modelled and per_item > 1.0:
        # An intraclass correlation of r raters is at least -1/(r - 1): its logit is
        # Fisher's transformation, ln[(1 + (r - 1) κ) / (1 - κ)].
        lowest = -1.0 / (per_item - 1.0)
    interval = problem.around(
        problem.value,
        problem.student_t(jackknifed.df) * math.sqrt(jackknifed.variance),
        lowest=lowest,
        method=f"item jackknife, t({jackknifed.df:g}) on the logit",
        unit="items",
        notes=jackknifed.notes,
    )
    if modelled and n_items < _SEVERAL:
        interval = _lift(problem, interval)
    return interval, "items left out, on a scale without ends"


def _without_spread(
    problem: IntervalProblem,
    modelled: bool,
    tabular: bool,
    jackknifed: _JackknifeVariance,
) -> tuple[Interval, str]:
    if tabular:
        why = "leaving items out says nothing, so that a model must"
        return default_table_interval(problem), why
    if modelled:
        why = "the ratings hardly disagree, so that a model must say what that can hide"
        return lower_bound_of_rho(problem), why
    why = "the spread of the units left out"
    return _interval_around_estimate(problem, jackknifed), why


def _lift(problem: IntervalProblem, interval: Interval) -> Interval:
    # An estimate of few items is skewed: low where its error is low, too. The posterior
    # knows, but trusts many raters too much where κ is low; halfway covers with either.
    counts = problem.item_counts()
    high = RhoPosterior.of(counts, DEFAULT_PRIOR, problem.level).high
    if not high > interval.high:
        return interval
    note = (
        f"the upper end, {interval.high:.3f}, is lifted halfway to that of the "
        f"Dirichlet-multinomial posterior, {high:.3f}: with few items an estimate "
        "that is low by chance has a low error, too"
    )
    halfway = 0.5 * (interval.high + high)
    return replace(interval, high=halfway, notes=(*interval.notes, note))


def _other_items_and_raters(
    problem: IntervalProblem, modelled: bool
) -> tuple[Interval, str]:
    # Either end is as far from the estimate as other items alone, and as other raters
    # alone, would put it: these distances squared and added, less what both hold of the
    # disagreement of a rater on an item, which is never taken as more than either has.
    # So the variance is below neither; nor is an end inside either interval. With the
    # fewer degrees of freedom of the two, in both, the answer is no surer than either.
    df = min(problem.n_paired_items, problem.n_paired_raters) - 1
    common = _variance_of_cells(problem)
    # of one item, nothing is known to be in both
    common = problem.student_t(df) ** 2 * common if df > 0 else 0.0
    items, raters = (
        choose_interval(replace(problem, target=of, max_df=df), modelled=modelled)[0]
        for of in ("items", "raters")
    )
    why = "what items left out and raters left out move"
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
            f"{of}: {note}"
            for of, part in (("items", items), ("raters", raters))
            for note in part.notes
        ],
    )
    return interval, why
