"""Chains that emcee moves and arviz-stats judges; nobody else knows these two."""

from collections.abc import Callable

import emcee
import numpy as np
from arviz_stats.base import array_stats

from masrel.agreement._engine import Floats
from masrel.errors import ConvergenceError

MAX_R_HAT = 1.01


def diagnose(chains: Floats) -> tuple[float, float]:
    """Return rank-normalized split R-hat and the effective sample size of the tails."""
    # shape of chains: (n_chains, n_steps)
    # Vehtari, A. et al. (2021). Rank-normalization, folding, and localization: an
    # improved R-hat. Bayesian Analysis, 16(2), 667-718.
    # https://doi.org/10.1214/20-BA1221
    r_hat = array_stats.rhat(chains, chain_axis=0, draw_axis=1)
    ess = array_stats.ess(
        chains, chain_axis=0, draw_axis=1, method="tail", prob=(0.025, 0.975)
    )
    return float(r_hat), float(ess)


def quantile_error(chains: Floats, share: float) -> float:
    """Return the Monte Carlo standard error of a quantile."""
    # shape of chains: (n_chains, n_steps)
    error = array_stats.mcse(
        chains, chain_axis=0, draw_axis=1, method="quantile", prob=share
    )
    return float(error)


def steps_needed(r_hat: float, ess: float, min_ess: float) -> float:
    """Return how many times as many steps it takes in all."""
    return max((r_hat - 1.0) / (MAX_R_HAT - 1.0), min_ess / max(ess, 1.0))


def not_converged(
    total: int, r_hat: float, ess: float, min_ess: float
) -> ConvergenceError:
    """Return the error that says how many more steps a sampler needs."""
    needed = steps_needed(r_hat, ess, min_ess)
    more = int(total * needed) - total if np.isfinite(needed) else total
    return ConvergenceError(
        f"the sampler has not converged after {total} steps: R-hat {r_hat:.4f} (needs "
        f"below {MAX_R_HAT}), effective size {ess:.0f} (needs {min_ess:.0f}); "
        f"about {max(more, 1)} more steps are needed"
    )


class Walkers:
    """Independent chains, moved by one proposal."""

    # Foreman-Mackey, D. et al. (2013). emcee: The MCMC Hammer. PASP, 125, 306.
    # https://doi.org/10.1086/670067
    # shape of start: (n_chains, n_dimensions)

    def __init__(
        self,
        log_density: Callable[[Floats], Floats],
        proposal: Callable[[Floats, np.random.RandomState], tuple[Floats, Floats]],
        start: Floats,
        generator: np.random.Generator,
    ) -> None:
        self._state = emcee.State(start, random_state=_legacy_state(generator))
        self._sampler = emcee.EnsembleSampler(
            *start.shape,
            log_density,
            moves=emcee.moves.MHMove(proposal),
            vectorize=True,
        )

    def run(self, n_steps: int, *, thin: int = 1) -> Floats:
        """Go on, and return every `thin`-th position, (n_chains, kept, dimensions)."""
        self._sampler.reset()
        self._state = self._sampler.run_mcmc(
            self._state, n_steps // thin, thin_by=thin, skip_initial_state_check=True
        )
        return np.ascontiguousarray(self._sampler.get_chain().swapaxes(0, 1))

    @property
    def acceptance(self) -> float:
        """Share of the proposals of the last run that were taken."""
        return float(self._sampler.acceptance_fraction.mean())


def _legacy_state(generator: np.random.Generator) -> tuple[object, ...]:
    # emcee passes over a numpy Generator without a word: it wants legacy state.
    legacy = np.random.RandomState(generator.integers(2**32, dtype=np.uint64))
    return tuple(legacy.get_state(legacy=True))
