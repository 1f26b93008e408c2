"""The Dirichlet-multinomial model of agreement, and the density of its ρ.

An item has category probabilities p ~ Dirichlet(A π); its ratings are multinomial. Then
ρ = 1 / (1 + A) is the population value of Fleiss' kappa. The likelihood is
Π_k Π_j (A π_k + j)^N_kj / Π_j (A + j)^n_j, with N_kj the items with more than j ratings
in category k, and n_j those with more than j ratings at all [1].

π is integrated out: each category's product Π_j (x + j)^N_kj at x = A π_k is a
polynomial. Under π ~ Dirichlet(a) the power π_k^t has the moment Γ(a_k + t) / Γ(a_k);
convolved over categories and divided by Γ(Σ a + t) the powers give a polynomial in A
[2], and with it the density of ρ. All coefficients are positive, so that sums and
products lose no digits; each is tilted by λ^t, so that floats hold what matters.

[1] Mosimann, J. E. (1962). On the compound multinomial distribution. Biometrika,
49(1/2), 65-82. https://doi.org/10.2307/2333468
[2] Antoniak, C. E. (1974). Mixtures of Dirichlet processes with applications to
Bayesian nonparametric problems. Annals of Statistics, 2(6), 1152-1174.
https://doi.org/10.1214/aos/1176342871
"""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, xlogy

from masrel.agreement._engine import Floats
from masrel.errors import ConvergenceError
from masrel.intervals._quadrature import log_sum_exp

TRIMMED = 1e-120
"""What is dropped of a product, relative to its largest value."""

_DROPPED = 1e-250  # what is dropped of a distribution; it is right above 1e-230
_RIGHT = 1e-230
_MAX_FACTORS = 20_000  # of a polynomial multiplied out in logarithms: some seconds
_KEPT = 1e-100  # of the convolution: what the categories dropped is far below
_NEGLIGIBLE = -43.0  # logarithm of a term at the edge, relative to the sum

_MAX_LOG_TILT = 160.0  # either way: beyond any posterior that floats can hold
_NATS = 45.0  # what is left out is below exp(-40) of the density's largest value
_MAX_NEWTON = 12  # steps; the method is quadratic,
_CLOSE = 1e-9  # so that after a step as small as that, of x, the next changes nothing


@dataclass(frozen=True, slots=True, kw_only=True)
class DirichletMultinomial:
    """The posterior of ρ and π given counts, π in the used categories."""

    # (n_parts,): parameters of the Dirichlet prior of π. Categories nobody used enter
    # the likelihood nowhere, so they are one part, the last, whose parameter is the sum
    # of theirs (the Dirichlet's aggregation property).
    prior: Floats = field(compare=False, repr=False)
    shape: float  # the prior of ρ is Beta(shape, shape): 1 is uniform
    powers: Floats = field(compare=False, repr=False)  # (n_used, n_depths): N_kj
    sizes: Floats = field(compare=False, repr=False)  # (n_depths,): n_j

    @classmethod
    def of_counts(
        cls,
        counts: NDArray[np.int64],
        *,
        concentration: float = 1.0,
        shape: float = 1.0,
    ) -> "DirichletMultinomial":
        """Reduce counts to the powers of the likelihood's factors."""
        # shape of counts: (n_items, n_categories)
        used = counts.any(axis=0)
        prior = np.full(int(used.sum()), concentration)
        if not used.all():
            prior = np.append(prior, concentration * float((~used).sum()))
        n = counts.sum(axis=1)
        met = [
            np.bincount(column, minlength=int(n.max()) + 1)
            for column in (*counts.T[used], n)
        ]
        # items with more than j ratings, j = 0, 1, ...
        more = np.array(met, dtype=np.float64)[:, :0:-1].cumsum(axis=1)[:, ::-1]
        more = np.ascontiguousarray(more)
        return cls(prior=prior, shape=shape, powers=more[:-1], sizes=more[-1])

    def log_cofactor(self, logit: Floats) -> Floats:
        """Return what multiplies the polynomial in A = exp(-logit ρ), as logarithm."""
        # -Σ n_j log(A + j), with the prior (ρ (1 - ρ))^(shape - 1) and the Jacobian
        # ρ (1 - ρ) of the logit; logit (n,) -> (n,)
        depth = np.arange(self.sizes.size)
        with np.errstate(divide="ignore"):  # j = 0 is the logit itself
            log = np.logaddexp(-logit[:, None], np.log(depth))
        log_prior = np.logaddexp(0.0, logit) + np.logaddexp(0.0, -logit)
        return np.asarray(-log @ self.sizes - self.shape * log_prior)

    def saddle(self, tilt: Floats) -> tuple[Floats, Floats]:
        """Return where each category's tilted polynomial is largest, and its power."""
        # With t(x) = Σ_j N_kj x / (x + j), the mean power of Π_j (x + j)^N_kj at x, it
        # is at x = λ (a_k + t(x)). Newton's method from the right, where x - λ (a_k +
        # t(x)) is convex and rises.
        # tilt λ (n,) -> x and t(x), both (n, n_used)
        depth = np.arange(self.sizes.size)
        a = self.prior[: len(self.powers)]
        tilt = tilt[:, None]
        x = tilt * (a + self.powers.sum(axis=1))
        for _ in range(_MAX_NEWTON):
            share = 1.0 / (x[..., None] + depth)
            t = x * (self.powers * share).sum(axis=-1)
            slope = (self.powers * depth * share * share).sum(axis=-1)
            step = (x - tilt * (a + t)) / (1.0 - tilt * slope)
            x = x - step
            if (np.abs(step) <= _CLOSE * x).all():
                break
        share = 1.0 / (x[..., None] + depth)
        return x, x * (self.powers * share).sum(axis=-1)


