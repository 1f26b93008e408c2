"""The posterior of a coefficient of two raters, given a Dirichlet on their table.

With θ ~ Dirichlet the share t of pairs that disagree, the shares x of the categories
among pairs that agree, and the shares y of the cells among pairs that do not, are
independent: a Beta and two Dirichlets. Given x and y the disagreement is linear in t,
and that by chance quadratic: the coefficient is at most a value where a quadratic in t
is positive, which has a probability in closed form. That is summed over nodes of x and
y: one where they do not matter, a grid for two categories, else draws.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Literal

import numpy as np
from scipy.special import betainc, betaln, xlogy

from masrel.agreement._engine import Floats
from masrel.errors import ConvergenceError
from masrel.estimates import Distribution
from masrel.intervals._quadrature import (
    NEGLIGIBLE,
    SETTLED,
    beta_nodes,
    solve_quantile,
)

ChanceAgreement = Literal["none", "uniform", "pooled", "pooled, Gwet", "margins"]
"""What disagreement by chance is made of."""

CHANCE_AGREEMENT: dict[str, ChanceAgreement] = {
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

_STEPS = (0.5, 0.25, 0.125, 0.0625)  # of the quadrature, until the ends settle
_NEARLY = 1e-5  # as far as a few tables get, of zeros and small priors
_FIRST_DRAWS = 500  # which show where the ends are about
_SHOWN_DRAWS = 2000  # from which a density that is looked at is made
_SHOWN = 101  # points of a distribution


@dataclass(frozen=True, slots=True, kw_only=True)
class Nodes:
    """Values of x and y with what the coefficient needs of them."""

    # The disagreement is t d, and by chance (1 - t)² e_0 + t (1 - t) e_1 + t² e_2. What
    # is stored are differences from d, which for two categories lose no digits.

    # (n,): probabilities of the values; they sum to 1
    weights: Floats = field(compare=False, repr=False)
    # (n,): d, of pairs that disagree
    disagreement: Floats = field(compare=False, repr=False)
    # (n,): e_0, by chance as if all pairs agreed
    by_chance: Floats = field(compare=False, repr=False)
    # (n,): d - e_1, and d - e_2
    excess_mixed: Floats = field(compare=False, repr=False)
    excess_disagreeing: Floats = field(compare=False, repr=False)

    @classmethod
    def of(
        cls, chance: ChanceAgreement, v: Floats, weights: Floats, x: Floats, y: Floats
    ) -> "Nodes":
        """Compute what the coefficient needs."""
        # v (n_categories, n_categories), weights (n,), x (n, n_categories), y (n,
        # n_categories (n_categories - 1))
        q = len(v)
        first, second = np.nonzero(~np.eye(q, dtype=bool))
        rows, columns = y @ np.eye(q)[first], y @ np.eye(q)[second]
        d = y @ v[first, second]
        if chance == "margins":
            mixed = _products(v, x, columns) + _products(v, rows, x)
            e = _products(v, x, x), mixed, _products(v, rows, columns)
        elif chance in ("none", "uniform"):
            level = np.full(len(weights), 1.0 if chance == "none" else v.mean())
            e = level, 2.0 * level, level
        else:
            both = 0.5 * (rows + columns)
            # Gwet: 1 - g Σ p (1 - p) = 1 - g + g Σ p², g = T_w / (q (q - 1))
            g = (q * q - v.sum()) / (q * (q - 1))
            u, rest = (v, 0.0) if chance == "pooled" else (g * np.eye(q), 1.0 - g)
            e = (
                rest + _products(u, x, x),
                2.0 * rest + 2.0 * _products(u, x, both),
                rest + _products(u, both, both),
            )
        excess = d - e[1], d - e[2]
        if q == 2 and chance == "margins":  # e_1 = d and e_2 = d (y² + (1 - y)²)
            excess = np.zeros(len(y)), d * 2.0 * y[:, 0] * y[:, 1]
        return cls(
            weights=weights,
            disagreement=d,
            by_chance=e[0],
            excess_mixed=excess[0],
            excess_disagreeing=excess[1],
        )

    def first(self, n: int) -> "Nodes":
        """Return the first n of nodes that weigh the same."""
        return Nodes(
            weights=np.full(n, 1.0 / n),
            disagreement=self.disagreement[:n],
            by_chance=self.by_chance[:n],
            excess_mixed=self.excess_mixed[:n],
            excess_disagreeing=self.excess_disagreeing[:n],
        )


def _products(v: Floats, one: Floats, two: Floats) -> Floats:
    # Σ_kl v_kl one_k two_l, (n,)
    return np.asarray(((one @ v) * two).sum(axis=1))


def _single_node(chance: ChanceAgreement, v: Floats) -> Nodes:
    # one value, where neither x nor y matters
    q = len(v)
    cells = q * (q - 1)
    x, y = np.full((1, q), 1.0 / q), np.full((1, cells), 1.0 / cells)
    return Nodes.of(chance, v, np.ones(1), x, y)


def grid_nodes(
    chance: ChanceAgreement, v: Floats, cells: Floats, step: float, value: float
) -> Nodes:
    """Return the nodes of two categories, for the coefficient at a value."""
    # both v and cells are 2 by 2
    # With margins and r = 1 - `value` the coefficient can be at most a negative value
    # only where r 2 y (1 - y) is at least -`value`; beyond that the probability is 0,
    # and a grid over all y would not see where it begins.
    x, of_x = beta_nodes(float(cells[0, 0]), float(cells[1, 1]), step)
    y, of_y = np.full((1, 2), 0.5), np.ones(1)
    if chance == "margins":  # else y does not matter
        product = max(-value, 0.0) / (1.0 - value)  # least 2 y (1 - y)
        least = product / (1.0 + np.sqrt(max(1.0 - 2.0 * product, 0.0)))
        y, of_y = beta_nodes(float(cells[0, 1]), float(cells[1, 0]), step, least)
    weights = np.multiply.outer(of_x, of_y).ravel()
    x, y = np.repeat(x, len(of_y), axis=0), np.tile(y, (len(of_x), 1))
    large = weights > NEGLIGIBLE * weights.max()
    return Nodes.of(chance, v, weights[large], x[large], y[large])


def _drawn_nodes(
    chance: ChanceAgreement,
    v: Floats,
    cells: Floats,
    generator: np.random.Generator,
    n_draws: int,
) -> Nodes:
    agreeing = np.eye(len(v), dtype=bool)
    x = generator.dirichlet(cells[agreeing], size=n_draws)
    y = generator.dirichlet(cells[~agreeing], size=n_draws)
    return Nodes.of(chance, v, np.full(n_draws, 1.0 / n_draws), x, y)


@dataclass(frozen=True, slots=True, kw_only=True)
class TablePosterior:
    """The distribution of a coefficient."""

    # A value to nodes of x and y, for the coefficient to be at most that value
    nodes: Callable[[float], Nodes]
    # the same with fewer nodes, as many as a density that is looked at needs
    shown: Callable[[float], Nodes]
    # the share of pairs that disagree is Beta(disagreeing, agreeing)
    disagreeing: float
    agreeing: float
    n_draws: int | None = None  # how many nodes were drawn; None if none were

    def probability(self, value: float) -> float:
        """Return the probability that the coefficient is at most a value."""
        nodes = self.nodes(value)
        return float(nodes.weights @ self._probabilities(nodes, value))

    def quantiles(
        self, shares: tuple[float, float], starts: tuple[float, float]
    ) -> tuple[float, float]:
        """Return the values below which shares lie."""
        return (
            self.quantile(shares[0], starts[0]),
            self.quantile(shares[1], starts[1]),
        )

    def quantile(self, share: float, start: float) -> float:
        """Return the value below which a share lies, from somewhere near it."""
        low, high = -1.0, 1.0
        while self.probability(low) > share:
            low = 2.0 * low - 1.0  # with weights it can be below -1
        start = start if low < start < high else 0.5 * (low + high)
        return solve_quantile(self._at, share, start, (low, high), 1e-11)

    def _at(self, value: float) -> tuple[float, float]:
        nodes = self.nodes(value)
        probability = float(nodes.weights @ self._probabilities(nodes, value))
        return probability, float(nodes.weights @ self._densities(nodes, value))

    def quantile_error(self, at: float) -> float:
        """Return the Monte Carlo standard error of the quantile at a value."""
        nodes = self.nodes(at)
        probabilities = self._probabilities(nodes, at)
        error = float(probabilities.std() / np.sqrt(probabilities.size))
        return error / float(nodes.weights @ self._densities(nodes, at))

    def distribution(self, low: float, high: float, words: str) -> Distribution:
        """Return the density between two values."""
        values = np.linspace(low, high, _SHOWN + 2)[1:-1]
        density = np.zeros(_SHOWN)
        for i, at in enumerate(values.tolist()):
            nodes = self.shown(at)
            density[i] = nodes.weights @ self._densities(nodes, at)
        return Distribution(
            values=values, weights=density, continuous=True, words=words
        )

    def _probabilities(self, nodes: Nodes, value: float) -> Floats:
        # (n,): P(coefficient <= value) at each node; from the nearer end of t, so that
        # a small parameter there keeps its digits
        up, up_rest, down, _ = _crossings(nodes, value)
        near = up < 0.5
        a = np.where(near, self.disagreeing, self.agreeing)
        b = np.where(near, self.agreeing, self.disagreeing)
        part = betainc(a, b, np.where(near, up, up_rest))
        out = np.where(near, 1.0 - part, part)
        ends = down < 1.0
        out[ends] -= betainc(self.agreeing, self.disagreeing, 1.0 - down[ends])
        return out

    def _densities(self, nodes: Nodes, value: float) -> Floats:
        # (n,): the density of t at each crossing, times how fast that moves in value,
        # D_e / slope, where (1 - value) D_e = t d
        up, up_rest, down, slope = _crossings(nodes, value)
        a, b = self.disagreeing, self.agreeing
        out = np.zeros(up.size)
        for t, rest in ((up, up_rest), (down, 1.0 - down)):
            inside = (t > 0.0) & (rest > 0.0) & (slope > 0.0)
            log = xlogy(a, t[inside]) + xlogy(b - 1.0, rest[inside])
            of_t = np.exp(log - betaln(a, b))  # density times t
            out[inside] += of_t * nodes.disagreement[inside] / slope[inside]
        return out / (1.0 - value)


def _crossings(nodes: Nodes, value: float) -> tuple[Floats, Floats, Floats, Floats]:
    # The coefficient is at most value where t d - (1 - value) D_e(t) >= 0: a quadratic
    # in t that is -`low` <= 0 at t = 0 and `high` at t = 1. It rises through 0 at t =
    # `up`; with `high` < 0 it falls again at `down`, or is nowhere 0. Its roots are
    # written so that nothing cancels at either end of t.
    # Returned, each (n,): up, 1 - up, down (1 if none), and the slope at either.
    rest = 1.0 - value
    low = rest * nodes.by_chance
    high = value * nodes.disagreement + rest * nodes.excess_disagreeing
    h = value * nodes.disagreement + rest * nodes.excess_mixed
    falls = high < 0.0
    cross = 2.0 * np.sqrt(low) * np.sqrt(np.abs(high))
    inside = np.where(falls, (h - cross) * (h + cross), 0.0)
    slope = np.where(falls, np.sqrt(np.maximum(inside, 0.0)), np.hypot(h, cross))
    near = slope + np.abs(h)
    with np.errstate(divide="ignore", invalid="ignore"):
        of_low, of_high = near / (near + 2.0 * low), near / (near + 2.0 * high)
        up = np.where(h >= 0.0, 2.0 * low / (near + 2.0 * low), of_high)
        up_rest = np.where(h >= 0.0, of_low, 2.0 * high / (near + 2.0 * high))
        down = near / (near - 2.0 * high)
    twice = falls & (inside > 0.0) & (h > 0.0)
    nowhere = falls & ~twice
    up[nowhere], up_rest[nowhere] = 1.0, 0.0
    lost = np.isnan(up)  # both ends are 0 in floating point
    up[lost], up_rest[lost] = 0.0, 1.0
    return up, up_rest, np.where(twice, down, 1.0), slope


def needs_draws(chance: ChanceAgreement, v: Floats) -> bool:
    """Return whether a coefficient's distribution is drawn, not integrated."""
    return len(v) > 2 and not _only_agreement_matters(chance, v)


