"""Sampling a posterior with emcee; the only place that knows emcee and arviz-stats."""

from collections.abc import Callable
from dataclasses import dataclass, field

import emcee
import numpy as np
from arviz_stats.base import array_stats

from masrel.agreement.kernel import Floats
from masrel.errors import ConvergenceError

__all__ = ["Draws", "sample"]

N_ENSEMBLES = 4
WALKERS_PER_DIMENSION = 20  # a step costs emcee more than its walkers do
LARGEST_R_HAT = 1.01
LEAST_ESS = 20_000.0  # endpoints within about 0.002 on Table V


@dataclass(frozen=True, slots=True, kw_only=True)
class Draws:
    """Draws of one quantity, converged.

    Attributes
    ----------
    values : ndarray, shape (n_chains, n_steps)
        One chain a walker, after burn-in.
    r_hat : float
        Rank-normalized split R-hat over all walkers of all ensembles.
    ess : float
        Effective sample size of the tails.
    """

    values: Floats = field(compare=False, repr=False)
    r_hat: float
    ess: float

    def quantile(self, share: float) -> float:
        """Return a quantile of all draws."""
        return float(np.quantile(self.values, share))

    def quantile_error(self, share: float) -> float:
        """Return the Monte Carlo standard error of a quantile."""
        error = array_stats.mcse(
            self.values, chain_axis=0, draw_axis=1, method="quantile", prob=share
        )
        return float(error)


def sample(
    log_density: Callable[[Floats], Floats],
    n_dimensions: int,
    quantity: Callable[[Floats], Floats],
    *,
    generator: np.random.Generator,
    n_steps: int,
    most_steps: int,
) -> Draws:
    """Sample a density until one quantity of it has converged.

    Parameters
    ----------
    log_density : callable
        Positions of shape (n, n_dimensions) to log-densities of shape (n,).
    n_dimensions : int
        Dimensions of a position.
    quantity : callable
        Positions to values of shape (n,).
    generator : Generator
        Where randomness comes from.
    n_steps : int
        Steps of every walker at first; the first third is burn-in. Doubled until
        converged.
    most_steps : int
        Where it gives up.

    Returns
    -------
    Draws
        R-hat below 1.01 and an effective size of at least 20 000 in the tails.

    Raises
    ------
    ConvergenceError
        If it has not converged after `most_steps`; says how many steps it needs.

    Notes
    -----
    The ensembles start apart and do not see each other. The move is differential
    evolution; the snooker variant of emcee 3.1.6 does not keep the density.

    References
    ----------
    .. [1] Foreman-Mackey, D. et al. (2013). emcee: The MCMC Hammer. PASP, 125, 306.
       https://doi.org/10.1086/670067
    .. [2] Vehtari, A. et al. (2021). Rank-normalization, folding, and localization:
       an improved R-hat. Bayesian Analysis, 16(2), 667-718.
       https://doi.org/10.1214/20-BA1221
    """
    ensembles = [
        _Ensemble(log_density, n_dimensions, generator) for _ in range(N_ENSEMBLES)
    ]
    total = 0
    while total < most_steps:
        more = n_steps if total == 0 else min(total, most_steps - total)
        for ensemble in ensembles:
            ensemble.run(more)
        total += more
        chains = np.concatenate([e.values(quantity, total // 3) for e in ensembles])
        r_hat = float(array_stats.rhat(chains, chain_axis=0, draw_axis=1))
        ess = float(
            array_stats.ess(
                chains, chain_axis=0, draw_axis=1, method="tail", prob=(0.025, 0.975)
            )
        )
        if r_hat < LARGEST_R_HAT and ess >= LEAST_ESS:
            return Draws(values=chains, r_hat=r_hat, ess=ess)
    # R-hat - 1 falls as one over the steps.
    needed = max((r_hat - 1.0) / (LARGEST_R_HAT - 1.0), LEAST_ESS / max(ess, 1.0))
    raise ConvergenceError(
        f"the sampler has not converged after {total} steps: R-hat {r_hat:.4f} (needs "
        f"below {LARGEST_R_HAT}), effective size {ess:.0f} (needs {LEAST_ESS:.0f}); "
        f"about {int(total * needed) - total} more steps are needed"
    )


class _Ensemble:
    """One ensemble of walkers with randomness of its own."""

    def __init__(
        self,
        log_density: Callable[[Floats], Floats],
        n_dimensions: int,
        generator: np.random.Generator,
    ) -> None:
        n_walkers = max(16, WALKERS_PER_DIMENSION * n_dimensions)
        start = generator.normal(scale=1.5, size=(n_walkers, n_dimensions))
        # emcee passes over a numpy Generator without a word: it wants legacy state.
        legacy = np.random.RandomState(generator.integers(2**32, dtype=np.uint64))
        self._state = emcee.State(start, random_state=legacy.get_state())
        self._sampler = emcee.EnsembleSampler(
            n_walkers,
            n_dimensions,
            log_density,
            moves=[(emcee.moves.DEMove(), 0.9), (emcee.moves.DEMove(gamma0=1.0), 0.1)],
            vectorize=True,
        )

    def run(self, n_steps: int) -> None:
        """Go on from where it stands."""
        self._state = self._sampler.run_mcmc(self._state, n_steps)

    def values(self, quantity: Callable[[Floats], Floats], burn_in: int) -> Floats:
        """Return the quantity, shape (n_walkers, n_steps)."""
        chain = self._sampler.get_chain(discard=burn_in)  # (n_steps, n_walkers, d)
        flat = quantity(chain.reshape(-1, chain.shape[-1]))
        return np.ascontiguousarray(flat.reshape(chain.shape[:2]).T)
