"""Populations of patterns of ratings in which most ratings are of one category.

A pattern is what the raters of an item gave it, -1 where one did not rate. Each has a
probability, so that what is true of a coefficient is computed, not drawn.
"""

from dataclasses import dataclass, field
from functools import cache
from itertools import product
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import gammaln, ndtr, ndtri

from docs.make.coverage.latent import severities
from docs.make.coverage.studies import Floats
from masrel.agreement import COEFFICIENTS, declared_weights
from masrel.agreement._engine import Formula as Kernel

Patterns = NDArray[np.int64]
Population = Literal["alike", "unlike", "double coding"]
Shares = tuple[float, ...]
WITHOUT_END = 1e12
"""Items that are as good as all: a correction for few of them is nothing."""
_STEP = 0.04
_LESS_OR_MORE = {2: (0.6, 1.4), 3: (0.5, 1.0, 1.5), 5: (0.4, 0.7, 1.0, 1.3, 1.6)}
_DOUBLE = 0.2  # of the items are rated by both


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Patterns (n_patterns, n_raters) and their probabilities (n_patterns,)."""

    patterns: Patterns = field(repr=False)
    shares: Floats = field(repr=False)
    n_categories: int

    @property
    def counts(self) -> Patterns:
        """Raters per category of each pattern, (n_patterns, n_categories)."""
        grades = np.arange(self.n_categories)
        return np.asarray((self.patterns[..., None] == grades).sum(axis=1))


@dataclass(frozen=True, slots=True, kw_only=True)
class Formula:
    """A coefficient of sums of features of patterns."""

    kernel: Kernel
    v: Floats = field(repr=False)
    features: Floats = field(repr=False)  # (n_patterns, n_features)

    @classmethod
    def of(cls, name: str, weights: str, table: Table) -> "Formula":
        """Prepare a coefficient by its name."""
        kernel = cast("Kernel", COEFFICIENTS[name].formula)
        scale = tuple(range(table.n_categories))
        v = declared_weights(weights, scale, declared=True).v  # type: ignore[arg-type]
        features = kernel.features(table.patterns, v).rows()
        return cls(kernel=kernel, v=v, features=features)

    def of_sums(self, sums: Floats) -> Floats:
        """Return the coefficient of sums (..., n_features)."""
        return np.asarray(self.kernel.value(sums, self.v))

    def of_freq(self, freq: Floats) -> Floats:
        """Return the coefficient of so many items (..., n_patterns) of each pattern."""
        return self.of_sums(np.asarray(freq @ self.features))

    def truth(self, table: Table) -> float:
        """Return the coefficient of the population."""
        return float(self.of_freq(table.shares * WITHOUT_END))


def population(kind: Population, shares: Shares, kappa: float, n_raters: int) -> Table:
    """Return a population with these shares of categories and this Fleiss' kappa.

    Raters alike: Dirichlet-multinomial. Unlike: a latent trait of which raters choose
    the rarer categories less or more often; kappa is that of such raters if alike.
    Double coding: the latter, two of them, of whom both rate a fifth of the items and
    one the others.
    """
    if kind == "alike":
        return _dirichlet_multinomial(shares, kappa, n_raters)
    noise, factors = _noise(shares, kappa), _LESS_OR_MORE[n_raters]
    table = _trait(shares, noise, factors)
    return table if kind == "unlike" else _doubly_coded(table)


def _all_patterns(q: int, n_raters: int) -> Patterns:
    return np.array(list(product(range(q), repeat=n_raters)), dtype=np.int64)


def _dirichlet_multinomial(shares: Shares, kappa: float, n_raters: int) -> Table:
    patterns = _all_patterns(len(shares), n_raters)
    a = np.array(shares) * (1.0 / kappa - 1.0)
    counts = (patterns[..., None] == np.arange(len(shares))).sum(axis=1)
    logs = (gammaln(a + counts) - gammaln(a)).sum(axis=1)
    weights = np.exp(logs - logs.max())
    return Table(
        patterns=patterns, shares=weights / weights.sum(), n_categories=len(shares)
    )


def _trait(shares: Shares, noise: float, factors: tuple[float, ...]) -> Table:
    # a rater's shares of the categories from the second on are `factors` times those
    severity, weights = severities(_STEP)
    patterns = _all_patterns(len(shares), len(factors))
    beyond = np.cumsum(shares[::-1])[::-1][1:]
    chances = np.ones((len(patterns), severity.size))
    edge = np.zeros((severity.size, 1))
    for factor, column in zip(factors, patterns.T, strict=True):
        cuts = -ndtri(beyond * factor) * np.hypot(1.0, noise)
        above = ndtr((severity[:, None] - cuts) / noise)
        of_rater = -np.diff(np.concatenate([edge + 1.0, above, edge], axis=1), axis=1)
        chances *= of_rater.T[column]
    found = chances @ weights
    return Table(
        patterns=patterns, shares=found / found.sum(), n_categories=len(shares)
    )


@cache
def _noise(shares: Shares, kappa: float) -> float:
    def off(log_noise: float) -> float:
        table = _trait(shares, np.exp(log_noise), (1.0, 1.0))
        return Formula.of("fleiss_kappa", "identity", table).truth(table) - kappa

    return float(np.exp(brentq(off, -4.0, 4.0, xtol=1e-8)))


def _doubly_coded(table: Table) -> Table:
    patterns, chances = [table.patterns], [table.shares * _DOUBLE]
    for rater in (0, 1):
        single = np.full((table.n_categories, 2), -1)
        single[:, rater] = np.arange(table.n_categories)
        patterns.append(single)
        of_rater = np.bincount(table.patterns[:, rater], weights=table.shares)
        chances.append(of_rater * 0.5 * (1.0 - _DOUBLE))
    return Table(
        patterns=np.concatenate(patterns),
        shares=np.concatenate(chances),
        n_categories=table.n_categories,
    )
