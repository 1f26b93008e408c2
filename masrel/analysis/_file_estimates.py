"""Questions about a file of ratings, and estimates: coefficients with intervals.

In: a `RatingsFile` and how estimates are made. Out: a row for every coefficient.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from masrel._input import refuse, split_names
from masrel.errors import MasrelError, RatingsError
from masrel.estimates import (
    Estimate,
    Interval,
    IntervalMethod,
    Target,
    _Convention,
)
from masrel.ratings._findings import listed

if TYPE_CHECKING:
    from masrel.agreement import (
        BandScale,
        CodedRatings,
        Coefficient,
        CountedRatings,
        Metric,
    )
    from masrel.analysis._judging import Judging
    from masrel.ratings import RatingsFile, RatingsPart

_Ratings = TypeVar("_Ratings", bound="CodedRatings | CountedRatings")

USUAL = ("percent_agreement", "fleiss_kappa")
"""The coefficients that are estimated by default."""

OF_MEASUREMENTS = ("icc_a1", "lin_ccc")
"""The coefficients shown beside limits of agreement, which are for measurements."""

# The coefficient that has metrics, and those of each rater's grades of two sessions
_OF_METRIC = "krippendorff_alpha"
_OF_SESSIONS = ("stratified_kappa", "pooled_kappa")

_SURE = 0.95  # probability with which the true value reaches the word for it
_SURE_TWO_SIDED = 0.90  # the level of which the lower end alone is as sure

# What is named as a coefficient and is a table of its own
_TABLES = {
    **dict.fromkeys(("mcnemar", "bowker", "stuart_maxwell", "bhapkar"), "--symmetry"),
    "bland_altman": "masrel limits",
}

# tables that take every item by itself
_BY_ITEM = ("retest", "each_category", "symmetry", "indices")


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimating:
    """Which estimates are made from ratings, and how.

    Parameters
    ----------
    coefficients : str, list of str or None
        Names of coefficients, or ``"all"`` that fit; None for the usual ones.
    weights : str, Path, Weights or array_like
        Weights of coefficients that take any; a path is that of a matrix.
    metric : str or None
        Krippendorff's difference function, in place of weights.
    target : {"items", "raters", "both"} or None
        The population to generalise to; no interval if None.
    interval : str
        Kind of interval; ``"auto"`` is the newest rule that chooses one.
    convention : {"irrcac", "spss", "over_n"} or None
        Take the standard errors and intervals for other items that irrCAC, SPSS, or
        psych and vcd print in place of ours, to have an old number again.
    level : float
        Level of intervals.
    n_resamples, seed : int
        Number of resamples and seed of intervals that draw.
    words : str or None
        Whose words for values; the best that the true value reaches with 95 %
        probability is named.

    Examples
    --------
    >>> Estimating(target="items").interval
    'auto'
    """

    coefficients: str | Sequence[str] | None = None
    # checked with the rest; a file until the scale is known
    weights: Any = "identity"
    metric: "Metric | None" = None
    target: Target | None = None
    interval: IntervalMethod = "auto"
    convention: _Convention | None = None
    level: float = 0.95
    n_resamples: int = 10_000
    seed: int = 0
    words: "BandScale | None" = None

    def __post_init__(self) -> None:
        if (names := self.coefficients) is not None:
            several = split_names(names) if isinstance(names, str) else list(names)
            object.__setattr__(self, "coefficients", several)


@dataclass(frozen=True, slots=True, kw_only=True)
class Questions(Estimating):
    """What is to be told of a file: estimates, and a table for each question."""

    command: str = "agree"  # the other ones have a table of their own
    retest: bool = False
    each_category: bool = False
    symmetry: bool = False
    indices: bool = False
    reference: str | None = None
    unit: str | None = None
    # of limits: what repeats are of, and whether they follow a line or are ratios
    truth: Literal["constant", "varying"] | None = None
    kind: Literal["proportional", "ratio"] | None = None
    clusters: tuple[str, ...] = ()  # that of every item of the part, if items have any
    judging: "Judging | None" = None

    @property
    def takes_all(self) -> bool:
        """Whether all coefficients are estimated that fit."""
        return self.coefficients == ["all"]

    @property
    def names(self) -> list[str]:
        """The coefficients that are named, or the usual ones."""
        if self.coefficients is not None:
            return list(self.coefficients)
        return list(USUAL) if self.metric is None else [_OF_METRIC]

    def weights_of(self, entry: "Coefficient") -> Any:
        """Return the weights, of a coefficient that takes any."""
        return self.weights if entry.weighted else "identity"

    def title(self, entry: "Coefficient") -> str:
        """Return what a coefficient is called with its weights."""
        weights = self.weights_of(entry)
        return entry.title if weights == "identity" else f"{entry.title}, {weights}"

    def record(self) -> dict[str, object]:
        """Return every option that decides a number."""
        if self.judging is not None:
            return {
                **self.judging.record(),
                "target": self.target,
                "level": self.level,
            }
        of_some = ("metric", "convention", "truth", "kind")
        return {
            "coefficients": self.names,
            "weights": str(self.weights),
            **(
                {}
                if isinstance(self.weights, str)
                else {"weight_matrix": self.weights.as_floats().round(15).tolist()}
            ),
            "target": self.target,
            "interval": self.interval,
            "level": self.level,
            "resamples": self.n_resamples,
            "seed": self.seed,
            "words": self.words,
            **{of: x for of in of_some if (x := getattr(self, of)) is not None},
        }

    def checked(self, clusters: str | None) -> "Questions":
        """Return the same with defaults, or refuse what excludes each other."""
        from masrel.agreement._engine import check_level
        from masrel.agreement._weights import plain_name

        check_level(self.level)  # nothing else looks at it where there is no interval
        others = {name: name.lower().replace("-", "_") for name in self.names}
        tables = [of.replace("_", "-") for of in _BY_ITEM if getattr(self, of)]
        of_raters = self.target in ("raters", "both")
        refuse(
            *(
                (
                    other in _TABLES,
                    f"--coefficients: needed names of coefficients, got {name!r}; "
                    f"{_TABLES.get(other)} makes that table",
                )
                for name, other in others.items()
            ),
            (
                clusters is not None and tables,
                f"--clusters: --{''.join(tables[:1])} treats items as independent: "
                "needed one of them, got both",
            ),
            (
                clusters is not None and of_raters,
                "--clusters: clusters group items, so it needs --target items, got "
                f"--target {self.target}",
            ),
            (
                self.convention is not None and of_raters,
                "--convention: other programs print errors for other items, so "
                f"it needs --target items, got --target {self.target}",
            ),
            (
                self.convention is not None and clusters is not None,
                "--convention: these errors ignore clusters, so it cannot be combined "
                "with --clusters",
            ),
            (
                self.convention is not None and self.interval != "auto",
                "--convention: it is itself a kind of interval, so it cannot be "
                f"combined with --interval, got {self.interval}",
            ),
        )
        of_items = clusters is not None or self.convention is not None
        return replace(
            self,
            weights=plain_name(self.weights),
            target="items" if of_items else self.target,
        )

    def on_scale(self, file: "RatingsFile") -> "Questions":
        """Return the same with weights that are in a file, or a matrix."""
        from masrel.agreement import Weights, declared_weights

        weights, scale, is_ordered = self.weights, file.scale, file.is_ordered
        if isinstance(weights, Path):
            from masrel.ratings._reader import read_weights

            weights = read_weights(weights, scale.grades, is_ordered=is_ordered)
        elif not isinstance(weights, str | Weights):
            check_order(file, "weights: a matrix")
            weights = declared_weights(weights, scale.values)
        return replace(self, weights=weights)

    def between_raters(self, file: "RatingsFile") -> "Questions | None":
        """Return what is estimated between raters; None where that is nothing."""
        are_alone = self.retest and all(len(part.raters) == 1 for part in file.parts)
        if self.judging is not None or self.truth is not None or are_alone:
            return None
        if not self.retest or self.coefficients is None:
            return self
        rest = [name for name in self.coefficients if name not in _OF_SESSIONS]
        return replace(self, coefficients=rest) if rest else None


Row = dict[str, Any]
"""Values by name; ``nan`` and infinities are null in JSON."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AgreementRow:
    """One estimate, and what to say of it that is not in it."""

    keys: Mapping[str, str | None]  # what tells it from others; None for all of them
    title: str  # the coefficient
    estimate: Estimate
    # what it lacks of what was requested, and what was assumed
    notes: tuple[str, ...] = ()
    # what the true value reaches with 95 % by its interval; None if there is none, or
    # no word is to be named
    lower_bound: float | None = None
    convention: _Convention | None = None  # whose error it has, if it is not ours

    @property
    def group(self) -> str:
        """What it is called, from the group down."""
        return ": ".join("all" if of is None else of for of in self.keys.values())


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What a question gives."""

    name: str  # in the JSON, and of the table
    rows: list[Row] = field(default_factory=list)  # of the JSON; none of estimates
    shown: list[Row] | None = None  # rows of the table, where they are others
    # what tells parts apart: a key of the table's rows, and what it is called
    heads: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()  # below the table
    of: str = ""  # what the caption says it is of
    grades: tuple[str, ...] = ()  # that have a column each
    estimates: tuple[AgreementRow, ...] = ()
    # what a figure shows of each part: its name, and its result
    figure: tuple[tuple[str, Any], ...] = ()


class Explanation(str):
    """A note on how numbers were made, which no first screen has."""

    __slots__ = ()


# Notes that stand below a table at once
_TEXTS = {
    "constant": "Repeats: {n} measurements in all; each item has one true value.",
    "varying": "Repeats: {n} measurements in pairs; the true value of an item may "
    "change from one pair to the next.",
    "left_out": "{group}Left out: {names}.",
    "pair": "Difference: {pair}.",
    "reference": "{rater} is the reference and is not included in the other estimates "
    "between raters.",
    "least": "Shown are the {n} pairs that agree least; --json has all {n_all}.",
    "roles": "Judges: {judges}. Humans: {humans}.",
    "closer": "Closer: number of items on which the human, or the judge, is closer to "
    "the other humans. Shares: items on which one is closer or as close.",
    "no_ends": "No intervals were asked for; add --target items.",
    "shared_clusters": "The groups share clusters; a shared cluster is left out of "
    "both groups at once.",
    "shared_items": "Same items: both groups have items with the same names. These "
    "are treated as the same items, and an item is left out of both groups at once.",
    "same_names": "{first} and {second}: {n} items have the same name but are treated "
    "as different items.",
    "without": "Left out: {titles}, for which this interval is not available.",
}

# Notes on how numbers were made
_EXPLANATIONS = {
    # test and retest
    "sessions": "{group}Each rater's grades in {first} are compared with "
    "those in {second}.",
    # two raters
    "test": "{test}: whether {hypothesis}.",
    "exact_test": "{test}: whether {hypothesis}; df: the number of items that changed.",
    "pabak": "PABAK: 2 p_o − 1, which is Brennan-Prediger's coefficient for two "
    "categories; SE by the delta method, with items as the sample.",
    "on_category": "Agreement on a category: how often one rater chose it when the "
    "other did; with two categories these are negative and positive agreement.",
    "largest": "Largest κ: the largest value that the raters' margins allow.",
    "limits": "Limits: mean ∓ 1.96 standard deviations. If differences are normal, 95 "
    "% lie between them.",
    **{
        f"limits_{kind}": (
            f"Limits: {middle} ∓ 1.96 standard deviations of the difference between "
            "two single measurements. If differences are normal, 95 % lie between "
            "them."
        )
        for kind, middle in (
            ("with_repeats", "mean"),
            ("that_follow", "line"),
            ("of_ratios", "mean of logarithms"),
        )
    },
    "mover_ends": "{level} % CI: t for the mean, t with HC3 errors for the slope, "
    "MOVER for the limits; for other items like these, measured by the same raters.",
    "cluster_ends": "{level} % CI: leaving out one cluster at a time, with Student's "
    "t; for other clusters like these, measured by the same raters.",
    "limits_with_mean": "Limit: 1.96 √((k − 1)/k) SEM on either side of the mean of "
    "all k raters. MDC95: 1.96 √2 SEM.",
    "mean_ends": "{level} % CI: modified large sample; for other items and raters.",
    "exact_ends": "{level} % CI: exact (t, noncentral t), separately for each number. "
    "Both: tolerance factors for the two limits together. They generalise to other "
    "items like these, rated by the same raters.",
    # diagnosis
    "change": "Change: agreement without the rater minus agreement of all raters. If "
    "it is above 0, the others agree better without the rater.",
    "standard_error": "SE: item jackknife.",
    "agreement": "Agreement: how often another rater of the same item also chose a "
    "category that one rater chose.",
    "raters_ends": "{level} % CI: Student's t, separately for each rater. They "
    "generalise to other items, rated by these raters.",
    "pairs_ends": "{level} % CI: as for {title} of these two raters alone. They "
    "generalise to other items, rated by these raters.",
    "categories_ends": "{level} % CI: exact at the effective number of items. They "
    "generalise to other items, rated by these raters.",
    "confusion": "Columns: the share of these times in which the rater gave that "
    "grade.",
    "confusion_ends": "Intervals are in --json: exact at the effective number of "
    "items.",
    # judges
    "advantage": "Advantage: how often the judge is at least as close to the other "
    "humans as a human is, averaged over humans. Not worse: number of humans who are "
    "better by less than ε.",
    "worse": "p: tests whether the human is better by ε or more; {tests}. Not worse: "
    "at {level} % over all humans for each judge (Benjamini and Yekutieli).",
    "right": "Alone right: one of the two gives the grade of {reference} and the "
    "other does not. p: tests whether the judge is right less often by {epsilon:g} or "
    "more.",
    "judge_difference": "Difference: the first judge's advantage minus the second's "
    "on the same items; {level} % CI and p by the jackknife; p (Holm): adjusted for "
    "all pairs.",
    "classes": "Share of the items of a class to which the rater gave each grade. "
    "Right, low and high: {level} % credible interval of the share that got the grade "
    "of the class.",
    "worth": "The number of raters with independent errors that would be as "
    "informative, from the correlation of their errors against the reference; {level} "
    "% CI: item jackknife.",
    "labels": "Labels: {labels}. {level} % CI.",
    "position": "First gains: share of pairs won by the answer shown first minus the "
    "share won by the one shown second; {level} % CI by Tango's method, p by "
    "McNemar's exact test. Same: share of pairs with the same verdict in both orders, "
    "where a tie is a verdict. Without ties: the same for pairs without a tie.{ties}",
    "strengths": "Strength: log odds of winning against an average answer "
    "(Bradley-Terry); a tie counts as half a win. {level} % CI: variance between "
    "items, Student's t.",
    # comparisons
    **{
        f"difference_of_{units}": (
            f"Difference: the first minus the second. SE, {{level}} % CI and p: "
            f"{unit} jackknife, Student's t. They generalise to other {population} "
            "like these, graded by the same raters, whether or not the groups share "
            "raters."
        )
        for units, unit, population in (
            ("items", "item", "items"),
            ("clusters", "cluster", "clusters of items"),
        )
    },
    "holm": "p (Holm): adjusted for {n} pairs, separately for each coefficient.",
    "Fleiss' weighted χ²": "Fleiss' weighted χ²: for groups with different items, by "
    "their delta-method errors.",
    "Donner's goodness of fit": "Donner's goodness of fit: for two raters and two "
    "categories, with a κ common to all groups; it keeps its level in smaller groups.",
    "Hotelling's T² as F": "Hotelling's T² as F: for groups with the same items (by "
    "name) or the same clusters, by the delta method.",
}


def note(kind: str, **values: object) -> str:
    """Return a note of a kind; a level in it is given in percent."""
    if isinstance(level := values.get("level"), float):
        values["level"] = f"{100.0 * level:g}"
    if kind in _TEXTS:
        return _TEXTS[kind].format(**values)
    return Explanation(_EXPLANATIONS[kind].format(**values))


# ---- parts of a file ----


def part_names(file: "RatingsFile", part: "RatingsPart") -> dict[str, str]:
    """Return what tells a part from the others: names of columns, and what they say."""
    names = {}
    if part.group is not None:
        names[str(file.read["by"])] = part.group
    if part.session is not None and len({other.session for other in file.parts}) > 1:
        names[str(file.read["session"])] = part.session
    return names


def heads_of(*names: str) -> dict[str, str]:
    """Return columns with names of a file, by keys unlike all else in a CSV."""
    taken = {of.name for of in (*fields(Estimate), *fields(Interval))}
    taken |= {"title", "word", "words", "data"}
    return {f"group_{name}" if name in taken else name: name for name in names}


def parts_of(file: "RatingsFile") -> "Iterator[tuple[RatingsPart, str, Row]]":
    """Return every part, what it is called, and the same by keys."""
    for part in file.parts:
        names = part_names(file, part)
        keys = dict(zip(heads_of(*names), names.values(), strict=True))
        yield part, ": ".join(names.values()), keys


@contextmanager
def placed(start: str, place: str | None = "") -> Iterator[None]:
    """Say of a refusal which file or option it is of, and which part of the file."""
    try:
        yield
    except RatingsError as error:
        where = f"{start}: {place}" if place else start
        text = str(error).removeprefix("ratings: ")  # a parameter, and no option
        raise RatingsError(f"{where}: {text}") from error


# ---- estimates ----


def agreement(file: "RatingsFile", questions: Questions) -> Answer:
    """Return how well the raters of every part agree, every coefficient as a row."""
    by = ", ".join(part_names(file, file.parts[0]))
    heads = heads_of(by) if by else {}
    estimates = []
    for part, group, _ in parts_of(file):
        keys = dict.fromkeys(heads, group)
        of_part = replace(questions, clusters=part.clusters)
        for entry in entries(questions, file, [part]):
            is_counted = entry.formula is not None and not entry.has_interval
            ratings = part.counted if is_counted else part.ratings
            ratings = on_grades(ratings, entry, file)
            estimates.append(estimate_row(entry, ratings, keys, of_part))
    return Answer(
        name="agreement",
        heads=heads,
        of=Path(file.read["file"]).name,
        estimates=tuple(estimates),
    )


def entries(
    questions: Questions, file: "RatingsFile", parts: "Sequence[RatingsPart]"
) -> list["Coefficient"]:
    """Return the coefficients that are estimated, or refuse those that do not fit."""
    from masrel.agreement import COEFFICIENTS, coefficient

    is_of_others = not questions.takes_all and _OF_METRIC not in questions.names
    refuse(
        (
            questions.metric and is_of_others,
            f"--metric {questions.metric}: is for {_OF_METRIC}, which is not among "
            f"--coefficients {','.join(questions.names)}",
        )
    )
    n_raters = max(len(part.raters) for part in parts) or file.read["n_raters"]
    chosen = (
        COEFFICIENTS.values()
        if questions.takes_all
        else map(coefficient, questions.names)
    )
    fitting = [
        of.by_metric(questions.metric) if of.name == _OF_METRIC else of for of in chosen
    ]
    if questions.takes_all:
        return [
            entry
            for entry in fitting
            if entry.shape == "ratings"
            and not entry.by_name_only
            and n_raters <= (entry.n_raters[1] or n_raters)
            and (file.is_ordered or not entry.needs_order)
        ]
    for entry in fitting:
        refuse(
            (
                entry.shape == "pairs",
                f"--coefficients: {entry.name} needs each rater's grades of two "
                "sessions: add --session COL --retest",
            )
        )
        if entry.needs_order:
            check_order(file, entry.name)
    return fitting


def check_order(file: "RatingsFile", what: str) -> None:
    """Refuse what needs the order of grades, where it is the alphabet's alone."""
    refuse(
        (
            not file.is_ordered,
            f"{what}: needs grades that are numbers or --categories with every grade "
            f"in order, the grades found are text: {listed(file.scale.grades)}",
        )
    )


