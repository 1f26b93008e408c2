"""Which interval answers a question at its size, by the study of coverage in the docs.

Where few items, or no disagreement, leave nothing to resample, Fleiss' kappa and what
estimates the same fall back on the Dirichlet-multinomial posterior, and other
coefficients of two raters on that of their table.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

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
from masrel.intervals.analytic import _on_logit
from masrel.intervals.jackknife import (
    _excess_of_raters,
    _interval_around_estimate,
    _jackknife_variance,
    _JackknifeVariance,
)

_FEW = 10  # items, and raters, below which a posterior covers best
_SEVERAL = 30  # items, below which a jackknife alone ends too low
_ACCIDENT = 0.003  # of (1 - κ) / ratings: a variance below it is no information
_OTHERS = {"items": "items", "raters": "raters", "both": "items and raters"}


@dataclass(frozen=True)
class Choice:
    """A question whose interval is to be chosen, and what the rules look at."""

    problem: IntervalProblem
    modelled: bool  # whether the Dirichlet-multinomial model applies to the coefficient

    @property
    def is_small(self) -> bool:
        """Whether items and raters are both few."""
        return self.problem.n_items < _FEW and self.n_raters < _FEW

    @cached_property
    def tabular(self) -> bool:
        """Whether the table of two raters applies to the coefficient instead."""
        problem = self.problem
        return not self.modelled and problem.target == "items" and applies_to(problem)

    @property
    def n_raters(self) -> int:
        """Raters, also without ratings."""
        return int(self.problem.coded.codes.shape[1])

    @cached_property
    def ratings_per_item(self) -> float:
        """Ratings of an item, on average."""
        rated = (self.problem.patterns.codes >= 0).sum(axis=1)
        return float(self.problem.freq @ rated) / self.problem.n_items

    @cached_property
    def counts(self) -> NDArray[np.int64]:
        """Raters per item and category."""
        return item_counts(self.problem.coded)

    @cached_property
    def posterior(self) -> RhoPosterior:
        """The posterior under the default prior."""
        return RhoPosterior.of(self.counts, DEFAULT_PRIOR, self.problem.level)

    def has_spread(self, variance: float) -> bool:
        """Whether a variance is more than an accident of few disagreements."""
        accident = 0.0
        if self.modelled:
            n_ratings = self.problem.n_items * self.ratings_per_item
            accident = _ACCIDENT * (1.0 - self.problem.value) / n_ratings
        return variance > accident

    def on_logit(self, half: float, method: str, notes: tuple[str, ...]) -> Interval:
        """Return the interval that is symmetric on a scale without ends."""
        # An intraclass correlation of r raters is at least -1/(r - 1): its logit is
        # Fisher's transformation, ln[(1 + (r - 1) κ) / (1 - κ)].
        problem = self.problem
        lowest = problem.entry.lowest
        if self.modelled and self.ratings_per_item > 1.0:
            lowest = -1.0 / (self.ratings_per_item - 1.0)
        low, high = _on_logit(problem.value, half, lowest)
        if math.isnan(low):  # at the least value there is
            low, high = problem.value - half, problem.value + half
        return problem.confidence(
            low, high, method=method, unit=problem.target, notes=notes
        )


def choose_interval(problem: IntervalProblem, *, modelled: bool) -> Interval:
    """Compute the interval that covers best, with a note of what it is and why."""
    interval, why = _choose(Choice(problem, modelled))
    note = f"chosen for other {_OTHERS[problem.target]}: {why}"
    return replace(interval, target=problem.target, notes=(note, *interval.notes))


def _choose(choice: Choice) -> tuple[Interval, str]:
    problem = choice.problem
    if problem.entry.shape == "pairs":
        why = "items leave with the pairs of all their raters"
        return _interval_around_estimate(problem, _jackknife_variance(problem)), why
    if choice.modelled and choice.is_small and problem.target == "items":
        why = f"few items ({problem.n_items}) and raters, where it covers best"
        return default_rho_interval(problem, choice.counts, choice.posterior), why
    if choice.tabular and problem.n_items < _FEW:
        why = f"few items ({problem.n_items}), where it covers best"
        return default_table_interval(problem), why
    jackknifed = _jackknife_variance(problem)
    if not choice.has_spread(jackknifed.variance):
        return _without_spread(choice, jackknifed)
    if problem.target == "raters":
        why = "raters left out, one at a time"
        return _interval_around_estimate(problem, jackknifed), why
    if problem.target == "items":
        return _other_items(choice, jackknifed)
    return _other_items_and_raters(choice, jackknifed)


def _without_spread(
    choice: Choice, jackknifed: _JackknifeVariance
) -> tuple[Interval, str]:
    if choice.tabular:
        why = "leaving items out says nothing, so that a model must"
        return default_table_interval(choice.problem), why
    if choice.modelled:
        why = "the ratings hardly disagree, so that a model must say what that can hide"
        return lower_bound_of_rho(choice.problem, choice.counts, choice.posterior), why
    why = "the spread of the units left out"
    return _interval_around_estimate(choice.problem, jackknifed), why


def _other_items(
    choice: Choice, jackknifed: _JackknifeVariance
) -> tuple[Interval, str]:
    df = choice.problem.n_items - 1
    half = choice.problem.student_t(df) * math.sqrt(jackknifed.variance)
    method = f"item jackknife, t({df}) on the logit"
    interval = choice.on_logit(half, method, jackknifed.notes)
    if choice.modelled and choice.problem.n_items < _SEVERAL:
        interval = _lift(interval, choice.posterior.high)
    return interval, "items left out, on a scale without ends"


def _lift(interval: Interval, high: float) -> Interval:
    # An estimate of few items is skewed: low where its error is low, too. The posterior
    # knows, but trusts many raters too much where κ is low; halfway covers with either.
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
    choice: Choice, jackknifed: _JackknifeVariance
) -> tuple[Interval, str]:
    problem = choice.problem
    t_raters = problem.student_t(choice.n_raters - 1)
    excess = t_raters**2 * _excess_of_raters(problem)
    if choice.modelled and choice.is_small:
        why = "few items and raters; raters add what they differ by"
        interval = default_rho_interval(
            problem, choice.counts, choice.posterior, excess
        )
        return interval, why
    items = _jackknife_variance(replace(problem, target="items")).variance
    half = math.sqrt(problem.student_t(problem.n_items - 1) ** 2 * items + excess)
    method = "two-way jackknife, t on the logit"
    why = "items left out, and what raters differ by beyond single ratings"
    return choice.on_logit(half, method, jackknifed.notes), why
