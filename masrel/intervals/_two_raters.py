"""The interval of a coefficient of two raters from a Dirichlet on their table."""

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from masrel.agreement._engine import Floats
from masrel.agreement._weights import MANY
from masrel.errors import ParameterError
from masrel.estimates import Interval
from masrel.intervals._question import IntervalProblem, recorded_generator
from masrel.intervals._rho import FEW_ITEMS, extended, prior_note
from masrel.intervals._table_quadrature import (
    CHANCE_AGREEMENT,
    TablePosterior,
    needs_draws,
    table_quantiles,
)

_MIN_DRAWS = 100
_DEFAULT_DRAWS, _SEED = 4_000, 1  # always the same ones, so that they repeat
_NOTED_DRAWS = 2_000  # for the interval under another prior: a note has three digits

_ITEMS = 1.5  # that the default prior is worth, by the study of coverage


@dataclass(frozen=True, slots=True, kw_only=True)
class TablePrior:
    """A Dirichlet over the pairs of categories."""

    cells: Floats = field(repr=False)  # (n_categories, n_categories): its parameters
    description: str  # the prior in words
    # the one parameter of all cells; None where pairs that agree have others
    concentration: float | None

    @classmethod
    def by_default(cls, n_categories: int) -> Self:
        """Return a prior worth 1.5 items, half of it on pairs that agree."""
        # With the same parameter in every cell agreement would be expected to be the
        # rarer, the more categories are declared.
        q = n_categories
        cells = np.full((q, q), 0.5 * _ITEMS / (q * (q - 1)))
        np.fill_diagonal(cells, 0.5 * _ITEMS / q)
        description = (
            f"a Dirichlet worth {_ITEMS:g} items, half of it on pairs that agree"
        )
        return cls(cells=cells, description=description, concentration=None)

    @classmethod
    def of(cls, concentration: float, n_categories: int) -> Self:
        """Return a prior with one parameter for all cells."""
        cells = np.full((n_categories, n_categories), concentration)
        description = f"Dirichlet({concentration:.3g}, ...) over the cells of the table"
        return cls(cells=cells, description=description, concentration=concentration)

    def other(self) -> Self:
        """Return another that is as reasonable."""
        q = len(self.cells)
        if self.concentration is not None and math.isclose(self.concentration, 1.0 / q):
            return self.by_default(q)
        return self.of(1.0 / q, q)


def applies_to(problem: IntervalProblem) -> bool:
    """Return whether a table of two raters can answer a question."""
    if problem.entry.name not in CHANCE_AGREEMENT or problem.n_raters != 2:
        return False
    if problem.coded.n_categories > MANY:
        return False
    if problem.entry.metric == "ordinal":  # not one of a table, but of its ratings
        return False
    table, _ = _table(problem)
    return _nothing_to_learn(problem, table) is None


def default_table_interval(problem: IntervalProblem) -> Interval:
    """Compute an interval that holds the estimate, one-sided where that is perfect."""
    perfect = not problem.value < 1.0
    interval = table_interval(
        problem, None, n_draws=_DEFAULT_DRAWS, rng=_SEED, one_sided=perfect
    )
    return interval if perfect else extended(problem, interval)


def table_interval(
    problem: IntervalProblem,
    concentration: float | None,
    *,
    n_draws: int,
    rng: np.random.Generator | int | None,
    one_sided: bool = False,
) -> Interval:
    """Compute the credible interval of a coefficient of two raters."""
    _check(problem, n_draws)
    table, n_single = _table(problem)
    reason = _nothing_to_learn(problem, table)
    if reason is not None:
        undefined = problem.undefined(reason, method="table posterior", unit=None)
        return dataclasses.replace(undefined, kind="credible")
    q = len(table)
    prior = (
        TablePrior.by_default(q)
        if concentration is None
        else TablePrior.of(concentration, q)
    )
    generator, seed = None, None
    if needs_draws(CHANCE_AGREEMENT[problem.entry.name], problem.v):
        generator, seed = recorded_generator(rng)
    posterior, ends = _posterior(
        problem, table + prior.cells, generator, n_draws, one_sided
    )
    what = _where_the_prior_weighs(table)
    notes: tuple[str, ...] = ()
    if n_single:
        notes = (f"left out, items of a single rating: {n_single}",)
    if what:
        other = prior.other()
        _, there = _posterior(
            problem, table + other.cells, generator, _NOTED_DRAWS, one_sided
        )
        text = (
            f"{ends[0]:.3f} to {ends[1]:.3f} with {prior.description}, but "
            f"{there[0]:.3f} to {there[1]:.3f} with {other.description}"
        )
        notes += (prior_note(f"{what}, so the prior weighs", text),)
    interval = _interval(problem, posterior, ends, prior, one_sided)
    return dataclasses.replace(interval, seed=seed, notes=notes)


