"""One question about a coefficient, checked once, as every interval method takes it.

In: a coefficient, ratings, and the population asked about. Out: an `IntervalProblem`.
"""

import math
import re
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from masrel._input import check_option, refuse, warn_caller
from masrel.agreement import (
    COEFFICIENTS,
    CodedRatings,
    Coefficient,
    CountedRatings,
    Label,
    Metric,
    WeightsLike,
    coefficient,
    count_ratings,
)
from masrel.agreement._codes import distinct_rows, item_counts
from masrel.agreement._engine import (
    Features,
    Floats,
    Formula,
    Integers,
    check_level,
    logit_ends,
    student_t,
    undefined,
)
from masrel.agreement._labels import Codes, is_missing, is_row
from masrel.agreement._weights import Line, declared_weights
from masrel.errors import (
    ParameterError,
    SmallSampleWarning,
)
from masrel.estimates import Estimate, Interval, Target, Unit, _CountNote

Statistic = str | Callable[..., Estimate] | Coefficient
"""A coefficient: its name, its public function, or its entry in the register."""

PriorName = Literal["uniform", "jeffreys"]
"""Prior of ρ: U(0, 1), or Beta(1/2, 1/2), the prior of Jeffreys for a probability."""

HELD = (
    "the ordinal metric depends on how often each grade was given; it was computed "
    "once, from all ratings, as if other ratings would give the same metric"
)

_MAX_PLACES = 1 << 23  # numbers of features that are held at once
_FEW_GRADES = 128  # up to which the features of every item are held
_MAX_REMADE = 40  # categories up to which that metric is made anew from their pairs

WITHOUT_END = 1e15
"""Items of a population, in which corrections for few vanish."""

COLUMNS = {"ratings": 1, "pairs": 2}
"""Columns of codes that a rater has, by what a coefficient takes."""

ROUNDING = 1e-12
"""Values of a coefficient, or probabilities, nearer than this are the same."""


