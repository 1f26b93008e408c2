"""The Dirichlet-multinomial model of agreement, as a log-density.

An item has category probabilities p ~ Dirichlet(A π); its ratings are multinomial.
Then ρ = 1 / (1 + A) is the population value of Fleiss' kappa.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from masrel.agreement.kernel import Floats

__all__ = ["DirichletMultinomial"]


@dataclass(frozen=True, slots=True, kw_only=True)
class DirichletMultinomial:
    """The posterior of ρ and π given counts, on an unbounded scale.

    Attributes
    ----------
    prior : ndarray, shape (n_parts,)
        Parameters of the Dirichlet prior of π. Categories nobody used enter the
        likelihood nowhere, so they are one part, the last, whose parameter is the
        sum of theirs (the Dirichlet's aggregation property).
    shape : float
        The prior of ρ is Beta(shape, shape): 1 is uniform.
    above, depth : ndarray of int64, shape (n_above,)
        Part k and depth j of every factor A π_k + j there is.
    times : ndarray, shape (n_above,)
        N_kj: items with more than j ratings in category k, the factor's power.
    times_below : ndarray, shape (largest number of ratings of an item,)
        n_j: items with more than j ratings, the power of A + j.

    References
    ----------
    .. [1] Mosimann, J. E. (1962). On the compound multinomial distribution.
       Biometrika, 49(1/2), 65-82. https://doi.org/10.2307/2333468
    """

    prior: Floats = field(compare=False, repr=False)
    shape: float
    above: NDArray[np.int64] = field(compare=False, repr=False)
    depth: NDArray[np.int64] = field(compare=False, repr=False)
    times: Floats = field(compare=False, repr=False)
    times_below: Floats = field(compare=False, repr=False)

    @classmethod
    def of_counts(
        cls,
        counts: NDArray[np.int64],
        *,
        concentration: float = 1.0,
        shape: float = 1.0,
    ) -> "DirichletMultinomial":
        """Compress counts to all that matters.

        Parameters
        ----------
        counts : ndarray of int64, shape (n_items, n_categories)
            Raters per item and category, at least two categories and one rating.
        concentration : float, optional
            The prior of π is Dirichlet(concentration, ...) over all categories.
        shape : float, optional
            The prior of ρ is Beta(shape, shape).

        Returns
        -------
        DirichletMultinomial
            The model.
        """
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
        """Return ρ, 1 - ρ and π at unbounded positions.

        Parameters
        ----------
        position : ndarray, shape (n, n_dimensions)
            logit ρ, then log(π_k / π_last).

        Returns
        -------
        tuple of ndarray
            ρ and 1 - ρ, both (n,), and π, (n, n_parts).
        """
        rho, rest = expit(position[:, 0]), expit(-position[:, 0])
        ratios = np.column_stack([position[:, 1:], np.zeros(len(position))])
        ratios = np.exp(ratios - ratios.max(axis=1, keepdims=True))
        return rho, rest, ratios / ratios.sum(axis=1, keepdims=True)

    def log_likelihood(self, rho: Floats, rest: Floats, pi: Floats) -> Floats:
        """Return the log-likelihood, constants left out.

        With A = (1 - ρ)/ρ every factor A π_k + j and A + j of [1] times ρ is
        (1 - ρ) π_k + j ρ and 1 - ρ + j ρ; there are as many above as below.

        Parameters
        ----------
        rho, rest : ndarray, shape (n,)
            ρ and 1 - ρ.
        pi : ndarray, shape (n, n_parts)
            Shares of the categories.

        Returns
        -------
        ndarray, shape (n,)
            Its logarithm.
        """
        above = rest[:, None] * pi[:, self.above] + rho[:, None] * self.depth
        below = rest[:, None] + rho[:, None] * np.arange(self.times_below.size)
        return np.asarray(np.log(above) @ self.times - np.log(below) @ self.times_below)

    def log_density(self, position: Floats) -> Floats:
        """Return the log posterior density of unbounded positions.

        Prior ρ ~ Beta(`shape`, `shape`) and π ~ Dirichlet(`prior`); the Jacobian is
        ρ (1 - ρ) of the logit and Π π_k of the log-ratios.

        Parameters
        ----------
        position : ndarray, shape (n, n_dimensions)
            As in `parts`.

        Returns
        -------
        ndarray, shape (n,)
            The logarithm, up to a constant; -inf where it is 0 in floating point.
        """
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
