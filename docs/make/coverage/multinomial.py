"""The Dirichlet-multinomial model: items differ, raters are alike."""

from dataclasses import dataclass

import numpy as np

from docs.make.coverage.studies import (
    Design,
    Floats,
    Studies,
    Target,
    drawn,
    kappa_of_items,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class DirichletMultinomial:
    """An item's category probabilities are Dirichlet(A π); its ratings multinomial.

    Kappa of all items is 1 / (1 + A), whichever the raters. With items fixed it is
    `kappa_of_items` of those the study happened to draw, another one in every study.
    """

    kappa: float
    shares: tuple[float, ...] = (0.35, 0.25, 0.2, 0.12, 0.08)

    def probabilities(
        self, size: int, n_items: int, rng: np.random.Generator
    ) -> Floats:
        """Draw Dirichlet vectors (size, n_items, n_categories), in logarithms.

        A gamma variable of shape a is one of shape a + 1 times U^(1/a), and that
        underflows where a is 0.01.
        """
        shape = np.array(self.shares) * (1.0 / self.kappa - 1.0)
        dimensions = (size, n_items, shape.size)
        logs = np.log(rng.gamma(shape + 1.0, size=dimensions))
        logs += np.log1p(-rng.random(dimensions)) / shape
        ratios = np.exp(logs - logs.max(axis=-1, keepdims=True))
        return np.asarray(ratios / ratios.sum(axis=-1, keepdims=True))

    def draw(
        self, size: int, design: Design, target: Target, rng: np.random.Generator
    ) -> Studies:
        """Draw studies, each with items of its own."""
        shares = self.probabilities(size, design.n_items, rng)
        truth = np.full(size, self.kappa)
        if target == "raters":
            truth = kappa_of_items(shares)
        codes = drawn(shares, design.n_raters, rng)
        return Studies(codes=codes, truth=truth, n_categories=len(self.shares))


def urn(
    model: DirichletMultinomial, size: int, n_raters: int, rng: np.random.Generator
) -> Floats:
    """Draw counts of single items (size, n_categories) from a Pólya urn.

    Every rating is of a category with probability (A π_k + its ratings so far) over
    the total: the same law, without a Dirichlet vector.
    """
    weights = np.tile(
        np.array(model.shares) * (1.0 / model.kappa - 1.0), (size, 1)
    )  # A π
    start = weights.copy()
    for _ in range(n_raters):
        codes = drawn(weights / weights.sum(axis=1, keepdims=True), 1, rng)[:, 0]
        weights[np.arange(size), codes] += 1.0
    return np.asarray(np.rint(weights - start))