@dataclass(frozen=True, kw_only=True, eq=False)
class IntervalProblem:
    """A coefficient, its data as sums of features, and the question about it."""

    # A coefficient is a function of sums over items of a few features of each, so that
    # a resample, or leaving an item out, changes the sums and nothing else.
    entry: Coefficient
    formula: Formula
    v: Any  # disagreement of two categories, as the formula takes it
    unweighted: bool  # whether every miss counts in full
    target: Target
    level: float
    coded: CodedRatings  # all ratings, item by item
    item_codes: Codes  # the same of raters who matter, (n_items, n_columns)
    codes: Codes  # the distinct rows of these, (n_rows, n_columns)
    often: Integers  # how often each occurs, (n_rows,)
    freq: Integers  # the same, but 0 of a row that changes no sum: it is no item
    item_features: Features  # of each row
    sums: Floats  # of features over all items, (n_features,)
    value: float  # the estimate; ``nan`` when undefined
    n_items: int  # that matter: of those, an item of one rating tells of chance only
    # those with a pair of ratings, which degrees of freedom and rules for few count
    n_paired_items: int
    min_value: float  # where intervals are cut
    is_too_large: bool  # to hold the features of all items
    notes: tuple[str, ...] = ()  # of every interval
    max_df: float = math.inf  # degrees of freedom, where other parts have as few

    @property
    def is_rho(self) -> bool:
        """Whether the value is ρ of the Dirichlet-multinomial model, as it pools."""
        return self.unweighted and self.entry.rho == "any raters"

    @property
    def n_raters(self) -> int:
        """Raters who matter."""
        return int(self.codes.shape[1]) // COLUMNS[self.entry.shape]

    @property
    def n_paired_raters(self) -> int:
        """Raters with a rating of an item that has a pair of ratings."""
        if self.entry.shape == "pairs":
            return self.n_raters
        rated = self.codes[self.freq > 0] >= 0
        return int(rated[rated.sum(axis=1) >= 2].any(axis=0).sum())

    def item_counts(self) -> Integers:
        """Count the raters of each category for every item that matters."""
        # -> (n_items, n_categories), equal items together
        counts = item_counts(self.codes, self.coded.n_categories)
        return counts.repeat(self.freq, axis=0)

    def features(self, codes: Codes) -> Floats:
        """Return the features of rows of codes, (n_rows, n_features)."""
        if self.is_too_large:
            raise ParameterError(
                f"ratings: {len(self.coded.codes)} items of {self.coded.n_categories} "
                f"different grades are too many for an interval of {self.formula.title}"
                " that counts each of them; kappas by Cohen, Conger, Fleiss and Light "
                "and alpha with quadratic weights count none, nor does "
                'method="analytic" for other items; intraclass correlations (ICC) take '
                "measurements as they are"
            )
        return self.formula.features(codes, self.v).rows()

    def values(self, sums: Floats) -> Floats:
        """Return the coefficient for sums of shape (..., n_features)."""
        return self.formula.value(sums, self.v)

    def disagreements(self, sums: Floats) -> tuple[Floats, Floats]:
        """Return D_o and D_e for sums of shape (..., n_features)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            d_o, d_e, _ = self.formula.disagreements(sums, self.v)
        return d_o, d_e

    def slopes(self, sums: Floats) -> Floats:
        """Return the derivatives of the coefficient in sums (..., n_features)."""
        return self.formula.slope(sums, self.v)

    def by_t(
        self,
        error: float,
        df: float,
        *,
        lowest: float | None = None,
        method: str,
        unit: Unit | None,
        notes: Sequence[str] = (),
    ) -> Interval:
        """Return an interval by Student's t, or by the normal of infinite degrees.

        With `lowest` it is symmetric on the logit of the place between that and 1, and
        on Fisher's z where there is no lowest; at either end itself it is undefined.
        """
        half = student_t(self.level, df) * error
        low, high = self.value - half, self.value + half
        lowest = None if lowest is None else max(lowest, -1.0)
        if lowest is not None and lowest < self.value < 1.0:
            low, high = logit_ends(self.value, half, lowest)
        return self.confidence(low, high, method=method, unit=unit, notes=notes)

    def confidence(
        self,
        low: float,
        high: float,
        *,
        method: str,
        unit: Unit | None,
        notes: Sequence[str] = (),
    ) -> Interval:
        """Return a confidence interval, cut at the ends of the parameter space."""
        if low < self.min_value - ROUNDING or high > 1.0 + ROUNDING:
            lowest = f"{self.min_value:g} or " * math.isfinite(self.min_value)
            notes = (*notes, f"the interval was cut at {lowest}1")
        return Interval(
            # resamples of items and raters can leave both ends below the space
            low=min(max(low, self.min_value), 1.0),
            high=max(min(high, 1.0), self.min_value),
            level=self.level,
            kind="confidence",
            method=method,
            target=self.target,
            unit=unit,
            notes=(*notes, *self.notes),
        )

    def undefined(self, reason: str, *, method: str, unit: Unit | None) -> Interval:
        """Return an interval of ``nan`` that says why, with a warning."""
        undefined(f"{method} interval of {self.entry.title}", reason)
        return Interval(
            low=math.nan,
            high=math.nan,
            level=self.level,
            kind="confidence",
            method=method,
            target=self.target,
            unit=unit,
            reason=reason,
        )


def pose_problem(
    statistic: Statistic,
    ratings: object,
    *,
    target: Target,
    categories: Sequence[Label] | None,
    weights: "WeightsLike",
    level: float,
    metric: Metric | None = None,
) -> IntervalProblem:
    """Check a question and prepare its data."""
    entry = find_entry(statistic, metric)
    check_option("target", target, get_args(Target))
    check_level(level)
    if isinstance(ratings, CountedRatings) and not (
        ratings.knows_raters or entry.tells_raters_apart
    ):
        refuse(
            (
                target != "items",
                'target: counts do not show who rated what, so it needs "items", '
                f'got "{target}"',
            )
        )
        ratings = count_ratings(ratings, categories).coded
    coded = entry.code(ratings, categories)
    fewest, most = entry.n_raters
    n_raters = coded.codes.shape[1]
    if most is not None and n_raters > most:
        n_raters = coded.n_raters  # those without any rating are none
    needed = f"{fewest}" if most == fewest else f"at least {fewest}"
    has_enough = entry.shape == "pairs" or fewest <= n_raters <= (most or n_raters)
    refuse(
        (not has_enough, f"{entry.title} needs {needed} raters, got {n_raters}"),
        (
            entry.formula is not None and entry.has_interval and target != "items",
            f"target: for {entry.title} items, or clusters of items, are left out or "
            f'drawn, so it needs "items", got "{target}"',
        ),
    )
    formula = entry.formula
    if formula is None:
        raise ParameterError(
            f"coefficient: this interval is not available for {entry.title}, which is "
            "not a function of sums over items; leave out the target to get the value"
        )
    if entry.weighted:
        made = declared_weights(weights, coded.categories, declared=coded.declared)
    else:
        made = entry.disagreement(coded, weights)
    is_held = entry.metric == "ordinal" and coded.n_categories > _MAX_REMADE
    if is_held:
        formula = coefficient(entry.name).formula or formula
    item_codes, codes, often = _who_matters(entry, formula, made.v, coded)
    v, n_rows = made.v, max(len(item_codes), len(made.v))
    features = formula.features(codes[:1], v)
    is_too_large = (
        len(v) > _FEW_GRADES
        and n_rows * (len(features.dense) + features.n) > _MAX_PLACES
    )
    if is_too_large and made.line is not None:
        if (by_nodes := _by_nodes(formula, made.line)) is not None:
            formula, v, is_too_large = by_nodes, made.line, False
    return IntervalProblem(
        entry=entry,
        formula=formula,
        v=v,
        unweighted=made.counts_misses,
        target=target,
        level=level,
        coded=coded,
        item_codes=item_codes,
        is_too_large=is_too_large,
        notes=(HELD,) if is_held else (),
        **_of_rows(entry, formula, v, codes, often),
    )


def _who_matters(
    entry: Coefficient, formula: Formula, v: Any, coded: CodedRatings
) -> tuple[Codes, Codes, Integers]:
    """Return codes of raters who matter, their distinct rows, and how often each is."""
    # A rater without a rating in a row that matters, or a pair in a test-retest, is no
    # rater; so the same intervals follow whether such rows and columns are there.
    width, fewest, item_codes = COLUMNS[entry.shape], entry.n_raters[0], coded.codes
    rated = (item_codes >= 0).any(axis=0)  # (n_columns,)
    if width == 1 and fewest <= rated.sum() < rated.size:
        item_codes = item_codes[:, rated]
    while True:
        codes, often = distinct_rows(item_codes, len(coded.categories))
        matter = formula.features(codes, v).summed(often)[1] > 0
        there = codes[matter] >= 0
        shape = (len(there), codes.shape[1] // width, width)
        rates = there.reshape(shape).all(axis=2).any(axis=0)  # (n_raters,)
        if rates.all() or rates.sum() < fewest:
            return item_codes, codes, often
        item_codes = item_codes[:, rates.repeat(width)]


def of_rows(problem: IntervalProblem, codes: Codes, often: Integers) -> IntervalProblem:
    """Return the same question of distinct rows of ratings that occur so often."""
    parts = _of_rows(problem.entry, problem.formula, problem.v, codes, often)
    coded = replace(problem.coded, codes=codes)
    return replace(problem, coded=coded, item_codes=codes, **parts)


def _of_rows(
    entry: Coefficient, formula: Formula, v: Any, codes: Codes, often: Integers
) -> dict[str, Any]:
    """Return what distinct rows and their features make of a question."""
    features = formula.features(codes, v)
    sums, freq = features.summed(often)
    value = float(formula.value(sums, v))
    return {
        "codes": codes,
        "often": often,
        "freq": freq,
        "item_features": features,
        "sums": sums,
        "value": value,
        "n_items": int(freq.sum()),
        # a pair is of one rater in a test-retest, where rows without do not matter
        "n_paired_items": int(freq @ ((codes >= 0).sum(axis=1) >= 2)),
        # weights, or items of a single rating, can bring a coefficient below -1
        "min_value": entry.lowest if value >= entry.lowest else -math.inf,
    }


def _by_nodes(formula: Formula, line: Line) -> Formula | None:
    """Return the formula with all ratings shared out among three nodes.

    Where v is the square of a distance, the nodes represent any number of grades.
    """
    if formula.needs_categories or (nodes := line.nodes()) is None:
        return None
    shares, v = nodes

    def features(codes: Codes, _v: Any, repeats: Integers | None = None) -> Features:
        made = formula.features(codes, line, repeats)
        slot, grade = np.divmod(made.places, len(shares))
        places = 3 * slot[:, :, None] + np.arange(3)
        values = made.values[:, :, None] * shares[grade]
        flat = len(codes), 3 * slot.shape[1]
        n = 3 * made.n // len(shares)
        return Features(made.dense, places.reshape(flat), values.reshape(flat), n)

    def disagreements(sums: Floats, _v: Any) -> tuple[Floats, Floats, Floats]:
        d_o, d_e, slope = formula.disagreements(sums, v)
        d_e = np.where(d_e > ROUNDING * v.max(), d_e, 0.0)  # 0 is rounded here
        return d_o, d_e, slope

    return replace(
        formula,
        features=features,
        disagreements=disagreements,
        resampled=None,
    )


def find_entry(statistic: Statistic, metric: Metric | None = None) -> Coefficient:
    """Return the entry of a name or a public function in the register."""
    if not isinstance(statistic, Coefficient):
        name = str(getattr(statistic, "__name__", statistic))
        # another name that it has, or an error, is looked up in full
        statistic = COEFFICIENTS[name] if name in COEFFICIENTS else coefficient(name)
    return statistic if metric is None else statistic.by_metric(metric)


# -- clusters of items -----------------------------------------------------------------


def cluster_codes(problem: IntervalProblem, clusters: object) -> Integers:
    """Return which cluster every item belongs to, as numbers from 0, (n_items,)."""
    n_items = len(problem.coded.codes)
    labels = list(clusters) if is_row(clusters) else []
    refuse(
        (
            problem.target != "items",
            'clusters: they are clusters of items, so they need target "items", got '
            f'"{problem.target}"',
        ),
        (
            not is_row(clusters),
            f"clusters: needs one label per item, got {type(clusters).__name__}",
        ),
        (
            len(labels) != n_items,
            f"clusters: needs a label for each of {n_items} items, got {len(labels)}",
        ),
    )
    numbers: dict[Hashable, int] = {}
    for item, label in enumerate(labels):
        if is_missing(label) or not isinstance(label, Hashable) or label == "":
            raise ParameterError(
                f"clusters: item {item} needs the label of its cluster, got {label!r}"
            )
        numbers.setdefault(label, len(numbers))
    return np.array([numbers[label] for label in labels])


def cluster_sums(
    problem: IntervalProblem, clusters: Integers
) -> tuple[Floats, NDArray[np.bool_], int]:
    """Add up the features of items over each cluster, which are numbers from 0.

    Returns the sums, (n_clusters, n_features), which clusters the coefficient knows
    of, and how many of them have a pair of ratings of an item.
    """
    features = problem.features(problem.item_codes)
    matters = features.any(axis=1)
    paired = matters & ((problem.item_codes >= 0).sum(axis=1) > 1)
    n = int(clusters.max(initial=-1)) + 1
    sums = np.zeros((n, len(problem.sums)))
    np.add.at(sums, clusters, features)
    known = np.bincount(clusters[matters], minlength=n) > 0
    return sums, known, len(np.unique(clusters[paired]))


# -- what is small ---------------------------------------------------------------------


def warn_small(
    count: int, minimum: int, what: str, of: int | None = None
) -> tuple[str, ...]:
    """Warn below a number of items or raters, and return the note of it."""
    if count >= minimum:
        return ()
    if of is not None and of > count:  # as many are there, few of them with a pair
        what += " with a pair of ratings"
    if count == 1:
        what = singular(what)
    note = _CountNote(
        f"{count} {what}: with fewer than {minimum} the true coverage may be below "
        "the level of the interval"
    )
    warn_caller(note, SmallSampleWarning)
    return (note,)


def singular(what: str) -> str:
    """Return the singular of a phrase in the plural."""
    return re.sub(r"s\b", "", what, count=1)  # "items with ratings": the first alone
