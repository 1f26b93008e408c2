"""The Dirichlet-multinomial posterior of ρ with π integrated out, exactly.

Each category's product Π_j (x + j)^N_kj at x = A π_k is a polynomial whose
coefficients are positive, so that nothing cancels. Under π ~ Dirichlet(a) the power
π_k^t has the moment Γ(a_k + t) / Γ(a_k); convolved over categories and divided by
Γ(Σ a + t) the powers give a positive polynomial in A, and with it the density of ρ.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln, xlogy

from masrel.agreement.kernel import Floats
from masrel.errors import ConvergenceError
from masrel.intervals.dirichlet import DirichletMultinomial
from masrel.intervals.dirichlet_saddle import Factors, Region

__all__ = ["ExactDensity"]

# Relative to the largest, what is dropped of a category's polynomial, of its product
# with the moments, and of the convolution; each far below what the one before loses.
_DROPPED, _TRIMMED, _KEPT = 1e-250, 1e-120, 1e-100
_NEGLIGIBLE = -43.0  # logarithm of a term at the edge, relative to the sum


@dataclass(frozen=True, slots=True, kw_only=True)
class _Powers:
    """Coefficients of λ^t for consecutive powers t, as value times exp(scale)."""

    first: int
    values: Floats = field(compare=False, repr=False)
    scale: float = 0.0

    def above(self, least: float) -> "_Powers":
        """Drop both ends as far as they are below a share of the largest."""
        high = np.flatnonzero(self.values > least * self.values.max())
        return _Powers(
            first=self.first + int(high[0]),
            values=self.values[high[0] : high[-1] + 1],
            scale=self.scale,
        )

    def times(self, other: "_Powers") -> "_Powers":
        """Multiply; all values are positive, so the sums lose no digits."""
        values = np.convolve(self.values, other.values)
        largest = float(values.max())
        return _Powers(
            first=self.first + other.first,
            values=values / largest,
            scale=self.scale + other.scale + float(np.log(largest)),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Tilted:
    """The polynomial in A at one tilt: the logarithm of each term at A = λ."""

    log_tilt: float
    powers: Floats = field(compare=False, repr=False)  # t, shape (n_terms,)
    terms: Floats = field(compare=False, repr=False)  # (n_terms,)
    whole: tuple[bool, bool]  # whether the lowest and highest powers are all there

    def log_sum(self, logit: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """Return the log of the polynomial, and where nothing it needs is dropped."""
        terms = self.terms + np.multiply.outer(-logit - self.log_tilt, self.powers)
        largest = terms.max(axis=1)
        total = largest + np.log(np.exp(terms - largest[:, None]).sum(axis=1))
        # Coefficients are log-concave: beyond an edge the terms only get smaller.
        lowest = self.whole[0] | (terms[:, 0] < total + _NEGLIGIBLE)
        highest = self.whole[1] | (terms[:, -1] < total + _NEGLIGIBLE)
        return total, lowest & highest


class ExactDensity:
    """The log-density of logit ρ, constants left out.

    Parameters
    ----------
    model : DirichletMultinomial
        Data and priors.

    Attributes
    ----------
    region : Region
        Where the density is not negligible.

    References
    ----------
    .. [1] Mosimann, J. E. (1962). On the compound multinomial distribution.
       Biometrika, 49(1/2), 65-82. https://doi.org/10.2307/2333468
    .. [2] Antoniak, C. E. (1974). Mixtures of Dirichlet processes with applications
       to Bayesian nonparametric problems. Annals of Statistics, 2(6), 1152-1174.
       https://doi.org/10.1214/aos/1176342871
    """

    def __init__(self, model: DirichletMultinomial) -> None:
        self._factors = Factors.of(model)
        self.region = Region.of(self._factors)
        self._tilted = [self._expand(self.region.mode)]

    def __call__(self, logit: Floats) -> Floats:
        """Return the log-density at logits of ρ, shape (n,)."""
        out = np.empty(logit.size)
        left = np.arange(logit.size)
        for tilted in self._tilted:
            left = self._fill(out, left, tilted, logit)
        while left.size:
            tilted = self._expand(float(logit[left[left.size // 2]]))
            self._tilted.append(tilted)
            rest = self._fill(out, left, tilted, logit)
            if rest.size == left.size:
                raise ConvergenceError(
                    "the exact posterior needs terms that floats cannot hold; "
                    'method="emcee" samples it'
                )
            left = rest
        return out + self._factors.outside(logit)

    @staticmethod
    def _fill(
        out: Floats,
        left: NDArray[np.intp],
        tilted: _Tilted,
        logit: Floats,
    ) -> NDArray[np.intp]:
        if not left.size:
            return left
        total, right = tilted.log_sum(logit[left])
        out[left[right]] = total[right]
        return left[~right]

    def _expand(self, logit: float) -> _Tilted:
        of = self._factors
        log_tilt = self.region.log_tilt(logit)
        x, _ = of.saddle(np.exp([log_tilt]))
        product = _Powers(first=0, values=np.ones(1))
        for powers, a, at in zip(of.powers, of.a, x[0], strict=True):
            one = _category(powers, float(a), float(at), log_tilt)
            product = product.times(one).above(_TRIMMED)
        product = product.above(_KEPT)
        t = product.first + np.arange(product.values.size)
        return _Tilted(
            log_tilt=log_tilt,
            powers=t.astype(np.float64),
            terms=np.log(product.values) + product.scale - gammaln(of.a_total + t),
            whole=(
                bool(t[0] == of.powers[:, 0].sum()),
                bool(t[-1] == of.powers.sum()),
            ),
        )


def _category(powers: Floats, a: float, x: float, log_tilt: float) -> _Powers:
    # Π_j (x + j)^N_j divided by its value at x is the law of a sum of binomials with
    # chances x / (x + j); from it the coefficient of each power, times its moment
    law = _Powers(first=int(powers[0]), values=np.ones(1))
    for j, n in enumerate(powers.tolist()):
        if j and n:
            law = law.times(_binomial(int(n), x, j)).above(_DROPPED)
    t = law.first + np.arange(law.values.size)
    log = np.log(law.values) + gammaln(a + t) + t * (log_tilt - np.log(x))
    largest = float(log.max())
    value = float(powers @ np.log(x + np.arange(powers.size)))
    return _Powers(
        first=law.first,
        values=np.exp(log - largest),
        scale=law.scale + largest + value,
    ).above(_TRIMMED)


def _binomial(n: int, x: float, j: int) -> _Powers:
    # chances x / (x + j); only as far out as Bernstein's inequality says is kept
    p, q = x / (x + j), j / (x + j)
    nats = -np.log(_DROPPED)
    reach = nats / 3.0 + np.sqrt(nats**2 / 9.0 + 2.0 * nats * n * p * q)
    k = np.arange(max(0, int(n * p - reach)), min(n, int(n * p + reach) + 1) + 1)
    log = gammaln(n + 1.0) - gammaln(k + 1.0) - gammaln(n - k + 1.0)
    log += xlogy(k, p) + xlogy(n - k, q)
    return _Powers(first=int(k[0]), values=np.exp(log))
