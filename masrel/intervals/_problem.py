"""One question about a coefficient, checked once, as every interval method takes it."""

import math
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NoReturn, get_args

import numpy as np
from numpy.typing import NDArray

from masrel.agreement import (
    COEFFICIENTS,
    CodedRatings,
    Coefficient,
    CountedRatings,
    Label,
    Metric,
    WeightsLike,
    code_ratings,
    coefficient,
)
from masrel.agreement._data import check_scale
from masrel.agreement._distances import Distances, Line
from masrel.agreement._engine import Features, Floats, Formula, RaterSums, check_level
from masrel.agreement._labels import Codes
from masrel.agreement._rows import distinct_rows, item_counts
from masrel.agreement._weights import Weights, as_line, declared_weights
from masrel.errors import (
    ParameterError,
    SmallSampleWarning,
    UndefinedStatisticWarning,
)
from masrel.estimates import Estimate, Interval, Target, Unit

Integers = NDArray[np.int64]

Statistic = str | Callable[..., Estimate] | Coefficient
"""A coefficient: its name, its public function, or its entry in the register."""

HELD = (
    "the ordinal metric, which depends on the ratings, is held as it was found in all "
    "of them"
)

_MAX_PLACES = 1 << 23  # numbers of features that are held at once
_FEW_GRADES = 128  # up to which the features of every item are held
_MAX_REMADE = 40  # categories up to which that metric is made anew from their pairs

COLUMNS = {"ratings": 1, "pairs": 2}
"""Columns of codes that a rater has, by what a coefficient takes."""

ROUNDING = 1e-12
"""Values of a coefficient, or probabilities, nearer than this are the same."""

_BLOCK = 1 << 14  # items at once: what is made of them takes more room than they do


