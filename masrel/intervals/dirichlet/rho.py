"""The exact credible interval of ρ, and what another prior would make of it."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from masrel.estimates import Distribution
from masrel.intervals.dirichlet.exact import ExactDensity
from masrel.intervals.dirichlet.model import DirichletMultinomial
from masrel.intervals.dirichlet.prior import Prior
from masrel.intervals.sinc import SincDistribution, sinc_distribution

__all__ = ["ExactPosterior", "prior_notes"]

_SHOWN = 201  # points of a distribution
_FEW_ITEMS = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class ExactPosterior:
    """The posterior of ρ = 1 / (1 + A), and the ends of its central interval."""

    # low, high: ends
    low: float
    high: float
    # the distribution of logit ρ
    logit: SincDistribution = field(compare=False, repr=False)
    # what it was integrated from
    log_density: ExactDensity = field(compare=False, repr=False)

    @classmethod
    def of(
        cls, counts: NDArray[np.int64], prior: Prior, level: float
    ) -> "ExactPosterior":
        """Integrate the posterior."""
        # Takes counts (n_items, n_categories)
        density = ExactDensity(
            DirichletMultinomial.of_counts(
                counts, concentration=prior.concentration, shape=prior.shape
            )
        )
        tail = 0.5 * (1.0 - level)
        first, last = density.region.logits[[0, -1]].tolist()
        logit, ends = sinc_distribution(density, first, last, (tail, 1.0 - tail))
        low, high = expit(ends).tolist()
        return cls(low=low, high=high, logit=logit, log_density=density)

    def distribution(self, words: str) -> Distribution:
        """Return the density of ρ at points between its outermost quantiles."""
        # Continuous; the points are equally spaced in logit ρ, from about the quantile
        # at 1e-6 to that at 1 - 1e-6.
        below = self.logit.masses.cumsum()
        ends = np.searchsorted(below, (1e-6, 1.0 - 1e-6)) + np.array([-1, 1])
        low, high = self.logit.points[ends.clip(0, below.size - 1)]
        logits = np.linspace(low, high, _SHOWN)
        rho, rest = expit(logits), expit(-logits)
        density = np.exp(self.log_density(logits) - self.logit.log_total)
        return Distribution(
            values=rho, weights=density / (rho * rest), continuous=True, words=words
        )


def prior_notes(
    counts: NDArray[np.int64], prior: Prior, level: float, low: float, high: float
) -> tuple[str, ...]:
    """Say where the prior weighs, by the interval under the one that moves it most."""
    # Takes counts (n_items, n_categories)
    n_items = int((counts.sum(axis=1) >= 2).sum())
    if (counts.sum(axis=0) > 0).sum() == 1:
        what = "all ratings are in one category"
    elif ((counts > 0).sum(axis=1) <= 1).all():
        what = "agreement is perfect in these data"
    elif n_items < _FEW_ITEMS:
        what = f"{n_items} items are few"
    else:
        return ()
    moved, other, found = 0.0, prior, (low, high)
    for candidate in prior.others(counts.shape[1]):
        there = ExactPosterior.of(counts, candidate, level)
        by = max(abs(there.low - low), abs(there.high - high))
        if by > moved:
            moved, other, found = by, candidate, (there.low, there.high)
    return (
        f"{what}, so the prior weighs: {low:.3f} to {high:.3f} with {prior.words}, "
        f"but {found[0]:.3f} to {found[1]:.3f} with {other.words}",
    )
