"""Bootstraps of Krippendorff's alpha as other programs have them, by name.

"krippendorff" resamples items and holds the disagreement by chance, as the R package
krippendorffsalpha does by its method "customary"; "hayes" draws pairs of values, as
Hayes' macro KALPHA does.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from masrel.agreement import CodedRatings
from masrel.agreement._counts import item_counts
from masrel.agreement._kernel import Floats, Kernel, divide, weighted_disagreement
from masrel.agreement._weights import MANY
from masrel.errors import ParameterError
from masrel.estimates import Interval
from masrel.intervals._endpoints import DrawnResamples, distribution_of
from masrel.intervals._problem import HELD, IntervalProblem, recorded_generator

_CELLS = 25  # times the cells in use: the most pairs that KALPHA draws
_CHUNK = 1 << 17  # numbers held at once while drawing
_INDEPENDENT = (
    "pairs of values are drawn as if no two were of one item, {n_pairs} a resample and "
    "never more than 25 for each kind of pair: with more items than that the interval "
    "does not narrow"
)


def check_alpha(problem: IntervalProblem, kind: str) -> None:
    """Refuse a bootstrap of alpha for anything else."""
    if problem.entry.name != "krippendorff_alpha":
        raise ParameterError(
            f'kind: "{kind}" is a bootstrap of krippendorff_alpha, got '
            f"{problem.entry.name}"
        )
    if problem.coded.n_categories > MANY:
        raise ParameterError(
            f'kind: "{kind}" needs at most {MANY} different grades, got '
            f"{problem.coded.n_categories}"
        )
    if problem.target != "items":
        raise ParameterError(
            f'target: the bootstrap "{kind}" generalises to other items, so "items"; '
            f'got "{problem.target}"'
        )


def hold_expected(problem: IntervalProblem) -> IntervalProblem:
    """Return alpha with the disagreement by chance, and the metric, held."""
    expected = _Coincidences.of(problem).expected

    def features(coded: CodedRatings, v: Floats) -> Floats:
        # (n_items, 2): V_i / (n_i - 1), and n_i where that is two or more
        counts = item_counts(coded).astype(np.float64)
        size = counts.sum(axis=1)
        counts[size < 2], size[size < 2] = 0.0, 0.0
        disagreement = weighted_disagreement(counts, v)
        return np.column_stack([disagreement / np.maximum(size - 1.0, 1.0), size])

    def value(sums: Floats, _v: Floats) -> Floats:
        return 1.0 - divide(sums[..., 0], sums[..., 1]) / expected

    kernel = Kernel(features=features, value=value)
    rows = kernel.features(problem.patterns, problem.v)
    held = (HELD,) if problem.entry.metric == "ordinal" else ()
    return replace(
        problem, kernel=kernel, rows=rows, sums=problem.freq @ rows, notes=held
    )


def hayes_interval(
    problem: IntervalProblem,
    n_resamples: int,
    rng: np.random.Generator | int | None,
) -> Interval:
    """Compute the interval of the macro KALPHA."""
    method = "KALPHA bootstrap of pairs"
    if math.isnan(problem.value):
        reason = "the estimate itself is undefined"
        return problem.undefined(reason, method=method, unit="items")
    pairs = _Pairs.of(problem)
    generator, seed = recorded_generator(rng)
    drawn = pairs.draw(n_resamples, generator)
    resamples = DrawnResamples(drawn=drawn, values=np.sort(drawn))
    tail = 0.5 * (1.0 - problem.level)
    # order statistics, counted from 1: [tail B] and [(1 - tail) B] + 1
    first = max(int(tail * n_resamples + 1e-9), 1) - 1
    last = min(int((1.0 - tail) * n_resamples + 1e-9), n_resamples - 1)
    low, high = float(resamples.values[first]), float(resamples.values[last])
    if not low < high:
        reason = "every resample gives the same value, so there is no spread"
        return problem.undefined(reason, method=method, unit="items")
    errors = (
        resamples.error(tail, 0.0, problem.value),
        resamples.error(1.0 - tail, 0.0, problem.value),
    )
    notes = (_INDEPENDENT.format(n_pairs=pairs.n),)
    return replace(
        problem.confidence(low, high, method=method, unit="items", notes=notes),
        n_resamples=n_resamples,
        n_undefined=0,
        monte_carlo_error=errors,
        seed=seed,
        distribution=distribution_of(resamples),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Coincidences:
    """Coincidences of values in items with a pair."""

    table: Floats  # (n_categories, n_categories): Σ_i n_ik (n_il - [k = l]) / (n_i - 1)
    n: float  # ratings
    n_pairs: float  # pairs of ratings of one item
    expected: float  # D_e

    @classmethod
    def of(cls, problem: IntervalProblem) -> "_Coincidences":
        counts = item_counts(problem.patterns).astype(np.float64)
        size, freq = counts.sum(axis=1), problem.freq
        paired = size > 1
        counts, size, freq = counts[paired], size[paired], freq[paired]
        over = freq / (size - 1.0)
        totals = freq @ counts
        n = float(totals.sum())
        between = float(totals @ problem.v @ totals)
        return cls(
            table=(counts * over[:, None]).T @ counts - np.diag(over @ counts),
            n=n,
            n_pairs=float(freq @ (size * (size - 1.0))) / 2.0,
            expected=between / (n * (n - 1.0)) if n > 1 else math.nan,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Pairs:
    """Kinds of pairs of values, and how many are drawn."""

    n: int  # drawn for a resample
    shares: Floats  # (n_kinds,): how probable each kind is
    disagreement: Floats  # (n_kinds,): δ² of each, over the disagreement by chance
    all_alike: float  # how probable it is that all draws are of one value

    @classmethod
    def of(cls, problem: IntervalProblem) -> "_Pairs":
        of_values = _Coincidences.of(problem)
        table, n = of_values.table, of_values.n
        both = np.triu(table) + np.triu(table, 1)  # each pair of values once
        kinds = np.nonzero(both)
        others = problem.n_raters - 1
        most = _CELLS * int(np.count_nonzero(table))
        alike = (np.diagonal(table) / n) ** of_values.n_pairs
        return cls(
            n=math.ceil(min(most, others * n / 2.0)),
            shares=both[kinds] / both.sum(),
            disagreement=problem.v[kinds] / of_values.expected,
            all_alike=float(alike.sum()),
        )

    def draw(self, n_resamples: int, generator: np.random.Generator) -> Floats:
        """Return alphas of resamples, as KALPHA corrects them."""
        size = max(1, _CHUNK // len(self.shares))
        parts = [
            generator.multinomial(self.n, self.shares, min(size, n_resamples - start))
            @ self.disagreement
            for start in range(0, n_resamples, size)
        ]
        values = np.maximum(1.0 - np.concatenate(parts) / self.n, -1.0)
        # Draws of one value alone have no alpha: as many as there should be count as 0.
        (perfect,) = np.nonzero(values == 1.0)
        values[perfect[: round(n_resamples * self.all_alike)]] = 0.0
        return np.asarray(values)
