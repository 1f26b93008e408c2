"""Intervals of many studies whose ratings are mostly of one category.

A study is how often each pattern occurs. Equal studies are computed once. Of two
categories the posterior of ρ and the share of the second is summed on a grid; of more,
ρ is exact and patterns are drawn.
"""

from dataclasses import dataclass, field
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaln, expit

from docs.make.coverage.bounds import Bounds, student
from docs.make.coverage.exact import posterior_ends
from docs.make.coverage.rare_studies import WITHOUT_END, Formula, Table
from docs.make.coverage.studies import Floats, Truths

TAILS = (0.025, 0.05, 0.975)
N_DRAWS = 500
FEW = 30
"""Items with a rating outside the commonest category, below which they are few."""
_RHO = np.linspace(-8.0, 8.0, 129)  # logit of ρ
_SHARE = np.linspace(-10.0, 6.0, 81)  # logit of the second category's share
_AT_ONCE = 200  # studies


@dataclass(frozen=True)
class RareStudies:
    """Studies of one cell, each distinct one once: (n_studies, n_patterns)."""

    table: Table
    freq: NDArray[np.int64] = field(repr=False)
    rng: np.random.Generator = field(repr=False)

    @cached_property
    def n_paired(self) -> NDArray[np.int64]:
        """Items with a pair of ratings."""
        return np.asarray(self.freq @ (self.table.counts.sum(axis=1) > 1))

    @cached_property
    def n_outside(self) -> NDArray[np.int64]:
        """Those of them with a rating outside the commonest category."""
        counts = self.table.counts
        size = counts.sum(axis=1, keepdims=True)
        commonest = (self.freq @ counts).argmax(axis=1)
        outside = (size - counts > 0) & (size > 1)  # (n_patterns, n_categories)
        every = self.freq @ outside
        return np.asarray(np.take_along_axis(every, commonest[:, None], axis=1)[:, 0])

    @cached_property
    def rare(self) -> Truths:
        """Whether the rule takes the posterior."""
        few = self.n_outside < FEW
        return np.asarray(few & (2 * self.n_outside < self.n_paired))

    @cached_property
    def grid(self) -> tuple[Floats, Floats]:
        """Quantiles of ρ and of Gwet's AC1, both (n_studies, n_tails)."""
        return _on_grid(self.freq, self.table)

    @cached_property
    def of_pairs(self) -> "RareStudies":
        """The same without items of one rating."""
        paired = self.table.counts.sum(axis=1) > 1
        return RareStudies(self.table, self.freq * paired, self.rng)

    @cached_property
    def rho(self) -> Floats:
        """Quantiles of ρ, (n_studies, n_tails), where the rule asks for them."""
        if self.table.n_categories == 2:
            return self.grid[0]
        out = np.full((len(self.freq), len(TAILS)), np.nan)
        for i in np.flatnonzero(self.rare | (self.n_paired < FEW)):
            counts = np.repeat(self.table.counts, self.freq[i], axis=0)
            out[i] = posterior_ends(counts[None], TAILS)[0]
        return out

    def drawn(self, formulas: list[Formula]) -> list[Floats]:
        """Quantiles of coefficients by the posterior of patterns, where asked for."""
        prior = prior_of_patterns(self.table)
        out = [np.full((len(self.freq), len(TAILS)), np.nan) for _ in formulas]
        for i in np.flatnonzero(self.rare):
            shape = self.freq[i] + prior
            used = shape > 0.0
            drawn = self.rng.standard_gamma(shape[used], (N_DRAWS, int(used.sum())))
            drawn *= WITHOUT_END
            for formula, ends in zip(formulas, out, strict=True):
                values = formula.of_sums(drawn @ formula.features[used])
                ends[i] = np.quantile(values[np.isfinite(values)], TAILS)
        return out


def prior_of_patterns(table: Table) -> Floats:
    """A Dirichlet worth 1.5 items, half of it on raters who agree."""
    counts, r = table.counts, table.patterns.shape[1]
    agree, dissent = counts.max(axis=1) == r, counts.max(axis=1) == r - 1
    dissent &= counts.sum(axis=1) == r
    # of two raters every pair that disagrees; of more one dissents, in one of r ways
    return np.asarray(0.75 * agree / agree.sum() + 0.75 * dissent / dissent.sum())


