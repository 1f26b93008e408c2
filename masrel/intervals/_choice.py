"""Which interval answers a question at its size, by the study of coverage in the docs.

Where few items, or no disagreement, leave nothing to resample, Fleiss' kappa and what
estimates the same fall back on the Dirichlet-multinomial posterior, and other
coefficients of two raters on that of their table.
"""

import math
from dataclasses import replace

from masrel.agreement._counts import item_counts
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
    _excess_of_raters,
    _interval_around_estimate,
    _jackknife_variance,
    _JackknifeVariance,
)

_FEW = 10  # items, and raters, below which a posterior covers best
_SEVERAL = 30  # items, below which a jackknife alone ends too low
_ACCIDENT = 0.003  # of (1 - κ) / ratings: a variance below it is no information


def choose_interval(
    problem: IntervalProblem, *, modelled: bool
) -> tuple[Interval, str]:
    """Compute the interval that covers best, and say what it is and why."""
    # modelled: whether the Dirichlet-multinomial model answers for the coefficient
    target, n_items = problem.target, problem.n_items
    n_raters = problem.coded.codes.shape[1]
    if problem.entry.shape == "pairs":
        why = "items leave with the pairs of all their raters"
        return _interval_around_estimate(problem, _jackknife_variance(problem)), why
    if n_items == 0:
        why = "nobody rated anything"
        return _interval_around_estimate(problem, _jackknife_variance(problem)), why
    is_small = modelled and n_items < _FEW and n_raters < _FEW
    if target == "items" and is_small:
        why = f"few items ({n_items}) and raters, where it covers best"
        return default_rho_interval(problem), why
    of_two = target == "items" and n_raters == 2
    tabular = of_two and not modelled and applies_to(problem)
    if tabular and n_items < _FEW:
        why = f"few items ({n_items}), where it covers best"
        return default_table_interval(problem), why
    jackknifed = _jackknife_variance(problem)
    n_ratings = int(problem.freq @ (problem.patterns.codes >= 0).sum(axis=1))
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
    if target == "both":
        return _other_items_and_raters(problem, is_small, lowest, jackknifed.notes)
    interval = problem.around(
        problem.value,
        problem.student_t(n_items - 1) * math.sqrt(jackknifed.variance),
        lowest=lowest,
        method=f"item jackknife, t({n_items - 1}) on the logit",
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
    counts = item_counts(problem.coded)
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
    problem: IntervalProblem,
    is_small: bool,
    lowest: float,
    notes: tuple[str, ...],
) -> tuple[Interval, str]:
    t_raters = problem.student_t(problem.coded.codes.shape[1] - 1)
    excess = t_raters**2 * _excess_of_raters(problem)
    if is_small:
        why = "few items and raters; raters add what they differ by"
        return default_rho_interval(problem, excess), why
    items = _jackknife_variance(replace(problem, target="items")).variance
    interval = problem.around(
        problem.value,
        math.sqrt(problem.student_t(problem.n_items - 1) ** 2 * items + excess),
        lowest=lowest,
        method="two-way jackknife, t on the logit",
        unit="both",
        notes=notes,
    )
    return interval, "items left out, and what raters differ by beyond single ratings"
