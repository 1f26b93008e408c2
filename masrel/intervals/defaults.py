"""Which interval answers a question at its size, by the study of coverage in the docs.

Where few items, or no disagreement, leave nothing to resample, Fleiss' kappa and what
estimates the same fall back on the Dirichlet-multinomial posterior, and other
coefficients of two raters on that of their table.
"""

import dataclasses
import math
from functools import cached_property

import numpy as np
from scipy.special import expit

from masrel.agreement.counting import item_counts
from masrel.estimates import Distribution, Interval
from masrel.intervals.case import Case, student_t
from masrel.intervals.dirichlet.prior import Prior
from masrel.intervals.dirichlet.rho import ExactPosterior, prior_notes
from masrel.intervals.jackknife import around_estimate
from masrel.intervals.spread import Spread, excess_of_raters, spread
from masrel.intervals.table.interval import speaks_of, table_interval
from masrel.intervals.transforms import around

__all__ = ["Choice", "choose"]

_FEW = 10  # items, and raters, below which the posterior covers best
_SEVERAL = 30  # items, below which a jackknife alone ends too low
_DRAWS, _SEED = 4_000, 1  # of a table; always the same ones, so that it repeats
_ACCIDENT = (
    0.003  # of (1 - κ) / ratings: a variance below it is chance, not information
)


@dataclasses.dataclass(frozen=True)
class Choice:
    """A question whose interval is to be chosen.

    Attributes
    ----------
    case : Case
        The question.
    modelled : bool
        Whether the Dirichlet-multinomial model speaks of the coefficient.
    """

    case: Case
    modelled: bool

    @property
    def small(self) -> bool:
        """Whether items and raters are both few."""
        return self.case.n_items < _FEW and self.n_raters < _FEW

    @cached_property
    def tabular(self) -> bool:
        """Whether the table of two raters speaks of the coefficient instead."""
        return (
            not self.modelled and self.case.target == "items" and speaks_of(self.case)
        )

    @property
    def n_raters(self) -> int:
        """Raters, also without ratings."""
        return int(self.case.coded.codes.shape[1])

    @cached_property
    def per_item(self) -> float:
        """Ratings of an item, on average."""
        given = (self.case.patterns.codes >= 0).sum(axis=1)
        return float(self.case.times @ given) / self.case.n_items

    @property
    def least(self) -> float:
        """The lower end of the scale on which an interval is symmetric.

        That of an intraclass correlation of r raters is -1/(r - 1): its logit is
        Fisher's transformation, ln[(1 + (r - 1) κ) / (1 - κ)].
        """
        if self.modelled and self.per_item > 1.0:
            return -1.0 / (self.per_item - 1.0)
        return self.case.entry.lowest

    @cached_property
    def counts(self) -> "np.ndarray[tuple[int, ...], np.dtype[np.int64]]":
        """Raters per item and category."""
        return item_counts(self.case.coded)

    @cached_property
    def posterior(self) -> ExactPosterior:
        """The posterior under the default prior."""
        return ExactPosterior.of(self.counts, _PRIOR, self.case.level)

    def has_spread(self, variance: float) -> bool:
        """Whether a variance is more than an accident of few disagreements."""
        case = self.case
        least = 0.0
        if self.modelled:
            n_ratings = case.n_items * self.per_item
            least = _ACCIDENT * (1.0 - case.value) / n_ratings
        return variance > least


_PRIOR = Prior.of("uniform", 1.0)


def choose(choice: Choice) -> Interval:
    """Compute the interval that covers best.

    Parameters
    ----------
    choice : Choice
        The question.

    Returns
    -------
    Interval
        Its first note says what was chosen and why.
    """
    case = choice.case
    if case.entry.shape == "pairs":
        why = "items leave with the pairs of all their raters"
        return _because(case, around_estimate(case, spread(case)), why)
    if choice.modelled and choice.small and case.target == "items":
        why = f"few items ({case.n_items}) and raters, where it covers best"
        return _because(case, _posterior(choice, 0.0), why)
    if choice.tabular and case.n_items < _FEW:
        why = f"few items ({case.n_items}), where it covers best"
        return _because(case, _table(choice), why)
    found = spread(case)
    if not choice.has_spread(found.variance):
        if choice.tabular:
            why = "leaving items out says nothing, so that a model must"
            return _because(case, _table(choice), why)
        if not choice.modelled:
            why = "the spread of the units left out"
            return _because(case, around_estimate(case, found), why)
        why = "the ratings hardly disagree, so that a model must say what that can hide"
        return _because(case, _one_sided(choice), why)
    if case.target == "raters":
        why = "raters left out, one at a time"
        return _because(case, around_estimate(case, found), why)
    if case.target == "items":
        half = student_t(case.level, case.n_items - 1) * math.sqrt(found.variance)
        words = f"item jackknife, t({case.n_items - 1}) on the logit"
        why = "items left out, on a scale without ends"
        interval = _on_logit(choice, found, half, words)
        if choice.modelled and case.n_items < _SEVERAL:
            interval = _lifted(interval, choice.posterior.high)
        return _because(case, interval, why)
    return _both(choice, found)


