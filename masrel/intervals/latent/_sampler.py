"""Hamiltonian sampling of the latent-trait model until all that is reported converges.

Metric and step length are fitted in warm-up and then stay: a chain that goes on
adapting has no distribution to converge to.
"""

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from scipy.optimize import minimize

from masrel.agreement._engine import Floats
from masrel.intervals._mcmc import (
    MAX_R_HAT,
    Walkers,
    diagnose,
    not_converged,
    steps_needed,
)
from masrel.intervals.latent._coordinates import Information, Traits
from masrel.intervals.latent._density import LatentDensity
from masrel.intervals.latent._implied import (
    Agreement,
    Items,
    agreement_on_items,
    agreement_on_new_items,
)

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
EXPECTED_STEPS = 1_000
"""Steps of a chain that studies take, warm-up among them: from 400 to 2300."""

# Gradients of all chains that studies take, about 3000 to 12 000 where ratings place
# the items, 11 000 to 23 000 where they hardly do, 35 000 where raters disagree on one
# item alone; and checks.
_GRADIENTS = {"placed": 5_700, "loose": 15_000, "agreed": 30_000}
_AGREED = 0.05  # share of items with dissent below which raters agree on nearly all
_CHECKS = 4
_N_CURVED = 32  # chains at whose places the curvature is averaged
_UNKNOWN = 0.3  # deviation in which chains begin around ρ', f' and η
_WIDER = 2.0  # from where a variance of the draws is believed over the curvature
_MAX_KEPT = 500  # positions of a chain; beyond, every other one is dropped
_N_CHAINS = 64
_MANY = 1_000  # ratings from which half as many chains do: a step then costs by them
_MIN_CURVATURE = 0.2  # least curvature that is believed
_MAX_DROP = 0.75  # how far below the mode chains may begin, per dimension
_MAX_KAPPAS = 8_192  # positions where an integral over new items is computed

_Proposal = Callable[[Floats, np.random.RandomState], tuple[Floats, Floats]]


@dataclass(frozen=True, slots=True, kw_only=True)
class LatentFit:
    """The model after the data."""

    density: LatentDensity  # what was sampled
    # draws of kappa and of all in `parts`, in that order
    chains: "Chains" = field(repr=False)
    # where "kappa", "severity", "bias", "noise", "thresholds", "shares" (of the items,
    # the biases and the noises) and "noise_spread" are among the quantities
    parts: dict[str, slice]
    # of two new raters, at the positions where kappa was computed
    agreement: Agreement = field(repr=False)

    def draws(self, max_draws: int) -> Traits:
        """Return the unknowns at no more than so many positions of all chains."""
        return self.density.traits(_some(self.chains.positions, max_draws))


def fit_latent(
    density: LatentDensity,
    items: Items,
    *,
    generator: np.random.Generator,
    n_steps: int,
    max_steps: int,
    progress: Callable[[int], object] | None,
    expect: Callable[[int], object] | None = None,
) -> LatentFit:
    """Sample the model until every reported quantity has converged."""
    agreement: list[Agreement] = []

    def quantities(positions: Floats) -> list[Floats]:
        agreement[:] = [_agreement(density, positions, items)]
        kappa = agreement[0].kappa
        traits = density.traits(positions.reshape(-1, density.n_dimensions))
        columns = np.column_stack([part for _, part in _reported(traits)]).T
        rest = columns.reshape(len(columns), *positions.shape[:2])
        return [kappa.reshape(len(positions), -1), *rest]

    density, start, covariance = _begin(density, generator)
    chains = sample_smooth(
        density,
        quantities,
        start,
        covariance,
        generator=generator,
        n_steps=n_steps,
        max_steps=max_steps,
        progress=progress,
        expect=expect,
    )
    return LatentFit(
        density=density,
        chains=chains,
        parts=_parts(density.traits(start)),
        agreement=agreement[0],
    )


def _n_chains(density: LatentDensity) -> int:
    return _N_CHAINS // 2 if density.cells.side.size > _MANY else _N_CHAINS


def n_warm_up_steps() -> int:
    """Return how many steps of every chain are thrown away."""
    return sum(_WARM_UP)


