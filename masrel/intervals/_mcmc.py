"""Sampling a posterior with emcee; the only place that knows emcee and arviz-stats."""

from collections.abc import Callable
from dataclasses import dataclass, field

import emcee
import numpy as np
from arviz_stats.base import array_stats

from masrel.agreement._engine import Floats
from masrel.errors import ConvergenceError

N_ENSEMBLES = 4
WALKERS_PER_DIMENSION = 20  # a step costs emcee more than its walkers do
MAX_R_HAT = 1.01
MIN_ESS = 20_000.0  # endpoints within about 0.002 on Table V


@dataclass(frozen=True, slots=True, kw_only=True)
class Draws:
    """Draws of one quantity, converged."""

    # (n_chains, n_steps): one chain a walker, after burn-in
    values: Floats = field(compare=False, repr=False)
    r_hat: float  # rank-normalized split R-hat over all walkers of all ensembles
    ess: float  # effective sample size of the tails

    def quantile(self, share: float) -> float:
        """Return a quantile of all draws."""
        return float(np.quantile(self.values, share))

    def quantile_error(self, share: float) -> float:
        """Return the Monte Carlo standard error of a quantile."""
        return quantile_error(self.values, share)


def sample(
    log_density: Callable[[Floats], Floats],
    n_dimensions: int,
    quantity: Callable[[Floats], Floats],
    *,
    generator: np.random.Generator,
    n_steps: int,
    max_steps: int,
) -> Draws:
    """Sample a density until one quantity of it has converged."""
    # The ensembles start far from each other and stay independent. The move is
    # differential evolution; the snooker variant of emcee 3.1.6 does not keep the
    # density.
    # [1] Foreman-Mackey, D. et al. (2013). emcee: The MCMC Hammer. PASP, 125, 306.
    # https://doi.org/10.1086/670067
    # [2] Vehtari, A. et al. (2021). Rank-normalization, folding, and localization: an
    # improved R-hat. Bayesian Analysis, 16(2), 667-718.
    # https://doi.org/10.1214/20-BA1221
    ensembles = [
        _Ensemble(log_density, n_dimensions, generator) for _ in range(N_ENSEMBLES)
    ]
    total = 0
    while total < max_steps:
        more = n_steps if total == 0 else min(total, max_steps - total)
        for ensemble in ensembles:
            ensemble.run(more)
        total += more
        chains = np.concatenate([e.values(quantity, total // 3) for e in ensembles])
        r_hat, ess = diagnose(chains)
        if r_hat < MAX_R_HAT and ess >= MIN_ESS:
            return Draws(values=chains, r_hat=r_hat, ess=ess)
    raise not_converged(total, r_hat, ess, MIN_ESS)


def diagnose(chains: Floats) -> tuple[float, float]:
    """Return rank-normalized split R-hat and the effective sample size of the tails."""
    # shape of chains: (n_chains, n_steps)
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
        self._state = emcee.State(start, random_state=_legacy_state(generator))
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
