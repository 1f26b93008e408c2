"""The credible interval of ρ in the Dirichlet-multinomial model."""

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from masrel.agreement._engine import Floats
from masrel.errors import ParameterError
from masrel.estimates import Distribution, Interval, _LongNote
from masrel.intervals._dirichlet_multinomial import DirichletMultinomial, RhoDensity
from masrel.intervals._quadrature import (
    TOLERANCE,
    LineDistribution,
    integrated_sinc,
    line_distribution,
    solve_quantile,
)
from masrel.intervals._question import IntervalProblem

PriorName = Literal["uniform", "jeffreys"]
"""Prior of ρ: U(0, 1), or Beta(1/2, 1/2), the prior of Jeffreys for a probability."""

PRIOR_SHAPES: dict[str, float] = {"uniform": 1.0, "jeffreys": 0.5}
"""The prior of ρ is Beta(shape, shape)."""

_OF_RHO = {"uniform": "ρ ~ U(0, 1)", "jeffreys": "ρ ~ Beta(1/2, 1/2)"}
_SHOWN = 201  # points of a distribution

FEW_ITEMS = 10
"""Items below which the interval under another prior is noted."""


_SUREST = 1e12  # concentration of a prior that leaves ratings no say


@dataclass(frozen=True, slots=True, kw_only=True)
class Prior:
    """The prior of the Dirichlet-multinomial model."""

    name: PriorName  # that of ρ
    # π ~ Dirichlet(concentration, ...) over the declared categories
    concentration: float

    @classmethod
    def of(cls, name: PriorName, concentration: float) -> "Prior":
        """Return a prior, checked."""
        if name not in PRIOR_SHAPES:
            raise ParameterError(
                f"prior: needs one of {', '.join(get_args(PriorName))}, got {name!r}"
            )
        is_number = isinstance(concentration, int | float | np.number)
        if not (is_number and 0.0 < concentration <= _SUREST):
            raise ParameterError(
                f"concentration: needs a positive number, got {concentration!r}"
                f" (and at most {_SUREST:g})"
            )
        return cls(name=name, concentration=float(concentration))

    @property
    def description(self) -> str:
        """Both priors, such as "ρ ~ U(0, 1), π ~ Dirichlet(1, ...)"."""
        return f"{_OF_RHO[self.name]}, π ~ Dirichlet({self.concentration:.3g}, ...)"

    def others(self, n_categories: int) -> "tuple[Prior, Prior]":
        """Return two that are as reasonable: another of ρ, and another of π."""
        # of π a Dirichlet as strong as one rating, Dirichlet(1/K, ...), or instead of
        # that Dirichlet(1, ...)
        of_rho: PriorName = "jeffreys" if self.name == "uniform" else "uniform"
        as_one = 1.0 / n_categories
        of_pi = 1.0 if math.isclose(self.concentration, as_one) else as_one
        return (
            Prior(name=of_rho, concentration=self.concentration),
            Prior(name=self.name, concentration=of_pi),
        )