@dataclass(frozen=True, slots=True, kw_only=True)
class IntervalProblem:
    """A coefficient, its data as sums of features, and the question about it."""

    # A coefficient is a function of sums over items of a few features of each, so that
    # a resample, or leaving an item out, changes the sums and nothing else.
    entry: Coefficient
    formula: Formula
    coded: CodedRatings  # all ratings, item by item
    used: CodedRatings  # the same of raters who matter
    distinct: CodedRatings  # the distinct rows of these, and how often each occurs
    distinct_freq: Integers = field(compare=False, repr=False)  # (n_distinct,)
    matters: NDArray[np.bool_] = field(compare=False, repr=False)  # (n_distinct,)
    patterns: CodedRatings  # the distinct rows of ratings that matter
    freq: Integers = field(compare=False, repr=False)  # (n_patterns,)
    rows: Floats = field(compare=False, repr=False)  # (n_patterns, n_features)
    sums: Floats = field(compare=False, repr=False)  # over all items, (n_features,)
    v: Floats = field(compare=False, repr=False)  # disagreement of two categories
    unweighted: bool  # whether every miss counts in full
    n_items: int  # that matter: of those, an item of one rating tells of chance only
    # those with a pair of ratings, which degrees of freedom and rules for few count
    n_paired_items: int
    value: float  # the estimate; ``nan`` when undefined
    target: Target
    level: float
    notes: tuple[str, ...] = ()  # of every interval
    max_df: float = math.inf  # degrees of freedom, where other parts have as few

    @property
    def min_value(self) -> float:
        """Where intervals are cut."""
        # weights, or items of a single rating, can bring a coefficient below -1
        lowest: float = self.entry.lowest
        return lowest if self.value >= lowest else -math.inf

    @property
    def n_raters(self) -> int:
        """Raters who matter."""
        n_columns: int = self.patterns.codes.shape[1]
        return n_columns // COLUMNS[self.entry.shape]

    @property
    def n_paired_raters(self) -> int:
        """Raters with a rating of an item that has a pair of ratings."""
        if self.entry.shape == "pairs":
            return self.n_raters
        rated = self.patterns.codes >= 0
        return int(rated[rated.sum(axis=1) >= 2].any(axis=0).sum())

    def item_counts(self) -> Integers:
        """Count the raters of each category for every item that matters."""
        # -> (n_items, n_categories), equal items together
        counts = item_counts(self.patterns.codes, self.patterns.n_categories)
        return counts.repeat(self.freq, axis=0)

    def values(self, sums: Floats) -> Floats:
        """Return the coefficient for sums of shape (..., n_features)."""
        return self.formula.value(sums, self.v)

    def slopes(self, sums: Floats) -> Floats:
        """Return the derivatives of the coefficient in sums (..., n_features)."""
        with np.errstate(invalid="ignore", divide="ignore"):  # undefined ones
            slope = self.formula.slope(sums, self.v)
        return np.where(np.isfinite(slope), slope, math.nan)

    def values_without(self, sums: Floats, rows: Floats) -> Floats:
        """Return the coefficient for sums less each row of features, (n_rows,)."""
        if not len(rows):
            return np.empty(0)
        if len(rows) <= _BLOCK:
            return self.formula.value(sums - rows, self.v)
        return np.concatenate(
            [self.values(sums - rows[block]) for block in blocks(len(rows))]
        )

    def features(self, coded: CodedRatings) -> Floats:
        """Return the features of items, (n_items, n_features)."""
        return _features(self.formula, coded, self.v)

    def rater_sums(self) -> RaterSums:
        """Return sums of features as a function of how often each rater is taken."""
        fewest, most = self.entry.n_raters
        if isinstance(self.v, Distances):
            raise ParameterError(
                f"target: raters of {len(self.v)} different grades are left out, but "
                "not resampled; use the jackknife"
            )
        if self.formula.rater_sums is None or most == fewest:
            raise ParameterError(
                f"target: raters of {self.entry.title} cannot be resampled without "
                "pairing a rater with a copy of itself"
            )
        return self.formula.rater_sums(self.patterns.codes, self.freq, self.v)

    def crossed_values(self) -> Callable[[Floats, Floats], Floats]:
        """Return values by how often each pattern and each rater is taken."""
        self.rater_sums()  # or an error
        if self.formula.crossed_sums is None:  # whoever has one has both
            raise ParameterError(f"target: none of both for {self.entry.title}")
        sums = self.formula.crossed_sums(self.patterns.codes, self.v)
        return lambda items, raters: self.values(sums(items, raters))

    def student_t(self, df: float) -> float:
        """Return the two-sided quantile of Student's t at the level."""
        from scipy.special import stdtrit  # loaded only when an interval needs it

        return float(stdtrit(df, 0.5 + 0.5 * self.level))

    def around(
        self,
        value: float,
        half: float,
        *,
        lowest: float | None = None,
        method: str,
        unit: Unit | None,
        notes: Sequence[str] = (),
    ) -> Interval:
        """Return an interval that is symmetric around a value, or is so on a logit.

        The logit is that of the place between `lowest` and 1; at either end itself
        there is none.
        """
        low, high = value - half, value + half
        if lowest is not None and lowest < value < 1.0:
            # The error is divided by the slope of the logit, and the ends are taken
            # back, so that they stay inside.
            width = 1.0 - lowest
            share = (value - lowest) / width
            half /= width * share * (1.0 - share)
            middle = math.log(share / (1.0 - share))
            # the inverse, from the side on which the exponential is small
            low, high = (
                lowest + width * (1.0 / (1.0 + math.exp(-x)))
                if x >= 0.0
                else lowest + width * (math.exp(x) / (1.0 + math.exp(x)))
                for x in (middle - half, middle + half)
            )
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
        if low < self.min_value or high > 1.0:
            space = f"[{self.min_value:g}, 1]"
            notes = (*notes, f"cut at the end of the parameter space {space}")
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
        warnings.warn(
            f"{method} interval of {self.entry.title} is undefined: {reason}",
            UndefinedStatisticWarning,
            stacklevel=3,
        )
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
    delta: bool = False,
) -> IntervalProblem:
    """Check a question and prepare its data.

    For the delta method alone, that may be without sums where there are too many.
    """
    entry = find_entry(statistic, metric)
    if target not in get_args(Target):
        raise ParameterError(
            f"target: needs one of {', '.join(get_args(Target))}, got {target!r}"
        )
    check_level(level)
    if isinstance(ratings, CountedRatings) and not entry.tells_raters_apart:
        coded = _of_counted(ratings, target, categories)
    else:
        coded = entry.code(ratings, categories)
    _check_raters(entry, coded)
    made, formula, v, notes = _as_sums(entry, coded, weights, delta)
    used, distinct, freq, rows = _what_matters(entry, formula, coded, v)
    parts = _of_rows(formula, v, distinct, freq, rows)
    if formula is NO_SUMS:
        parts["value"] = entry(coded, weights=weights).value
    return IntervalProblem(
        entry=entry,
        formula=formula,
        coded=coded,
        used=used,
        v=v,
        unweighted=made.counts_misses,
        target=target,
        level=level,
        notes=notes,
        **parts,
    )


def rows_problem(
    problem: IntervalProblem, codes: Integers, freq: Integers
) -> IntervalProblem:
    """Return the same question of other ratings: distinct rows, and how often each."""
    # Takes codes (n_patterns, n_raters), freq (n_patterns,)
    distinct = replace(problem.coded, codes=codes)
    rows = problem.features(distinct)
    parts = _of_rows(problem.formula, problem.v, distinct, freq, rows)
    return replace(problem, coded=distinct, used=distinct, **parts)


