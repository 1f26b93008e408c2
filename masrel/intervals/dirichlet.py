"""The Dirichlet-multinomial model of agreement, as a log-density.

An item has category probabilities p ~ Dirichlet(A π); its ratings are multinomial.
Then ρ = 1 / (1 + A) is the population value of Fleiss' kappa.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.kernel import Floats

__all__ = ["DirichletMultinomial"]


@dataclass(frozen=True, slots=True, kw_only=True)
class DirichletMultinomial:
    """The posterior of ρ and π given counts, on an unbounded scale.

    Attributes
    ----------
    deep : ndarray of int64, shape (depth, n_categories)
        N_kj: items with more than j ratings in category k. All the likelihood needs.
    deep_items : ndarray of int64, shape (depth,)
        n_j: items with more than j ratings.

    References
    ----------
    .. [1] Mosimann, J. E. (1962). On the compound multinomial distribution.
       Biometrika, 49(1/2), 65-82. https://doi.org/10.2307/2333468
    """

    deep: NDArray[np.int64] = field(compare=False, repr=False)
    deep_items: NDArray[np.int64] = field(compare=False, repr=False)

    @classmethod
    def of_counts(cls, counts: NDArray[np.int64]) -> "DirichletMultinomial":
        """Compress counts of shape (n_items, n_categories)."""
        n = counts.sum(axis=1)
        depth = np.arange(int(n.max(initial=0)))
        deep = (counts[None] > depth[:, None, None]).sum(axis=1)
        return cls(deep=deep, deep_items=(n[None] > depth[:, None]).sum(axis=1))

    @property
    def n_dimensions(self) -> int:
        """The logit of ρ, and the log-ratios of π to its last part."""
        return int(self.deep.shape[1])

    def parts(self, position: Floats) -> tuple[Floats, Floats, Floats]:
        """Return ρ, 1 - ρ and π at unbounded positions.

        Parameters
        ----------
        position : ndarray, shape (n, n_dimensions)
            logit ρ, then log(π_k / π_last).

        Returns
        -------
        tuple of ndarray
            ρ and 1 - ρ, both (n,), and π, (n, n_categories).
        """
        rho = 1.0 / (1.0 + np.exp(-position[:, 0]))
        rest = 1.0 / (1.0 + np.exp(position[:, 0]))
        ratios = np.column_stack([position[:, 1:], np.zeros(len(position))])
        ratios = np.exp(ratios - ratios.max(axis=1, keepdims=True))
        return rho, rest, ratios / ratios.sum(axis=1, keepdims=True)

    def log_likelihood(self, rho: Floats, rest: Floats, pi: Floats) -> Floats:
        """Return the log-likelihood, constants left out.

        With A = (1 - ρ)/ρ every factor A π_k + j and A + j of [1] times ρ is
        (1 - ρ) π_k + j ρ and 1 - ρ + j ρ; there are as many above as below.
        """
        depth = np.arange(len(self.deep_items))
        above = (
            rest[:, None, None] * pi[:, None, :] + rho[:, None, None] * depth[:, None]
        )
        below = rest[:, None] + rho[:, None] * depth
        used = np.log(np.where(self.deep > 0, above, 1.0))
        return np.asarray(
            (self.deep * used).sum(axis=(1, 2))
            - (self.deep_items * np.log(below)).sum(1)
        )

    def log_density(self, position: Floats) -> Floats:
        """Return the log posterior density of unbounded positions.

        Prior ρ ~ U(0, 1) and π ~ Dirichlet(1, ..., 1); the Jacobian is ρ (1 - ρ) of
        the logit and Π π_k of the log-ratios.
        """
        rho, rest, pi = self.parts(position)
        with np.errstate(divide="ignore"):  # far out a part is 0, and its density too
            jacobian = np.log(rho) + np.log(rest) + np.log(pi).sum(axis=1)
            density = self.log_likelihood(rho, rest, pi) + jacobian
        return np.where(np.isfinite(density), density, -np.inf)
