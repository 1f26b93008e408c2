"""What studies of one design show, exactly or by whole studies drawn in arrays.

In: a `StudyDesign`. Out: `StudySums`, sums over studies that can be added up, so that
tasks on any number of processes give the same numbers.
"""

import math
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from masrel.agreement import CodedRatings, Coefficient, coefficient
from masrel.agreement._rows import distinct_rows
from masrel.agreement._weights import WeightsLike
from masrel.errors import ParameterError, SmallSampleWarning, UndefinedStatisticWarning
from masrel.estimates import Interval, Target
from masrel.intervals._choice import choose_interval
from masrel.intervals._problem import IntervalProblem, pose_problem, rows_problem
from masrel.intervals.bootstrap import bootstrap
from masrel.intervals.jackknife import (
    _interval_around_estimate,
    _jackknife_variance,
)
from masrel.intervals.posterior import posterior
from masrel.planning._item_models import (
    MAX_ROWS,
    Floats,
    Integers,
    ItemModel,
    draw_ratings,
    n_rows,
    probabilities,
    rows_of,
)

NDArrayBool = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

_PLACES = 1 << 20  # numbers held at once
_LARGE = 1e12  # items of a population
_LEAST = 1e-13  # of a half-width: what rounding may leave above the aim
_WALD = ("t", "normal", "analytic")  # computed for all studies at once


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyDesign:
    """A study to be planned: all that its simulation depends on."""

    coefficient: str
    weights: WeightsLike
    model: ItemModel
    n_items: int
    n_raters: int
    target: Target
    level: float  # of the two-sided interval that is computed
    interval: str  # "t", "normal", or a method of `masrel.intervals`
    value: float  # the true coefficient
    half_width: float | None = None
    lower: float | None = None
    upper: float | None = None
    null: float | None = None

    @property
    def entry(self) -> Coefficient:
        """The coefficient's entry in the register."""
        return coefficient(self.coefficient)

    @property
    def ordered(self) -> bool:
        """Whether it matters which rater gave which rating."""
        alike = not self.entry.tells_raters_apart or self.entry.name == "scott_pi"
        return self.model.name == "table" or not alike

    @property
    def has_rows(self) -> bool:
        """Whether a study is how often each distinct row of ratings occurs."""
        return (
            self.target == "items"
            and self.model.has_rows
            and self.entry.shape == "ratings"
            and n_rows(self.model, self.n_raters, ordered=self.ordered) <= MAX_ROWS
        )

    @property
    def is_jackknife(self) -> bool:
        """Whether raters are left out, one at a time, of all studies at once."""
        of_raters = self.target == "raters" and self.entry.shape == "ratings"
        return of_raters and self.interval in ("auto", "t", "jackknife")

    @property
    def is_chosen(self) -> bool:
        """Whether an interval is computed study by study."""
        return self.interval not in _WALD and not self.is_jackknife

    @property
    def n_tables(self) -> float:
        """How many studies there are that differ; infinite where none are listed."""
        if not (self.has_rows and self.model.n_categories == 2):
            return math.inf
        cells = n_rows(self.model, self.n_raters, ordered=self.ordered)
        return math.comb(self.n_items + cells - 1, cells - 1)


@dataclass(frozen=True, slots=True)
class StudySums:
    """Sums over studies, by weight: counts of studies, or probabilities."""

    # weight; weight of defined; then of defined studies the half-width, the ends and
    # the estimate, each with its square; then weights of: narrow enough, rejecting,
    # inside the limits, holding the truth
    sums: Floats = field(compare=False, repr=False)  # (14,)

    def __add__(self, other: "StudySums") -> "StudySums":
        return StudySums(self.sums + other.sums)

    @classmethod
    def of(cls, design: StudyDesign, outcomes: Floats, weight: Floats) -> "StudySums":
        """Sum up outcomes (n_studies, 4): estimate, half-width, low and high."""
        value, half, low, high = outcomes.T
        is_defined = ~np.isnan(half)
        w = np.where(is_defined, weight, 0.0)
        parts = [float(weight.sum()), float(w.sum())]
        for number in (half, low, high, value):
            plain = np.where(is_defined, number, 0.0)
            parts += [float(w @ plain), float(w @ plain**2)]
        narrow = half <= (design.half_width or math.inf) * (1.0 + _LEAST)
        inside = (low >= _or(design.lower, -math.inf)) & (
            high <= _or(design.upper, math.inf)
        )
        holds = (low <= design.value + 1e-12) & (design.value - 1e-12 <= high)
        for event in (narrow, _rejects(design, low, high), inside, holds):
            parts.append(float(w @ event))
        return cls(np.array(parts))

    @property
    def weight(self) -> float:
        """Studies, or 1 where they are probabilities."""
        return float(self.sums[0])

    @property
    def p_undefined(self) -> float:
        """Share of studies without a coefficient or an interval."""
        return max(0.0, 1.0 - float(self.sums[1] / self.sums[0]))

    def mean(self, place: int) -> tuple[float, float]:
        """Return mean and Monte Carlo error of half-width, low, high or estimate."""
        n = float(self.sums[1])
        if n == 0.0:
            return math.nan, math.nan
        first, second = self.sums[2 + 2 * place : 4 + 2 * place] / n
        return float(first), math.sqrt(max(second - first**2, 0.0) / n)

    def share(self, place: int) -> float:
        """Return how often: narrow, rejecting, inside, or holding where defined."""
        over = self.sums[1] if place == 3 else self.sums[0]
        return float(self.sums[10 + place] / over) if over else math.nan


