"""The exact posterior of ρ in the Dirichlet-multinomial model, and its intervals.

An item has category probabilities p ~ Dirichlet(A π); its ratings are multinomial. Then
ρ = 1 / (1 + A) is the population value of Fleiss' kappa. The likelihood is
Π_k Π_j (A π_k + j)^N_kj / Π_j (A + j)^n_j, with N_kj the items with more than j ratings
in category k, and n_j those with more than j ratings at all [1].

π is integrated out: each category's product Π_j (x + j)^N_kj at x = A π_k is a
polynomial. Under π ~ Dirichlet(a) the power π_k^t has the moment Γ(a_k + t) / Γ(a_k);
convolved over categories and divided by Γ(Σ a + t) the powers give a polynomial in A
[2], and with it the density of ρ. All coefficients are positive, so that sums and
products lose no digits.

[1] Mosimann, J. E. (1962). On the compound multinomial distribution. Biometrika,
49(1/2), 65-82. https://doi.org/10.2307/2333468
[2] Antoniak, C. E. (1974). Mixtures of Dirichlet processes with applications to
Bayesian nonparametric problems. Annals of Statistics, 2(6), 1152-1174.
https://doi.org/10.1214/aos/1176342871
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import get_args

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, gammaln

from masrel._input import check_option, refuse
from masrel.agreement._engine import Floats
from masrel.agreement._weights import Distances
from masrel.errors import ConvergenceError
from masrel.estimates import Distribution, Interval, _LongNote
from masrel.intervals._quadrature import (
    LineDistribution,
    log_convolve,
    log_sum_exp,
    where_it_matters,
)
from masrel.intervals._question import IntervalProblem, PriorName

PRIOR_SHAPES: dict[str, float] = {"uniform": 1.0, "jeffreys": 0.5}
"""The prior of ρ is Beta(shape, shape)."""


METHOD = "Dirichlet-multinomial posterior"
"""Of all intervals of raters who are alike."""

_OF_RHO = {"uniform": "ρ ~ U(0, 1)", "jeffreys": "ρ ~ Beta(1/2, 1/2)"}
_FEW_ITEMS = 10  # below which the interval under another prior is noted
_SUREST = 1e12  # concentration of a prior that leaves ratings no say
_MAX_RATINGS = 1_000_000  # whose polynomials take some ten seconds
_MAX_LOGIT = 160.0  # either way: beyond any posterior that floats can hold
_N_POINTS = 769  # of the density at least: ends are within 1e-10
_OF_PEAK, _PEAK_POINTS = 8.0, 48  # nats down to which its peak goes, and points of that
_N_TERMS = 1 << 20  # at once
_SHOWN = 201  # points of a distribution


@dataclass(frozen=True, slots=True, kw_only=True)
class Prior:
    """The prior of the Dirichlet-multinomial model."""

    name: PriorName  # that of ρ
    # π ~ Dirichlet(concentration, ...) over the declared categories
    concentration: float

    @classmethod
    def of(cls, name: PriorName, concentration: float) -> "Prior":
        """Return a prior, checked."""
        check_option("prior", name, get_args(PriorName))
        is_number = isinstance(concentration, int | float | np.number)
        refuse(
            (
                not (is_number and 0.0 < concentration <= _SUREST),
                f"concentration: needs a number above 0 and at most {_SUREST:g}, got "
                f"{concentration!r}",
            )
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


@lru_cache(maxsize=64)
def _category_polynomial(exponents: tuple[float, ...]) -> Floats:
    """Return the logarithms of the coefficients of Π_j>0 (x + j)^N_j."""
    log = np.zeros(1)
    for j, n in enumerate(exponents[1:], start=1):
        k = np.arange(n + 1.0)
        of_one = gammaln(n + 1.0) - gammaln(k + 1.0) - gammaln(n - k + 1.0)
        log = log_convolve(of_one + (n - k) * math.log(j), log)
    return log


@dataclass(frozen=True, slots=True, kw_only=True)
class RhoPosterior:
    """The posterior of ρ = 1 / (1 + A), integrated over π."""

    prior: Prior
    powers: Floats = field(compare=False, repr=False)  # (n_used, n_depths): N_kj
    sizes: Floats = field(compare=False, repr=False)  # (n_depths,): n_j
    logit: LineDistribution = field(compare=False, repr=False)  # of logit ρ

    @classmethod
    def of(cls, counts: NDArray[np.int64], prior: Prior) -> "RhoPosterior":
        """Integrate the posterior of counts (n_items, n_categories)."""
        used, n = counts.any(axis=0), counts.sum(axis=1)
        # categories nobody used enter the likelihood nowhere, so they are one part, the
        # last, whose parameter is the sum of theirs (the Dirichlet's aggregation)
        n_each = [1.0] * int(used.sum()) + [float((~used).sum())] * (not used.all())
        of_shares = prior.concentration * np.array(n_each)
        met = [
            np.bincount(column, minlength=int(n.max()) + 1)
            for column in (*counts.T[used], n)
        ]
        # items with more than j ratings, j = 0, 1, ...
        more = np.array(met, dtype=np.float64)[:, :0:-1].cumsum(axis=1)[:, ::-1]
        powers, sizes = more[:-1], more[-1]
        if sizes.sum() > _MAX_RATINGS:
            raise ConvergenceError(
                f"the exact posterior needs at most {_MAX_RATINGS} ratings, got "
                f"{sizes.sum():.0f}; use the jackknife"
            )
        # the polynomial in A: its powers t, and the logarithms of their coefficients
        terms = np.zeros(1)
        for exponents, a in zip(powers, of_shares, strict=False):
            log = _category_polynomial(tuple(exponents.tolist()))
            t = exponents[0] + np.arange(log.size)
            terms = log_convolve(terms, log + gammaln(a + t))
        t = powers[:, 0].sum() + np.arange(terms.size)
        terms -= gammaln(of_shares.sum() + t)
        n_rows = max(1, _N_TERMS // t.size)
        with np.errstate(divide="ignore"):  # A + 0 is A itself
            log_depth = np.log(np.arange(sizes.size))

        def log_density(logit: Floats) -> Floats:
            # of A = exp(-logit ρ): the polynomial, divided by Π (A + j)^n_j, with the
            # prior (ρ (1 - ρ))^(shape - 1) and the Jacobian ρ (1 - ρ) of the logit
            blocks = np.split(logit, range(n_rows, logit.size, n_rows))
            sums = [log_sum_exp(terms - np.outer(rows, t)) for rows in blocks]
            log_divisor = np.logaddexp(-logit[:, None], log_depth) @ sizes
            log_prior = np.logaddexp(0.0, logit) + np.logaddexp(0.0, -logit)
            of_prior = PRIOR_SHAPES[prior.name] * log_prior
            return np.asarray(np.concatenate(sums) - log_divisor - of_prior)

        ends = where_it_matters(log_density, -_MAX_LOGIT, _MAX_LOGIT)
        # a tail may be a hundred times as long as the peak, of which the steps are
        low, high = where_it_matters(log_density, *ends, nats=_OF_PEAK)
        n_points = int((ends[1] - ends[0]) / (high - low) * _PEAK_POINTS)
        points = np.linspace(*ends, max(_N_POINTS, n_points))
        log = log_density(points)
        masses = np.exp(log - log.max())
        return cls(
            prior=prior,
            powers=powers,
            sizes=sizes,
            logit=LineDistribution(points=points, masses=masses / masses.sum()),
        )

    def quantiles(self, *shares: float) -> list[float]:
        """Return quantiles of ρ."""
        return list(map(float, expit(self.logit.quantiles(shares))))

    def draw(self, n_draws: int, generator: np.random.Generator) -> Floats:
        """Draw ρ from as many equal parts of its distribution, ascending."""
        logits = self._logits()
        shares = (np.arange(n_draws) + generator.random(n_draws)) / n_draws
        below = self.logit.probability(logits)
        return np.asarray(expit(np.interp(shares, below, logits)))

    def _logits(self) -> Floats:
        # equally spaced, between outermost quantiles
        low, high = self.logit.quantiles((1e-6, 1.0 - 1e-6))
        return np.linspace(low, high, _SHOWN)

    def distribution(self) -> Distribution:
        """Return the density of ρ at points between its outermost quantiles."""
        logits = self._logits()
        rho, rest = expit(logits), expit(-logits)
        return Distribution(
            values=rho,
            weights=self.logit.density(logits) / (rho * rest),
            continuous=True,
            words=f"posterior of ρ, prior {self.prior.description}",
        )


def rho_interval(
    problem: IntervalProblem, prior: Prior, *, one_sided: bool = False
) -> Interval:
    """Compute the central credible interval of ρ, or all above a lower quantile."""
    counts, level = problem.item_counts(), problem.level
    shares = (1.0 - level,) if one_sided else (0.5 - 0.5 * level, 0.5 + 0.5 * level)
    posterior = RhoPosterior.of(counts, prior)
    ends = posterior.quantiles(*shares)
    bound = "the bound depends on the prior, too" if one_sided else ""
    notes: tuple[str, ...] = ()
    if why := bound or where_the_prior_weighs(counts):
        others = [
            (RhoPosterior.of(counts, other).quantiles(*shares), other.description)
            for other in prior.others(counts.shape[1])
        ]
        # the one that moves an end most
        there = max(others, key=lambda of: np.abs(np.subtract(of[0], ends)).max())
        notes = (prior_note(why, (ends, prior.description), there),)
    return Interval(
        low=ends[0],
        high=1.0 if one_sided else ends[1],
        median=posterior.quantiles(0.5)[0],
        level=level,
        kind="credible",
        method=f"{METHOD}, {'one-sided' if one_sided else 'exact'}",
        target=problem.target,
        notes=notes,
        distribution=posterior.distribution(),
        is_one_sided=one_sided,
        prior=prior.description,
    )


def nothing_to_learn(problem: IntervalProblem) -> str | None:
    """Return why ratings say nothing of a coefficient, or None."""
    if problem.n_paired_items == 0:
        return "no item has ratings of two raters"
    if problem.coded.n_categories < 2:
        return "one category is declared"
    # distances, which stand for the matrix of many categories, are all numbers
    if isinstance(problem.v, Distances):
        return None
    if np.isnan(problem.v).any():
        return "the scale has no such weights"
    return None if problem.v.any() else "the weights treat nothing as disagreement"


def where_the_prior_weighs(counts: NDArray[np.int64]) -> str:
    """Return why counts (n_items, n_categories) leave the prior a say, or nothing."""
    n_items = int((counts.sum(axis=1) >= 2).sum())
    if counts.any(axis=0).sum() == 1:
        what = "all ratings are in one category, so"
    elif ((counts > 0).sum(axis=1) <= 1).all():
        what = "agreement is perfect in these data, so"
    elif n_items < _FEW_ITEMS:
        what = "with only 1 item" if n_items == 1 else f"with only {n_items} items"
    else:
        return ""
    return f"{what} the prior affects this interval"


def prior_note(why: str, *answers: tuple[Sequence[float], str]) -> str:
    """Return a note on two priors' ends, which a table gives without them."""
    here, there = (
        f"{' to '.join(f'{end:.3f}' for end in ends)} with {words}"
        for ends, words in answers
    )
    return _LongNote(
        f"{why}: it is {here}, but {there}", f"{why}; --explain shows how much"
    )


def extended(problem: IntervalProblem, interval: Interval) -> Interval:
    """Extend an end to an estimate outside, and say so."""
    value, low, high = problem.value, interval.low, interval.high
    if not (value < low or value > high):
        return interval
    name, end = ("lower", low) if value < low else ("upper", high)
    note = (
        f"the {name} limit of the posterior, {end:.3f}, is extended to the estimate, "
        f"{value:.3f}, which lies outside"
    )
    return replace(
        interval,
        low=min(low, value),
        high=max(high, value),
        method=f"{interval.method}, {name} end extended to the estimate",
        notes=(note, *interval.notes),
    )
