"""The density of ρ with π integrated out: a polynomial in A with positive coefficients.

Each category's product Π_j (x + j)^N_kj at x = A π_k is a polynomial. Under
π ~ Dirichlet(a) the power π_k^t has the moment Γ(a_k + t) / Γ(a_k); convolved over
categories and divided by Γ(Σ a + t) the powers give a polynomial in A [1], [2], and
with it the density of ρ. All coefficients are positive, so that sums and products lose
no digits; each is tilted by λ^t, so that floats hold what matters.

[1] Mosimann, J. E. (1962). On the compound multinomial distribution. Biometrika,
49(1/2), 65-82. https://doi.org/10.2307/2333468
[2] Antoniak, C. E. (1974). Mixtures of Dirichlet processes with applications to
Bayesian nonparametric problems. Annals of Statistics, 2(6), 1152-1174.
https://doi.org/10.1214/aos/1176342871
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, xlogy

from masrel.agreement._kernel import Floats
from masrel.errors import ConvergenceError
from masrel.intervals._dirichlet_multinomial import DirichletMultinomial
from masrel.intervals._quadrature import log_sum_exp

TRIMMED = 1e-120
"""What is dropped of a product, relative to its largest value."""

_DROPPED = 1e-250  # what is dropped of a distribution; it is right above 1e-230
_RIGHT = 1e-230
_MAX_FACTORS = 20_000  # of a polynomial multiplied out in logarithms: some seconds
_KEPT = 1e-100  # of the convolution: what the categories dropped is far below
_NEGLIGIBLE = -43.0  # logarithm of a term at the edge, relative to the sum


@dataclass(frozen=True, slots=True, kw_only=True)
class Powers:
    """Coefficients of consecutive powers, as value times exp(scale)."""

    first: int  # the lowest power
    values: Floats = field(compare=False, repr=False)  # (n_powers,): positive
    scale: float = 0.0  # logarithm of what all are to be multiplied by

    @property
    def exponents(self) -> Floats:
        """The powers, (n_powers,)."""
        return self.first + np.arange(self.values.size, dtype=np.float64)

    def trimmed(self, share: float) -> "Powers":
        """Drop both ends as far as they are below a share of the largest."""
        high = np.flatnonzero(self.values > share * self.values.max())
        return Powers(
            first=self.first + int(high[0]),
            values=self.values[high[0] : high[-1] + 1],
            scale=self.scale,
        )

    def multiply(self, other: "Powers") -> "Powers":
        """Multiply two polynomials."""
        values = np.convolve(self.values, other.values)
        largest = float(values.max())
        return Powers(
            first=self.first + other.first,
            values=values / largest,
            scale=self.scale + other.scale + float(np.log(largest)),
        )


@dataclass(frozen=True)
class Category:
    """One category's coefficients times the moments Γ(a + t) / Γ(a) of its share."""

    powers: Floats  # (n_depths,): N_j
    a: float  # the parameter of its share

    def tilted(self, x: float, log_tilt: float) -> Powers:
        """Return the coefficients of λ^t, the constant Γ(a) left out."""
        by_mass = self._sum_of_binomials(x)
        log = np.log(by_mass.values) - by_mass.exponents * np.log(x)
        result = self._with_moments(by_mass.first, by_mass.scale + log, log_tilt)
        # The moments rise faster than any tilt: they may need what was dropped.
        inside = by_mass.values[result.first - by_mass.first :][: result.values.size]
        last = by_mass.first + by_mass.values.size - 1
        lacks_low = by_mass.first > self.powers[0] and inside[0] < _RIGHT
        lacks_high = last < self.powers.sum() and inside[-1] < _RIGHT
        if lacks_low or lacks_high:
            log = self._log_coefficients
            result = self._with_moments(int(self.powers[0]), log, log_tilt)
        return result

    def _with_moments(self, first: int, log: Floats, log_tilt: float) -> Powers:
        t = first + np.arange(log.size)
        log = log + gammaln(self.a + t) + t * log_tilt
        largest = float(log.max())
        values = np.exp(log - largest)
        return Powers(first=first, values=values, scale=largest).trimmed(TRIMMED)

    def _sum_of_binomials(self, x: float) -> Powers:
        # Divided by its value at x, Π_j (x + j)^N_j is the distribution of a sum of
        # binomials with probabilities x / (x + j).
        value = float(self.powers @ np.log(x + np.arange(self.powers.size)))
        result = Powers(first=int(self.powers[0]), values=np.ones(1), scale=value)
        for j, n in enumerate(self.powers.tolist()):
            if j and n:
                result = result.multiply(_binomial(int(n), x, j)).trimmed(_DROPPED)
        return result

    @cached_property
    def _log_coefficients(self) -> Floats:
        # factor by factor in logarithms, which drops nothing
        if self.powers[1:].sum() > _MAX_FACTORS:
            raise ConvergenceError(
                f"the exact posterior needs {self.powers.sum():.0f} ratings in one "
                'category multiplied out in logarithms; method="emcee" samples it'
            )
        log = np.zeros(1)
        for j, n in enumerate(self.powers.tolist()):
            for _ in range(int(n) if j else 0):
                log = log_convolve(np.array([np.log(j), 0.0]), log)  # times x + j
        return log