def _of_rows(
    formula: Formula,
    v: Any,
    distinct: CodedRatings,
    freq: Integers,
    rows: Floats,
) -> dict[str, Any]:
    """Return what distinct rows and their features make of a question."""
    matters, patterns, of_patterns = rows.any(axis=1), distinct, freq
    if not matters.all():
        patterns = replace(distinct, codes=distinct.codes[matters])
        of_patterns, rows = freq[matters], rows[matters]
    sums = np.asarray(of_patterns @ rows)
    value = float(formula.value(sums, v))
    # a pair is of one rater in a test-retest, where rows without one do not matter
    paired = (patterns.codes >= 0).sum(axis=1) >= 2
    return {
        "distinct": distinct,
        "distinct_freq": freq,
        "matters": matters,
        "patterns": patterns,
        "freq": of_patterns,
        "rows": rows,
        "sums": sums,
        "n_items": int(of_patterns.sum()),
        "n_paired_items": int(of_patterns @ paired),
        "value": value,
    }


def _as_sums(
    entry: Coefficient, coded: CodedRatings, weights: "WeightsLike", delta: bool
) -> tuple[Weights, Formula, Any, tuple[str, ...]]:
    """Return weights, the formula of sums, the v that it takes, and notes."""
    formula = entry.formula or _refuse_coefficient(entry)
    if entry.metric is None:
        made = declared_weights(weights, coded.categories, declared=coded.declared)
    else:
        made = entry.disagreement(coded, weights)
    notes: tuple[str, ...] = ()
    if entry.metric == "ordinal" and coded.n_categories > _MAX_REMADE:
        formula, notes = coefficient(entry.name).formula or formula, (HELD,)
    if not _are_too_many(formula, coded, made.v):
        return made, formula, made.v, notes
    line = as_line(made, coded.categories)
    formula = NO_SUMS if delta else _of_nodes(formula, coded, line)
    return made, formula, made.v if line is None else line, notes


def _of_counted(
    ratings: CountedRatings, target: Target, categories: Sequence[Label] | None
) -> CodedRatings:
    # counted ratings, or counts that do not say who rated what
    if ratings.knows_raters:
        return code_ratings(ratings, categories)
    if target != "items":
        raise ParameterError(
            "target: counts do not say who rated what, so that an interval generalises "
            f'to other "items"; got "{target}"'
        )
    if categories is not None:
        check_scale(ratings.categories, categories)
    return ratings.coded


def _refuse_coefficient(entry: Coefficient) -> NoReturn:
    raise ParameterError(
        f"coefficient: {entry.title} is no function of sums over items: there is no "
        "such interval of it"
    )


def _are_too_many(formula: Formula, coded: CodedRatings, v: Any) -> bool:
    # features of every item to be held; those of few grades always are
    if len(v) <= _FEW_GRADES:
        return False
    one = formula.features(coded.codes[:1], v, None)
    n_features = len(one.dense) + one.n
    return max(len(coded.codes), len(v)) * n_features > _MAX_PLACES


def _of_nodes(formula: Formula, coded: CodedRatings, line: Line | None) -> Formula:
    """Return the formula with all ratings shared out among three nodes, or refuse.

    Where v is the square of a distance, the nodes stand for any number of grades.
    """
    nodes = None if line is None or formula.needs_categories else line.nodes()
    if nodes is None:
        raise ParameterError(
            f"ratings: {len(coded.codes)} items of {coded.n_categories} different "
            f"grades are too many for an interval of {formula.title} that counts each "
            "of them; kappas by Cohen, Conger, Fleiss and Light and alpha with "
            'quadratic weights count none, nor does method="analytic" for other items; '
            "intraclass correlations (ICC) take measurements as they are"
        )
    shares, v = nodes

    def features(codes: Codes, _v: Any, repeats: Integers | None = None) -> Features:
        made = formula.features(codes, line, repeats)
        slot, grade = np.divmod(made.places, len(shares))
        places = 3 * slot[:, :, None] + np.arange(3)
        values = made.values[:, :, None] * shares[grade]
        flat = len(codes), 3 * slot.shape[1]
        n = 3 * made.n // len(shares)
        return Features(made.dense, places.reshape(flat), values.reshape(flat), n)

    def disagreements(sums: Floats, _v: Any) -> tuple[Floats, Floats]:
        d_o, d_e = formula.disagreements(sums, v)
        return d_o, np.where(d_e > ROUNDING * v.max(), d_e, 0.0)  # 0 is rounded here

    return replace(
        formula,
        features=features,
        disagreements=disagreements,
        slope=lambda sums, _v: formula.slope(sums, v),
        rater_sums=None,
        crossed_sums=None,
    )


def _whether_rated(codes: Codes, _v: Any, _repeats: Any = None) -> Features:
    none = np.empty((len(codes), 0))
    rated = np.asarray((codes >= 0).any(axis=1, keepdims=True).T, dtype=np.float64)
    return Features(rated, none.astype(np.int64), none, 0)


