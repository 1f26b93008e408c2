"""The ordinal latent-trait model: its prior, its likelihood, and both with slopes.

Rater r perceives item i at θ_i + b_r + σ_r ε, with ε ~ N(0, 1), and gives grade k if
that lies between the thresholds τ_(k-1) and τ_k: a cumulative probit model.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, log_ndtr, ndtr

from masrel.agreement._engine import Floats
from masrel.agreement._labels import Codes
from masrel.errors import ParameterError
from masrel.intervals.latent._coordinates import (
    NOISE_UNIT,
    Coordinates,
    Traits,
    UnconstrainedPoint,
    grade_shares,
    normal_density,
    normal_probability,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class LatentPrior:
    """The prior of the ordinal latent-trait model.

    The variance of a rating on the latent scale is 1. It has three shares: of the
    items' severities ρ, of the raters' biases (1 - ρ)(1 - f), and of the raters'
    noise (1 - ρ) f.

    Attributes
    ----------
    item_share : tuple of float
        ρ ~ Beta(a, b). By default Beta(1, 1/3), under which the kappa of six grades is
        nearly uniform: its 5, 50 and 95 % are 0.03, 0.42 and 0.98. (Under a uniform ρ
        they are 0.01, 0.14 and 0.59: that would all but rule out good agreement.)
    noise_fraction : tuple of float
        f ~ Beta(a, b). By default Beta(2, 2): raters have both biases and noise.
    noise_spread : float
        Raters' noises are σ e^(η w) with w ~ N(0, 1) and η ~ half-normal of this
        scale. By default 0.5: most raters within a factor of two of each other.
    concentration : float
        The shares of the grades over the population of items and raters are
        Dirichlet(concentration, ...). Uniform by default.
    """

    item_share: tuple[float, float] = (1.0, 1.0 / 3.0)
    noise_fraction: tuple[float, float] = (2.0, 2.0)
    noise_spread: float = 0.5
    concentration: float = 1.0

    def __post_init__(self) -> None:
        for name, values in (
            ("item_share", self.item_share),
            ("noise_fraction", self.noise_fraction),
            ("noise_spread", (self.noise_spread,)),
            ("concentration", (self.concentration,)),
        ):
            if not all(0.0 < value < math.inf for value in values):
                raise ParameterError(
                    f"prior: {name} needs positive numbers, got {values}"
                )

    @classmethod
    def other(cls) -> "LatentPrior":
        """Return one that might as well have been chosen.

        Returns
        -------
        LatentPrior
            A uniform share of the items and split of bias and noise, Dirichlet(1/2,
            ...) for the grades, and noises that differ half as much.
        """
        return cls(
            item_share=(1.0, 1.0),
            noise_fraction=(1.0, 1.0),
            noise_spread=0.25,
            concentration=0.5,
        )

    @property
    def words(self) -> str:
        """The prior in one line."""
        a, b = self.item_share
        c, d = self.noise_fraction
        return (
            f"share of the items ~ Beta({a:.3g}, {b:.3g}), noise of the rest ~ "
            f"Beta({c:.3g}, {d:.3g}), spread of the noises ~ half-normal"
            f"({self.noise_spread:g}), grades ~ Dirichlet({self.concentration:g}, ...)"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class CellSlopes:
    """Slopes of the log-likelihood at n positions."""

    item: Floats = field(compare=False, repr=False)  # (n, n_items): by u_i
    # bias, log_noise: (n, n_raters): by b_r and log σ_r
    bias: Floats = field(compare=False, repr=False)
    log_noise: Floats = field(compare=False, repr=False)
    # (n, n_categories - 1): by T_k
    threshold: Floats = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Cells:
    """Between which thresholds each rating fell."""

    shape: tuple[int, int]  # items and raters
    # side: (n_items, n_raters): -1 for a rating in the first grade, 1 in the last,
    # which one threshold bounds: the probability is Φ(x); 0 for others and missing ones
    side: Floats = field(compare=False, repr=False)
    # inner, below: (n_inner,): the others, counted through the table row by row, and
    # the threshold below them
    inner: NDArray[np.intp] = field(compare=False, repr=False)
    below: NDArray[np.intp] = field(compare=False, repr=False)
    # (n_inner, n_categories - 1): 1 where a threshold is the one below, and above
    at_lower: Floats = field(compare=False, repr=False)
    at_upper: Floats = field(compare=False, repr=False)

    @classmethod
    def of(cls, codes: Codes, n_categories: int) -> "Cells":
        """Take codes of shape (n_items, n_raters), -1 where missing."""
        flat, last = codes.ravel().astype(np.intp), n_categories - 1
        (inner,) = np.nonzero((flat > 0) & (flat < last))
        below = flat[inner] - 1
        ends = np.arange(last)
        return cls(
            shape=(codes.shape[0], codes.shape[1]),
            side=(codes == last).astype(np.float64) - (codes == 0),
            inner=inner,
            below=below,
            at_lower=(below[:, None] == ends).astype(np.float64),
            at_upper=(below[:, None] + 1 == ends).astype(np.float64),
        )

    def log_likelihood(self, point: UnconstrainedPoint) -> Floats:
        """Return the logarithm, (n,); -inf where a rating has probability 0."""
        density = np.zeros(len(point.item))
        if self.side.any():
            x, _ = self._edge(point)
            density += np.einsum("nir,ir->n", log_ndtr(x), np.abs(self.side))
        if self.inner.size:
            low, high, _ = self._inner_ends(point)
            density += np.log(normal_probability(low, high)).sum(axis=1)
        return density

    def slopes(self, point: UnconstrainedPoint) -> CellSlopes:
        """Return the slopes of `log_likelihood`; not finite where it is -inf."""
        by_edge = self._edge_slopes(point)
        if not self.inner.size:
            return by_edge
        low, high, sharp = self._inner_ends(point)
        probability = normal_probability(low, high)
        at_low = normal_density(low) / probability
        at_high = normal_density(high) / probability
        wide = low * at_low - high * at_high
        at_low *= sharp
        at_high *= sharp
        by_cell, by_noise = np.zeros((2, len(low), self.side.size))
        by_cell[:, self.inner] = at_low - at_high
        by_noise[:, self.inner] = wide
        by_cell = by_cell.reshape(-1, *self.shape)
        # einsum and not a product of matrices, whose threads cost more than they save
        threshold = np.einsum("nr,rk->nk", at_high, self.at_upper)
        threshold -= np.einsum("nr,rk->nk", at_low, self.at_lower)
        return CellSlopes(
            item=by_edge.item + by_cell.sum(axis=2),
            bias=by_edge.bias + by_cell.sum(axis=1),
            log_noise=by_edge.log_noise + by_noise.reshape(-1, *self.shape).sum(axis=1),
            threshold=by_edge.threshold + threshold,
        )

    def _edge_slopes(self, point: UnconstrainedPoint) -> CellSlopes:
        # of the ratings at the ends of the scale
        x, sharp = self._edge(point)
        hazard = x * x
        hazard *= -0.5
        np.exp(hazard, out=hazard)
        hazard /= ndtr(x)
        hazard *= self.side / np.sqrt(2.0 * np.pi)
        x *= self.side
        x *= hazard
        hazard *= sharp
        threshold = np.zeros_like(point.threshold)
        if threshold.shape[1] > 1:
            threshold[:, 0] = -np.einsum("nir,ir->n", hazard, self.side < 0)
            threshold[:, -1] = -np.einsum("nir,ir->n", hazard, self.side > 0)
        else:
            threshold[:, 0] = -hazard.sum(axis=(1, 2))
        return CellSlopes(
            item=hazard.sum(axis=2),
            bias=hazard.sum(axis=1),
            log_noise=-x.sum(axis=1),
            threshold=threshold,
        )

    def _edge(self, point: UnconstrainedPoint) -> tuple[Floats, Floats]:
        # how far within its grade each rating at an end of the scale lies, in its
        # rater's noises, (n, n_items, n_raters), and one over those, (n, 1, n_raters)
        sharp = (1.0 / point.noise)[:, None, :]
        x = point.item[:, :, None] + point.bias[:, None, :]
        if point.threshold.shape[1] > 1:
            first, last = point.threshold[:, 0], point.threshold[:, -1]
            x -= np.where(self.side > 0, last[:, None, None], first[:, None, None])
        else:
            x -= point.threshold[:, :, None]
        x *= sharp
        x *= self.side
        return x, sharp

    def _inner_ends(self, point: UnconstrainedPoint) -> tuple[Floats, Floats, Floats]:
        # of each rating between two thresholds both ends in its rater's noises, and
        # the noise under one: three of shape (n, n_inner)
        item, rater = np.divmod(self.inner, self.shape[1])
        sharp = (1.0 / point.noise)[:, rater]
        centre = point.item[:, item] + point.bias[:, rater]
        low = (point.threshold[:, self.below] - centre) * sharp
        high = (point.threshold[:, self.below + 1] - centre) * sharp
        return low, high, sharp


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

    def start(self) -> Floats:
        """Return a position, (n_dimensions,), where the density is near its peak."""
        return self.coordinates.start(self.prior.noise_spread)

    def traits(self, position: Floats) -> Traits:
        """Turn positions (n, n_dimensions) into the unknowns."""
        return self.coordinates.point(position).traits

    def log_density(self, position: Floats) -> Floats:
        """Return the log posterior density of unbounded positions."""
        # position (n, n_dimensions) -> (n,)
        with np.errstate(all="ignore"):  # far out a cell has probability 0
            point = self.coordinates.point(position)
            density = self.cells.log_likelihood(point)
            density += self._log_prior(point) + self.coordinates.log_jacobian(point)
        return np.where(np.isfinite(density), density, -np.inf)

    def _log_prior(self, point: UnconstrainedPoint) -> Floats:
        # densities of θ_i or z_i, b_r / ω, w_r, τ; of ρ, f and η with the Jacobians
        # of their coordinates, (n,)
        prior, placed = self.prior, self.coordinates.placed
        a, b = prior.item_share
        c, d = prior.noise_fraction
        rho, f = point.logit_share, point.logit_fraction
        # N(0, ρ), where 1/√ρ = (1 + e^-ρ')^½ for ρ' = logit ρ
        of_items = np.where(
            placed,
            -0.5 * point.severity**2 / point.share + 0.5 * np.logaddexp(0.0, -rho),
            -0.5 * point.raw_item**2,
        )
        density = of_items.sum(axis=1) + point.b.log_jacobian + point.w.log_jacobian
        density -= 0.5 * (point.b.value**2 + point.w.value**2).sum(axis=1)
        # Beta density and Jacobian of the logit: ρ^a (1 - ρ)^b
        shares = a * np.logaddexp(0.0, -rho) + b * np.logaddexp(0.0, rho)
        shares += c * np.logaddexp(0.0, -f) + d * np.logaddexp(0.0, f)
        of_sd = -0.5 * (point.noise_sd / prior.noise_spread) ** 2
        of_sd -= np.logaddexp(0.0, -point.raw_noise_sd)
        # Dirichlet density of the shares Φ(τ_k) - Φ(τ_(k-1)), Jacobian Π φ(τ_k)
        tau = point.tau
        density += (of_sd - shares)[:, 0] - 0.5 * (tau**2).sum(axis=1)
        if prior.concentration != 1.0:
            grades = np.log(grade_shares(tau)).sum(axis=1)
            density += (prior.concentration - 1.0) * grades
        return np.asarray(density)

    def gradient(self, position: Floats) -> Floats:
        """Return the gradient of `log_density`."""
        # position (n, n_dimensions) -> (n, n_dimensions)
        with np.errstate(all="ignore"):
            point = self.coordinates.point(position)
            slope = self._slopes(point, self.cells.slopes(point))
        known = np.isfinite(slope).all(axis=1, keepdims=True)
        return np.where(known, slope, 0.0)

    def _slopes(self, point: UnconstrainedPoint, by: CellSlopes) -> Floats:
        coordinates = self.coordinates
        placed = coordinates.placed
        root, share = point.root, point.share
        severity = point.severity
        # of the prior by θ_i and by τ_k
        item = np.where(placed, -severity / share, 0.0)
        tau = self._by_tau(point.tau)
        by_place = np.where(placed, by.item + root * item, 0.0)
        by_coordinate, through = coordinates.by_item(by_place, point)
        by_raw_item = np.where(
            placed, by_coordinate, by.item * np.sqrt(share) / root - point.raw_item
        )
        threshold = by.threshold + root * tau + by_place @ coordinates.threshold_weights
        loose = np.where(placed, 0.0, by.item)  # moves against the thresholds with α
        anchor = item.sum(axis=1) + tau.sum(axis=1) - (loose / root).sum(axis=1)
        b, w = point.b, point.w
        by_b = np.sqrt(1.0 - point.fraction) * by.bias - b.value
        by_w = point.noise_sd * by.log_noise - w.value
        return np.hstack(
            [
                by_raw_item,
                by_b * b.by_coordinate,
                by_w * w.by_coordinate,
                self._by_share(point, item, tau, loose) + through,
                self._by_fraction_and_noise_sd(point, by, by_b, by_w),
                anchor[:, None],
                1.0 + self.coordinates.by_threshold(threshold, point),
            ]
        )

    def _by_tau(self, tau: Floats) -> Floats:
        more = self.prior.concentration - 1.0
        if more == 0.0:
            return -tau
        grades = grade_shares(tau)
        return (
            more * normal_density(tau) * (1.0 / grades[:, :-1] - 1.0 / grades[:, 1:])
            - tau
        )

    def _by_share(
        self, point: UnconstrainedPoint, item: Floats, tau: Floats, loose: Floats
    ) -> Floats:
        # by logit ρ, (n, 1): through c, dc = -c ρ/2; through the densities and the
        # Jacobian; and through u_i = (√ρ z_i - α) / c
        share, root, placed = point.share, point.root, self.coordinates.placed
        a, b = self.prior.item_share
        n_scaled = int(placed.sum()) + self.coordinates.n_categories - 2
        severity = point.severity
        scaled = (item * (severity - point.anchor)).sum(axis=1, keepdims=True)
        scaled += (tau * (point.tau - point.anchor)).sum(axis=1, keepdims=True)
        slope = -0.5 * share * (scaled + n_scaled) + a * (1.0 - share) - b * share
        through = np.where(placed, severity**2 / share - 1.0, 0.0)
        slope += 0.5 * (1.0 - share) * through.sum(axis=1, keepdims=True)
        moved = np.sqrt(share) * point.raw_item - share * point.anchor
        return np.asarray(
            slope + 0.5 * (loose * moved / root).sum(axis=1, keepdims=True)
        )

    def _by_fraction_and_noise_sd(
        self, point: UnconstrainedPoint, by: CellSlopes, by_b: Floats, by_w: Floats
    ) -> Floats:
        # by logit f and ±η, (n, 2); √(1 - f) and η scale b and w
        c, d = self.prior.noise_fraction
        f, eta, b, w = point.fraction, point.noise_sd, point.b, point.w
        bias = by.bias * b.value + by_b * b.by_scale
        bias_slope = bias.sum(axis=1, keepdims=True) + b.jacobian_by_scale
        noise = 0.5 * by.log_noise.sum(axis=1, keepdims=True)
        noises = (by.log_noise * w.value + by_w * w.by_scale).sum(axis=1, keepdims=True)
        return np.hstack(
            [
                (1.0 - f) * (noise + c) - f * (0.5 * np.sqrt(1.0 - f) * bias_slope + d),
                (noises + w.jacobian_by_scale - eta / self.prior.noise_spread**2)
                * NOISE_UNIT
                * expit(point.raw_noise_sd)
                + expit(-point.raw_noise_sd),
            ]
        )
