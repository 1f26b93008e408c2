"""The interval of a coefficient of two raters from a Dirichlet on their table."""

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._kernel import Floats
from masrel.errors import ParameterError
from masrel.estimates import Interval
from masrel.intervals._problem import IntervalProblem
from masrel.intervals._seeds import recorded_generator
from masrel.intervals.table.chances import CHANCE
from masrel.intervals.table.posterior import TablePosterior
from masrel.intervals.table.prior import TablePrior
from masrel.intervals.table.quantiles import table_quantiles

__all__ = ["speaks_of", "table_interval"]

_FEW_ITEMS = 10
_LEAST_DRAWS = 100
_NOTED_DRAWS = 2_000  # for the interval under another prior: a note has three digits


def speaks_of(problem: IntervalProblem) -> bool:
    """Return whether a table of two raters has something to say."""
    if problem.entry.name not in CHANCE or problem.coded.codes.shape[1] != 2:
        return False
    table, _ = _table(problem.coded.codes, problem.coded.n_categories)
    return _nothing_to_learn(problem, table) is None


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
    table, n_single = _table(problem.coded.codes, problem.coded.n_categories)
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
    asked = _Asked(problem, rng, one_sided)
    found, ends = asked.posterior(table + prior.cells, n_draws)
    said = (f"left out, items of a single rating: {n_single}",) if n_single else ()
    notes = (*said, *_prior_notes(asked, table, prior, ends))
    return _interval(asked, found, ends, prior, notes)


def _interval(
    asked: "_Asked",
    found: TablePosterior,
    ends: tuple[float, float],
    prior: TablePrior,
    notes: tuple[str, ...],
) -> Interval:
    problem, (low, high) = asked.problem, ends
    method = "Dirichlet posterior of the table of two raters, exact"
    errors = None
    if found.n_draws is not None:
        method = method.replace("exact", f"{found.n_draws} draws")
        above = 0.0 if asked.one_sided else found.quantile_error(high)
        errors = (found.quantile_error(low), above)
    return Interval(
        low=low,
        high=high,
        level=problem.level,
        kind="credible",
        method=f"{method}, one-sided" if asked.one_sided else method,
        target=problem.target,
        n_resamples=found.n_draws,
        monte_carlo_error=errors,
        seed=asked.seed,
        notes=notes,
        distribution=found.distribution(
            *_reach(problem, low, high),
            f"posterior of {problem.entry.title}, prior {prior.words}",
        ),
    )


def _check(problem: IntervalProblem, n_draws: int) -> None:
    if problem.entry.name not in CHANCE or problem.coded.codes.shape[1] != 2:
        raise ParameterError(
            f'model: "table" speaks of {", ".join(CHANCE)} of exactly two raters; got '
            f"{problem.entry.name} of {problem.coded.codes.shape[1]}"
        )
    if n_draws < _LEAST_DRAWS:
        raise ParameterError(f"n_draws: needs at least {_LEAST_DRAWS}, got {n_draws}")


class _Asked:
    """One question for several priors; a generator is made when first needed."""

    def __init__(
        self,
        problem: IntervalProblem,
        rng: np.random.Generator | int | None,
        one_sided: bool,
    ) -> None:
        self.problem = problem
        self.one_sided = one_sided
        self.seed: int | None = None
        self._rng = rng
        self._generator: np.random.Generator | None = None

    def posterior(
        self, prior: Floats, n_draws: int
    ) -> tuple[TablePosterior, tuple[float, float]]:
        """Return the posterior of one Dirichlet and its ends."""
        tail = 1.0 - self.problem.level
        tail = tail if self.one_sided else 0.5 * tail
        found, (low, high) = table_quantiles(
            CHANCE[self.problem.entry.name],
            self.problem.v,
            prior,
            (tail, 1.0 - tail),
            start=0.5 if math.isnan(self.problem.value) else self.problem.value,
            generator=self._made,
            n_draws=n_draws,
        )
        return found, (low, 1.0 if self.one_sided else high)

    def _made(self) -> np.random.Generator:
        if self._generator is None:
            self._generator, self.seed = recorded_generator(self._rng)
        return self._generator


def _table(codes: NDArray[np.signedinteger], n_categories: int) -> tuple[Floats, int]:
    # (n_items, 2) -> items per pair of categories, and items of one rating
    given = (codes >= 0).sum(axis=1)
    both = codes[given == 2].astype(np.int64)
    cells = np.bincount(both @ (n_categories, 1), minlength=n_categories**2)
    shape = (n_categories, n_categories)
    return cells.reshape(shape).astype(np.float64), int((given == 1).sum())


def _nothing_to_learn(problem: IntervalProblem, table: Floats) -> str | None:
    if not table.any():
        return "no item has ratings of two raters"
    if len(table) < 2:
        return "one category is declared"
    if np.isnan(problem.v).any():
        return "the scale has no such weights"
    if not problem.v.any():
        return "the weights know no disagreement"
    return None


def _reach(problem: IntervalProblem, low: float, high: float) -> tuple[float, float]:
    # beyond the ends as far as the interval is wide
    wide = high - low
    return max(low - wide, min(problem.entry.lowest, low)), min(high + wide, 1.0)


def _prior_notes(
    asked: _Asked, table: Floats, prior: TablePrior, ends: tuple[float, float]
) -> tuple[str, ...]:
    # the interval under another prior, where that matters
    if (table > 0.0).sum() == 1 and table.trace():
        what = "all ratings are in one category"
    elif table.trace() == table.sum():
        what = "agreement is perfect in these data"
    elif table.sum() < _FEW_ITEMS:
        what = f"{table.sum():.0f} items are few"
    else:
        return ()
    other = prior.other()
    _, there = asked.posterior(table + other.cells, _NOTED_DRAWS)
    return (
        f"{what}, so the prior weighs: {ends[0]:.3f} to {ends[1]:.3f} with "
        f"{prior.words}, but {there[0]:.3f} to {there[1]:.3f} with {other.words}",
    )