DEFAULT_PRIOR = Prior(name="uniform", concentration=1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class RhoPosterior:
    """The posterior of ρ = 1 / (1 + A), integrated."""

    prior: Prior
    low: float  # ends of the central interval
    median: float
    high: float
    logit: LineDistribution = field(compare=False, repr=False)  # of logit ρ
    log_density: RhoDensity = field(compare=False, repr=False)  # of logit ρ

    @classmethod
    def of(
        cls, counts: NDArray[np.int64], prior: Prior, level: float
    ) -> "RhoPosterior":
        """Integrate the posterior of counts (n_items, n_categories)."""
        density = RhoDensity(
            DirichletMultinomial.of_counts(
                counts,
                concentration=prior.concentration,
                shape=PRIOR_SHAPES[prior.name],
            )
        )
        tail = 0.5 * (1.0 - level)
        first, last = density.logits[[0, -1]].tolist()
        shares = (tail, 0.5, 1.0 - tail)
        logit, ends = line_distribution(density, first, last, shares)
        low, median, high = expit(ends).tolist()
        return cls(
            prior=prior,
            low=low,
            median=median,
            high=high,
            logit=logit,
            log_density=density,
        )

    def quantile(self, share: float) -> float:
        """Return a quantile of ρ."""
        points = self.logit.points.tolist()
        near = min(int(self.logit.masses.cumsum().searchsorted(share)), len(points) - 1)
        ends = points[0], points[-1]
        return float(
            expit(solve_quantile(self.logit.at, share, points[near], ends, TOLERANCE))
        )

    def draw(self, n_draws: int, generator: np.random.Generator) -> Floats:
        """Draw ρ from as many equal parts of its distribution, ascending."""
        logits, logit = self._logits(), self.logit
        below = integrated_sinc(logits[:, None] - logit.points, logit.step)
        shares = (np.arange(n_draws) + generator.random(n_draws)) / n_draws
        return np.asarray(expit(np.interp(shares, below @ logit.masses, logits)))

    def _logits(self) -> Floats:
        # equally spaced, from about the quantile at 1e-6 to that at 1 - 1e-6
        cumulative = self.logit.masses.cumsum()
        ends = np.searchsorted(cumulative, (1e-6, 1.0 - 1e-6)) + np.array([-1, 1])
        low, high = self.logit.points[ends.clip(0, cumulative.size - 1)]
        return np.linspace(low, high, _SHOWN)

    def distribution(self) -> Distribution:
        """Return the density of ρ at points between its outermost quantiles."""
        logits = self._logits()
        rho, rest = expit(logits), expit(-logits)
        density = np.exp(self.log_density(logits) - self.logit.log_total)
        return Distribution(
            values=rho,
            weights=density / (rho * rest),
            continuous=True,
            words=f"posterior of ρ, prior {self.prior.description}",
        )


def prior_notes(
    counts: NDArray[np.int64], prior: Prior, level: float, low: float, high: float
) -> tuple[str, ...]:
    """Say where the prior weighs, by the interval under the one that moves it most."""
    # shape of counts: (n_items, n_categories)
    n_items = int((counts.sum(axis=1) >= 2).sum())
    if (counts.sum(axis=0) > 0).sum() == 1:
        what = "all ratings are in one category"
    elif ((counts > 0).sum(axis=1) <= 1).all():
        what = "agreement is perfect in these data"
    elif n_items < FEW_ITEMS:
        what = "1 item is few" if n_items == 1 else f"{n_items} items are few"
    else:
        return ()
    moved, other, ends = 0.0, prior, (low, high)
    for candidate in prior.others(counts.shape[1]):
        there = RhoPosterior.of(counts, candidate, level)
        by = max(abs(there.low - low), abs(there.high - high))
        if by > moved:
            moved, other, ends = by, candidate, (there.low, there.high)
    text = (
        f"{low:.3f} to {high:.3f} with {prior.description}, but "
        f"{ends[0]:.3f} to {ends[1]:.3f} with {other.description}"
    )
    return (prior_note(f"{what}, so the prior weighs", text),)


def prior_note(what: str, ends: str) -> str:
    """Return a note on the prior, which a table gives without its ends."""
    return _LongNote(f"{what}: {ends}", f"{what} (--explain says by how much)")


def default_rho_interval(problem: IntervalProblem) -> Interval:
    """Compute an interval that holds the estimate, one-sided where that is perfect."""
    if not problem.value < 1.0:  # perfect, or undefined: one category
        return _lower_bound_of_rho(problem)
    counts, method = problem.item_counts(), "Dirichlet-multinomial posterior, exact"
    posterior = RhoPosterior.of(counts, DEFAULT_PRIOR, problem.level)
    interval = _central(problem, posterior, method)
    low, high = interval.low, interval.high
    notes = prior_notes(counts, DEFAULT_PRIOR, problem.level, low, high)
    return extended(problem, dataclasses.replace(interval, notes=notes))


def extended(problem: IntervalProblem, interval: Interval) -> Interval:
    """Extend an end to an estimate outside, and say so."""
    value, low, high = problem.value, interval.low, interval.high
    if not (value < low or value > high):
        return interval
    name, end = ("lower", low) if value < low else ("upper", high)
    note = (
        f"the {name} end is extended from {end:.3f}, that of the posterior, to the "
        f"estimate, {value:.3f}, which lies outside"
    )
    return dataclasses.replace(
        interval,
        low=min(low, value),
        high=max(high, value),
        notes=(note, *interval.notes),
    )


def _central(
    problem: IntervalProblem, posterior: RhoPosterior, method: str
) -> Interval:
    return Interval(
        low=posterior.low,
        high=posterior.high,
        median=posterior.median,
        level=problem.level,
        kind="credible",
        method=method,
        target=problem.target,
        distribution=posterior.distribution(),
    )


def _lower_bound_of_rho(problem: IntervalProblem) -> Interval:
    """Compute the interval of all that is above a lower quantile."""
    counts, prior, share = (
        problem.item_counts(),
        DEFAULT_PRIOR,
        1.0 - problem.level,
    )
    posterior = RhoPosterior.of(counts, prior, problem.level)
    low = posterior.quantile(share)
    others = [
        (RhoPosterior.of(counts, other, problem.level).quantile(share), other)
        for other in prior.others(counts.shape[1])
    ]
    there, other = max(others, key=lambda bound: abs(bound[0] - low))
    ends = f"{low:.3f} with {prior.description}, but {there:.3f} with "
    note = prior_note("the bound rests on the prior, too", ends + other.description)
    return Interval(
        low=low,
        high=1.0,
        median=posterior.median,
        level=problem.level,
        kind="credible",
        method="Dirichlet-multinomial posterior, one-sided",
        target=problem.target,
        notes=(note,),
        distribution=posterior.distribution(),
    )


def rho_interval(problem: IntervalProblem, prior: Prior) -> Interval:
    """Compute the central credible interval of ρ."""
    method = "Dirichlet-multinomial posterior, exact"
    counts = problem.item_counts()
    reason = _nothing_to_learn(counts)
    if reason is not None:
        undefined = problem.undefined(reason, method=method, unit=None)
        return dataclasses.replace(undefined, kind="credible")
    level = problem.level
    interval = _central(problem, RhoPosterior.of(counts, prior, level), method)
    notes = prior_notes(counts, prior, level, interval.low, interval.high)
    return dataclasses.replace(interval, notes=notes)


def _nothing_to_learn(counts: NDArray[np.int64]) -> str | None:
    # shape of counts: (n_items, n_categories)
    if not (counts.sum(axis=1) >= 2).any():
        return "no item has ratings of two raters"
    if counts.shape[1] < 2:
        return "one category is declared"
    return None
