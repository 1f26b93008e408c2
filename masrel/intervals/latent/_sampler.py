"""Hamiltonian sampling of the latent-trait model until all that is reported converges.

Metric and step length are fitted in warm-up and then stay: a chain that goes on
adapting has no distribution to converge to.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import emcee
import numpy as np
from arviz_stats.base import array_stats

from masrel.agreement._engine import Floats
from masrel.errors import ConvergenceError
from masrel.intervals.latent._model import LatentDensity

MAX_R_HAT = 1.01

JOURNEY = 2.0
"""How far a proposal of the fitted step length goes, in units of the metric; with the
lengths there are, a quarter of an orbit on average, π/2."""

MIN_ESS = 4_000.0  # an end of a 95 % interval within .04 posterior deviations
_WARM_UP = (40, 40, 60, 40)  # the metric is fitted after each but the last
_BLOCK = 5  # steps of warm-up between two fits of the step length
_FIRST_STEP = 0.1
_STEPS = (0.02, 1.0)  # the least and the largest
_BEST_ACCEPTANCE = 0.8
LONGEST = 1.15  # the longest step length of a proposal, over the fitted one
SHORTEST = 0.27  # the shortest, as a share of the longest
_EXPECTED_STEPS = 1_000  # of a chain, before any is checked: studies take 400 to 2300
_N_CURVED = 32  # chains at whose places the curvature is averaged
_UNKNOWN = 0.3  # deviation of every coordinate in which chains begin
_WIDER = 2.0  # from where a variance of the draws is believed over the curvature
_MAX_KEPT = 500  # positions of a chain; beyond, every other one is dropped
_N_CHAINS = 64
_MANY = 1_000  # ratings from which half as many chains do: a step then costs by them
_MIN_CURVATURE = 0.2  # least curvature that is believed

Progress = Callable[[int, int], object]
"""Called with the number of steps made and the number expected in all."""

_Proposal = Callable[[Floats, np.random.RandomState], tuple[Floats, Floats]]


def n_warm_up_steps() -> int:
    """Return how many steps of every chain are thrown away."""
    return sum(_WARM_UP)


def begin(density: LatentDensity, generator: np.random.Generator) -> Floats:
    """Return where chains start, (n_chains, n_dimensions)."""
    n_chains = _N_CHAINS // 2 if density.codes.size > _MANY else _N_CHAINS
    away = generator.standard_normal((n_chains, density.n_dimensions))
    return density.start() + _UNKNOWN * away


def _covariance(density: LatentDensity, positions: Floats) -> Floats:
    # (d, d): the inverse of minus the mean second derivatives at positions (n, d)
    n, d = positions.shape
    around = 1e-4 * np.eye(d)
    total = np.zeros((d, d))
    for first in range(0, d, _N_CHAINS):  # no more rows at once than there are chains
        rows = around[first : first + _N_CHAINS]
        for position in positions:
            before, after = position - rows, position + rows
            slope = density.gradient(before) - density.gradient(after)
            total[first : first + len(rows)] += slope
    values, axes = np.linalg.eigh(0.5 * (total + total.T) / (2e-4 * n))
    return np.asarray((axes / values.clip(_MIN_CURVATURE)) @ axes.T)


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Chains:
    """Draws of several quantities, converged."""

    # (n_chains, n_kept, n_dimensions): where the chains were after warm-up
    positions: Floats = field(compare=False, repr=False)
    # by name: the quantities there, or at some of them, (n_chains, at most n_kept, n)
    values: dict[str, Floats] = field(compare=False, repr=False)
    # by name: rank-normalized split R-hat and effective size of the tails, (n, 2)
    diagnostics: dict[str, Floats] = field(compare=False, repr=False)
    n_steps: int  # steps of every chain after warm-up, kept or not

    def draws(self, name: str, index: int = 0) -> Floats:
        """Return the draws of one number, (n_chains, at most n_kept)."""
        return self.values[name][..., index]

    @property
    def worst(self) -> tuple[float, float]:
        """The largest R-hat and the smallest effective size."""
        r_hat, ess = np.concatenate(list(self.diagnostics.values())).T
        return float(r_hat.max()), float(ess.min())


def sample_smooth(
    density: LatentDensity,
    quantities: Callable[[Floats], dict[str, Floats]],
    start: Floats,
    *,
    generator: np.random.Generator,
    n_steps: int,
    max_steps: int,
    progress: Progress | None = None,
) -> Chains:
    """Sample a density by Hamiltonian proposals until its quantities have converged."""
    # shape of start: (n_chains, n_dimensions)
    n_made, n_expected = 0, _EXPECTED_STEPS

    def report(n_steps: int) -> None:
        nonlocal n_made
        n_made += n_steps
        if progress is not None:
            progress(n_made, max(n_made, n_expected))

    walkers = _warm_up(density, start, generator, report)
    positions = np.empty((len(start), 0, start.shape[1]))
    total, thin, more = 0, 1, n_steps
    while total < max_steps:
        n_more, positions, thin = _go_on(walkers, more, positions, thin, report)
        total += n_more
        values = quantities(positions)
        chains = Chains(
            positions=positions,
            values=values,
            diagnostics={
                name: np.array([diagnose(one) for one in np.moveaxis(of, 2, 0)])
                for name, of in values.items()
            },
            n_steps=total,
        )
        r_hat, ess = chains.worst
        if r_hat < MAX_R_HAT and ess >= MIN_ESS:
            return chains
        # how many times as many steps it takes in all
        needed = max((r_hat - 1.0) / (MAX_R_HAT - 1.0), MIN_ESS / max(ess, 1.0))
        n_expected = n_warm_up_steps() + int(total * max(needed, 1.0))
        # no more than as many again: the first steps say little of how many it takes
        share = min(max(1.1 * needed - 1.0, 0.25), 1.0)
        more = min(int(share * total) + 1, max_steps - total)
    further = int(total * needed) - total if np.isfinite(needed) else total
    raise ConvergenceError(
        f"the sampler has not converged after {total} steps: R-hat {r_hat:.4f} (needs "
        f"below {MAX_R_HAT}), effective size {ess:.0f} (needs {MIN_ESS:.0f}); "
        f"about {max(further, 1)} more steps are needed"
    )


class Walkers:
    """Independent chains, moved by one proposal."""

    # Foreman-Mackey, D. et al. (2013). emcee: The MCMC Hammer. PASP, 125, 306.
    # https://doi.org/10.1086/670067
    # shape of start: (n_chains, n_dimensions)

    def __init__(
        self,
        log_density: Callable[[Floats], Floats],
        proposal: _Proposal,
        start: Floats,
        generator: np.random.Generator,
    ) -> None:
        # emcee passes over a numpy Generator without a word: it wants legacy state.
        legacy = np.random.RandomState(generator.integers(2**32, dtype=np.uint64))
        random = tuple(legacy.get_state(legacy=True))
        self._state = emcee.State(start, random_state=random)
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


def _warm_up(
    density: LatentDensity,
    start: Floats,
    generator: np.random.Generator,
    report: Callable[[int], object],
) -> Walkers:
    # fits the metric to where the chains went and the step to how many proposals
    # were taken
    step, covariance = _FIRST_STEP, np.eye(start.shape[1])
    for stage, n_steps in enumerate(_WARM_UP):
        root = np.linalg.cholesky(covariance).astype(np.float64)
        positions = []
        for first in range(0, n_steps, _BLOCK):
            proposal = hamiltonian_proposal(density.gradient, root, step)
            walkers = Walkers(density.log_density, proposal, start, generator)
            positions.append(walkers.run(min(_BLOCK, n_steps - first)))
            start = positions[-1][:, -1]
            report(positions[-1].shape[1])
            step *= float(np.exp(walkers.acceptance - _BEST_ACCEPTANCE))
            step = min(max(step, _STEPS[0]), _STEPS[1])
        if stage < len(_WARM_UP) - 1:
            covariance = _covariance(density, start[:_N_CURVED])
            if stage > 0:
                late = np.concatenate(positions[len(positions) // 2 :], axis=1)
                covariance = _widened(covariance, late)
    proposal = hamiltonian_proposal(density.gradient, root, step)
    return Walkers(density.log_density, proposal, start, generator)


def _widened(covariance: Floats, positions: Floats) -> Floats:
    # -> (d, d), with the variance of positions (n_chains, n, d) along the directions
    # in which they went much farther; in others so few of them know less than slopes
    root = np.linalg.cholesky(covariance)
    flat = positions.reshape(-1, positions.shape[2])
    sample = np.asarray(np.cov(flat @ np.linalg.inv(root).T, rowvar=False))
    values, axes = np.linalg.eigh(sample.reshape(covariance.shape))
    wide = np.where(values > _WIDER, values, 1.0)
    return np.asarray(root @ (axes * wide) @ axes.T @ root.T)


def _go_on(
    walkers: Walkers,
    more: int,
    positions: Floats,
    thin: int,
    report: Callable[[int], object],
) -> tuple[int, Floats, int]:
    # -> steps made, positions so far, and one in how many is kept
    parts, n_made = [positions], 0
    for _ in range(10):
        block = max(more // (10 * thin), 1) * thin
        parts.append(walkers.run(block, thin=thin))
        n_made += block
        report(block)
    positions = np.concatenate(parts, axis=1)
    while positions.shape[1] > _MAX_KEPT:
        positions, thin = positions[:, 1::2], 2 * thin
    return n_made, positions, thin


def hamiltonian_proposal(
    gradient: Callable[[Floats], Floats],
    root: Floats,
    step: float,
) -> _Proposal:
    """Make a proposal for a Metropolis step of many walkers at once."""
    # Each walker gets a momentum p ~ N(0, I) and a step length of its own, and moves by
    # leapfrog steps in coordinates whose covariance is about I.
    # Takes root (n_dimensions, n_dimensions). Few steps are much shorter than the
    # others; they lead out of corners.
    # Positions and random state to new positions and the logarithms of what the ratio
    # of densities is multiplied by: exp(|p|²/2 - |p'|²/2). A leapfrog keeps volume and
    # is its own inverse but for the sign of p, so that this is all.
    # [1] Neal, R. M. (2011). MCMC using Hamiltonian dynamics. Handbook of Markov Chain
    # Monte Carlo, ch. 5, eqs. 5.18-5.20. https://arxiv.org/abs/1206.1901
    leaps = int(np.ceil(JOURNEY / step))

    def propose(
        position: Floats, random: np.random.RandomState
    ) -> tuple[Floats, Floats]:
        momentum = random.standard_normal(position.shape)
        length = random.uniform(size=(len(position), 1)) ** 1.5
        length = LONGEST * step * SHORTEST**length
        before = 0.5 * (momentum**2).sum(axis=1)
        with np.errstate(over="ignore", invalid="ignore"):  # a wall; not taken then
            momentum = momentum + 0.5 * length * (gradient(position) @ root)
            for leap in range(leaps):
                position = position + length * (momentum @ root.T)
                share = 1.0 if leap < leaps - 1 else 0.5
                momentum = momentum + share * length * (gradient(position) @ root)
            return position, before - 0.5 * (momentum**2).sum(axis=1)

    return propose
