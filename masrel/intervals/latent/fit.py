"""From codes to converged chains of the latent-trait model."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import minimize

from masrel.agreement._kernel import Floats
from masrel.intervals.latent.density import LatentDensity
from masrel.intervals.latent.kappa import (
    Agreement,
    agreement_on_items,
    agreement_on_new_items,
)
from masrel.intervals.latent.ratings import Items
from masrel.intervals.latent.sampler import Chains, sample_smooth
from masrel.intervals.latent.traits import Traits

__all__ = ["LatentFit", "fit_latent"]

_N_CHAINS = 64
_FLATTEST = 0.2  # least curvature at the mode that is believed
_FURTHEST = 0.75  # how far below the mode chains may begin, per dimension
_MOST_KAPPAS = 8_192  # positions where an integral over new items is computed


@dataclass(frozen=True, slots=True, kw_only=True)
class LatentFit:
    """The model after the data."""

    density: LatentDensity  # what was sampled
    # draws of kappa and of all in `parts`, in that order
    chains: Chains = field(repr=False)
    # where "kappa", "severity", "bias", "noise", "thresholds", "shares" (of the items,
    # the biases and the noises) and "noise_spread" are among the quantities
    parts: dict[str, slice]
    # of two new raters, at the positions where kappa was computed
    agreement: Agreement = field(repr=False)

    def draws(self, most: int) -> Traits:
        """Return the unknowns at no more than so many positions of all chains."""
        return self.density.traits(_some(self.chains.positions, most))


def fit_latent(
    density: LatentDensity,
    items: Items,
    *,
    generator: np.random.Generator,
    n_steps: int,
    most_steps: int,
    progress: Callable[[int], object] | None,
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

    start, covariance = _begin(density, generator)
    chains = sample_smooth(
        density,
        quantities,
        start,
        covariance,
        generator=generator,
        n_steps=n_steps,
        most_steps=most_steps,
        progress=progress,
    )
    return LatentFit(
        density=density,
        chains=chains,
        parts=_parts(density.traits(start)),
        agreement=agreement[0],
    )


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
    return agreement_on_new_items(density.traits(_some(positions, _MOST_KAPPAS)))


def _some(positions: Floats, most: int) -> Floats:
    # (n_chains, n_kept, d) -> (n, d): every so many of each chain, the last included
    n_chains, n_kept, d = positions.shape
    every = -(-n_chains * n_kept // most)
    return positions[:, (n_kept - 1) % every :: every].reshape(-1, d)


def _begin(
    density: LatentDensity, generator: np.random.Generator
) -> tuple[Floats, Floats]:
    # -> starts (n_chains, d) spread as a normal around the mode, and its covariance
    tilt = density.counterweight

    def height(x: Floats) -> Floats:
        return np.asarray(density.log_density(x) + x @ tilt)

    def downhill(x: Floats) -> tuple[float, Floats]:
        row = x[None]
        return -float(height(row)[0]), -density.gradient(row)[0] - tilt

    found = minimize(downhill, density.middle_of_prior(), jac=True, method="BFGS")
    mode = found.x
    around = 1e-4 * np.eye(mode.size)
    slopes = density.gradient(mode + around) - density.gradient(mode - around)
    bend = -0.5 * (slopes + slopes.T) / 2e-4
    curvature, axes = np.linalg.eigh(bend)
    covariance = (axes / curvature.clip(_FLATTEST)) @ axes.T
    away = generator.standard_normal((_N_CHAINS, mode.size))
    away = away @ np.linalg.cholesky(covariance).T
    lowest = -found.fun - _FURTHEST * mode.size
    while (low := ~(height(mode + away) > lowest)).any():
        away[low] *= 0.8  # walls of the likelihood are nearer than a normal's
    return mode + away, covariance