def _only_agreement_matters(chance: ChanceAgreement, v: Floats) -> bool:
    away = v[~np.eye(len(v), dtype=bool)]
    return chance in ("none", "uniform") and float(np.ptp(away)) == 0.0


def table_quantiles(
    chance: ChanceAgreement,
    v: Floats,
    cells: Floats,
    shares: tuple[float, float],
    *,
    start: float,
    generator: np.random.Generator | None = None,
    n_draws: int = 0,
) -> tuple[TablePosterior, tuple[float, float]]:
    """Integrate, or draw, the posterior of a coefficient of two raters."""
    # v and the parameters of the Dirichlet, both (n_categories, n_categories)
    agreeing = float(cells.trace())
    of_nodes = partial(
        TablePosterior, disagreeing=float(cells.sum()) - agreeing, agreeing=agreeing
    )
    starts = (start, start)
    if _only_agreement_matters(chance, v):
        nodes = _always(_single_node(chance, v))
        result = of_nodes(nodes=nodes, shown=nodes)
        return result, result.quantiles(shares, starts)
    if generator is not None:
        drawn = _drawn_nodes(chance, v, cells, generator, n_draws)
        few, shown = (
            _always(drawn.first(min(n, n_draws))) for n in (_FIRST_DRAWS, _SHOWN_DRAWS)
        )
        starts = of_nodes(nodes=few, shown=few).quantiles(shares, starts)
        result = of_nodes(nodes=_always(drawn), shown=shown, n_draws=n_draws)
        return result, result.quantiles(shares, starts)
    coarse = _on_grid(chance, v, cells, _STEPS[0])
    ends = starts
    for step in _STEPS:
        result = of_nodes(nodes=_on_grid(chance, v, cells, step), shown=coarse)
        before, ends = ends, result.quantiles(shares, ends)
        moved = max(abs(ends[0] - before[0]), abs(ends[1] - before[1]))
        if moved < SETTLED:
            break
    if moved > _NEARLY:
        raise ConvergenceError("the quadrature of the posterior has not settled")
    return result, ends


def _always(nodes: Nodes) -> Callable[[float], Nodes]:
    return lambda _: nodes


def _on_grid(
    chance: ChanceAgreement, v: Floats, cells: Floats, step: float
) -> Callable[[float], Nodes]:
    # From 0 on all values have the same nodes.
    of_positive = grid_nodes(chance, v, cells, step, 0.0)
    if chance != "margins":
        return _always(of_positive)
    return lambda at: of_positive if at >= 0 else grid_nodes(chance, v, cells, step, at)
