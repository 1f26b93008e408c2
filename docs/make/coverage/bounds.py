"""Ends of intervals of many studies: scales, quantiles, and what replaces them."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from scipy.special import stdtrit

from docs.make.coverage.studies import Floats, Truths

Scale = Literal["plain", "Fisher z", "intraclass"]
PER_RATING = 0.003
"""Of (1 - kappa) / (items × raters): variances below it are accidents."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """Lower and upper ends, shape (n_studies,); ``nan`` where there is none."""

    low: Floats = field(repr=False)
    high: Floats = field(repr=False)

    def cover(self, truth: Floats) -> Floats:
        """Whether each holds the truth, as 0 or 1; where there is none it does not."""
        slack = 1e-12  # an end at the truth itself, rounded
        inside = (self.low <= truth + slack) & (truth <= self.high + slack)
        return inside.astype(np.float64)

    @property
    def exist(self) -> Floats:
        """Whether there is an interval, as 0 or 1."""
        return np.isfinite(self.low + self.high).astype(np.float64)

    def where(self, use: Truths, other: "Bounds") -> "Bounds":
        """Return these ends where `use` holds, else the other's."""
        return Bounds(
            low=np.where(use, self.low, other.low),
            high=np.where(use, self.high, other.high),
        )


def student(df: Floats | float) -> Floats:
    """Return the 97.5 % quantile of Student's t."""
    return np.asarray(stdtrit(df, 0.975))


def around(value: Floats, half: Floats, scale: Scale, n_raters: int) -> Bounds:
    """Return ends symmetric on a scale, half a width taken on that of kappa."""
    low, high = value - half, value + half
    plain = Bounds(low=np.maximum(low, -1.0), high=np.minimum(high, 1.0))
    if scale == "plain":
        return plain
    least = -1.0 if scale == "Fisher z" else -1.0 / (n_raters - 1)
    share = (value - least) / (1.0 - least)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        odds = share / (1.0 - share)
        factor = np.exp(half / ((1.0 - least) * share * (1.0 - share)))
        low, high = odds / factor, odds * factor
        ends = Bounds(
            low=least + (1.0 - least) * low / (1.0 + low),
            high=1.0 - (1.0 - least) / (1.0 + high),
        )
    return ends.where(share > 1e-12, plain)


@dataclass(frozen=True, slots=True, kw_only=True)
class Posterior:
    """Quantiles of the Dirichlet-multinomial posterior, each of shape (n_studies,)."""

    p025: Floats = field(repr=False)
    p05: Floats = field(repr=False)
    p50: Floats = field(repr=False)
    p975: Floats = field(repr=False)

    @property
    def central(self) -> Bounds:
        """The central 95 % interval."""
        return Bounds(low=self.p025, high=self.p975)

    @property
    def one_sided(self) -> Bounds:
        """All above the 5 % quantile."""
        return Bounds(low=self.p05, high=np.ones_like(self.p05))

    def holding(self, value: Floats, ends: Bounds) -> Bounds:
        """Widen ends to an estimate outside; one-sided at 1 and without an estimate."""
        inside = ~(np.isnan(value) | (value >= 1.0))
        wide = Bounds(
            low=np.minimum(ends.low, value), high=np.maximum(ends.high, value)
        )
        return wide.where(inside, self.one_sided)


def has_spread(variance: Floats, value: Floats, n_ratings: int) -> Truths:
    """Whether a variance is more than an accident of few disagreements."""
    return np.asarray(variance > PER_RATING * (1.0 - value) / n_ratings)


def joined(*parts: tuple[Floats, int]) -> tuple[Floats, Floats]:
    """Add variances, each with its degrees of freedom: Satterthwaite's for the sum."""
    total = np.sum([variance for variance, _ in parts], axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        df = total**2 / np.sum([v**2 / df for v, df in parts], axis=0)
    return total, df