class RhoDensity:
    """The log-density of logit ρ, constants left out."""

    def __init__(self, model: DirichletMultinomial) -> None:
        # The bulk of the density is found by narrowing a grid of tilts until a dozen of
        # them lie there: the largest term of the density's logarithm is the density up
        # to a slowly varying factor.
        self._model = model
        a, a_total = model.prior[: len(model.powers)], float(model.prior.sum())
        depth = np.arange(model.sizes.size)
        grid = np.linspace(_MAX_LOG_TILT, -_MAX_LOG_TILT, 65)
        for _ in range(30):
            tilt = np.exp(grid)
            x, t = model.saddle(tilt)
            total = t.sum(axis=1)
            logits = -np.log(tilt) - np.log(a_total + total)
            terms = (model.powers * np.log(x[..., None] + depth)).sum(axis=-1)
            terms += gammaln(a + t) - t * np.log(x)
            density = terms.sum(axis=1) - gammaln(a_total + total) - total * logits
            density += model.log_cofactor(logits)
            best = int(density.argmax())
            high = np.flatnonzero(density > density[best] - _NATS)
            first, last = max(high[0] - 1, 0), min(high[-1] + 1, grid.size - 1)
            if high.size >= 12:
                # (n,): where the density is not negligible, and log λ there
                self.logits = logits[first : last + 1]
                self._log_tilts = grid[first : last + 1]
                self._expansions = [self._expand(float(logits[best]))]
                return
            grid = np.linspace(grid[first], grid[last], 33)
        raise ConvergenceError("the posterior is too narrow to be found")

    def __call__(self, logit: Floats) -> Floats:
        """Return the log-density at logits of ρ, (n,)."""
        out = np.empty(logit.size)
        left = np.arange(logit.size)
        n_tried = 0
        while left.size:
            is_new = n_tried == len(self._expansions)
            if is_new:
                middle = float(logit[left[left.size // 2]])
                self._expansions.append(self._expand(middle))
            log_tilt, powers, at_tilt, complete = self._expansions[n_tried]
            n_tried += 1
            terms = at_tilt + np.multiply.outer(-logit[left] - log_tilt, powers)
            total = log_sum_exp(terms)
            # Coefficients are log-concave: beyond an edge the terms only get smaller.
            lowest = complete[0] | (terms[:, 0] < total + _NEGLIGIBLE)
            highest = complete[1] | (terms[:, -1] < total + _NEGLIGIBLE)
            right = lowest & highest  # nothing that is needed was dropped
            if is_new and not right.any():
                raise ConvergenceError(
                    "the exact posterior needs terms that floats cannot hold; use the "
                    "jackknife"
                )
            out[left[right]] = total[right]
            left = left[~right]
        return out + self._model.log_cofactor(logit)

    def _expand(self, logit: float) -> "Expansion":
        # the polynomial in A, tilted to where the density of such a logit comes from
        model = self._model
        log_tilt = float(np.interp(logit, self.logits, self._log_tilts))
        x, _ = model.saddle(np.exp([log_tilt]))
        product = Powers(0, np.ones(1), 0.0)
        for exponents, a, at in zip(model.powers, model.prior, x[0], strict=False):
            category = tilted(exponents, float(a), float(at), log_tilt)
            product = multiply(product, category, TRIMMED)
        large = np.flatnonzero(product.values > _KEPT)
        values = product.values[large[0] : large[-1] + 1]
        t = product.first + np.arange(large[0], large[-1] + 1, dtype=np.float64)
        log = np.log(values) + product.scale
        return Expansion(
            log_tilt=log_tilt,
            powers=t,
            terms=log - gammaln(float(model.prior.sum()) + t),
            complete=(
                bool(t[0] == model.powers[:, 0].sum()),
                bool(t[-1] == model.powers.sum()),
            ),
        )


class Expansion(NamedTuple):
    """The polynomial in A at one tilt: the logarithm of each term at A = λ."""

    log_tilt: float
    powers: Floats  # t, (n_terms,)
    terms: Floats  # (n_terms,)
    complete: tuple[bool, bool]  # whether no power is dropped below, and above


class Powers(NamedTuple):
    """Coefficients of consecutive powers, as value times exp(scale)."""

    first: int  # the lowest power
    values: Floats  # (n_powers,): positive
    scale: float  # logarithm of what all are to be multiplied by


def tilted(
    exponents: Floats, a: float, x: float, log_tilt: float, *, exact: bool = False
) -> Powers:
    """Return one category's coefficients times Γ(a + t) λ^t, the moments tilted."""
    # exponents (n_depths,): N_j of Π_j (x + j)^N_j
    if exact:
        first, log = int(exponents[0]), log_coefficients(tuple(exponents.tolist()))
        t = first + np.arange(log.size)
    else:
        first, mass, scale = sum_of_binomials(exponents, x)
        t = first + np.arange(mass.size)
        log = scale + (np.log(mass) - t * np.log(x))
    log = log + gammaln(a + t) + t * log_tilt
    largest = float(log.max())
    values = np.exp(log - largest)
    low, high = np.flatnonzero(values > TRIMMED)[[0, -1]].tolist()
    if not exact:
        # The moments rise faster than any tilt: they may need what was dropped.
        lacks_low = t[0] > exponents[0] and mass[low] < _RIGHT
        lacks_high = t[-1] < exponents.sum() and mass[high] < _RIGHT
        if lacks_low or lacks_high:
            return tilted(exponents, a, x, log_tilt, exact=True)
    return Powers(first + low, values[low : high + 1], largest)


def sum_of_binomials(exponents: Floats, x: float) -> Powers:
    """Return the terms of Π_j (x + j)^N_j at x, by power, as shares of their sum."""
    # They are the distribution of a sum of binomials with probabilities x / (x + j).
    value = float(exponents @ np.log(x + np.arange(exponents.size)))
    result = Powers(int(exponents[0]), np.ones(1), value)
    nats = -np.log(_DROPPED)
    for j, n in enumerate(exponents.tolist()):
        if not (j and n):
            continue
        p, q = x / (x + j), j / (x + j)
        # only as far out as Bernstein's inequality says matters
        reach = nats / 3.0 + np.sqrt(nats**2 / 9.0 + 2.0 * nats * n * p * q)
        low, high = max(0, int(n * p - reach)), min(int(n), int(n * p + reach) + 1)
        k = np.arange(low, high + 1)
        log = gammaln(n + 1.0) - gammaln(k + 1.0) - gammaln(n - k + 1.0)
        log += xlogy(k, p) + xlogy(n - k, q)
        result = multiply(result, Powers(low, np.exp(log), 0.0), _DROPPED)
    return result


def multiply(left: Powers, right: Powers, dropped: float) -> Powers:
    """Multiply two polynomials, and drop both ends below a share of the largest."""
    values = np.convolve(left.values, right.values)
    largest = float(values.max())
    values = values / largest
    high = np.flatnonzero(values > dropped)
    return Powers(
        first=left.first + right.first + int(high[0]),
        values=values[high[0] : high[-1] + 1],
        scale=left.scale + right.scale + float(np.log(largest)),
    )


@lru_cache(maxsize=32)
def log_coefficients(exponents: tuple[float, ...]) -> Floats:
    """Return the logarithms of all coefficients of Π_j (x + j)^N_j."""
    # factor by factor in logarithms, which drops nothing, and takes long
    if sum(exponents[1:]) > _MAX_FACTORS:
        raise ConvergenceError(
            f"the exact posterior needs {sum(exponents):.0f} ratings in one "
            "category multiplied out in logarithms; use the jackknife"
        )
    log = np.zeros(1)
    for j, n in enumerate(exponents):
        for _ in range(int(n) if j else 0):
            log = log_convolve(np.array([np.log(j), 0.0]), log)  # times x + j
    return log


def log_convolve(short: Floats, long: Floats) -> Floats:
    """Multiply two polynomials of which the logarithms of coefficients are known."""
    product = np.full(short.size + long.size - 1, -np.inf)
    for j, log in enumerate(short.tolist()):
        reached = slice(j, j + long.size)
        product[reached] = np.logaddexp(product[reached], log + long)
    return product
