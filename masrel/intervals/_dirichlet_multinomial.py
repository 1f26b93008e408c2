"""The Dirichlet-multinomial model of agreement.

An item has category probabilities p ~ Dirichlet(A π); its ratings are multinomial. Then
ρ = 1 / (1 + A) is the population value of Fleiss' kappa. The likelihood is
Π_k Π_j (A π_k + j)^N_kj / Π_j (A + j)^n_j, with N_kj the items with more than j ratings
in category k, and n_j those with more than j ratings at all [1].

[1] Mosimann, J. E. (1962). On the compound multinomial distribution. Biometrika,
49(1/2), 65-82. https://doi.org/10.2307/2333468
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, gammaln

from masrel.agreement._kernel import Floats
from masrel.errors import ConvergenceError

_MAX_LOG_TILT = 160.0  # either way: beyond any posterior that floats can hold
_NATS = 45.0  # what is left out is below exp(-40) of the density's largest value
_MAX_NEWTON = 12  # steps; the method is quadratic,
_CLOSE = 1e-9  # so that after a step as small as that, of x, the next changes nothing


class Bulk(NamedTuple):
    """Where the posterior of ρ is not negligible."""

    logits: Floats  # (n,): of ρ, ascending
    log_tilts: Floats  # (n,): log λ at each
    mode: float  # about the logit of the highest density


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
        n_depths = int(n.max())
        powers = [_items_above(column, n_depths) for column in counts.T[used]]
        return cls(
            prior=prior,
            shape=shape,
            powers=np.array(powers, dtype=np.float64),
            sizes=_items_above(n, n_depths).astype(np.float64),
        )

    @property
    def n_dimensions(self) -> int:
        """The logit of ρ, and the log-ratios of π to its last part."""
        return int(self.prior.size)

    def parts(self, position: Floats) -> tuple[Floats, Floats, Floats]:
        """Return ρ, 1 - ρ and π at unbounded positions."""
        # position (n, n_dimensions) -> ρ and 1 - ρ, both (n,), and π, (n, n_parts)
        rho, rest = expit(position[:, 0]), expit(-position[:, 0])
        ratios = np.column_stack([position[:, 1:], np.zeros(len(position))])
        ratios = np.exp(ratios - ratios.max(axis=1, keepdims=True))
        return rho, rest, ratios / ratios.sum(axis=1, keepdims=True)

    def log_likelihood(self, rho: Floats, rest: Floats, pi: Floats) -> Floats:
        """Return the log-likelihood, constants left out."""
        # With A = (1 - ρ)/ρ every factor A π_k + j and A + j, times ρ, is (1 - ρ) π_k +
        # j ρ and 1 - ρ + j ρ; numerator and denominator have as many of them.
        # rho, rest (n,), pi (n, n_parts) -> (n,)
        part, depth = np.nonzero(self.powers)
        numerator = rest[:, None] * pi[:, part] + rho[:, None] * depth
        denominator = rest[:, None] + rho[:, None] * np.arange(self.sizes.size)
        log = np.log(numerator) @ self.powers[part, depth]
        return np.asarray(log - np.log(denominator) @ self.sizes)

    def log_density(self, position: Floats) -> Floats:
        """Return the log posterior density of unbounded positions."""
        # position (n, n_dimensions) -> (n,)
        rho, rest, pi = self.parts(position)
        with np.errstate(divide="ignore", invalid="ignore"):  # far out a part is 0
            # Beta density (ρ (1 - ρ))^(shape - 1), times the logit's Jacobian ρ (1 - ρ)
            of_rho = self.shape * (np.log(rho) + np.log(rest))
            # Dirichlet density Π π_k^(a_k - 1), times the log-ratios' Jacobian Π π_k
            of_pi = np.log(pi) @ self.prior
            density = self.log_likelihood(rho, rest, pi) + of_rho + of_pi
        return np.where(np.isfinite(density), density, -np.inf)

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

    def bulk(self) -> Bulk:
        """Narrow a grid of tilts until a dozen of them lie where the density does."""
        grid = np.linspace(_MAX_LOG_TILT, -_MAX_LOG_TILT, 65)
        for _ in range(30):
            logits, density = self._profile(np.exp(grid))
            best = int(density.argmax())
            high = np.flatnonzero(density > density[best] - _NATS)
            first, last = max(high[0] - 1, 0), min(high[-1] + 1, grid.size - 1)
            if high.size >= 12:
                inside = slice(first, last + 1)
                return Bulk(logits[inside], grid[inside], float(logits[best]))
            grid = np.linspace(grid[first], grid[last], 33)
        raise ConvergenceError("the posterior is too narrow to be found")

    def _profile(self, tilt: Floats) -> tuple[Floats, Floats]:
        # the logits of ρ that tilts belong to, and the largest term of the density's
        # logarithm there: the density up to a slowly varying factor; all (n,)
        x, t = self.saddle(tilt)
        total = t.sum(axis=1)
        a, a_total = self.prior[: len(self.powers)], float(self.prior.sum())
        logit = -np.log(tilt) - np.log(a_total + total)
        depth = np.arange(self.sizes.size)
        terms = (self.powers * np.log(x[..., None] + depth)).sum(axis=-1)
        terms += gammaln(a + t) - t * np.log(x)
        inner = terms.sum(axis=1) - gammaln(a_total + total) - total * logit
        return logit, inner + self.log_cofactor(logit)


def _items_above(counts: NDArray[np.int64], n_depths: int) -> NDArray[np.int64]:
    # (n_items,) -> (n_depths,): items with more than j ratings, j = 0, 1, ...
    met = np.bincount(counts, minlength=n_depths + 1)
    return np.asarray(met[:0:-1].cumsum()[::-1])