def on_grades(ratings: _Ratings, entry: "Coefficient", file: "RatingsFile") -> _Ratings:
    """Return ratings with the text of their grades if a metric takes sets of labels."""
    from masrel.agreement import CountedRatings

    if entry.metric not in ("jaccard", "masi"):
        return ratings
    grades = file.scale.grades
    if isinstance(ratings, CountedRatings) and ratings.coded is not None:
        return replace(
            ratings,
            categories=grades,
            source=replace(ratings.coded, categories=grades),
        )
    return replace(ratings, categories=grades)


def estimate_row(
    entry: "Coefficient",
    ratings: "CodedRatings | CountedRatings",
    keys: Mapping[str, str | None],
    questions: Questions,
) -> AgreementRow:
    """Return the row of a coefficient; of all that fit, some without an interval."""
    notes = []
    if questions.weights != questions.weights_of(entry) and not questions.takes_all:
        notes.append(
            f"computed with its metric, not with {questions.weights} weights"
            if entry.metric
            else "unweighted, because it has no weighted form"
        )
    try:
        estimate = _estimate(entry, ratings, questions, questions.level)
    except MasrelError as error:
        # not all that is usual has an error by SPSS, say
        is_by_program = questions.convention and questions.coefficients is None
        is_left_out = questions.takes_all or is_by_program or entry.formula is None
        if questions.target is None or not is_left_out:
            raise
        why = "none is available" if entry.formula is None else error
        notes.append(f"no interval: {why}")
        questions = replace(questions, target=None, convention=None)
        estimate = _estimate(entry, ratings, questions, questions.level)
    has_word = questions.words and entry.chance_corrected
    at_level = partial(_estimate, entry, ratings, questions)
    return AgreementRow(
        keys=keys,
        title=questions.title(entry),
        estimate=estimate,
        notes=tuple(notes),
        lower_bound=lower_bound(estimate, at_level) if has_word else None,
        convention=None if entry.has_interval else questions.convention,
    )


