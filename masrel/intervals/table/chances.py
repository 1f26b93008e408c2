"""A table of two raters' chances taken apart: how often they agree, on what, and not.

With θ ~ Dirichlet the share t of pairs that are apart, the shares x of the categories
among pairs that agree, and the shares y of the cells among pairs that do not, are
independent: a Beta and two Dirichlets. Given x and y the disagreement is linear in t,
and that by chance quadratic.
"""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from masrel.agreement._kernel import Floats
from masrel.intervals.table.beta_nodes import LEAST, beta_nodes

__all__ = ["CHANCE", "Chance", "Nodes", "drawn", "grid", "single"]

Chance = Literal["none", "uniform", "pooled", "pooled, Gwet", "margins"]
"""What disagreement by chance is made of."""

CHANCE: dict[str, Chance] = {
    "percent_agreement": "none",
    "brennan_prediger": "uniform",
    "scott_pi": "pooled",
    "fleiss_kappa": "pooled",
    "krippendorff_alpha": "pooled",
    "gwet_ac": "pooled, Gwet",
    "cohen_kappa": "margins",
    "conger_kappa": "margins",
    "light_kappa": "margins",
}
"""Coefficients of two raters; those of one kind have one value in the population."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Nodes:
    """Values of x and y with what the coefficient needs of them."""

    # The disagreement is t d, and by chance (1 - t)² e_0 + t (1 - t) e_1 + t² e_2. What
    # is kept are differences from d, which for two categories lose no digits.

    # (n,): probabilities of the values; they sum to 1
    weights: Floats = field(compare=False, repr=False)
    apart: Floats = field(compare=False, repr=False)  # (n,): d, of pairs that are apart
    # (n,): e_0, as if all pairs agreed
    agreed: Floats = field(compare=False, repr=False)
    # less_mixed, less_apart: (n,): d - e_1, and d - e_2
    less_mixed: Floats = field(compare=False, repr=False)
    less_apart: Floats = field(compare=False, repr=False)

    @classmethod
    def of(
        cls, chance: Chance, v: Floats, weights: Floats, x: Floats, y: Floats
    ) -> "Nodes":
        """Compute what the coefficient needs."""
        # Takes v (n_categories, n_categories), weights (n,), x (n, n_categories), y (n,
        # n_categories (n_categories - 1))
        q = len(v)
        first, second = np.nonzero(~np.eye(q, dtype=bool))
        rows, columns = y @ np.eye(q)[first], y @ np.eye(q)[second]
        if chance == "margins":
            parts = _products(v, x, x), _products(v, x, columns)
            mixed = parts[1] + _products(v, rows, x)
            found = parts[0], mixed, _products(v, rows, columns)
        elif chance in ("none", "uniform"):
            level = np.full(len(weights), 1.0 if chance == "none" else v.mean())
            found = level, 2.0 * level, level
        else:
            both = 0.5 * (rows + columns)
            # Gwet: 1 - g Σ p (1 - p) = 1 - g + g Σ p², g = T_w / (q (q - 1))
            g = (q * q - v.sum()) / (q * (q - 1))
            u, rest = (v, 0.0) if chance == "pooled" else (g * np.eye(q), 1.0 - g)
            found = (
                rest + _products(u, x, x),
                2.0 * rest + 2.0 * _products(u, x, both),
                rest + _products(u, both, both),
            )
        apart = y @ v[first, second]
        less = apart - found[1], apart - found[2]
        if q == 2 and chance == "margins":  # e_1 = d and e_2 = d (y² + (1 - y)²)
            less = np.zeros(len(y)), apart * 2.0 * y[:, 0] * y[:, 1]
        return cls(
            weights=weights,
            apart=apart,
            agreed=found[0],
            less_mixed=less[0],
            less_apart=less[1],
        )

    def first(self, n: int) -> "Nodes":
        """Return the first n of nodes that weigh the same."""
        return Nodes(
            weights=np.full(n, 1.0 / n),
            apart=self.apart[:n],
            agreed=self.agreed[:n],
            less_mixed=self.less_mixed[:n],
            less_apart=self.less_apart[:n],
        )


def _products(v: Floats, one: Floats, two: Floats) -> Floats:
    # Σ_kl v_kl one_k two_l, (n,)
    return np.asarray(((one @ v) * two).sum(axis=1))


def single(chance: Chance, v: Floats) -> Nodes:
    """Return one value, where neither x nor y matters."""
    # Takes v (n_categories, n_categories)
    q = len(v)
    cells = q * (q - 1)
    x, y = np.full((1, q), 1.0 / q), np.full((1, cells), 1.0 / cells)
    return Nodes.of(chance, v, np.ones(1), x, y)


def grid(chance: Chance, v: Floats, prior: Floats, step: float, value: float) -> Nodes:
    """Return the quadrature nodes of two categories."""
    # Takes v (2, 2), prior (2, 2)
    # With margins and r = 1 - `value` the coefficient can be at most a negative value
    # only where r 2 y (1 - y) is at least -`value`; what is beyond is 0, and a grid
    # over all y would not see where it begins.
    x, of_x = beta_nodes(float(prior[0, 0]), float(prior[1, 1]), step)
    y, of_y = np.full((1, 2), 0.5), np.ones(1)
    if chance == "margins":  # else y matters nowhere
        spread = max(-value, 0.0) / (1.0 - value)  # least 2 y (1 - y)
        least = spread / (1.0 + np.sqrt(max(1.0 - 2.0 * spread, 0.0)))
        y, of_y = beta_nodes(float(prior[0, 1]), float(prior[1, 0]), step, least)
    weights = np.multiply.outer(of_x, of_y).ravel()
    x, y = np.repeat(x, len(of_y), axis=0), np.tile(y, (len(of_x), 1))
    kept = weights > LEAST * weights.max()
    return Nodes.of(chance, v, weights[kept], x[kept], y[kept])


def drawn(
    chance: Chance,
    v: Floats,
    prior: Floats,
    generator: np.random.Generator,
    n_draws: int,
) -> Nodes:
    """Draw values of x and y."""
    # Takes v (n_categories, n_categories), prior (n_categories, n_categories)
    agreed = np.eye(len(v), dtype=bool)
    x = generator.dirichlet(prior[agreed], size=n_draws)
    y = generator.dirichlet(prior[~agreed], size=n_draws)
    return Nodes.of(chance, v, np.full(n_draws, 1.0 / n_draws), x, y)
