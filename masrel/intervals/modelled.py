"""What a model says where few items, or no disagreement, leave nothing to resample."""

import dataclasses
import math
from typing import TYPE_CHECKING

from scipy.special import expit

from masrel.estimates import Distribution, Interval
from masrel.intervals.dirichlet.prior import Prior
from masrel.intervals.dirichlet.rho import ExactPosterior, prior_notes
from masrel.intervals.table.interval import table_interval

__all__ = ["lifted", "of_any_raters", "of_two_raters", "one_sided"]

if TYPE_CHECKING:
    from masrel.intervals._choice import Choice

PRIOR = Prior.of("uniform", 1.0)  # of the Dirichlet-multinomial model

_DRAWS, _SEED = 4_000, 1  # of a table; always the same ones, so that it repeats


def lifted(interval: Interval, above: float) -> Interval:
    """Move an upper end halfway to a higher one of the posterior."""
    # An estimate of few items is skewed: low where its error is low, too. The posterior
    # knows, but trusts many raters too much where κ is low; halfway covers with either.
    if not above > interval.high:
        return interval
    note = (
        f"the upper end, {interval.high:.3f}, is lifted halfway to that of the "
        f"Dirichlet-multinomial posterior, {above:.3f}: with few items an estimate "
        "that is low by chance has a low error, too"
    )
    high = 0.5 * (interval.high + above)
    return dataclasses.replace(interval, high=high, notes=(*interval.notes, note))


def of_any_raters(choice: "Choice", excess: float) -> Interval:
    """Compute the Dirichlet-multinomial posterior's interval, holding the estimate."""
    problem, found = choice.problem, choice.posterior
    if not problem.value < 1.0:  # perfect, or undefined: one category
        return one_sided(choice)
    low, high = found.low, found.high
    method = "Dirichlet-multinomial posterior, exact"
    if excess:
        method += ", and the spread of raters"
        middle = float(expit(found.logit.quantile(0.5)))
        low = middle - math.hypot(middle - low, math.sqrt(excess))
        high = middle + math.hypot(high - middle, math.sqrt(excess))
    notes = prior_notes(choice.counts, PRIOR, problem.level, found.low, found.high)
    if not low <= problem.value <= high:
        notes += ("widened to the estimate, which lies outside the posterior's",)
    interval = problem.confidence(
        min(low, problem.value), max(high, problem.value), method=method, unit=None
    )
    return dataclasses.replace(
        interval,
        kind="confidence" if excess else "credible",
        notes=(*interval.notes, *notes),
        distribution=_distribution(found),
    )


def one_sided(choice: "Choice") -> Interval:
    """Compute all that is above a lower end of the Dirichlet-multinomial posterior."""
    problem, share = choice.problem, 1.0 - choice.problem.level
    low = float(expit(choice.posterior.logit.quantile(share)))
    others = [
        (float(expit(other.logit.quantile(share))), prior.words)
        for prior in PRIOR.others(choice.counts.shape[1])
        for other in [ExactPosterior.of(choice.counts, prior, problem.level)]
    ]
    there, words = max(others, key=lambda found: abs(found[0] - low))
    note = (
        f"the bound rests on the prior, too: {low:.3f} with {PRIOR.words}, but "
        f"{there:.3f} with {words}"
    )
    return Interval(
        low=low,
        high=1.0,
        level=problem.level,
        kind="credible",
        method="Dirichlet-multinomial posterior, one-sided",
        target=problem.target,
        notes=(note,),
        distribution=_distribution(choice.posterior),
    )


def of_two_raters(choice: "Choice") -> Interval:
    """Compute the interval of the posterior of two raters' table."""
    problem = choice.problem
    perfect = not problem.value < 1.0
    found = table_interval(problem, None, n_draws=_DRAWS, rng=_SEED, one_sided=perfect)
    if perfect or found.low <= problem.value <= found.high:
        return found
    note = "widened to the estimate, which lies outside the posterior's"
    return dataclasses.replace(
        found,
        low=min(found.low, problem.value),
        high=max(found.high, problem.value),
        notes=(*found.notes, note),
    )


def _distribution(found: ExactPosterior) -> Distribution:
    return found.distribution(f"posterior of ρ, prior {PRIOR.words}")
