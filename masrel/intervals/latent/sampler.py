"""Sampling a density whose slopes are known, until all that is asked has converged."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from masrel.agreement._kernel import Floats
from masrel.intervals.latent.hamiltonian import hamiltonian_proposal
from masrel.intervals.mcmc import LARGEST_R_HAT, Walkers, diagnose, not_converged

__all__ = ["Chains", "SmoothDensity", "sample_smooth"]

LEAST_ESS = 4_000.0  # an end of a 95 % interval within .04 posterior deviations
_WARM_UP = (100, 100, 100)
_FIRST_STEP = 0.1
_BEST_ACCEPTANCE = (0.8, 0.97)
_MOST_KEPT = 500  # positions of a chain; beyond, every other one is dropped


class SmoothDensity(Protocol):
    """A log-density with its slopes, of many positions at once."""

    def log_density(self, position: Floats) -> Floats:
        """Return the logarithm, (n,), at positions (n, n_dimensions)."""

    def gradient(self, position: Floats) -> Floats:
        """Return its slopes, (n, n_dimensions)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Chains:
    """Draws of several quantities, converged."""

    # (n_chains, n_kept, n_dimensions): where the chains were after warm-up
    positions: Floats = field(compare=False, repr=False)
    # (n_chains, at most n_kept): the quantities there, or at some of them
    values: list[Floats] = field(compare=False, repr=False)
    # r_hat, ess: (n_quantities,): rank-normalized split R-hat; effective size of the
    # tails
    r_hat: Floats = field(compare=False, repr=False)
    ess: Floats = field(compare=False, repr=False)
    n_steps: int  # steps of every chain after warm-up, kept or not
    acceptance: float  # share of the proposals that were taken


def sample_smooth(
    density: SmoothDensity,
    quantities: Callable[[Floats], list[Floats]],
    start: Floats,
    covariance: Floats,
    *,
    generator: np.random.Generator,
    n_steps: int,
    most_steps: int,
    progress: Callable[[int], object] | None = None,
) -> Chains:
    """Sample a density by Hamiltonian proposals until its quantities have converged."""
    # Takes start (n_chains, n_dimensions), covariance (n_dimensions, n_dimensions)
    # Metric and step length are fitted in warm-up and then stay: a chain that goes on
    # adapting has no law to converge to.
    tell = progress or _silent
    walkers = _warm_up(density, start, covariance, generator, tell)
    kept = np.empty((len(start), 0, start.shape[1]))
    total, thin = 0, 1
    while total < most_steps:
        more = n_steps if total == 0 else min(total, most_steps - total)
        made, kept, thin = _go_on(walkers, more, kept, thin, tell)
        total += made
        values = quantities(kept)
        found = np.array([diagnose(of_one) for of_one in values])
        r_hat, ess = found.T
        if (r_hat < LARGEST_R_HAT).all() and (ess >= LEAST_ESS).all():
            return Chains(
                positions=kept,
                values=values,
                r_hat=r_hat,
                ess=ess,
                n_steps=total,
                acceptance=walkers.acceptance,
            )
    raise not_converged(total, float(r_hat.max()), float(ess.min()), LEAST_ESS)


def _warm_up(
    density: SmoothDensity,
    start: Floats,
    covariance: Floats,
    generator: np.random.Generator,
    tell: Callable[[int], object],
) -> Walkers:
    # fits the metric to where the chains went and the step to how many proposals
    # were taken
    step = _FIRST_STEP
    for n_steps in (*_WARM_UP, 0):
        root = np.linalg.cholesky(covariance).astype(np.float64)
        proposal = hamiltonian_proposal(density.gradient, root, step)
        walkers = Walkers(density.log_density, proposal, start, generator)
        if n_steps == 0:
            break
        positions = walkers.run(n_steps)
        tell(n_steps)
        start = positions[:, -1]
        covariance = _covariance(positions[:, n_steps // 2 :], covariance)
        if walkers.acceptance < _BEST_ACCEPTANCE[0]:
            step *= 0.6
        elif walkers.acceptance > _BEST_ACCEPTANCE[1]:
            step *= 1.5
    return walkers


def _covariance(positions: Floats, before: Floats) -> Floats:
    # (n_chains, n_steps, d) -> (d, d), with as much of the one before as it takes for
    # the draws, of which one in ten counts, to know every direction
    n_chains, n_steps, d = positions.shape
    found = np.asarray(np.cov(positions.reshape(-1, d).T), dtype=np.float64)
    mix = d / (d + n_chains * n_steps / 10)
    return np.asarray((1.0 - mix) * found.reshape(d, d) + mix * before)


def _go_on(
    walkers: Walkers,
    more: int,
    kept: Floats,
    thin: int,
    tell: Callable[[int], object],
) -> tuple[int, Floats, int]:
    # -> steps made, positions kept so far, and one in how many is
    parts, made = [kept], 0
    for _ in range(10):
        block = max(more // (10 * thin), 1) * thin
        parts.append(walkers.run(block, thin=thin))
        made += block
        tell(block)
    kept = np.concatenate(parts, axis=1)
    while kept.shape[1] > _MOST_KEPT:
        kept, thin = kept[:, 1::2], 2 * thin
    return made, kept, thin


def _silent(_: int) -> None: ...
