"""Coordinates in which the posterior of the latent-trait model is nearly normal.

Ratings tell how items and thresholds lie to each other in units of c = √(1 - ρ), by
which a rating differs from its item; of ρ they tell nothing more. So thresholds are
T_k = (τ_k - α) / c from the one of them that halves the ratings, α, and an item whose
ratings place it is told by how far (θ_i - α) / c is from the thresholds between its
grades. An item that its ratings hardly place is told by θ_i / √ρ, as its prior is.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, ndtri

from masrel.agreement._kernel import Floats
from masrel.agreement._labels import Codes
from masrel.intervals.latent.place import Place

__all__ = ["Coordinates"]

_PLAIN = 5.0  # variance of items' means over its error, where ratings place items


@dataclass(frozen=True, slots=True, kw_only=True)
class Coordinates:
    """What a position holds."""

    # In this order: one coordinate an item; b_r / ω and w_r (n_raters each); logit ρ,
    # logit f, log η; α; and the logarithms of the distances between neighbouring T_k,
    # from the lowest pair up.

    # n_items, n_raters, n_categories: sizes
    n_items: int
    n_raters: int
    n_categories: int
    middle: int  # the threshold that is α: the one that halves the ratings best
    # (n_items,): items whose coordinate is v_i = u_i - Σ_k W_ik T_k; of the others it
    # is z_i = θ_i / √ρ
    placed: NDArray[np.bool_] = field(compare=False, repr=False)
    # (n_items, n_categories - 1): w: weights of the thresholds between an item's grades
    between: Floats = field(compare=False, repr=False)

    @classmethod
    def of(cls, codes: Codes, n_categories: int) -> "Coordinates":
        """Fit coordinates to codes of shape (n_items, n_raters), -1 where missing."""
        given = codes >= 0
        grades = np.arange(n_categories - 1)
        at_most = (given[:, :, None] & (codes[:, :, None] <= grades)).sum(axis=1)
        n_each = given.sum(axis=1)
        share = at_most / n_each.clip(1)[:, None]
        weight = share * (1.0 - share)  # 0 where all are on one side
        total = weight.sum(axis=1)
        placed = (total > 0.0) & _tell_items_apart(codes)
        return cls(
            n_items=codes.shape[0],
            n_raters=codes.shape[1],
            n_categories=n_categories,
            middle=int(np.abs(2 * at_most.sum(axis=0) - given.sum()).argmin()),
            placed=placed,
            between=np.where(placed, 1.0 / np.where(placed, total, 1.0), 0.0)[:, None]
            * weight,
        )

    @property
    def n_dimensions(self) -> int:
        """Length of a position."""
        return self.shares + 3 + self.n_categories - 1

    @property
    def shares(self) -> int:
        """Where logit ρ, logit f and log η begin."""
        return self.n_items + 2 * self.n_raters

    def middle_of_prior(self, noise_spread: float) -> Floats:
        """Return a position, (n_dimensions,), where the density is near its peak."""
        position = np.zeros(self.n_dimensions)
        at = self.shares
        position[at] = 1.0
        position[at + 2] = np.log(noise_spread)
        tau = ndtri(np.arange(1, self.n_categories) / self.n_categories)
        position[at + 3] = tau[self.middle]
        position[at + 4 :] = np.log(np.diff(tau) / np.sqrt(expit(-1.0)))
        return position

    def place(self, position: Floats) -> Place:
        """Take positions (n, n_dimensions) apart."""
        at, n = self.shares, self.n_items
        own, b, w = np.split(position[:, :at], [n, n + self.n_raters], axis=1)
        rho, f, eta, anchor = np.split(position[:, at : at + 4], 4, axis=1)
        share, fraction, spread = expit(rho), expit(f), np.exp(eta)
        root = np.sqrt(expit(-rho))
        gap = np.exp(position[:, at + 4 :])
        threshold = self._thresholds(gap)
        by_ratings = own + threshold @ self.between.T
        by_prior = (np.sqrt(share) * own - anchor) / root
        return Place(
            item=np.where(self.placed, by_ratings, by_prior),
            bias=np.sqrt(expit(-f)) * b,
            noise=np.sqrt(fraction) * np.exp(spread * w),
            threshold=threshold,
            own=own,
            b=b,
            w=w,
            logit_share=rho,
            logit_fraction=f,
            log_spread=eta,
            share=share,
            root=root,
            fraction=fraction,
            spread=spread,
            anchor=anchor,
            gap=gap,
        )

    def _thresholds(self, gap: Floats) -> Floats:
        # T_k from their distances, (n, n_categories - 1); that of α is 0
        below = -_from_right(gap[:, : self.middle])
        above = gap[:, self.middle :].cumsum(axis=1)
        return np.hstack([below, np.zeros((len(gap), 1)), above])

    def log_jacobian(self, place: Place) -> Floats:
        """Return log |∂(θ, τ) / ∂(their coordinates)|, (n,), without items' √ρ."""
        # z_i is a unit normal by its prior, whose density needs no Jacobian.
        n_scaled = int(self.placed.sum()) + self.n_categories - 2
        return np.asarray(
            n_scaled * np.log(place.root[:, 0]) + np.log(place.gap).sum(axis=1)
        )

    def by_threshold(self, slope: Floats, place: Place) -> Floats:
        """Turn slopes by T_k into slopes by the logarithms of their distances."""
        # slope (n, n_categories - 1) -> (n, n_categories - 2)
        # a distance below the middle moves all thresholds below it down
        down = -slope.cumsum(axis=1)[:, : self.middle]
        up = _from_right(slope)[:, self.middle + 1 :]
        return np.asarray(place.gap * np.hstack([down, up]))


def _tell_items_apart(codes: Codes) -> bool:
    # whether the variance of items' mean codes is plainly more than its error
    given = codes >= 0
    n_each = given.sum(axis=1)
    rated = n_each > 0
    spare = int((n_each[rated] - 1).sum())
    if rated.sum() < 2 or spare < 1:
        return False
    mean = np.where(given, codes, 0).sum(axis=1) / n_each.clip(1)
    within = (np.where(given, codes - mean[:, None], 0.0) ** 2).sum() / spare
    error = within * (1.0 / n_each[rated]).mean()
    return bool(mean[rated].var(ddof=1) > _PLAIN * error)


def _from_right(values: Floats) -> Floats:
    # (n, m) -> (n, m): sums of each entry and all to its right
    return values[:, ::-1].cumsum(axis=1)[:, ::-1]