def _posterior(
    problem: IntervalProblem,
    cells: Floats,
    generator: np.random.Generator | None,
    n_draws: int,
    one_sided: bool,
) -> tuple[TablePosterior, tuple[float, float]]:
    # of a Dirichlet with these parameters, and the ends of its interval
    tail = 1.0 - problem.level
    tail = tail if one_sided else 0.5 * tail
    posterior, (low, high) = table_quantiles(
        CHANCE_AGREEMENT[problem.entry.name],
        problem.v,
        cells,
        (tail, 1.0 - tail),
        start=0.5 if math.isnan(problem.value) else problem.value,
        generator=generator,
        n_draws=n_draws,
    )
    return posterior, (low, 1.0 if one_sided else high)


def _interval(
    problem: IntervalProblem,
    posterior: TablePosterior,
    ends: tuple[float, float],
    prior: TablePrior,
    one_sided: bool,
) -> Interval:
    low, high = ends
    method = "Dirichlet posterior of the table of two raters, exact"
    errors = None
    if posterior.n_draws is not None:
        method = method.replace("exact", f"{posterior.n_draws} draws")
        of_high = 0.0 if one_sided else posterior.quantile_error(high)
        errors = (posterior.quantile_error(low), of_high)
    width = high - low  # the density is shown as far beyond the ends
    lowest = min(problem.entry.lowest, low)
    return Interval(
        low=low,
        high=high,
        median=posterior.quantile(0.5, 0.5 * (low + high)),
        level=problem.level,
        kind="credible",
        method=f"{method}, one-sided" if one_sided else method,
        target=problem.target,
        n_resamples=posterior.n_draws,
        monte_carlo_error=errors,
        distribution=posterior.distribution(
            max(low - width, lowest),
            min(high + width, 1.0),
            f"posterior of {problem.entry.title}, prior {prior.description}",
        ),
    )


def _check(problem: IntervalProblem, n_draws: int) -> None:
    name, n_raters = problem.entry.name, problem.n_raters
    if name not in CHANCE_AGREEMENT or n_raters != 2:
        raise ParameterError(
            f'model: "table" applies to {", ".join(CHANCE_AGREEMENT)} of exactly two '
            f"raters; got {name} of {n_raters}"
        )
    if problem.coded.n_categories > MANY:
        raise ParameterError(
            f"ratings: a posterior of their table needs at most {MANY} different "
            f"grades, got {problem.coded.n_categories}; use the jackknife"
        )
    if problem.entry.metric == "ordinal":
        raise ParameterError(
            "metric: ordinal depends on the ratings, and so has no posterior; use the "
            "jackknife or the bootstrap"
        )
    if n_draws < _MIN_DRAWS:
        raise ParameterError(f"n_draws: needs at least {_MIN_DRAWS}, got {n_draws}")


def _table(problem: IntervalProblem) -> tuple[Floats, int]:
    # -> items per pair of categories, (n_categories, n_categories), and those of one
    # rating that matter otherwise
    codes, freq = problem.codes, problem.freq
    paired = (codes >= 0).all(axis=1)
    cells = np.zeros((problem.coded.n_categories,) * 2)
    cells[tuple(codes[paired].T)] = freq[paired]  # distinct rows: one a cell
    return cells, int(freq[~paired].sum())


def _nothing_to_learn(problem: IntervalProblem, table: Floats) -> str | None:
    if not table.any():
        return "no item has ratings of two raters"
    if len(table) < 2:
        return "one category is declared"
    if np.isnan(problem.v).any():
        return "the scale has no such weights"
    if not problem.v.any():
        return "the weights count nothing as disagreement"
    return None


def _where_the_prior_weighs(table: Floats) -> str:
    if (table > 0.0).sum() == 1 and table.trace():
        return "all ratings are in one category"
    if table.trace() == table.sum():
        return "agreement is perfect in these data"
    if table.sum() < FEW_ITEMS:
        return f"{table.sum():.0f} items are few"
    return ""
