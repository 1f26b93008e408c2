"""The unknowns of the latent-trait model at many positions."""

from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtr

from masrel.agreement._kernel import Floats

__all__ = ["Traits", "between", "grade_shares", "normal"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Traits:
    """The unknowns at n positions, on the scale where a rating has variance 1."""

    severity: Floats = field(compare=False, repr=False)  # (n, n_items): θ_i ~ N(0, ρ)
    # (n, n_raters): b_r ~ N(0, ω²), ω² = (1 - ρ)(1 - f)
    bias: Floats = field(compare=False, repr=False)
    # (n, n_raters): σ_r = σ e^(η w_r), σ² = (1 - ρ) f, w_r ~ N(0, 1)
    noise: Floats = field(compare=False, repr=False)
    # (n, n_categories - 1): τ_k, ascending
    thresholds: Floats = field(compare=False, repr=False)
    # item_share, noise_fraction, noise_spread: (n,): ρ, f and η
    item_share: Floats = field(compare=False, repr=False)
    noise_fraction: Floats = field(compare=False, repr=False)
    noise_spread: Floats = field(compare=False, repr=False)
    # bias_variance, noise_variance: (n,): ω² and σ²
    bias_variance: Floats = field(compare=False, repr=False)
    noise_variance: Floats = field(compare=False, repr=False)


def grade_shares(thresholds: Floats) -> Floats:
    """Return the shares of the grades over all items and raters."""
    # thresholds (n, n_categories - 1) -> (n, n_categories)
    far = np.full((len(thresholds), 1), np.inf)
    ends = np.hstack([-far, thresholds, far])
    return between(ends[:, :-1], ends[:, 1:])


def between(low: Floats, high: Floats) -> Floats:
    """Return Φ(high) - Φ(low), from the side where it keeps its digits."""
    flip = low > 0.0  # in the upper tail from the other side
    return np.asarray(
        ndtr(np.where(flip, -low, high)) - ndtr(np.where(flip, -high, low))
    )


def normal(x: Floats) -> Floats:
    """Return the density of a unit normal."""
    return np.asarray(np.exp(-0.5 * x * x) / np.sqrt(2.0 * np.pi))