def jackknife(studies: RareStudies, formula: Formula) -> tuple[Floats, Floats]:
    """Return the estimates and their jackknife variances over items."""
    value = formula.of_freq(studies.freq.astype(np.float64))
    n = studies.freq.sum(axis=1)
    variance = np.empty(len(n))
    for start in range(0, len(n), _AT_ONCE):
        freq = studies.freq[start : start + _AT_ONCE]
        sums = (freq @ formula.features)[:, None, :] - formula.features
        left = np.where(freq > 0, formula.of_sums(sums), 0.0)
        here = n[start : start + _AT_ONCE]
        mean = (freq * left).sum(axis=1) / here
        squares = (freq * (left - mean[:, None]) ** 2).sum(axis=1)
        variance[start : start + _AT_ONCE] = (here - 1) / here * squares
    return value, variance


def on_logit(
    studies: RareStudies, value: Floats, variance: Floats, least: float
) -> Bounds:
    """Return the jackknife's ends on a logit between the least value and 1."""
    half = student(np.maximum(studies.n_paired - 1, 1)) * np.sqrt(variance)
    share = (value - least) / (1.0 - least)
    with np.errstate(all="ignore"):
        middle = np.log(share / (1.0 - share))
        half = half / ((1.0 - least) * share * (1.0 - share))
        low, high = (least + (1.0 - least) * expit(middle + x) for x in (-half, half))
        there = (share > 0.0) & (share < 1.0) & (variance > 0.0)
    return Bounds(low=np.where(there, low, np.nan), high=np.where(there, high, np.nan))


def held(ends: Floats, value: Floats) -> Bounds:
    """Return a posterior's ends, extended to the estimate; one-sided at 1."""
    perfect = ~(value < 1.0)
    low = np.where(perfect, ends[:, 1], np.fmin(ends[:, 0], value))
    return Bounds(low=low, high=np.where(perfect, 1.0, np.fmax(ends[:, 2], value)))


@cache
def _likelihoods(n: int, x: int) -> Floats:
    # of x ratings of n in the second category, (n_rho * n_share,)
    rho, share = expit(_RHO)[:, None], expit(_SHARE)
    a, b = (1.0 - rho) / rho * share, (1.0 - rho) / rho * (1.0 - share)
    return np.asarray((betaln(a + x, b + n - x) - betaln(a, b)).ravel())


def _on_grid(freq: NDArray[np.int64], table: Table) -> tuple[Floats, Floats]:
    counts = table.counts
    kinds, which = np.unique(counts, axis=0, return_inverse=True)
    of_kinds = np.stack(
        [freq[:, which.ravel() == k].sum(axis=1) for k in range(len(kinds))], axis=1
    )
    logs = np.stack([_likelihoods(int(k.sum()), int(k[1])) for k in kinds])
    rho, share = np.meshgrid(expit(_RHO), expit(_SHARE), indexing="ij")
    # uniform priors of both, times the slopes of their logits
    prior = np.log(rho * (1.0 - rho) * share * (1.0 - share)).ravel()
    spread = 2.0 * share * (1.0 - share)  # of the shares: chance disagreement
    gwet = (1.0 - (1.0 - rho) * spread / (1.0 - spread)).ravel()
    order = np.argsort(gwet, kind="stable")
    of_rho, of_gwet = np.empty((2, len(freq), len(TAILS)))
    for i, row in enumerate(of_kinds):
        log = row @ logs + prior
        weights = np.exp(log - log.max())
        density = weights.reshape(rho.shape).sum(axis=1)
        below = np.concatenate([[0.0], np.cumsum(density[1:] + density[:-1])])
        of_rho[i] = expit(np.interp(np.array(TAILS) * below[-1], below, _RHO))
        up_to = np.cumsum(weights[order])
        of_gwet[i] = np.interp(np.array(TAILS) * up_to[-1], up_to, gwet[order])
    return of_rho, of_gwet


def lifted(studies: RareStudies, ends: Bounds) -> Bounds:
    """Return ends of which, below 30 items, the upper goes halfway to that of ρ."""
    above = np.where(studies.n_paired < FEW, studies.rho[:, 2], -np.inf)
    high = np.fmax(ends.high, 0.5 * (ends.high + above))
    return Bounds(low=ends.low, high=np.where(np.isnan(ends.high), np.nan, high))