def _both(choice: Choice, found: Spread) -> Interval:
    case = choice.case
    excess = student_t(case.level, choice.n_raters - 1) ** 2 * excess_of_raters(case)
    if choice.modelled and choice.small:
        why = "few items and raters; raters add what they differ by"
        return _because(case, _posterior(choice, excess), why)
    items = spread(dataclasses.replace(case, target="items")).variance
    half = math.sqrt(student_t(case.level, case.n_items - 1) ** 2 * items + excess)
    words = "two-way jackknife, t on the logit"
    why = "items left out, and what raters differ by beyond single ratings"
    return _because(case, _on_logit(choice, found, half, words), why)


def _on_logit(choice: Choice, found: Spread, half: float, words: str) -> Interval:
    case = choice.case
    low, high = around(case.value, half, "logit", choice.least)
    if math.isnan(low):  # at the least value there is
        low, high = around(case.value, half, "none", choice.least)
    return case.closed(low, high, method=words, unit=case.target, notes=found.notes)


def _lifted(interval: Interval, above: float) -> Interval:
    # κ̂ of few items is skewed: low where its error is low, too. The posterior knows,
    # but trusts many raters too much where κ is low: halfway to it covers with either.
    if not above > interval.high:
        return interval
    note = (
        f"the upper end, {interval.high:.3f}, is lifted halfway to that of the "
        f"Dirichlet-multinomial posterior, {above:.3f}: with few items an estimate "
        "that is low by chance has a low error, too"
    )
    high = 0.5 * (interval.high + above)
    return dataclasses.replace(interval, high=high, notes=(*interval.notes, note))


def _posterior(choice: Choice, excess: float) -> Interval:
    # the central interval, wider by what raters add, and widened to the estimate
    case, found = choice.case, choice.posterior
    if not case.value < 1.0:  # perfect, or undefined: one category
        return _one_sided(choice)
    middle = float(expit(found.logit.quantile(0.5)))
    low = middle - math.hypot(middle - found.low, math.sqrt(excess))
    high = middle + math.hypot(found.high - middle, math.sqrt(excess))
    method = "Dirichlet-multinomial posterior, exact"
    if excess:
        method += ", and the spread of raters"
    notes = prior_notes(choice.counts, _PRIOR, case.level, found.low, found.high)
    if not low <= case.value <= high:
        notes += ("widened to the estimate, which lies outside the posterior's",)
    interval = case.closed(
        min(low, case.value), max(high, case.value), method=method, unit=None
    )
    return dataclasses.replace(
        interval,
        kind="confidence" if excess else "credible",
        notes=(*interval.notes, *notes),
        distribution=_distribution(found),
    )


def _one_sided(choice: Choice) -> Interval:
    case, share = choice.case, 1.0 - choice.case.level
    low = float(expit(choice.posterior.logit.quantile(share)))
    others = [
        (float(expit(other.logit.quantile(share))), prior.words)
        for prior in _PRIOR.others(choice.counts.shape[1])
        for other in [ExactPosterior.of(choice.counts, prior, case.level)]
    ]
    there, words = max(others, key=lambda found: abs(found[0] - low))
    note = (
        f"the bound rests on the prior, too: {low:.3f} with {_PRIOR.words}, but "
        f"{there:.3f} with {words}"
    )
    return Interval(
        low=low,
        high=1.0,
        level=case.level,
        kind="credible",
        method="Dirichlet-multinomial posterior, one-sided",
        target=case.target,
        notes=(note,),
        distribution=_distribution(choice.posterior),
    )


def _table(choice: Choice) -> Interval:
    # one-sided where nothing disagrees, and holding the estimate elsewhere
    case = choice.case
    perfect = not case.value < 1.0
    found = table_interval(case, None, n_draws=_DRAWS, rng=_SEED, one_sided=perfect)
    if perfect or found.low <= case.value <= found.high:
        return found
    note = "widened to the estimate, which lies outside the posterior's"
    return dataclasses.replace(
        found,
        low=min(found.low, case.value),
        high=max(found.high, case.value),
        notes=(*found.notes, note),
    )


def _distribution(found: ExactPosterior) -> Distribution:
    return found.distribution(f"posterior of ρ, prior {_PRIOR.words}")


def _because(case: Case, interval: Interval, why: str) -> Interval:
    note = f"chosen for other {_OTHERS[case.target]}: {why}"
    return dataclasses.replace(
        interval, target=case.target, notes=(note, *interval.notes)
    )


_OTHERS = {"items": "items", "raters": "raters", "both": "items and raters"}
