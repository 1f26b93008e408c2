"""What a latent-trait model implies: kappa of new raters, and replicated ratings.

A rater drawn from the population gives item i grade k with probability
p_ik = E[Φ((τ_k - θ_i)/s) - Φ((τ_(k-1) - θ_i)/s)], s² = ω² + σ² e^(2 η w), where the
expectation is over w ~ N(0, 1) and the bias is integrated out. Two raters agree on it
with probability Σ_k p_ik². With P_o the mean of that over items, π_k that of p_ik, and
P_e = Σ_k π_k², κ = (P_o - P_e) / (1 - P_e), which is the variance of p_ik over items
as a share of the most it could be: Σ_k var(p_k) / Σ_k π_k (1 - π_k).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from masrel.agreement._engine import Floats
from masrel.agreement._labels import Codes
from masrel.intervals._quadrature import beta_nodes
from masrel.intervals.latent._model import Traits

Items = Literal["fixed", "random"]
"""Whether kappa is for these items, or for new items of their population."""

_MAX_W = 5.5  # where the sum over a rater's w ends, on either side
_N_NODES = 69  # of a tanh-sinh quadrature
_MAX_Z = 8.5  # standard deviations of an item
_CHUNK = 400  # positions at a time


@dataclass(frozen=True, slots=True, kw_only=True)
class Agreement:
    """Agreement of two new raters, at n positions."""

    # observed, chance: (n,): p_o and P_e
    observed: Floats = field(compare=False, repr=False)
    chance: Floats = field(compare=False, repr=False)
    # (n,): fleiss' kappa; 0 where all ratings are in one category
    kappa: Floats = field(compare=False, repr=False)

    @classmethod
    def of(cls, shares: Floats, variance: Floats) -> "Agreement":
        """Put together shares π (n, n_categories) and Σ_k var(p_k) (n,)."""
        rest = shares @ (1.0 - np.eye(shares.shape[1]))  # 1 - π_k with all its digits
        most = (shares * rest).sum(axis=1)
        kappa = np.divide(variance, most, out=np.zeros_like(most), where=most > 0.0)
        chance = (shares**2).sum(axis=1)
        return cls(
            observed=chance + variance, chance=chance, kappa=kappa.clip(0.0, 1.0)
        )


def grade_probabilities(traits: Traits) -> Floats:
    """Return how likely a new rater gives each grade to each of the items."""
    # -> (n, n_items, n_categories)
    return _shares(traits, traits.thresholds[:, None, :] - traits.severity[:, :, None])


def agreement_on_items(traits: Traits) -> Agreement:
    """Return the agreement of two new raters on these items."""
    p = grade_probabilities(traits)
    shares = p.mean(axis=1)
    return Agreement.of(shares, ((p - shares[:, None]) ** 2).sum(axis=2).mean(axis=1))


def agreement_on_new_items(traits: Traits) -> Agreement:
    """Return the agreement of two new raters on new items."""
    # At each of them; the variance is an integral over θ ~ N(0, ρ), and in π_k θ
    # integrates out.
    # p_k(θ) changes within s of each threshold, however small s is. The tanh-sinh rule
    # between neighbouring thresholds has points so close to both ends that it follows:
    # κ is within 1e-6 for ρ < 0.99, and within 1e-5 beyond.
    shares = _shares(traits, traits.thresholds[:, None, :], more=traits.item_share)
    # Positions of like spread together, as the widest says how many points w needs.
    order, variance = np.argsort(traits.noise_spread), np.empty(len(shares))
    for at in range(0, len(shares), _CHUNK):
        rows = order[at : at + _CHUNK]
        variance[rows] = _variance(traits, shares, rows)
    return Agreement.of(shares[:, 0], variance)


def _variance(traits: Traits, shares: Floats, rows: NDArray[np.intp]) -> Floats:
    # -> (rows,): ∫ Σ_k (p_k(z √ρ) - π_k)² φ(z) dz, between neighbouring thresholds
    root = np.sqrt(traits.item_share[rows])[:, None]
    tau = traits.thresholds[rows]
    inner = (tau / root).clip(-_MAX_Z, _MAX_Z)
    far = np.full_like(root, _MAX_Z)
    ends = np.sort(np.hstack([-far, inner, 0.0 * far, far]), axis=1)
    nodes, mass = beta_nodes(1.0, 1.0, _N_NODES)
    width = np.diff(ends, axis=1)[:, :, None]
    z = (ends[:, :-1, None] + width * nodes[:, 0]).reshape(len(root), -1)
    weigh = (width * mass).reshape(z.shape) * np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi)
    p = _shares(traits, tau[:, None, :] - (root * z)[:, :, None], rows)
    return np.asarray((((p - shares[rows]) ** 2).sum(axis=2) * weigh).sum(axis=1))


def _shares(
    traits: Traits,
    away: Floats,
    rows: NDArray[np.intp] | slice = slice(None),
    more: Floats | float = 0.0,
) -> Floats:
    # Of thresholds less severities, (n, m, n_categories - 1), to which new raters add
    # their bias and noise, and severities a variance of their own: the shares of the
    # grades, as (n, m, n_categories).
    # A trapezoid sum over w: as s² is 0 at distances of π/(2 η) from the real line, the
    # error falls as e^(-π²/(η h)) with the step h, and as e^(-2 π²/h²) (Trefethen,
    # L. N., Weideman, J. A. C. (2014). The exponentially convergent trapezoidal rule.
    # SIAM Review 56(3), 385-458. https://doi.org/10.1137/130932132)
    eta = traits.noise_spread[rows]
    n = int(np.ceil(_MAX_W * max(1.0, 2.0 * eta.max(initial=0.0))))
    points = np.linspace(-_MAX_W, _MAX_W, 2 * n + 1)
    weights = np.exp(-0.5 * points**2)
    below = np.zeros(away.shape)
    for w, weight in zip(points, weights / weights.sum(), strict=True):
        noise = traits.noise_variance[rows] * np.exp(2.0 * eta * w)
        deviation = np.sqrt(more + traits.bias_variance[rows] + noise)
        below += weight * ndtr(away / deviation[:, None, None])
    return np.diff(below, axis=-1, prepend=0.0, append=1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictiveCheck:
    """A property of the ratings compared with what the model predicts.

    Attributes
    ----------
    name : str
        What it is.
    observed : float
        In the ratings.
    low, high : float
        Central 95 % of replicated ratings by the same raters on the same items.
    p_value : float
        Share of those that are larger, with half of those that are equal. Near 0 or 1
        the model does not make ratings such as these.
    """

    name: str
    observed: float
    low: float
    high: float
    p_value: float


def predictive_checks(
    codes: Codes,
    traits: Traits,
    categories: Sequence[object],
    generator: np.random.Generator,
) -> tuple[PredictiveCheck, ...]:
    """Compare ratings with ratings replicated from the posterior."""
    # Takes codes (n_items, n_raters)
    drawn = np.where(codes >= 0, replicate(traits, generator), -1)
    n = len(categories)
    names = [
        "agreeing pairs",
        *(f"ratings of {category}" for category in categories),
        "spread of raters' mean grades",
        "spread of items' mean grades",
        "widest spread of the grades of an item",
        "widest distance of a rater from items' means",
    ]
    observed, replicated = _properties(codes[None], n)[0], _properties(drawn, n)
    return tuple(
        PredictiveCheck(
            name=name,
            observed=float(value),
            low=float(np.quantile(values, 0.025)),
            high=float(np.quantile(values, 0.975)),
            p_value=float((values > value).mean() + 0.5 * (values == value).mean()),
        )
        for name, value, values in zip(names, observed, replicated.T, strict=True)
    )


def replicate(traits: Traits, generator: np.random.Generator) -> NDArray[np.int64]:
    """Let the same raters rate the same items again."""
    # -> (n, n_items, n_raters)
    perceived = traits.severity[:, :, None] + traits.bias[:, None, :]
    noise = generator.standard_normal(perceived.shape)
    perceived = perceived + traits.noise[:, None, :] * noise
    passed = perceived[..., None] > traits.thresholds[:, None, None, :]
    return np.asarray(passed.sum(axis=-1))


def _properties(codes: Codes, n_categories: int) -> Floats:
    # (n, n_items, n_raters) -> (n, n_categories + 5)
    rated = codes >= 0
    counts = (codes[..., None] == np.arange(n_categories)).sum(axis=2)  # (n, items, q)
    n_ratings = counts.sum(axis=2)
    pairs = (n_ratings * (n_ratings - 1)).sum(axis=1)
    grades = np.where(rated, codes, 0)
    by_rater = grades.sum(axis=1) / rated.sum(axis=1)  # each has a rating
    by_item = grades.sum(axis=2) / rated.sum(axis=2)
    away = np.where(rated, codes - by_item[:, :, None], 0.0) ** 2
    return np.column_stack(
        [
            (counts * (counts - 1)).sum(axis=(1, 2)) / pairs,
            counts.sum(axis=1),
            by_rater.std(axis=1),
            by_item.std(axis=1),
            np.sqrt(away.sum(axis=2) / rated.sum(axis=2)).max(axis=1),
            np.sqrt(away.sum(axis=1) / rated.sum(axis=1)).max(axis=1),
        ]
    )
