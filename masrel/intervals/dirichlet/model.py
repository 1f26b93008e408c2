"""The Dirichlet-multinomial model of agreement, as a log-density.

An item has category probabilities p ~ Dirichlet(A π); its ratings are multinomial.
Then ρ = 1 / (1 + A) is the population value of Fleiss' kappa.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from masrel.agreement._kernel import Floats

__all__ = ["DirichletMultinomial"]


@dataclass(frozen=True, slots=True, kw_only=True)
class DirichletMultinomial:
    """The posterior of ρ and π given counts, on an unbounded scale."""

    # [1] Mosimann, J. E. (1962). On the compound multinomial distribution. Biometrika,
    # 49(1/2), 65-82. https://doi.org/10.2307/2333468

    # (n_parts,): parameters of the Dirichlet prior of π. Categories nobody used enter
    # the likelihood nowhere, so they are one part, the last, whose parameter is the sum
    # of theirs (the Dirichlet's aggregation property).
    prior: Floats = field(compare=False, repr=False)
    shape: float  # the prior of ρ is Beta(shape, shape): 1 is uniform
    # above, depth: (n_above,): part k and depth j of every factor A π_k + j there is
    above: NDArray[np.int64] = field(compare=False, repr=False)
    depth: NDArray[np.int64] = field(compare=False, repr=False)
    # (n_above,): n_kj: items with more than j ratings in category k, the factor's power
    times: Floats = field(compare=False, repr=False)
    # (largest number of ratings of an item,): n_j: items with more than j ratings, the
    # power of A + j
    times_below: Floats = field(compare=False, repr=False)

    @classmethod
    def of_counts(
        cls,
        counts: NDArray[np.int64],
        *,
        concentration: float = 1.0,
        shape: float = 1.0,
    ) -> "DirichletMultinomial":
        """Compress counts to all that matters."""
        # Takes counts (n_items, n_categories)
        used = counts.any(axis=0)
        prior = np.full(int(used.sum()), concentration)
        if not used.all():
            prior = np.append(prior, concentration * float((~used).sum()))
        n = counts.sum(axis=1)
        n_depths = int(n.max())
        deep = np.array([_items_above(column, n_depths) for column in counts.T[used]])
        above, depth = np.nonzero(deep)
        return cls(
            prior=prior,
            shape=shape,
            above=above,
            depth=depth,
            times=deep[above, depth].astype(np.float64),
            times_below=_items_above(n, n_depths).astype(np.float64),
        )

    @property
    def n_dimensions(self) -> int:
        """The logit of ρ, and the log-ratios of π to its last part."""
        return int(self.prior.size)

    def parts(self, position: Floats) -> tuple[Floats, Floats, Floats]:
        """Return ρ, 1 - ρ and π at unbounded positions."""
        # Takes position (n, n_dimensions)
        # ρ and 1 - ρ, both (n,), and π, (n, n_parts).
        rho, rest = expit(position[:, 0]), expit(-position[:, 0])
        ratios = np.column_stack([position[:, 1:], np.zeros(len(position))])
        ratios = np.exp(ratios - ratios.max(axis=1, keepdims=True))
        return rho, rest, ratios / ratios.sum(axis=1, keepdims=True)

    def log_likelihood(self, rho: Floats, rest: Floats, pi: Floats) -> Floats:
        """Return the log-likelihood, constants left out."""
        # With A = (1 - ρ)/ρ every factor A π_k + j and A + j of [1] times ρ is (1 - ρ)
        # π_k + j ρ and 1 - ρ + j ρ; there are as many above as below.
        # rho, rest (n,), pi (n, n_parts) -> (n,)
        above = rest[:, None] * pi[:, self.above] + rho[:, None] * self.depth
        below = rest[:, None] + rho[:, None] * np.arange(self.times_below.size)
        return np.asarray(np.log(above) @ self.times - np.log(below) @ self.times_below)

    def log_density(self, position: Floats) -> Floats:
        """Return the log posterior density of unbounded positions."""
        # Prior ρ ~ Beta(`shape`, `shape`) and π ~ Dirichlet(`prior`); the Jacobian is ρ
        # (1 - ρ) of the logit and Π π_k of the log-ratios.
        # position (n, n_dimensions) -> (n,)
        rho, rest, pi = self.parts(position)
        with np.errstate(divide="ignore", invalid="ignore"):  # far out a part is 0
            # Beta density (ρ (1 - ρ))^(shape - 1), times the Jacobian ρ (1 - ρ)
            of_rho = self.shape * (np.log(rho) + np.log(rest))
            # Dirichlet density Π π_k^(a_k - 1), times the Jacobian Π π_k
            of_pi = np.log(pi) @ self.prior
            density = self.log_likelihood(rho, rest, pi) + of_rho + of_pi
        return np.where(np.isfinite(density), density, -np.inf)


def _items_above(counts: NDArray[np.int64], n_depths: int) -> NDArray[np.int64]:
    # (n_items,) -> (n_depths,): items with more than j ratings, j = 0, 1, ...
    met = np.bincount(counts, minlength=n_depths + 1)
    return np.asarray(met[:0:-1].cumsum()[::-1])
