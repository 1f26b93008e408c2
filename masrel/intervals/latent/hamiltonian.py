"""Hamiltonian proposals: far steps along the slopes of a density."""

from collections.abc import Callable

import numpy as np

from masrel.agreement._kernel import Floats

__all__ = ["JOURNEY", "hamiltonian_proposal"]

JOURNEY = 1.5
"""How far a proposal goes in units of the metric: a quarter of an orbit is π/2."""

Proposal = Callable[[Floats, np.random.RandomState], tuple[Floats, Floats]]


def hamiltonian_proposal(
    gradient: Callable[[Floats], Floats], root: Floats, step: float
) -> Proposal:
    """Make a proposal for a Metropolis step of many walkers at once."""
    # Each walker gets a momentum p ~ N(0, I) and a step length of its own, and moves by
    # leapfrog steps in coordinates whose covariance is about I.
    # Takes root (n_dimensions, n_dimensions)
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
        length = 1.4 * step * 0.1 ** random.uniform(size=(len(position), 1))
        before = 0.5 * (momentum**2).sum(axis=1)
        with np.errstate(over="ignore", invalid="ignore"):  # a wall; not taken then
            momentum = momentum + 0.5 * length * (gradient(position) @ root)
            for leap in range(leaps):
                position = position + length * (momentum @ root.T)
                share = 1.0 if leap < leaps - 1 else 0.5
                momentum = momentum + share * length * (gradient(position) @ root)
            return position, before - 0.5 * (momentum**2).sum(axis=1)

    return propose