def expected_run_seconds(density: LatentDensity, items: Items) -> float:
    """Return about how long the model takes to converge under one prior."""
    # Costs are those of one gradient and of kappa and the diagnostics at a check,
    # timed; how many there will be is what studies took.
    n_chains = _n_chains(density)
    position = np.tile(density.start(), (n_chains, 1))
    gradient = _timed(lambda: density.gradient(position))
    kappa = _timed(lambda: _agreement(density, position[:, None], items))
    draws = np.random.default_rng(0).standard_normal((n_chains, _MAX_KEPT // 2))
    check = _timed(lambda: diagnose(draws)) * (density.n_dimensions + 3)
    n_kappas = _MAX_KAPPAS / n_chains if items == "random" else _MAX_KEPT
    n_gradients = _GRADIENTS[_kind(density)]
    return n_gradients * gradient + _CHECKS * (check + n_kappas * kappa)


def _kind(density: LatentDensity) -> str:
    # of a study, among those of `_GRADIENTS`
    placed, beyond = density.coordinates.placed, density.coordinates.beyond
    if not placed.any():
        return "loose"
    return "agreed" if (beyond == 0.0).mean() < _AGREED else "placed"


def _timed(call: Callable[[], object]) -> float:
    # seconds, of the second of two calls
    for _ in range(2):
        begin = time.perf_counter()
        call()
    return time.perf_counter() - begin


def _reported(traits: Traits) -> list[tuple[str, Floats]]:
    # Severities and thresholds can all move together: from the mean of these items
    # they are known better than from the mean of their population.
    centre = traits.severity.mean(axis=1, keepdims=True)
    shares = (traits.item_share, traits.bias_variance, traits.noise_variance)
    return [
        ("severity", traits.severity - centre),
        ("bias", traits.bias),
        ("noise", traits.noise),
        ("thresholds", traits.thresholds - centre),
        ("shares", np.column_stack(shares)),
        ("noise_spread", traits.noise_spread[:, None]),
    ]


def _parts(traits: Traits) -> dict[str, slice]:
    named = [("kappa", 1)] + [(n, part.shape[1]) for n, part in _reported(traits)]
    ends = itertools.accumulate(size for _, size in named)
    return {
        name: slice(end - size, end)
        for (name, size), end in zip(named, ends, strict=True)
    }


def _agreement(density: LatentDensity, positions: Floats, items: Items) -> Agreement:
    if items == "fixed":
        flat = positions.reshape(-1, density.n_dimensions)
        return agreement_on_items(density.traits(flat))
    return agreement_on_new_items(density.traits(_some(positions, _MAX_KAPPAS)))


def _some(positions: Floats, max_draws: int) -> Floats:
    # (n_chains, n_kept, d) -> (n, d): every so many of each chain, the last included
    n_chains, n_kept, d = positions.shape
    every = -(-n_chains * n_kept // max_draws)
    return positions[:, (n_kept - 1) % every :: every].reshape(-1, d)


def _begin(
    density: LatentDensity, generator: np.random.Generator
) -> tuple[LatentDensity, Floats, Floats]:
    # -> starts (n_chains, d) spread as a normal, and its covariance. The joint density
    # has its mode in a spike of next to no volume: the peak is looked for with ρ, f
    # and η held.
    at = density.coordinates.share_start
    loose = np.delete(np.arange(density.n_dimensions), slice(at, at + 3))
    peak = density.start()

    def downhill(part: Floats) -> tuple[float, Floats]:
        row = np.array(peak)
        row[loose] = part
        value, slope = density.log_density(row[None]), density.gradient(row[None])
        return -float(value[0]), -slope[0, loose]

    optimum = minimize(downhill, peak[loose], jac=True, method="L-BFGS-B")
    peak[loose] = optimum.x
    density, peak = _informed(density, peak)
    held = np.ix_(loose, loose)
    covariance = _UNKNOWN**2 * np.eye(peak.size)
    covariance[held] = _inverse(_curvature(density, peak[None])[held])
    away = generator.standard_normal((_n_chains(density), peak.size))
    away = away @ np.linalg.cholesky(covariance).T
    lowest = -optimum.fun - _MAX_DROP * peak.size
    while (low := ~(density.log_density(peak + away) > lowest)).any():
        away[low] *= 0.8  # walls of the likelihood are nearer than a normal's
    return density, peak + away, covariance


def _informed(density: LatentDensity, peak: Floats) -> tuple[LatentDensity, Floats]:
    # -> with coordinates of biases and noises that know what ratings tell of each, as
    # seen at the peak; and the peak in them
    coordinates, point = density.coordinates, density.coordinates.point(peak[None])
    curvature = np.diag(_curvature(density, peak[None])) - 1.0
    n, first = coordinates.n_raters, coordinates.n_items
    scales = np.sqrt(1.0 - point.fraction[0, 0]), point.noise_sd[0, 0]
    parts = slice(first, first + n), slice(first + n, first + 2 * n)
    known = [
        Information.at_peak(peak[part], curvature[part], float(scale))
        for part, scale in zip(parts, scales, strict=True)
    ]
    peak = np.array(peak)
    peak[first : first + 2 * n] = 0.0
    informed = replace(coordinates, of_bias=known[0], of_noise=known[1])
    return replace(density, coordinates=informed), peak


def _curvature(density: "SmoothDensity", positions: Floats) -> Floats:
    # minus the second derivatives, (d, d), averaged over positions (n, d)
    n, d = positions.shape
    around = 1e-4 * np.eye(d)
    total = np.zeros((d, d))
    for first in range(0, d, _N_CHAINS):  # no more rows at once than there are chains
        rows = around[first : first + _N_CHAINS]
        for position in positions:
            slope = density.gradient(position - rows) - density.gradient(
                position + rows
            )
            total[first : first + len(rows)] += slope
    return np.asarray(0.5 * (total + total.T) / (2e-4 * n))


def _inverse(curvature: Floats) -> Floats:
    # -> a covariance
    values, axes = np.linalg.eigh(curvature)
    return np.asarray((axes / values.clip(_MIN_CURVATURE)) @ axes.T)


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
    max_steps: int,
    progress: Callable[[int], object] | None = None,
    expect: Callable[[int], object] | None = None,
) -> Chains:
    """Sample a density by Hamiltonian proposals until its quantities have converged."""
    # shape of start: (n_chains, n_dimensions); of covariance: n_dimensions squared;
    # expect is called with the steps there will be in all, as far as is known
    report, plan = progress or _silent, expect or _silent
    plan(EXPECTED_STEPS)
    walkers = _warm_up(density, start, covariance, generator, report)
    positions = np.empty((len(start), 0, start.shape[1]))
    total, thin, more = 0, 1, n_steps
    while total < max_steps:
        n_made, positions, thin = _go_on(walkers, more, positions, thin, report)
        total += n_made
        values = quantities(positions)
        r_hat, ess = np.array([diagnose(of_one) for of_one in values]).T
        if (r_hat < MAX_R_HAT).all() and (ess >= MIN_ESS).all():
            return Chains(
                positions=positions,
                values=values,
                r_hat=r_hat,
                ess=ess,
                n_steps=total,
                acceptance=walkers.acceptance,
            )
        needed = steps_needed(float(r_hat.max()), float(ess.min()), MIN_ESS)
        plan(sum(_WARM_UP) + int(total * max(needed, 1.0)))
        # no more than as many again: the first steps say little of how many it takes
        share = min(max(1.1 * needed - 1.0, 0.25), 1.0)
        more = min(int(share * total) + 1, max_steps - total)
    raise not_converged(total, float(r_hat.max()), float(ess.min()), MIN_ESS)


def _warm_up(
    density: SmoothDensity,
    start: Floats,
    covariance: Floats,
    generator: np.random.Generator,
    report: Callable[[int], object],
) -> Walkers:
    # fits the metric to where the chains went and the step to how many proposals
    # were taken
    step = _FIRST_STEP
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
            covariance = _inverse(_curvature(density, start[:_N_CURVED]))
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


def _silent(_: int) -> None: ...


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
