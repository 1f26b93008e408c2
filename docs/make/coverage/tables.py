"""Tables of two raters: populations, coefficients, and intervals of many at once."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from docs.make.coverage.bounds import Bounds, around, student
from docs.make.coverage.latent import severities
from docs.make.coverage.studies import Floats

SHARES = {2: (0.65, 0.35), 4: (0.35, 0.3, 0.2, 0.15)}
"""Shares of the grades of the first rater, by their number."""
N_DRAWS = 1_000  # of a posterior: an end's error is some 3 % of the width


def quasi(kappa: float, n_grades: int) -> Floats:
    """Pairs that agree with a chance of kappa, and by accident else."""
    first = np.array(SHARES[n_grades])
    second = first * np.linspace(1.2, 0.8, n_grades)
    accident = np.outer(first, second / second.sum())
    return kappa * np.diag(first) + (1.0 - kappa) * accident


def latent(kappa: float, n_grades: int) -> Floats:
    """Two raters who see the same severity with noise, half a noise apart."""
    severity, weights = severities(0.05)
    cuts = ndtri(np.cumsum(SHARES[n_grades])[:-1])

    def table(log_noise: float) -> Floats:
        noise = np.exp(log_noise)
        ends = np.concatenate([[-np.inf], cuts * np.hypot(1.0, noise), [np.inf]])
        seen = [
            np.diff(ndtr((ends - severity[:, None]) / noise - bias), axis=1)
            for bias in (-0.25, 0.25)
        ]
        return np.einsum("s,sk,sl->kl", weights, *seen)

    noise = brentq(lambda x: float(cohen(table(x))) - kappa, -4.0, 4.0, xtol=1e-10)
    return table(noise)


MODELS = {"agreement or accident": quasi, "latent trait": latent}


def weighted(v: Floats) -> Callable[[Floats], Floats]:
    """Return Cohen's kappa of tables (..., q, q) by disagreements of categories."""

    def kappa(tables: Floats) -> Floats:
        shares = tables / tables.sum(axis=(-1, -2), keepdims=True)
        observed = (shares * v).sum(axis=(-1, -2))
        chance = np.einsum("...i,...j,ij->...", shares.sum(-1), shares.sum(-2), v)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(1.0 - observed / chance)

    return kappa


def cohen(tables: Floats) -> Floats:
    """Cohen's kappa, unweighted, of tables (..., q, q)."""
    return weighted(1.0 - np.eye(tables.shape[-1]))(tables)


def quadratic(tables: Floats) -> Floats:
    """Cohen's kappa with quadratic weights."""
    place = np.arange(tables.shape[-1], dtype=np.float64)
    return weighted((place[:, None] - place) ** 2)(tables)


def gwet(tables: Floats) -> Floats:
    """Gwet's AC1."""
    shares = tables / tables.sum(axis=(-1, -2), keepdims=True)
    both = 0.5 * (shares.sum(-1) + shares.sum(-2))
    chance = (both * (1.0 - both)).sum(axis=-1) / (shares.shape[-1] - 1)
    return (np.einsum("...ii", shares) - chance) / (1.0 - chance)


COEFFICIENTS: Mapping[str, Callable[[Floats], Floats]] = {
    "cohen_kappa": cohen,
    "cohen_kappa, quadratic": quadratic,
    "gwet_ac": gwet,
}


@dataclass(frozen=True)
class Tables:
    """Studies of one cell: items per pair of grades, (n_studies, q, q)."""

    counts: Floats = field(repr=False)
    formula: Callable[[Floats], Floats]
    rng: np.random.Generator

    @property
    def n_items(self) -> int:
        """Items of a study."""
        return int(self.counts[0].sum())

    @cached_property
    def value(self) -> Floats:
        """The estimates."""
        return self.formula(self.counts)

    @cached_property
    def perfect(self) -> "np.ndarray[tuple[int, ...], np.dtype[np.bool_]]":
        """Whether nobody disagrees."""
        return np.einsum("sii->s", self.counts) == self.n_items

    @cached_property
    def jackknife(self) -> Floats:
        """The variance over items; ``nan`` where one left out leaves no estimate."""
        q = self.counts.shape[-1]
        left = self.counts[:, None] - np.eye(q * q).reshape(1, q * q, q, q)
        freq = self.counts.reshape(-1, q * q)
        without_one = np.where(freq > 0.0, self.formula(np.maximum(left, 0.0)), 0.0)
        mean = (freq * without_one).sum(axis=1, keepdims=True) / self.n_items
        squares = (freq * (without_one - mean) ** 2).sum(axis=1)
        return (self.n_items - 1) / self.n_items * squares

    def posterior(self, prior: Floats) -> Bounds:
        """The posterior of a Dirichlet, drawn; one-sided where nobody disagrees."""
        ends = []
        for counts, perfect in zip(self.counts, self.perfect, strict=True):
            shape = (N_DRAWS, *prior.shape)
            drawn = self.formula(self.rng.standard_gamma(counts + prior, shape))
            shares = (0.05, 1.0) if perfect else (0.025, 0.975)
            low, high = np.quantile(drawn[np.isfinite(drawn)], shares)
            ends.append((low, 1.0 if perfect else high))
        low, high = np.array(ends).T
        return Bounds(low=low, high=high)


def on_scale(tables: Tables, *, logit: bool) -> Bounds:
    """The item jackknife with Student's t, plain or between -1 and 1."""
    half = student(tables.n_items - 1) * np.sqrt(tables.jackknife)
    ends = around(tables.value, half, "Fisher z" if logit else "plain", 2)
    nowhere = np.full(len(half), np.nan)
    there = tables.jackknife > 0.0
    return ends.where(there, Bounds(low=nowhere, high=nowhere))
