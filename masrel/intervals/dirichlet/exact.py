"""The Dirichlet-multinomial posterior of ρ with π integrated out, exactly.

Each category's product Π_j (x + j)^N_kj at x = A π_k is a polynomial whose
coefficients are positive, so that nothing cancels. Under π ~ Dirichlet(a) the power
π_k^t has the moment Γ(a_k + t) / Γ(a_k); convolved over categories and divided by
Γ(Σ a + t) the powers give a positive polynomial in A, and with it the density of ρ.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from masrel.agreement._kernel import Floats
from masrel.errors import ConvergenceError
from masrel.intervals.dirichlet.model import DirichletMultinomial
from masrel.intervals.dirichlet.powers import TRIMMED, Category, Powers
from masrel.intervals.dirichlet.saddle import Factors, Region

__all__ = ["ExactDensity"]

_KEPT = 1e-100  # of the convolution: what the categories dropped is far below
_NEGLIGIBLE = -43.0  # logarithm of a term at the edge, relative to the sum


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
    """The log-density of logit ρ, constants left out."""

    # [1] Mosimann, J. E. (1962). On the compound multinomial distribution. Biometrika,
    # 49(1/2), 65-82. https://doi.org/10.2307/2333468
    # [2] Antoniak, C. E. (1974). Mixtures of Dirichlet processes with applications to
    # Bayesian nonparametric problems. Annals of Statistics, 2(6), 1152-1174.
    # https://doi.org/10.1214/aos/1176342871

    def __init__(self, model: DirichletMultinomial) -> None:
        self._factors = Factors.of(model)
        self.region = Region.of(self._factors)
        self._categories = [
            Category(powers, a)
            for powers, a in zip(
                self._factors.powers, self._factors.a.tolist(), strict=True
            )
        ]
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
        product = Powers(first=0, values=np.ones(1))
        for category, at in zip(self._categories, x[0].tolist(), strict=True):
            product = product.times(category.tilted(at, log_tilt)).above(TRIMMED)
        product = product.above(_KEPT)
        t = product.exponents
        return _Tilted(
            log_tilt=log_tilt,
            powers=t,
            terms=np.log(product.values) + product.scale - gammaln(of.a_total + t),
            whole=(
                bool(t[0] == of.powers[:, 0].sum()),
                bool(t[-1] == of.powers.sum()),
            ),
        )