def lower_bound(
    estimate: Estimate, at_level: Callable[[float], Estimate]
) -> float | None:
    """Return what the true value reaches with 95 %, by the interval if there is one."""
    # at_level: the same estimate with an interval of another level; the lower end of an
    # interval leaves out half of what is outside, a bound all
    interval = estimate.interval
    if interval is None:
        return None
    level = _SURE if interval.is_one_sided else _SURE_TWO_SIDED
    if interval.reason is None and interval.level != level:
        interval = at_level(level).interval or interval
    return interval.low


def _estimate(
    entry: "Coefficient",
    ratings: "CodedRatings | CountedRatings",
    questions: Questions,
    level: float,
) -> Estimate:
    """Return the coefficient, with the interval that answers for the target."""
    weights = questions.weights_of(entry)
    # Unless it was named, one that comes with an interval has it, whatever its target.
    is_named = questions.coefficients is not None and not questions.takes_all
    is_done = entry.has_interval and not (is_named or questions.clusters)
    if questions.target is None or is_done:
        result = entry(
            ratings, categories=ratings.categories, weights=weights, level=level
        )
        # one that comes with the coefficient knows of no clusters
        if questions.clusters:
            result = replace(result, interval=None, standard_error=math.nan)
        return result
    ask: Any = {
        "target": questions.target,
        "categories": ratings.categories,
        "weights": weights,
        "level": level,
    }
    if questions.convention is not None:
        from masrel.intervals.analytic import _by_convention

        return _by_convention(entry, ratings, convention=questions.convention, **ask)
    from masrel.intervals.choose import estimate

    return estimate(
        entry,
        ratings,
        **ask,
        method=questions.interval,
        n_resamples=questions.n_resamples,
        rng=questions.seed,
        clusters=questions.clusters or None,
    )
