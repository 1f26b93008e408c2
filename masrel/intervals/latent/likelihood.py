"""How likely ratings are where items, raters and thresholds lie.

Rater r perceives item i at u_i + b_r + σ_r ε, with ε ~ N(0, 1), and gives grade k if
that lies between the thresholds T_(k-1) and T_k: a cumulative probit model.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._kernel import Floats
from masrel.agreement._labels import Codes
from masrel.intervals.latent.place import Place
from masrel.intervals.latent.traits import between, normal

__all__ = ["CellSlopes", "Cells"]


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
    # lower, upper: (n_items * n_raters,): thresholds below and above, counting -∞ as 0
    # and ∞ as n_categories; a missing rating fell between those two
    lower: NDArray[np.intp] = field(compare=False, repr=False)
    upper: NDArray[np.intp] = field(compare=False, repr=False)
    # at_lower, at_upper: (n_items * n_raters, n_categories - 1): 1 where a threshold is
    # the lower, the upper end
    at_lower: Floats = field(compare=False, repr=False)
    at_upper: Floats = field(compare=False, repr=False)

    @classmethod
    def of(cls, codes: Codes, n_categories: int) -> "Cells":
        """Take codes of shape (n_items, n_raters), -1 where missing."""
        flat = codes.ravel().astype(np.intp)
        lower = np.where(flat < 0, 0, flat)
        upper = np.where(flat < 0, n_categories, flat + 1)
        ends = np.arange(1, n_categories)
        return cls(
            shape=(codes.shape[0], codes.shape[1]),
            lower=lower,
            upper=upper,
            at_lower=(lower[:, None] == ends).astype(np.float64),
            at_upper=(upper[:, None] == ends).astype(np.float64),
        )

    def log_likelihood(self, place: Place) -> Floats:
        """Return the logarithm, (n,); -inf where a rating has probability 0."""
        low, high, _ = self._ends(place)
        return np.asarray(np.log(between(low, high)).sum(axis=1))

    def slopes(self, place: Place) -> CellSlopes:
        """Return the slopes of `log_likelihood`; not finite where it is -inf."""
        low, high, sharp = self._ends(place)
        chance = between(low, high)
        at_low, at_high = normal(low) / chance, normal(high) / chance
        wide = np.where(np.isfinite(low), low * at_low, 0.0)
        wide -= np.where(np.isfinite(high), high * at_high, 0.0)
        at_low *= sharp
        at_high *= sharp
        centre = (at_low - at_high).reshape(-1, *self.shape)
        # einsum and not a product of matrices, whose threads cost more than they save
        threshold = np.einsum("nr,rk->nk", at_high, self.at_upper)
        threshold -= np.einsum("nr,rk->nk", at_low, self.at_lower)
        return CellSlopes(
            item=centre.sum(axis=2),
            bias=centre.sum(axis=1),
            log_noise=wide.reshape(-1, *self.shape).sum(axis=1),
            threshold=threshold,
        )

    def _ends(self, place: Place) -> tuple[Floats, Floats, Floats]:
        # of each rating's cell both ends in its rater's noises, and the noise under
        # one: three of shape (n, n_items * n_raters)
        n = len(place.item)
        far = np.full((n, 1), np.inf)
        ends = np.hstack([-far, place.threshold, far])
        centre = place.item[:, :, None] + place.bias[:, None, :]
        centre = centre.reshape(n, -1)
        sharp = np.tile(1.0 / place.noise, self.shape[0])
        low = (ends[:, self.lower] - centre) * sharp
        high = (ends[:, self.upper] - centre) * sharp
        return low, high, sharp