def _or(value: float | None, otherwise: float) -> float:
    return otherwise if value is None else value


def _rejects(design: StudyDesign, low: Floats, high: Floats) -> NDArrayBool:
    # the end of the interval on the side of the null value lies beyond it
    if design.null is None:
        return np.zeros(len(low), dtype=bool)
    if design.value >= design.null:
        return np.asarray(low > design.null)
    return np.asarray(high < design.null)


class StudyMaker:
    """The studies of a design: what is the same in all of them, made once."""

    def __init__(self, design: StudyDesign) -> None:
        self.design = design
        self._intervals: dict[bytes, tuple[float, float, float]] = {}

    @cached_property
    def rows(self) -> Integers:
        """Distinct rows of the ratings of an item."""
        design = self.design
        return rows_of(design.model, design.n_raters, ordered=design.ordered)

    @cached_property
    def p(self) -> Floats:
        """How probable each is, (n_rows,)."""
        p = probabilities(self.design.model, self.rows, ordered=self.design.ordered)
        p = np.maximum(p, 0.0)
        return np.asarray(p / p.sum())

    @cached_property
    def problem(self) -> IntervalProblem:
        """The question about the ratings, of which each study has others."""
        design = self.design
        per_rater = 2 if design.entry.shape == "pairs" else 1
        q, r = design.model.n_categories, design.n_raters * per_rater
        codes = np.arange(q)[:, None] * np.ones((1, r), dtype=np.int64)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return pose_problem(
                replace(design.entry, code=lambda ratings, _categories: ratings),
                CodedRatings(
                    codes=codes, categories=design.model.scale or tuple(range(q))
                ),
                target=design.target,
                categories=None,
                weights=design.weights,
                level=design.level,
            )

    @cached_property
    def features(self) -> Floats:
        """Features of each distinct row, (n_rows, n_features)."""
        return self.features_of(self.rows)

    def features_of(self, codes: Integers) -> Floats:
        """Return the features of items, (n_items, n_features)."""
        return self.problem.features(replace(self.problem.coded, codes=codes))

    # -- the truth ----------------------------------------------------------------

    def true_value(self) -> float:
        """Return the coefficient of a population of items and of raters."""
        value, _ = self._population(2)
        return value

    def item_sd(self) -> float:
        """Return the standard deviation of what one item moves the coefficient by."""
        return self._population(self.design.n_raters)[1]

    def _population(self, n_raters: int) -> tuple[float, float]:
        model = self.design.model
        whole = replace(model, p_missing=0.0) if n_raters == 2 else model
        ordered = self.design.ordered
        rows = rows_of(whole, n_raters, ordered=ordered)
        p = probabilities(whole, rows, ordered=ordered)
        features = self.features_of(rows)
        sums = _LARGE * (p @ features)
        u = _LARGE * (features @ self._slopes(sums[None])[0])
        matters = p * features.any(axis=1)
        u -= matters @ u / matters.sum()
        return float(self.problem.values(sums)), math.sqrt(float(matters @ u**2))

    def _values(self, sums: Floats) -> Floats:
        # 0/0 where a study has no coefficient
        with np.errstate(invalid="ignore"):
            return self.problem.values(sums)

    def _slopes(self, sums: Floats) -> Floats:
        # of the coefficient in each sum, (..., n_features)
        with np.errstate(invalid="ignore", divide="ignore"):
            return self.problem.slopes(sums)

    # -- what studies show --------------------------------------------------------

    def exact(self) -> StudySums:
        """Sum over every study that there can be, by its probability."""
        from scipy.special import gammaln

        total = StudySums(np.zeros(14))
        log_p = np.log(np.maximum(self.p, 1e-300))
        n = self.design.n_items
        for freq in _tables(n, len(self.rows)):
            logs = gammaln(n + 1) - gammaln(freq + 1.0).sum(axis=1) + freq @ log_p
            weight = np.exp(logs)
            total += StudySums.of(self.design, self._of_freq(freq), weight)
        return total

    def simulate(self, rng: np.random.Generator, n_studies: int) -> StudySums:
        """Sum over studies that are drawn, in blocks so that memory stays flat."""
        design, total = self.design, StudySums(np.zeros(14))
        size = len(self.rows) if design.has_rows else design.n_items * design.n_raters
        block = max(1, min(n_studies, 2 * _PLACES // size))
        for start in range(0, n_studies, block):
            n = min(block, n_studies - start)
            if design.has_rows:
                freq = rng.multinomial(design.n_items, self.p, size=n)
                outcomes = self._of_freq(freq)
            else:
                outcomes = self._of_codes(self._draw(rng, n))
            total += StudySums.of(design, outcomes, np.ones(n))
        return total

    def _draw(self, rng: np.random.Generator, n: int) -> Integers:
        design = self.design
        if design.entry.shape == "ratings":
            return draw_ratings(
                design.model,
                rng,
                n_studies=n,
                n_items=design.n_items,
                n_raters=design.n_raters,
            )
        # a rater's two gradings are those of two raters who never differ in bias
        n_pairs = design.n_items * design.n_raters
        codes = draw_ratings(
            design.model, rng, n_studies=n, n_items=n_pairs, n_raters=2
        )
        return codes.reshape(n, design.n_items, 2 * design.n_raters)

    def _of_freq(self, freq: Integers) -> Floats:
        # how often each distinct row occurs (n_studies, n_rows) -> (n_studies, 4)
        if self.design.is_chosen:
            distinct, place = np.unique(freq, axis=0, return_inverse=True)
            results = [self._chosen(self.rows, row) for row in distinct]
            return np.array(results).reshape(-1, 4)[place.ravel()]
        weight = freq.astype(np.float64)
        sums = weight @ self.features
        slopes = self._slopes(sums)
        u = slopes @ self.features.T
        n_rated = weight @ self.features.any(axis=1)
        mean = (weight * u).sum(axis=1) / np.maximum(n_rated, 1.0)
        squares = (weight * u**2).sum(axis=1) - n_rated * mean**2
        n_paired = weight @ ((self.rows >= 0).sum(axis=1) >= 2)
        return self._wald(self._values(sums), squares, n_rated, n_paired)

    def _wald(
        self, value: Floats, squares: Floats, n_rated: Floats, n_paired: Floats
    ) -> Floats:
        from scipy.special import ndtri, stdtrit

        n: Floats = np.where(n_rated > 1, n_rated, np.nan)
        # √[Σ (n u_i)² / (n (n - 1))] about the mean, as of every estimate
        error = np.sqrt(np.maximum(squares, 0.0) * n / (n - 1.0))
        upper = 0.5 + 0.5 * self.design.level
        df = np.maximum(n_paired - 1.0, 1.0)
        is_normal = self.design.interval == "normal"
        half = error * (ndtri(upper) if is_normal else stdtrit(df, upper))
        if self.design.interval != "analytic":
            return np.column_stack([value, half, value - half, value + half])
        # as `analytic` gives it: cut at the ends of the scale, none without spread
        has_spread = (error > 0.0) & (n_paired > 1)
        return self._cut(value, np.asarray(np.where(has_spread, half, np.nan)))

    def _cut(self, value: Floats, half: Floats) -> Floats:
        lowest = np.minimum(self.design.entry.lowest, value)
        low, high = np.maximum(value - half, lowest), np.minimum(value + half, 1.0)
        return np.column_stack([value, 0.5 * (high - low), low, high])

    def _of_codes(self, codes: Integers) -> Floats:
        # codes (n_studies, n_items, n_raters) -> (n_studies, 4)
        if self.design.is_jackknife:
            return self._raters_left_out(codes)
        if not self.design.is_chosen:
            return self._wald_of_codes(codes)
        return np.array([self._chosen_of_codes(of) for of in codes]).reshape(-1, 4)

    def _chosen_of_codes(self, codes: Integers) -> tuple[float, ...]:
        rows, freq = distinct_rows(codes, self.design.model.n_categories)
        return self._chosen(rows, freq)

    def _features_of_studies(self, codes: Integers) -> Floats:
        n, n_items, n_raters = codes.shape
        features = self.features_of(codes.reshape(-1, n_raters))
        return features.reshape(n, n_items, -1)

    def _wald_of_codes(self, codes: Integers) -> Floats:
        features = self._features_of_studies(codes)
        sums = features.sum(axis=1)
        u = np.einsum("sif,sf->si", features, self._slopes(sums))
        n_rated = features.any(axis=2).sum(axis=1).astype(float)
        is_paired = (codes >= 0).sum(axis=2) >= 2
        if self.design.entry.shape == "pairs":
            is_paired = features.any(axis=2)  # a pair is of one rater
        n_paired = is_paired.sum(axis=1).astype(float)
        squares = (u**2).sum(axis=1) - u.sum(axis=1) ** 2 / np.maximum(n_rated, 1.0)
        return self._wald(self._values(sums), squares, n_rated, n_paired)

    def _raters_left_out(self, codes: Integers) -> Floats:
        # The rater jackknife of `intervals` for all studies at once; what that leaves
        # undefined or without spread is left to the choice of `intervals`, one by one.
        from scipy.special import stdtrit

        r = codes.shape[2]
        value = self._values(self._features_of_studies(codes).sum(axis=1))
        without = np.stack(
            [
                self._values(
                    self._features_of_studies(np.delete(codes, rater, axis=2)).sum(1)
                )
                for rater in range(r)
            ],
            axis=1,
        )
        moved = without - without.mean(axis=1, keepdims=True)
        variance = (r - 1) / r * (moved**2).sum(axis=1)
        half = stdtrit(r - 1, 0.5 + 0.5 * self.design.level) * np.sqrt(variance)
        if self.design.interval == "t":
            return np.column_stack([value, half, value - half, value + half])
        outcomes = self._cut(value, half)
        for study in np.flatnonzero(~(variance > 1e-3 / codes[0].size)):
            outcomes[study] = self._chosen_of_codes(codes[study])
        return outcomes

    def _chosen(self, rows: Integers, freq: Integers) -> tuple[float, ...]:
        # the interval that an analysis would choose of one study
        occurs = freq > 0
        key = rows[occurs].tobytes() + freq[occurs].tobytes()
        if key not in self._intervals:
            self._intervals[key] = self._interval(rows[occurs], freq[occurs])
        value, low, high = self._intervals[key]
        return value, 0.5 * (high - low), low, high

    def _interval(self, rows: Integers, freq: Integers) -> tuple[float, float, float]:
        problem = rows_problem(self.problem, rows, freq)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UndefinedStatisticWarning)
            warnings.simplefilter("ignore", SmallSampleWarning)
            interval = self._interval_of(problem)
        return problem.value, interval.low, interval.high

    def _interval_of(self, problem: IntervalProblem) -> Interval:
        # what an analysis would compute by the method that is planned
        method = self.design.interval
        if method in ("auto", "t"):
            return choose_interval(problem, unweighted=problem.unweighted)[0]
        if method == "jackknife":
            return _interval_around_estimate(problem, _jackknife_variance(problem))
        rows, freq = problem.distinct.codes, problem.distinct_freq
        ratings = replace(problem.coded, codes=np.repeat(rows, freq, axis=0))
        compute = bootstrap if method == "bootstrap" else posterior
        return compute(
            problem.entry,
            ratings,
            target=self.design.target,
            weights=self.design.weights,
            level=self.design.level,
            rng=0,
        )


def _tables(n: int, n_cells: int) -> Iterator[Integers]:
    """Yield every way in which n items fall into cells, in blocks of rows."""
    if n_cells * math.comb(n + n_cells - 1, n) <= _PLACES:
        yield _all_tables(n, n_cells)
        return
    for count in range(n + 1):
        for rest in _tables(n - count, n_cells - 1):
            yield np.column_stack([np.full(len(rest), count), rest])


def _all_tables(n: int, n_cells: int) -> Integers:
    # cell by cell: each row as often as there are counts left for the next cell
    tables, left = np.zeros((1, 0), dtype=np.int64), np.array([n])
    for _ in range(n_cells - 1):
        row = np.repeat(np.arange(len(left)), left + 1)
        count = np.arange(len(row)) - np.repeat(
            np.cumsum(left + 1) - left - 1, left + 1
        )
        tables, left = np.column_stack([tables[row], count]), left[row] - count
    return np.column_stack([tables, left])


def check_raters(design: StudyDesign) -> None:
    """Check that the coefficient and the target can have so many raters."""
    fewest, most = design.entry.n_raters
    if design.target != "items" and design.entry.shape == "ratings":
        fewest = 3
    if design.n_raters < fewest or design.n_raters > (most or design.n_raters):
        raise ParameterError(
            f"n_raters: {design.entry.title} for other {design.target} needs "
            f"{fewest if most != fewest else f'{fewest} exactly,'} "
            f"{'or more, ' if most is None else ''}got {design.n_raters}"
        )
