"""Estimates of any file of ratings: which coefficients, with which interval and bound.

In: a part of the file, and how estimates are made. Out: a row for every coefficient.
"""

import math
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from masrel.errors import MasrelError, MasrelWarning, ParameterError
from masrel.estimates import Estimate, Interval, Target

if TYPE_CHECKING:
    from masrel.agreement import (
        BandScale,
        CodedRatings,
        Coefficient,
        CountedRatings,
        Metric,
        WeightName,
    )
    from masrel.ratings import RatingsPart
    from masrel.scales import Scale

_Ratings = TypeVar("_Ratings", bound="CodedRatings | CountedRatings")

USUAL = ("percent_agreement", "fleiss_kappa")
"""The coefficients that are estimated where none are named."""

OF_MEASUREMENTS = ("icc_a1", "lin_ccc")
"""The same where limits of agreement show that grades are measurements."""

_OF_METRIC = "krippendorff_alpha"
"""The coefficient that has metrics."""

_SURE = 0.95  # probability with which the true value reaches the word for it
_SURE_TWO_SIDED = 0.90  # the level of which the lower end alone is as sure


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimateOptions:
    """What is estimated of every part of the ratings."""

    coefficients: list[str] | None  # names, or "all" alone; None for `usual`
    weights: "WeightName"  # for coefficients that take any; checked where they are made
    target: Target | None  # what a new study would draw anew; no interval when None
    interval: Literal["auto", "analytic", "jackknife", "bootstrap", "posterior"]
    level: float
    # n_resamples, seed: for intervals that draw
    n_resamples: int
    seed: int
    words: "BandScale | None"  # whose words for values
    metric: "Metric | None" = None  # of Krippendorff's alpha
    clusters: tuple[str, ...] = ()  # that of every item of the part, if items have any
    usual: tuple[str, ...] = USUAL  # estimated where none are named

    @property
    def takes_all(self) -> bool:
        """Whether all coefficients are estimated that fit."""
        return self.coefficients == ["all"]

    @property
    def are_named(self) -> bool:
        """Whether the coefficients were named one by one."""
        return self.coefficients is not None and not self.takes_all

    @property
    def names(self) -> list[str]:
        """The coefficients that are named, or the usual ones."""
        if self.coefficients is not None:
            return self.coefficients
        return list(self.usual) if self.metric is None else [_OF_METRIC]

    def by_metric(self, entry: "Coefficient") -> "Coefficient":
        """Return the coefficient by the metric that was chosen, if it has metrics."""
        return entry.by_metric(self.metric) if entry.name == _OF_METRIC else entry

    def weights_of(self, entry: "Coefficient") -> "WeightName":
        """Return the weights, of a coefficient that takes any."""
        return self.weights if entry.weighted else "identity"

    def title(self, entry: "Coefficient") -> str:
        """Return what a coefficient is called with its weights."""
        weights = self.weights_of(entry)
        return entry.title if weights == "identity" else f"{entry.title}, {weights}"

    def record(self) -> dict[str, object]:
        """Return every option that decides a number."""
        by_metric = {} if self.metric is None else {"metric": self.metric}
        return {
            "coefficients": self.names,
            "weights": self.weights,
            "target": self.target,
            "interval": self.interval,
            "level": self.level,
            "resamples": self.n_resamples,
            "seed": self.seed,
            "words": self.words,
            **by_metric,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class AgreementRow:
    """One estimate, and what to say of it that is not in it."""

    # group, title: of what (such as a session), and which coefficient
    group: str
    title: str
    estimate: Estimate
    # what it lacks of what was requested, and what was assumed
    notes: tuple[str, ...] = ()
    # what the true value reaches with 95 % by its interval; None if there is none, or
    # no word is to be named
    lower_bound: float | None = None


@dataclass(frozen=True, slots=True)
class Note:
    """What a reader must know of a table, as data; `masrel.tables` has the words."""

    kind: str
    values: Mapping[str, object] = field(default_factory=dict)


Row = dict[str, Any]
"""Values by name; ``nan`` and infinities are null in JSON."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What a question gives."""

    name: str  # in the JSON, and of the table
    rows: list[Row]  # of the JSON
    shown: list[Row] | None = None  # rows of the table, where they are others
    # what tells parts apart: a key of the table's rows, and what it is called
    heads: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[Note, ...] = ()
    of: str = ""  # what the caption says it is of
    grades: tuple[str, ...] = ()  # that have a column each
    has_reference: bool = False  # whether a rater is held against another
    is_single: bool = False  # whether there is nothing that p is adjusted for
    # estimates, of which `rows` has what tells them apart
    estimates: "Sequence[AgreementRow]" = ()
    # what a figure shows of each part: its name, and its result
    figure: tuple[tuple[str, Any], ...] = ()


def group_key(by: str) -> str:
    """Return what groups are called in a CSV and a record, unlike all else there."""
    fields = set(Estimate.__dataclass_fields__) | set(Interval.__dataclass_fields__)
    return f"group_{by}" if by in fields | {"title", "word", "words", "data"} else by


def estimate_rows(
    part: "RatingsPart",
    *,
    group: str,
    n_raters: int,
    scale: "Scale",
    is_ordered: bool,
    options: EstimateOptions,
) -> "list[AgreementRow]":
    """Estimate one part of the ratings, every coefficient as a row."""
    # is_ordered: whether the order of the grades is more than the alphabet's
    rows, refused = [], []
    of_part = replace(options, clusters=part.clusters)
    with warnings.catch_warnings():
        # Every note is in the result, and so below the table or in the JSON.
        warnings.simplefilter("ignore", MasrelWarning)
        for entry in entries(options, n_raters, scale, is_ordered):
            ratings = part.ratings if entry.formula is None else part.counted
            ratings = on_grades(ratings, entry, scale)
            row, refusal = estimate_row(entry, ratings, group, of_part)
            rows.append(row)
            refused += [] if refusal is None else [refusal]
    if not options.takes_all and refused and len(refused) == len(rows):
        raise refused[0]
    return rows


def on_grades(ratings: _Ratings, entry: "Coefficient", scale: "Scale") -> _Ratings:
    """Return ratings with the text of their grades if a metric takes sets of labels."""
    from masrel.agreement import CodedRatings

    if entry.metric not in ("jaccard", "masi"):
        return ratings
    if isinstance(ratings, CodedRatings):
        return replace(ratings, categories=scale.grades)
    coded = ratings.coded
    if coded is not None:
        coded = replace(coded, categories=scale.grades)
    return replace(ratings, categories=scale.grades, source=coded)


def estimate_row(
    entry: "Coefficient",
    ratings: "CodedRatings | CountedRatings",
    group: str,
    options: EstimateOptions,
) -> "tuple[AgreementRow, MasrelError | None]":
    """Return the row of a coefficient, and why it has no interval if it should."""
    notes, refusal = [], None
    is_unweighted = options.weights != options.weights_of(entry)
    if is_unweighted and not options.takes_all:
        by_metric = f"by its metric, without {options.weights} weights"
        unweighted = "unweighted, there are no weights for it"
        notes.append(by_metric if entry.metric else unweighted)
    has_target = options.target is not None
    try:
        estimate = _estimate(entry, ratings, options, options.level, has_target)
    except MasrelError as error:
        if not has_target or options.are_named:
            raise  # each of them must have the interval
        none = (
            "it is no function of sums over items" if entry.formula is None else error
        )
        notes.append(f"no interval: {none}")
        refusal, has_target = error, False
        estimate = _estimate(entry, ratings, options, options.level, has_target)
    bound = None
    if options.words and entry.chance_corrected:
        bound = _surely_reached(
            estimate.interval,
            lambda level: (
                _estimate(entry, ratings, options, level, has_target).interval
            ),
        )
    row = AgreementRow(
        group=group,
        title=options.title(entry),
        estimate=estimate,
        notes=tuple(notes),
        lower_bound=bound,
    )
    return row, refusal


def category_rows(
    part: "RatingsPart", names: Iterable[str], scale: "Scale", options: EstimateOptions
) -> "list[AgreementRow]":
    """Estimate how well raters tell each category of a part from all others."""
    # names: what tells the part from others
    head = tuple(names)
    return [
        _category_row(part, place, ": ".join((*head, grade)), scale, options)
        for place, grade in enumerate(scale.grades)
    ]


def _category_row(
    part: "RatingsPart",
    place: int,
    group: str,
    scale: "Scale",
    options: EstimateOptions,
) -> AgreementRow:
    from masrel.agreement import category_kappa, coefficient

    estimate = category_kappa(part.counted, scale.values[place])
    row = AgreementRow(group=group, title="Fleiss' κ, category", estimate=estimate)
    if options.target is not None and estimate.reason is None:
        # that of Fleiss' kappa of the two categories that the scale is folded to
        folded = _folded(part, place)
        if folded is None:
            none = "no interval: counts do not say who rated what"
            row = replace(row, notes=(none,))
        else:
            plain = replace(options, coefficients=None, weights="identity")
            of, _ = estimate_row(coefficient("fleiss_kappa"), folded, group, plain)
            row = replace(of, title=row.title)
            estimate = replace(estimate, interval=of.estimate.interval)
    return replace(row, estimate=replace(estimate, weights=scale.grades[place]))


def _folded(part: "RatingsPart", place: int) -> "CodedRatings | None":
    """Return the ratings on a scale of one category and the rest."""
    import numpy as np

    from masrel.agreement import CodedRatings

    if not part.counted.knows_raters:
        return None
    coded = part.counted.coded
    codes = np.where(coded.codes < 0, -1, coded.codes != place)
    return CodedRatings(codes=codes, categories=("this", "other"))


def _estimate(
    entry: "Coefficient",
    ratings: "CodedRatings | CountedRatings",
    options: EstimateOptions,
    level: float,
    has_target: bool,
) -> Estimate:
    """Return the coefficient, with the interval that answers for the target."""
    weights = options.weights_of(entry)
    # Unless it was named, one that comes with an interval has it, whatever its target.
    is_done = entry.has_interval and not (options.are_named or options.clusters)
    if options.target is None or not has_target or is_done:
        result = entry(
            ratings, categories=ratings.categories, weights=weights, level=level
        )
        # one that comes with the coefficient knows of no clusters
        return replace(result, interval=None) if options.clusters else result
    from masrel import intervals

    return intervals.estimate(
        entry,
        ratings,
        target=options.target,
        method=options.interval,
        categories=ratings.categories,
        weights=weights,
        level=level,
        n_resamples=options.n_resamples,
        rng=options.seed,
        clusters=options.clusters or None,
    )


def check_order(options: EstimateOptions, scale: "Scale", is_ordered: bool) -> None:
    """Refuse weights of grades without an order."""
    if options.weights != "identity" and not is_ordered:
        raise ParameterError(
            f"--weights {options.weights}: needs --categories with every grade of the "
            f"scale in order, the grades met are text: {', '.join(scale.grades)}"
        )


def entries(
    options: EstimateOptions, n_raters: int, scale: "Scale", is_ordered: bool
) -> list["Coefficient"]:
    """Return the coefficients that are estimated, or refuse those that do not fit."""
    from masrel.agreement import COEFFICIENTS, coefficient

    check_order(options, scale, is_ordered)
    if options.takes_all:
        return [
            entry
            for entry in map(options.by_metric, COEFFICIENTS.values())
            if entry.shape == "ratings"
            and not entry.by_name_only
            and n_raters <= (entry.n_raters[1] or n_raters)
            and (is_ordered or not entry.needs_order)
        ]
    if options.metric is not None and _OF_METRIC not in options.names:
        raise ParameterError(
            f"--metric {options.metric}: is of {_OF_METRIC}, which is not among "
            f"--coefficients {','.join(options.names)}"
        )
    chosen = [options.by_metric(coefficient(name)) for name in options.names]
    for entry in chosen:
        if entry.shape == "pairs":
            raise ParameterError(
                f"--coefficients: {entry.name} takes each rater's grades of two "
                "sessions: --session COL --retest computes it"
            )
        if entry.needs_order and not is_ordered:
            raise ParameterError(
                f"{entry.name}: needs grades that are numbers or --categories with "
                "every grade in order, the grades met are text: "
                f"{', '.join(scale.grades)}"
            )
    return chosen


def _surely_reached(
    interval: Interval | None, at_level: Callable[[float], Interval | None]
) -> float | None:
    """Return what the true value reaches with 95 %; None without an interval."""
    # at_level: the same interval at another level
    if interval is None:
        return None
    if interval.reason is not None:
        return math.nan
    # the lower end of an interval leaves out half of what is outside, a bound all
    level = _SURE if interval.is_one_sided else _SURE_TWO_SIDED
    other = interval if level == interval.level else at_level(level)
    return math.nan if other is None else other.low
