"""The posterior of a coefficient of two raters, given a Dirichlet on their table.

With θ ~ Dirichlet the share t of pairs that disagree, the shares x of the categories
among pairs that agree, and the shares y of the cells among pairs that do not, are
independent: a Beta and two Dirichlets. Given x and y the disagreement is linear in t,
and that by chance quadratic: the coefficient is at most a value where a quadratic in t
is positive, which has a probability in closed form. That is summed over nodes of x and
y: one where they do not matter, a grid for two categories, else draws.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial

import numpy as np
from scipy.special import betainc

from masrel.agreement._codes import pair_table
from masrel.agreement._engine import Floats, recorded_generator
from masrel.agreement._weights import MANY
from masrel.errors import ConvergenceError
from masrel.estimates import Distribution, Interval
from masrel.intervals._quadrature import beta_nodes, solve_quantile
from masrel.intervals._question import WITHOUT_END, IntervalProblem
from masrel.intervals._rho import prior_note, where_the_prior_weighs

_NOTED_DRAWS = 2_000  # for the interval under another prior: a note has three digits
_ITEMS = 1.5  # that the default prior is worth, by the study of coverage
_NODES = (53, 97, 193)  # of the quadrature, until it settles
_SETTLED = 1e-6  # with three quarters of them a share is off less
_NEGLIGIBLE = 1e-16  # weight of a node
_SLOPE = 1e-6  # step of a slope
_SHOWN, _SHOWN_DRAWS = 101, 1_000  # of a density, looked at


@dataclass(frozen=True, slots=True, kw_only=True)
class Nodes:
    """Values of x and y with what the coefficient needs of them, all (n,)."""

    # The disagreement is t d, and by chance (1 - t)² e_0 + t (1 - t) e_1 + t² e_2.

    weights: Floats = field(compare=False, repr=False)  # probabilities of the values
    d: Floats = field(compare=False, repr=False)
    # e_0, e_1, e_2: as if all pairs agreed, as if half of them did, as if none did
    e_0: Floats = field(compare=False, repr=False)
    e_1: Floats = field(compare=False, repr=False)
    e_2: Floats = field(compare=False, repr=False)

    @classmethod
    def of(
        cls, problem: IntervalProblem, weights: Floats, x: Floats, y: Floats
    ) -> "Nodes":
        """Compute what the coefficient needs."""
        # x has a column for each category, y for each pair of unequal ones
        q = problem.coded.n_categories
        unequal = np.stack(np.nonzero(~np.eye(q, dtype=bool)), axis=1)
        equal = np.repeat(np.arange(q)[:, None], 2, axis=1)
        agreed = WITHOUT_END * (x @ problem.features(equal))
        differed = WITHOUT_END * (y @ problem.features(unequal))
        # D_e is quadratic in t: known at three of its values, it is known at all
        sums = np.stack([agreed, 0.5 * (agreed + differed), differed])
        observed, (e_0, half, e_2) = (of[..., 0] for of in problem.disagreements(sums))
        e_1 = 4.0 * half - e_0 - e_2
        return cls(weights=weights, d=observed[2], e_0=e_0, e_1=e_1, e_2=e_2)


@dataclass(frozen=True, slots=True, kw_only=True)
class TablePosterior:
    """The distribution of a coefficient."""

    # a value to nodes of x and y, for the coefficient to be at most that value
    nodes: Callable[[float], Nodes]
    # the share t of pairs that disagree is Beta(disagreeing, agreeing)
    disagreeing: float
    agreeing: float

    def conditional(self, nodes: Nodes, value: float) -> Floats:
        """Return the probability of at most a value at each node, (n,)."""
        # That is where t d - (1 - value) D_e(t) >= 0, or with s = t / (1 - t) where
        # `high` s² + `h` s - `low` >= 0. It rises through 0 at t = `up`; with `high` <
        # 0 it falls again at `down`, or is nowhere 0. Its roots are written so that
        # nothing cancels at either end of t.
        rest = 1.0 - value
        low = rest * nodes.e_0
        h, high = nodes.d - rest * nodes.e_1, nodes.d - rest * nodes.e_2
        inside = h * h + 4.0 * low * high
        near = np.sqrt(np.maximum(inside, 0.0)) + np.abs(h)
        twice = (high < 0.0) & (inside > 0.0) & (h > 0.0)
        never = (high < 0.0) & ~twice
        part = np.where(h >= 0.0, 2.0 * low, near)
        other = np.where(h >= 0.0, near, 2.0 * high)
        with np.errstate(divide="ignore", invalid="ignore"):
            up, up_rest = part / (part + other), other / (part + other)
            down_rest = 2.0 * high / (2.0 * high - near)
        lost = np.isnan(up)  # both ends are 0 in floating point
        up, up_rest = np.where(lost, 0.0, up), np.where(lost, 1.0, up_rest)
        # from the nearer end of t, so that a small parameter there keeps its digits
        from_0 = up < 0.5
        a = np.where(from_0, self.disagreeing, self.agreeing)
        b = np.where(from_0, self.agreeing, self.disagreeing)
        part = betainc(a, b, np.where(from_0, up, up_rest))
        beyond: Floats = np.where(from_0, 1.0 - part, part)
        beyond[never] = 0.0
        beyond[twice] -= betainc(self.agreeing, self.disagreeing, down_rest[twice])
        return beyond

    def probability(self, value: float) -> float:
        """Return the probability that the coefficient is at most a value."""
        nodes = self.nodes(value)
        return float(nodes.weights @ self.conditional(nodes, value))

    def quantile(self, share: float) -> float:
        """Return the value below which a share lies."""
        low = -1.0
        while self.probability(low) > share:
            low = 2.0 * low - 1.0  # with weights it can be below -1
        return solve_quantile(self.probability, share, low, 1.0)

    def quantile_error(self, at: float) -> float:
        """Return the Monte Carlo standard error of the quantile at a value."""
        probabilities = self.conditional(self.nodes(at), at)
        ends = at - _SLOPE, min(at + _SLOPE, 1.0)
        slope = np.diff([self.probability(end) for end in ends]) / np.diff(ends)
        return float(probabilities.std() / np.sqrt(probabilities.size) / slope[0])

    def distribution(self, low: float, high: float, words: str) -> Distribution:
        """Return the density between two values, the mean of each small part."""
        edges = np.linspace(low, high, _SHOWN + 1)
        below = [self.probability(edge) for edge in edges.tolist()]
        return Distribution(
            values=0.5 * (edges[1:] + edges[:-1]),
            weights=(np.diff(below) / np.diff(edges)).clip(0.0),
            continuous=True,
            words=words,
        )


def table_quantiles(
    problem: IntervalProblem,
    cells: Floats,
    shares: Sequence[float],
    *,
    generator: np.random.Generator | None = None,
    n_draws: int = 1,
) -> tuple[TablePosterior, list[float], TablePosterior]:
    """Integrate, or draw, the posterior of a coefficient of two raters."""
    # -> the posterior, its quantiles, and one of fewer nodes for its density;
    # cells, the parameters of the Dirichlet, (n_categories, n_categories)
    agreeing = np.eye(len(cells), dtype=bool)
    of_nodes = partial(
        TablePosterior,
        disagreeing=float(cells[~agreeing].sum()),
        agreeing=float(cells.trace()),
    )
    if len(cells) > 2:
        if generator is None:  # only how often they agree matters: any x and y
            n = len(cells)
            x, y = (np.full((1, of), 1.0 / of) for of in (n, n * n - n))
        else:
            x = generator.dirichlet(cells[agreeing], size=n_draws)
            y = generator.dirichlet(cells[~agreeing], size=n_draws)
        every, some = (
            Nodes.of(problem, np.full(n, 1.0 / n), x[:n], y[:n])
            for n in (len(x), min(len(x), _SHOWN_DRAWS))
        )
        posterior = of_nodes(nodes=lambda _: every)
        ends = [posterior.quantile(share) for share in shares]
        return posterior, ends, of_nodes(nodes=lambda _: some)
    for n in _NODES:
        posterior, fewer = (
            of_nodes(nodes=grid_nodes(problem, cells, m)) for m in (n, 3 * n // 4)
        )
        ends = [posterior.quantile(share) for share in shares]
        again = [fewer.probability(end) for end in ends]
        if np.allclose(again, shares, rtol=_SETTLED, atol=0.0):
            return posterior, ends, fewer
    raise ConvergenceError("the quadrature of the posterior did not converge")


def grid_nodes(
    problem: IntervalProblem, cells: Floats, n: int
) -> Callable[[float], Nodes]:
    """Return the nodes of two categories, for the coefficient at a value."""
    # of the Dirichlet of two by two cells
    x, of_x = beta_nodes(float(cells[0, 0]), float(cells[1, 1]), n)

    @lru_cache(maxsize=1)
    def nodes(least: float) -> Nodes:
        y, of_y = np.full((1, 2), 0.5), np.ones(1)
        if problem.entry.raters_matter:  # else y does not matter
            y, of_y = beta_nodes(float(cells[0, 1]), float(cells[1, 0]), n, least)
        weights = np.outer(of_x, of_y).ravel()
        large = weights > _NEGLIGIBLE
        x_each, y_each = np.repeat(x, len(y), axis=0), np.tile(y, (len(x), 1))
        return Nodes.of(problem, weights[large], x_each[large], y_each[large])

    def at(value: float) -> Nodes:
        if problem.entry.rho != "raters alike":
            return nodes(0.0)
        # With chance of margins and r = 1 - `value` the coefficient can be at most a
        # negative value only where r 2 y (1 - y) is at least -`value`; beyond that the
        # probability is 0, and a grid over all y would not see where it begins.
        below = max(-value, 0.0)
        product = below / (1.0 + below)  # least 2 y (1 - y)
        return nodes(product / (1.0 + math.sqrt(max(1.0 - 2.0 * product, 0.0))))

    return at


def table_prior(concentration: float | None, q: int) -> tuple[Floats, str]:
    """Return the parameters of a Dirichlet over pairs of categories, and its words."""
    # -> (q, q)
    if concentration is not None:
        words = f"Dirichlet({concentration:.3g}, ...) over the cells of the table"
        return np.full((q, q), concentration), words
    # Worth 1.5 items, half of it on pairs that agree: with the same parameter in every
    # cell agreement would be expected to be the rarer, the more categories there are.
    cells = np.full((q, q), 0.5 * _ITEMS / (q * (q - 1)))
    np.fill_diagonal(cells, 0.5 * _ITEMS / q)
    return cells, f"a Dirichlet worth {_ITEMS:g} items, half of it on pairs that agree"


def table_interval(
    problem: IntervalProblem,
    concentration: float | None,
    *,
    n_draws: int,
    rng: np.random.Generator | int | None,
    one_sided: bool = False,
) -> Interval:
    """Compute the credible interval of a coefficient of two raters."""
    q = problem.coded.n_categories
    table = pair_table(problem.codes, q, problem.freq)
    prior, description = table_prior(concentration, q)
    generator, seed, errors = None, None, None
    # x and y do not matter where all misses count alike, and chance is the same of one
    # category, of two, ... of all
    equal = np.repeat(np.arange(q)[:, None], 2, axis=1)
    _, chance = problem.disagreements(problem.features(equal).cumsum(axis=0))
    is_drawn = q > 2 and bool(np.ptp(chance) or not problem.unweighted)
    if is_drawn:
        generator, seed = recorded_generator(rng)
    tail = (1.0 - problem.level) * (1.0 if one_sided else 0.5)
    shares = (tail, 0.5) if one_sided else (tail, 0.5, 1.0 - tail)
    of_cells = partial(table_quantiles, problem, shares=shares)
    posterior, ends, fewer = of_cells(
        table + prior, generator=generator, n_draws=n_draws
    )
    low, median, high = [*ends, 1.0][:3]  # 1 is the upper end of a one-sided one
    if is_drawn:
        of_high = 0.0 if one_sided else posterior.quantile_error(high)
        errors = (posterior.quantile_error(low), of_high)
    n_single = problem.n_items - problem.n_paired_items
    notes = [f"items with a single rating, left out: {n_single}"] * bool(n_single)
    counts = problem.item_counts()
    if why := where_the_prior_weighs(counts[counts.sum(axis=1) > 1]):
        # another prior that is as reasonable
        is_even = concentration is not None and math.isclose(concentration, 1.0 / q)
        other, other_words = table_prior(None if is_even else 1.0 / q, q)
        _, there, _ = of_cells(table + other, generator=generator, n_draws=_NOTED_DRAWS)
        answers = ([low, high], description), ([*there, 1.0][:3:2], other_words)
        notes.append(prior_note(why, *answers))
    way = f"{n_draws} draws" if is_drawn else "exact"
    method = f"Dirichlet posterior of the table of two raters, {way}"
    width = high - low  # the density is shown as far beyond the ends
    return Interval(
        low=low,
        high=high,
        median=median,
        level=problem.level,
        kind="credible",
        method=f"{method}, one-sided" if one_sided else method,
        target=problem.target,
        n_resamples=n_draws if is_drawn else None,
        monte_carlo_error=errors,
        seed=seed,
        notes=tuple(notes),
        is_one_sided=one_sided,
        prior=description,
        distribution=fewer.distribution(
            max(low - width, min(problem.entry.lowest, low)),
            min(high + width, 1.0),
            f"posterior of {problem.entry.title}, prior {description}",
        ),
    )


def table_refusal(problem: IntervalProblem) -> str:
    """Return why there is no table of two raters to ask, or nothing."""
    if problem.n_raters != 2:
        return (
            'model: "table" applies to exactly two raters; got '
            f"{problem.entry.name} of {problem.n_raters}"
        )
    if problem.coded.n_categories > MANY:
        return (
            f"ratings: a posterior of their table needs at most {MANY} different "
            f"grades, got {problem.coded.n_categories}; use the jackknife"
        )
    if problem.entry.metric == "ordinal":
        return (
            "metric: there is no posterior for ordinal, which depends on the ratings; "
            "use the jackknife or the bootstrap"
        )
    return ""