def _no_sums(sums: Floats, _v: Any) -> tuple[Floats, Floats]:
    none = np.full((*sums.shape[:-1], 1), math.nan)
    return none, none


NO_SUMS = Formula(
    name="",
    title="",
    features=_whether_rated,
    disagreements=_no_sums,
    slope=lambda sums, _v: np.full(sums.shape, math.nan),
)
"""In place of the formula of a coefficient whose features would be too many."""


def find_entry(statistic: Statistic, metric: Metric | None = None) -> Coefficient:
    """Return the entry of a name or a public function in the register."""
    if isinstance(statistic, Coefficient):
        entry = statistic
    else:
        name = statistic
        if not isinstance(name, str):
            name = getattr(statistic, "__name__", repr(statistic))
        # another name that it has, or an error, is looked up in full
        entry = COEFFICIENTS[name] if name in COEFFICIENTS else coefficient(name)
    return entry if metric is None else entry.by_metric(metric)


def _check_raters(entry: Coefficient, coded: CodedRatings) -> None:
    fewest, most = entry.n_raters
    n_raters = coded.codes.shape[1]
    if most is not None and n_raters > most:
        n_raters = coded.n_raters  # those without any rating are none
    if entry.shape != "ratings" or fewest <= n_raters <= (most or n_raters):
        return
    needed = f"{fewest}" if most == fewest else f"at least {fewest}"
    raise ParameterError(f"{entry.title} needs {needed} raters, got {n_raters}")


def _what_matters(
    entry: Coefficient, formula: Formula, coded: CodedRatings, v: Floats
) -> tuple[CodedRatings, CodedRatings, Integers, Floats]:
    """Return ratings of raters who matter, distinct rows, frequencies and features."""
    # A row whose features are all 0 changes no sum: to the coefficient it is no item.
    # A rater without a rating in the others, or a pair in a test-retest, is no rater;
    # so the same intervals follow whether such rows and columns are there or not.
    width, fewest = COLUMNS[entry.shape], entry.n_raters[0]
    while True:
        codes, freq = distinct_rows(coded.codes, len(coded.categories))
        rated = (codes >= 0).any(axis=0)  # (n_columns,)
        if width == 1 and fewest <= rated.sum() < rated.size:
            coded = replace(coded, codes=coded.codes[:, rated])
            continue
        distinct = replace(coded, codes=codes)
        rows = _features(formula, distinct, v)
        codes = codes[rows.any(axis=1)]
        shape = (len(codes), codes.shape[1] // width, width)
        rates = (codes >= 0).reshape(shape).all(axis=2).any(axis=0)  # (n_raters,)
        if rates.all() or rates.sum() < fewest:
            return coded, distinct, freq, rows
        coded = replace(coded, codes=coded.codes[:, rates.repeat(width)])


def _features(formula: Formula, coded: CodedRatings, v: Floats) -> Floats:
    # (n_items, n_features), made a block at a time
    n_items = len(coded.codes)
    if n_items <= _BLOCK:
        return formula.features(coded.codes, v).rows()
    features = None
    for block in blocks(n_items):
        part = formula.features(coded.codes[block], v).rows()
        if features is None:
            features = np.empty((n_items, part.shape[1]))
        features[block] = part
    return np.asarray(features)


def blocks(n_items: int) -> Iterator[slice]:
    """Cut items into blocks, so that what is made of them stays small."""
    for start in range(0, n_items, _BLOCK):
        yield slice(start, min(start + _BLOCK, n_items))


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
    note = f"{count} {what}: below {minimum} the interval may cover less than it says"
    # called by what a method calls: the warning points to who called the method
    warnings.warn(note, SmallSampleWarning, stacklevel=4)
    return (note,)


def singular(what: str) -> str:
    """Return for one what is said in the plural."""
    return re.sub(r"s\b", "", what, count=1)  # "items with ratings": the first alone


def recorded_generator(
    rng: np.random.Generator | int | None,
) -> tuple[np.random.Generator, int | None]:
    """Return a generator and the seed that repeats it."""
    check_rng(rng)
    if isinstance(rng, np.random.Generator):
        return rng, None  # its owner knows where it began
    if rng is None:
        rng = int(np.random.SeedSequence().generate_state(1, np.uint64)[0] >> 1)
    return np.random.default_rng(int(rng)), int(rng)


def check_rng(rng: object) -> None:
    """Check that random numbers can come from something."""
    if rng is None or isinstance(rng, np.random.Generator):
        return
    if isinstance(rng, bool) or not isinstance(rng, int | np.integer) or rng < 0:
        raise ParameterError(
            f"rng: needs a numpy Generator or an integer of at least 0, got {rng!r}"
        )
