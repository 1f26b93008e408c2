"""The ordinal latent-trait model: severities, biases of raters, noise, thresholds."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri

from docs.make.coverage.studies import Design, Floats, Studies, Target, kappa_of_items

STEP = 0.04


def severities(step: float) -> tuple[Floats, Floats]:
    """Nodes and weights of the trapezoid rule under the normal density.

    Its error falls as fast as the Fourier transform of what is integrated: below
    1e-9 for grades of noise one step wide, which is less than kappa 0.9 needs.
    """
    nodes = np.arange(-7.0, 7.0 + step / 2, step)
    weights = np.exp(-0.5 * nodes**2)
    return nodes, weights / weights.sum()


@dataclass(frozen=True, slots=True, kw_only=True)
class LatentTrait:
    """A rater sees severity + own bias + noise, and cuts it into grades.

    Severities are N(0, 1), noise N(0, scale²), biases N(0, (bias · scale)²). The scale
    is solved such that the population has `kappa`: that of all items and raters, or,
    with items fixed, of these items and all raters. Fixed items have evenly spaced
    quantiles of severity, as models made to span a scale; none may lie on a threshold.
    """

    kappa: float
    bias: float = 0.5
    shares: tuple[float, ...] = (0.35, 0.3, 0.2, 0.15)

    def draw(
        self, size: int, design: Design, target: Target, rng: np.random.Generator
    ) -> Studies:
        """Draw studies with raters of their own, and items too unless fixed."""
        scale, severity = self.scale(), rng.normal(size=(size, design.n_items))
        if target == "raters":
            scale = self.scale(design.n_items)
            severity = np.tile(fixed(design.n_items), (size, 1))
        biases = rng.normal(0.0, self.bias * scale, (size, design.n_raters))
        seen = severity[:, :, None] + biases[:, None, :]
        seen = seen + rng.normal(0.0, scale, seen.shape)
        truth = np.full(size, self.kappa)
        if target == "items":  # these raters, all items
            parts = np.array_split(biases, -(-size // 100))
            truth = np.concatenate([self.of_raters(scale, part) for part in parts])
        codes = np.searchsorted(self.thresholds, seen).astype(np.int8)
        return Studies(codes=codes, truth=truth, n_categories=len(self.shares))

    @property
    def thresholds(self) -> Floats:
        """Cuts between grades, from how many severities lie below each."""
        return np.asarray(ndtri(np.cumsum(self.shares)[:-1]))

    def scale(self, n_fixed: int | None = None) -> float:
        """Return the scale of noise and biases, for all items or so many fixed ones."""
        return _scale(self, n_fixed)

    def grades(self, severity: Floats, noise: float) -> Floats:
        """Probabilities (..., n_categories) of the grades of severities (...)."""
        below = ndtr((self.thresholds - severity[..., None]) / noise)
        edge = np.zeros((*severity.shape, 1))
        return np.diff(np.concatenate([edge, below, edge + 1.0], axis=-1))

    def of_all(
        self, scale: float, n_fixed: int | None = None, step: float = STEP
    ) -> float:
        """Kappa of all raters, whose bias is noise to who does not know them."""
        noise = float(scale * np.hypot(1.0, self.bias))
        if n_fixed is not None:
            return float(kappa_of_items(self.grades(fixed(n_fixed), noise)))
        nodes, weights = severities(step)
        shares = self.grades(nodes, noise)
        observed = 1.0 - weights @ (shares**2).sum(axis=-1)
        return float(1.0 - observed / (1.0 - ((weights @ shares) ** 2).sum()))

    def of_raters(self, scale: float, biases: Floats, step: float = STEP) -> Floats:
        """Kappa of all items and of raters with these biases (size, n_raters)."""
        nodes, weights = severities(step)
        size, r = biases.shape
        total = np.zeros((size, nodes.size, len(self.shares)))
        with_itself = np.zeros((size, nodes.size))
        for bias in biases.T:
            of_rater = self.grades(nodes + bias[:, None], scale)
            total += of_rater
            with_itself += (of_rater**2).sum(axis=-1)
        agree = ((total**2).sum(axis=-1) - with_itself) / (r * (r - 1)) @ weights
        shares = np.einsum("q,sqk->sk", weights, total) / r
        return np.asarray(1.0 - (1.0 - agree) / (1.0 - (shares**2).sum(axis=-1)))


def fixed(n_items: int) -> Floats:
    """Severities of fixed items: evenly spaced quantiles."""
    return np.asarray(ndtri((np.arange(n_items) + 0.5) / n_items))


@cache
def _scale(model: LatentTrait, n_fixed: int | None) -> float:
    return float(brentq(lambda s: model.of_all(s, n_fixed) - model.kappa, 0.02, 20.0))
