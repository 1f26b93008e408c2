"""The ordinal latent-trait model, as a log-density with its gradient.

Rater r perceives item i at θ_i + b_r + σ_r ε, with ε ~ N(0, 1), and gives grade k if
that lies between the thresholds τ_(k-1) and τ_k: a cumulative probit model.
"""

from dataclasses import dataclass

import numpy as np

from masrel.agreement._kernel import Floats
from masrel.agreement._labels import Codes
from masrel.intervals.latent.coordinates import Coordinates
from masrel.intervals.latent.likelihood import Cells, CellSlopes
from masrel.intervals.latent.place import Place
from masrel.intervals.latent.prior import LatentPrior
from masrel.intervals.latent.traits import Traits, grade_shares, normal

__all__ = ["LatentDensity"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LatentDensity:
    """The posterior of the model on unbounded coordinates."""

    coordinates: Coordinates  # what a position holds
    cells: Cells  # the ratings
    prior: LatentPrior  # what is believed before

    @classmethod
    def of(cls, codes: Codes, n_categories: int, prior: LatentPrior) -> "LatentDensity":
        """Take codes of shape (n_items, n_raters), -1 where missing."""
        return cls(
            coordinates=Coordinates.of(codes, n_categories),
            cells=Cells.of(codes, n_categories),
            prior=prior,
        )

    @property
    def n_dimensions(self) -> int:
        """Length of a position."""
        return self.coordinates.n_dimensions

    @property
    def counterweight(self) -> Floats:
        """Slopes, (n_dimensions,), that take a spike off the density."""
        # Where ρ goes to 0, all severities can go to one point, and the joint density
        # to infinity, on next to no volume. With these slopes added it has a mode.
        slopes = np.zeros(self.n_dimensions)
        slopes[self.coordinates.shares] = 0.5 * self.coordinates.placed.sum()
        return slopes

    def middle_of_prior(self) -> Floats:
        """Return a position, (n_dimensions,), where the density is near its peak."""
        return self.coordinates.middle_of_prior(self.prior.noise_spread)

    def traits(self, position: Floats) -> Traits:
        """Turn positions (n, n_dimensions) into the unknowns."""
        return self.coordinates.place(position).traits

    def log_density(self, position: Floats) -> Floats:
        """Return the log posterior density of unbounded positions."""
        # position (n, n_dimensions) -> (n,)
        with np.errstate(all="ignore"):  # far out a cell has probability 0
            place = self.coordinates.place(position)
            density = self.cells.log_likelihood(place)
            density += self._log_prior(place) + self.coordinates.log_jacobian(place)
        return np.where(np.isfinite(density), density, -np.inf)

    def _log_prior(self, place: Place) -> Floats:
        # densities of θ_i or z_i, b_r / ω, w_r, τ; of ρ, f and η with the Jacobians
        # of their coordinates, (n,)
        prior, placed = self.prior, self.coordinates.placed
        a, b = prior.item_share
        c, d = prior.noise_fraction
        rho, f = place.logit_share, place.logit_fraction
        # N(0, ρ), where 1/√ρ = (1 + e^-ρ')^½ for ρ' = logit ρ
        of_items = np.where(
            placed,
            -0.5 * place.severity**2 / place.share + 0.5 * np.logaddexp(0.0, -rho),
            -0.5 * place.own**2,
        )
        density = of_items.sum(axis=1) - 0.5 * (place.b**2 + place.w**2).sum(axis=1)
        # Beta density and Jacobian of the logit: ρ^a (1 - ρ)^b
        shares = a * np.logaddexp(0.0, -rho) + b * np.logaddexp(0.0, rho)
        shares += c * np.logaddexp(0.0, -f) + d * np.logaddexp(0.0, f)
        spread = place.log_spread - 0.5 * (place.spread / prior.noise_spread) ** 2
        # Dirichlet density of the shares Φ(τ_k) - Φ(τ_(k-1)), Jacobian Π φ(τ_k)
        tau = place.tau
        density += (spread - shares)[:, 0] - 0.5 * (tau**2).sum(axis=1)
        if prior.concentration != 1.0:
            grades = np.log(grade_shares(tau)).sum(axis=1)
            density += (prior.concentration - 1.0) * grades
        return np.asarray(density)

    def gradient(self, position: Floats) -> Floats:
        """Return the gradient of `log_density`."""
        # position (n, n_dimensions) -> (n, n_dimensions)
        with np.errstate(all="ignore"):
            place = self.coordinates.place(position)
            slope = self._slopes(place, self.cells.slopes(place))
        known = np.isfinite(slope).all(axis=1, keepdims=True)
        return np.where(known, slope, 0.0)

    def _slopes(self, place: Place, by: CellSlopes) -> Floats:
        placed, between = self.coordinates.placed, self.coordinates.between
        root, share = place.root, place.share
        severity = place.severity
        # of the prior by θ_i and by τ_k
        item = np.where(placed, -severity / share, 0.0)
        tau = self._by_tau(place.tau)
        by_own = np.where(
            placed, by.item + root * item, by.item * np.sqrt(share) / root - place.own
        )
        shifted = np.where(placed, by.item, 0.0) + root * item
        threshold = by.threshold + root * tau + shifted @ between
        loose = np.where(placed, 0.0, by.item)  # moves against the thresholds with α
        anchor = item.sum(axis=1) + tau.sum(axis=1) - (loose / root).sum(axis=1)
        bias_root = np.sqrt(1.0 - place.fraction)
        return np.hstack(
            [
                by_own,
                bias_root * by.bias - place.b,
                place.spread * by.log_noise - place.w,
                self._by_share(place, item, tau, loose),
                self._by_fraction_and_spread(place, by),
                anchor[:, None],
                1.0 + self.coordinates.by_threshold(threshold, place),
            ]
        )

    def _by_tau(self, tau: Floats) -> Floats:
        more = self.prior.concentration - 1.0
        if more == 0.0:
            return -tau
        grades = grade_shares(tau)
        return more * normal(tau) * (1.0 / grades[:, :-1] - 1.0 / grades[:, 1:]) - tau

    def _by_share(
        self, place: Place, item: Floats, tau: Floats, loose: Floats
    ) -> Floats:
        # by logit ρ, (n, 1): through c, dc = -c ρ/2; through the densities and the
        # Jacobian; and through u_i = (√ρ z_i - α) / c
        share, root, placed = place.share, place.root, self.coordinates.placed
        a, b = self.prior.item_share
        n_scaled = int(placed.sum()) + self.coordinates.n_categories - 2
        severity = place.severity
        scaled = (item * (severity - place.anchor)).sum(axis=1, keepdims=True)
        scaled += (tau * (place.tau - place.anchor)).sum(axis=1, keepdims=True)
        slope = -0.5 * share * (scaled + n_scaled) + a * (1.0 - share) - b * share
        through = np.where(placed, severity**2 / share - 1.0, 0.0)
        slope += 0.5 * (1.0 - share) * through.sum(axis=1, keepdims=True)
        moved = np.sqrt(share) * place.own - share * place.anchor
        return np.asarray(
            slope + 0.5 * (loose * moved / root).sum(axis=1, keepdims=True)
        )

    def _by_fraction_and_spread(self, place: Place, by: CellSlopes) -> Floats:
        # by logit f and log η, (n, 2)
        c, d = self.prior.noise_fraction
        f, eta = place.fraction, place.spread
        bias = 0.5 * (by.bias * place.bias).sum(axis=1, keepdims=True)
        noise = 0.5 * by.log_noise.sum(axis=1, keepdims=True)
        noises = (by.log_noise * place.w).sum(axis=1, keepdims=True)
        return np.hstack(
            [
                (1.0 - f) * (noise + c) - f * (bias + d),
                eta * noises + 1.0 - (eta / self.prior.noise_spread) ** 2,
            ]
        )