def _binomial(n: int, x: float, j: int) -> Powers:
    # probability x / (x + j); only as far out as Bernstein's inequality says is kept
    p, q = x / (x + j), j / (x + j)
    nats = -np.log(_DROPPED)
    reach = nats / 3.0 + np.sqrt(nats**2 / 9.0 + 2.0 * nats * n * p * q)
    k = np.arange(max(0, int(n * p - reach)), min(n, int(n * p + reach) + 1) + 1)
    log = gammaln(n + 1.0) - gammaln(k + 1.0) - gammaln(n - k + 1.0)
    log += xlogy(k, p) + xlogy(n - k, q)
    return Powers(first=int(k[0]), values=np.exp(log))


def log_convolve(short: Floats, long: Floats) -> Floats:
    """Multiply two polynomials of which the logarithms of coefficients are known."""
    product = np.full(short.size + long.size - 1, -np.inf)
    for j, log in enumerate(short.tolist()):
        reached = slice(j, j + long.size)
        product[reached] = np.logaddexp(product[reached], log + long)
    return product


@dataclass(frozen=True, slots=True, kw_only=True)
class _Expansion:
    """The polynomial in A at one tilt: the logarithm of each term at A = λ."""

    log_tilt: float
    powers: Floats = field(compare=False, repr=False)  # t, (n_terms,)
    terms: Floats = field(compare=False, repr=False)  # (n_terms,)
    complete: tuple[bool, bool]  # whether no power is dropped below, and above

    def log_sum(self, logit: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """Return the log of the polynomial, and where nothing it needs is dropped."""
        terms = self.terms + np.multiply.outer(-logit - self.log_tilt, self.powers)
        total = log_sum_exp(terms)
        # Coefficients are log-concave: beyond an edge the terms only get smaller.
        lowest = self.complete[0] | (terms[:, 0] < total + _NEGLIGIBLE)
        highest = self.complete[1] | (terms[:, -1] < total + _NEGLIGIBLE)
        return total, lowest & highest


class RhoDensity:
    """The log-density of logit ρ, constants left out."""

    def __init__(self, model: DirichletMultinomial) -> None:
        self._model = model
        self.bulk = model.bulk()
        a = model.prior[: len(model.powers)].tolist()
        self._categories = [Category(*of) for of in zip(model.powers, a, strict=True)]
        self._expansions = [self._expand(self.bulk.mode)]

    def __call__(self, logit: Floats) -> Floats:
        """Return the log-density at logits of ρ, (n,)."""
        out = np.empty(logit.size)
        left = np.arange(logit.size)
        known = iter(tuple(self._expansions))
        while left.size:
            expansion = next(known, None)
            fresh = expansion is None
            if expansion is None:
                expansion = self._expand(float(logit[left[left.size // 2]]))
                self._expansions.append(expansion)
            total, right = expansion.log_sum(logit[left])
            if fresh and not right.any():
                raise ConvergenceError(
                    "the exact posterior needs terms that floats cannot hold; "
                    'method="emcee" samples it'
                )
            out[left[right]] = total[right]
            left = left[~right]
        return out + self._model.log_cofactor(logit)

    def _expand(self, logit: float) -> _Expansion:
        model, bulk = self._model, self.bulk
        log_tilt = float(np.interp(logit, bulk.logits, bulk.log_tilts))
        x, _ = model.saddle(np.exp([log_tilt]))
        product = Powers(first=0, values=np.ones(1))
        for category, at in zip(self._categories, x[0].tolist(), strict=True):
            product = product.multiply(category.tilted(at, log_tilt)).trimmed(TRIMMED)
        product = product.trimmed(_KEPT)
        t = product.exponents
        log = np.log(product.values) + product.scale
        return _Expansion(
            log_tilt=log_tilt,
            powers=t,
            terms=log - gammaln(float(model.prior.sum()) + t),
            complete=(
                bool(t[0] == model.powers[:, 0].sum()),
                bool(t[-1] == model.powers.sum()),
            ),
        )
