"""The ordinal latent-trait model, as a log-density with its gradient.

Rater r perceives item i at θ_i + b_r + σ_r ε, with ε ~ N(0, 1), and gives grade k if
that lies between the thresholds τ_(k-1) and τ_k: a cumulative probit model.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, ndtr, ndtri

from masrel.agreement.coding import Codes
from masrel.agreement.kernel import Floats
from masrel.intervals.latent.prior import LatentPrior

__all__ = ["LatentDensity", "Traits"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Traits:
    """The unknowns at n positions, on the scale where a rating has variance 1.

    Attributes
    ----------
    severity : ndarray, shape (n, n_items)
        θ_i ~ N(0, ρ).
    bias : ndarray, shape (n, n_raters)
        b_r ~ N(0, ω²), ω² = (1 - ρ)(1 - f).
    noise : ndarray, shape (n, n_raters)
        σ_r = σ e^(η w_r), σ² = (1 - ρ) f, w_r ~ N(0, 1).
    thresholds : ndarray, shape (n, n_categories - 1)
        τ_k, ascending.
    item_share, noise_fraction, noise_spread : ndarray, shape (n,)
        ρ, f and η.
    bias_variance, noise_variance : ndarray, shape (n,)
        ω² and σ².
    """

    severity: Floats = field(compare=False, repr=False)
    bias: Floats = field(compare=False, repr=False)
    noise: Floats = field(compare=False, repr=False)
    thresholds: Floats = field(compare=False, repr=False)
    item_share: Floats = field(compare=False, repr=False)
    noise_fraction: Floats = field(compare=False, repr=False)
    noise_spread: Floats = field(compare=False, repr=False)
    bias_variance: Floats = field(compare=False, repr=False)
    noise_variance: Floats = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class LatentDensity:
    """The posterior of the model on unbounded coordinates.

    A position holds, in this order: z_i = θ_i / √ρ (n_items); b_r / ω and w_r
    (n_raters each); logit ρ, logit f, log η; one threshold; and the logarithms of the
    distances between neighbouring thresholds, from the lowest pair up.

    Attributes
    ----------
    n_items, n_raters, n_categories : int
        Sizes.
    lower, upper : ndarray of int, shape (n_items * n_raters,)
        Between which thresholds each rating fell, counting -∞ as 0 and ∞ as
        n_categories; a missing rating fell between those two.
    middle : int
        The threshold that is a coordinate: the one that halves the ratings best.
    prior : LatentPrior
        What is believed before.
    """

    n_items: int
    n_raters: int
    n_categories: int
    lower: NDArray[np.intp] = field(compare=False, repr=False)
    upper: NDArray[np.intp] = field(compare=False, repr=False)
    middle: int
    prior: LatentPrior

    @classmethod
    def of(cls, codes: Codes, n_categories: int, prior: LatentPrior) -> "LatentDensity":
        """Take codes of shape (n_items, n_raters), -1 where missing."""
        flat = codes.ravel().astype(np.intp)
        missing = flat < 0
        below = np.bincount(flat[~missing], minlength=n_categories).cumsum()[:-1]
        return cls(
            n_items=codes.shape[0],
            n_raters=codes.shape[1],
            n_categories=n_categories,
            lower=np.where(missing, 0, flat),
            upper=np.where(missing, n_categories, flat + 1),
            middle=int(np.abs(2 * below - (~missing).sum()).argmin()),
            prior=prior,
        )

    @property
    def n_dimensions(self) -> int:
        """Length of a position."""
        return self._shares + 3 + self.n_categories - 1

    @property
    def _shares(self) -> int:
        # where logit ρ, logit f and log η begin
        return self.n_items + 2 * self.n_raters

    def middle_of_prior(self) -> Floats:
        """Return a position, (n_dimensions,), where the density is not far from high.

        Severities, biases and noises in the middle, the grades equally frequent.
        """
        position = np.zeros(self.n_dimensions)
        at = self._shares
        position[at] = 1.0
        position[at + 2] = np.log(self.prior.noise_spread)
        tau = ndtri(np.arange(1, self.n_categories) / self.n_categories)
        position[at + 3] = tau[self.middle]
        position[at + 4 :] = np.log(np.diff(tau))
        return position

    def traits(self, position: Floats) -> Traits:
        """Turn positions (n, n_dimensions) into the unknowns."""
        z, b, w, (rho, f, eta), anchor, gaps = self._parts(position)
        item_share, rest = expit(rho), expit(-rho)
        bias_variance, noise_variance = rest * expit(-f), rest * expit(f)
        spread = np.exp(eta)
        below, above = gaps[:, : self.middle], gaps[:, self.middle :]
        return Traits(
            severity=np.sqrt(item_share)[:, None] * z,
            bias=np.sqrt(bias_variance)[:, None] * b,
            noise=np.sqrt(noise_variance)[:, None] * np.exp(spread[:, None] * w),
            thresholds=np.hstack(
                [anchor - _from_right(below), anchor, anchor + above.cumsum(axis=1)]
            ),
            item_share=item_share,
            noise_fraction=expit(f),
            noise_spread=spread,
            bias_variance=bias_variance,
            noise_variance=noise_variance,
        )

    def _parts(
        self, position: Floats
    ) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
        # z (n, items), b and w (n, raters), the three shares (3, n), the threshold
        # (n, 1), the distances (n, categories - 2)
        at = self._shares
        z, b, w = np.split(
            position[:, :at], [self.n_items, self.n_items + self.n_raters], axis=1
        )
        gaps = np.exp(position[:, at + 4 :])
        return z, b, w, position[:, at : at + 3].T, position[:, at + 3 : at + 4], gaps

    def log_density(self, position: Floats) -> Floats:
        """Return the log posterior density of unbounded positions.

        Parameters
        ----------
        position : ndarray, shape (n, n_dimensions)
            Coordinates.

        Returns
        -------
        ndarray, shape (n,)
            The logarithm, up to a constant; -inf where it is 0 in floating point.
        """
        with np.errstate(all="ignore"):  # far out a cell has probability 0
            traits = self.traits(position)
            density = np.log(self._cells(traits)[2]).sum(axis=1)
            density += self._log_prior(position, traits)
        return np.where(np.isfinite(density), density, -np.inf)

    def _cells(self, traits: Traits) -> tuple[Floats, Floats, Floats, Floats]:
        # both ends of each rating's cell in its rater's noises, its probability, and
        # one over the noise, each (n, items * raters)
        n = len(traits.severity)
        far = np.full((n, 1), np.inf)
        ends = np.hstack([-far, traits.thresholds, far])
        centre = traits.severity[:, :, None] + traits.bias[:, None, :]
        centre = centre.reshape(n, -1)
        sharp = np.tile(1.0 / traits.noise, self.n_items)
        low = (ends[:, self.lower] - centre) * sharp
        high = (ends[:, self.upper] - centre) * sharp
        # In the upper tail from the other side, where the difference keeps its digits.
        flip = low > 0.0
        chance = ndtr(np.where(flip, -low, high)) - ndtr(np.where(flip, -high, low))
        return low, high, chance, sharp

    def _log_prior(self, position: Floats, traits: Traits) -> Floats:
        # densities of the unknowns times the Jacobians of their coordinates, (n,)
        at, prior = self._shares, self.prior
        a, b = prior.item_share
        c, d = prior.noise_fraction
        rho, f, eta = position[:, at : at + 3].T
        density = -0.5 * (position[:, :at] ** 2).sum(axis=1)
        # Beta density and Jacobian of the logit: ρ^a (1 - ρ)^b
        density -= a * np.logaddexp(0.0, -rho) + b * np.logaddexp(0.0, rho)
        density -= c * np.logaddexp(0.0, -f) + d * np.logaddexp(0.0, f)
        density += eta - 0.5 * (traits.noise_spread / prior.noise_spread) ** 2
        # Dirichlet density of the shares Φ(τ_k) - Φ(τ_(k-1)), Jacobian Π φ(τ_k)
        density -= 0.5 * (traits.thresholds**2).sum(axis=1)
        if prior.concentration != 1.0:
            grades = np.log(grade_shares(traits.thresholds)).sum(axis=1)
            density += (prior.concentration - 1.0) * grades
        # Jacobian of the logarithms of the distances
        return np.asarray(density + position[:, at + 4 :].sum(axis=1))

    def gradient(self, position: Floats) -> Floats:
        """Return the gradient of `log_density`.

        Parameters
        ----------
        position : ndarray, shape (n, n_dimensions)
            Coordinates.

        Returns
        -------
        ndarray, shape (n, n_dimensions)
            Slopes; 0 where the density is 0 in floating point.
        """
        with np.errstate(all="ignore"):
            traits = self.traits(position)
            items, raters, noises, thresholds = self._slopes(traits)
            slope = np.hstack(
                [
                    np.sqrt(traits.item_share)[:, None] * items,
                    np.sqrt(traits.bias_variance)[:, None] * raters,
                    traits.noise_spread[:, None] * noises,
                    self._share_slopes(position, traits, items, raters, noises),
                    self._threshold_slopes(position, traits, thresholds),
                ]
            )
            slope[:, : self._shares] -= position[:, : self._shares]
        known = np.isfinite(slope).all(axis=1, keepdims=True)
        return np.where(known, slope, 0.0)

    def _slopes(self, traits: Traits) -> tuple[Floats, Floats, Floats, Floats]:
        # of the log-likelihood by severity, bias, log noise and threshold
        low, high, chance, sharp = self._cells(traits)
        at_low, at_high = _normal(low) / chance, _normal(high) / chance
        n = len(low)
        cell = (n, self.n_items, self.n_raters)
        centre = ((at_low - at_high) * sharp).reshape(cell)
        wide = np.where(np.isfinite(low), low * at_low, 0.0)
        wide -= np.where(np.isfinite(high), high * at_high, 0.0)
        ends = np.arange(1, self.n_categories)
        thresholds = (at_high * sharp) @ (self.upper[:, None] == ends).astype(float)
        thresholds -= (at_low * sharp) @ (self.lower[:, None] == ends).astype(float)
        return (
            centre.sum(axis=2),
            centre.sum(axis=1),
            wide.reshape(cell).sum(axis=1),
            thresholds,
        )

    def _share_slopes(
        self,
        position: Floats,
        traits: Traits,
        items: Floats,
        raters: Floats,
        noises: Floats,
    ) -> Floats:
        # by logit ρ, logit f and log η, (n, 3)
        prior = self.prior
        rho, f, eta = traits.item_share, traits.noise_fraction, traits.noise_spread
        w = position[:, self._shares - self.n_raters : self._shares]
        severity = 0.5 * (items * traits.severity).sum(axis=1)  # by log ρ
        bias = 0.5 * (raters * traits.bias).sum(axis=1)  # by log ω²
        noise = 0.5 * noises.sum(axis=1)  # by log σ²
        (a, b), (c, d) = prior.item_share, prior.noise_fraction
        return np.column_stack(
            [
                (1.0 - rho) * (severity + a) - rho * (bias + noise + b),
                (1.0 - f) * (noise + c) - f * (bias + d),
                eta * (noises * w).sum(axis=1) + 1.0 - (eta / prior.noise_spread) ** 2,
            ]
        )

    def _threshold_slopes(
        self, position: Floats, traits: Traits, slope: Floats
    ) -> Floats:
        # by the threshold that is a coordinate, and by the log distances
        tau, more = traits.thresholds, self.prior.concentration - 1.0
        slope = slope - tau
        if more:
            grades = grade_shares(tau)
            slope += more * _normal(tau) * (1.0 / grades[:, :-1] - 1.0 / grades[:, 1:])
        gaps = np.exp(position[:, self._shares + 4 :])
        # a distance below the middle moves all thresholds below it down
        down = -slope.cumsum(axis=1)[:, : self.middle]
        up = _from_right(slope)[:, self.middle + 1 :]
        return np.hstack(
            [slope.sum(axis=1)[:, None], 1.0 + gaps * np.hstack([down, up])]
        )


def grade_shares(thresholds: Floats) -> Floats:
    """Return the shares of the grades over all items and raters.

    Parameters
    ----------
    thresholds : ndarray, shape (n, n_categories - 1)
        Ascending.

    Returns
    -------
    ndarray, shape (n, n_categories)
        Φ(τ_k) - Φ(τ_(k-1)), each from the side where it keeps its digits.
    """
    far = np.full((len(thresholds), 1), np.inf)
    low, high = np.hstack([-far, thresholds]), np.hstack([thresholds, far])
    flip = low > 0.0
    return ndtr(np.where(flip, -low, high)) - ndtr(np.where(flip, -high, low))


def _from_right(values: Floats) -> Floats:
    # (n, m) -> (n, m): sums of each entry and all to its right
    return values[:, ::-1].cumsum(axis=1)[:, ::-1]


def _normal(x: Floats) -> Floats:
    return np.asarray(np.exp(-0.5 * x * x) / np.sqrt(2.0 * np.pi))
