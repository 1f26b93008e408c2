"""Pictures of ratings: when each can be drawn, and from what.

In: the ratings of a part of a file, and what was answered of them. Out: drawings with
captions, for a page or for axes.
"""

import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from masrel._input import check_option
from masrel.agreement import (
    COEFFICIENTS,
    CodedRatings,
    Coefficient,
    RepeatedLimits,
    code_ratings,
    coefficient,
    contingency_table,
    count_ratings,
    item_disagreement,
    limits_of_agreement,
    variance_components,
)
from masrel.agreement._codes import item_counts
from masrel.agreement.krippendorff import _metric_weights
from masrel.analysis._file_estimates import (
    Answer,
    Questions,
    Row,
    on_grades,
    parts_of,
)
from masrel.errors import MasrelError, MasrelWarning, ParameterError
from masrel.estimates import Interval
from masrel.pages._sections import Drawing
from masrel.plots._drawn_values import FOREST, Drawn, ForestRow
from masrel.ratings import RatingsFile, RatingsPart
from masrel.tables._answer_tables import agreement_forest, is_in_units
from masrel.tables._tables import counted, interval_text, number, p_text, percent

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from masrel.intervals import Diagnosis

_MOST_GRADES = 20  # of which each has a place in a picture
_MOST_RATERS = 60
_MOST_RATINGS = 5_000_000  # that are laid out item by item
_SHOWN = 30  # items that raters disagree on most

_GRADES = "masrel.plots._grades"


@dataclass(kw_only=True)
class PartSeen:
    """The ratings of a part of a file, and what pictures show of them."""

    file: RatingsFile
    part: RatingsPart
    group: str  # what the part is called; nothing where it is all
    questions: Questions
    answers: Sequence[Answer]

    @cached_property
    def coded(self) -> CodedRatings | None:
        """The ratings item by item; None where it is unknown who gave which."""
        rows = self.part.counted
        n_ratings = int(rows.freq.sum()) * rows.codes.shape[1]
        if not rows.knows_raters or not 0 < n_ratings <= _MOST_RATINGS:
            return None
        return code_ratings(self.part.ratings)

    @property
    def raters(self) -> list[str]:
        """Their names, or else their places."""
        n_raters = 0 if self.coded is None else self.coded.codes.shape[1]
        return list(self.part.raters or map(str, range(1, n_raters + 1)))

    @property
    def is_measured(self) -> bool:
        """Whether grades are measurements, or as many numbers."""
        is_long = len(self.file.scale.grades) > _MOST_GRADES
        doubted = any(of.code == "measurements" for of in self.file.warnings)
        return self.file.is_ordered and (is_long or doubted)

    @property
    def has_few_grades(self) -> bool:
        """Whether each grade has room in a picture, and is not a measurement."""
        return 2 <= len(self.file.scale.grades) <= _MOST_GRADES and not self.is_measured

    @property
    def has_intervals(self) -> bool:
        """Whether independent items are what was sampled."""
        return self.questions.target is not None and not self.part.clusters

    @property
    def entry(self) -> Coefficient:
        """The first coefficient that allows for chance and is made of sums."""
        names = [row.estimate.coefficient for row in self.answers[0].estimates]
        of_all = [COEFFICIENTS[name] for name in names if name in COEFFICIENTS]
        fitting = (of for of in of_all if of.chance_corrected and of.formula)
        chosen = next(fitting, coefficient("fleiss_kappa"))
        is_alpha = chosen.name == "krippendorff_alpha"
        return chosen.by_metric(self.questions.metric) if is_alpha else chosen

    @cached_property
    def diagnosis(self) -> "Diagnosis | None":
        """Which raters, pairs and grades agree; None where nothing tells."""
        from masrel.intervals import diagnose

        for answer in self.answers:
            if answer.name == "diagnosis_pairs":
                return cast("Diagnosis", dict(answer.figure)[self.group])
        if self.coded is None or len(self.raters) > _MOST_RATERS:
            return None
        try:
            return diagnose(
                on_grades(self.coded, self.entry, self.file),
                coefficient=self.entry,
                target="items" if self.has_intervals else None,
                raters=self.raters,
                weights=self.questions.weights_of(self.entry),
                level=self.questions.level,
            )
        except MasrelError:  # these ratings have none, of one item say
            return None

    @property
    def distance(self) -> Any:
        """The weights by which ratings are apart; linear ones, if in order."""
        if (metric := self.questions.metric) is not None and self.coded is not None:
            ratings = on_grades(self.coded, self.entry, self.file)
            return _metric_weights(metric, count_ratings(ratings))
        if self.questions.weights == "identity" and self.file.is_ordered:
            return "linear"
        return self.questions.weights

    @cached_property
    def disagreement(self) -> "NDArray[np.float64]":
        """How far the ratings of each item are apart, (n_items,)."""
        # items of counts are none that one could discuss
        # and of repeats every item is there several times
        if (
            self.coded is None
            or self.questions.truth
            or not (self.part.items or self.coded is self.part.ratings)
        ):
            return np.zeros(0)
        ratings = on_grades(self.coded, self.entry, self.file)
        return item_disagreement(ratings, weights=self.distance)

    @property
    def disputed(self) -> "NDArray[np.intp]":
        """Items that raters disagree on, most first."""
        order = np.argsort(-np.nan_to_num(self.disagreement), kind="stable")[:_SHOWN]
        return order[self.disagreement[order] > 0.0]

    def how_many(self, n: int) -> str:
        """Return which items are shown, of all that raters disagree on."""
        n_all = int((self.disagreement > 0.0).sum())
        which = f"{n} of {n_all}" if n < n_all else str(n)
        noun = "item" if n_all == 1 else "items"
        return f"{which} {noun} that raters disagree on, most disagreement first"

    @property
    def items(self) -> list[str]:
        """What the items are called, or else their places."""
        return list(self.part.items or map(str, range(1, self.disagreement.size + 1)))

    def drawing(
        self, name: str, builder: str, arguments: tuple[object, ...], caption: str,
        alt: str = "",
    ) -> Drawing:  # fmt: skip
        """Return a drawing that names its part."""
        of_part = f"{self.group}: " if self.group else ""
        return Drawing(
            name=name,
            caption=of_part + caption,
            alt=of_part + (alt or caption),
            content=Drawn(builder, arguments),
            stamp="",
        )


_DRAWERS = {
    "diagnosis_pairs": "masrel.plots._rater_pairs:pairs_pictures",
    **dict.fromkeys(
        (
            *("limits_of_agreement", "limits_with_repeats", "limits_that_follow"),
            *("limits_of_ratios", "limits_with_mean"),
        ),
        "masrel.plots._limits_figure:limits_pictures",
    ),
}


class _Forest(NamedTuple):
    """How rows of an answer about judges are drawn beside each other."""

    label: str  # key of what a row is called
    value: str  # key of the number; its ends begin with it, or have no more to them
    axis: str
    caption: str
    margin: float = 0.0  # where ε is marked, as a multiple of it


_FORESTS = {
    "humans": _Forest(
        "human",
        "difference",
        "human's share minus the judge's",
        "How much more often than the judge each human is at least as close to the "
        "other humans, with {level} % confidence intervals (Tango). If the interval "
        "excludes ε = {epsilon:g}, the judge is not worse.",
        1.0,
    ),
    "judge_reference": _Forest(
        "human",
        "difference",
        "judge's share of correct grades minus the human's",
        "How much more often than the human the judge gives the grade of {reference}, "
        "with {level} % confidence intervals (Tango). If the interval excludes ε = "
        "{epsilon:g} in favour of the human, the judge is not worse.",
        -1.0,
    ),
    "rates": _Forest(
        "name",
        "value",
        "share of items with the grade {grade}",
        "How often {grade} is right, by the judge alone, corrected for its errors in "
        "two ways, and by labels alone, with {level} % confidence intervals.",
    ),
    "strengths": _Forest(
        "model",
        "value",
        "strength: log odds of winning against an average answer",
        "Which answer each judge prefers (Bradley-Terry), with {level} % confidence "
        "intervals.",
    ),
}


def judge_drawings(answers: Sequence[Answer], level: float) -> Iterator[Drawing]:
    """Return each human beside a judge, rates, strengths; nothing where none is."""
    by_name = {answer.name: answer.shown or [] for answer in answers}
    for name, forest in _FORESTS.items():
        if rows := by_name.get(name):
            of = (
                (by_name.get("judges") or rows)[0] | rows[0] | {"level": percent(level)}
            )
            yield _judge_drawing(name, forest, rows, of, level)

    if rows := by_name.get("truth_confusion"):
        grades = [row["class"] for row in by_name["truth"] or ()]
        counts: dict[str, list[Any]] = {}
        for row in rows:
            expected = [row["n"] * row["shares"][grade] for grade in grades]
            counts.setdefault(f"{row['group']} {row['rater']}".strip(), []).append(
                expected
            )
        text = (
            "Expected share of each grade that each rater gives to items of each class."
        )
        yield Drawing(
            name="confusions",
            caption=text,
            alt=text,
            content=Drawn(f"{_GRADES}:confusions_pictures", (counts, grades)),
            stamp="",
        )


def _forest_row(row: Row, forest: _Forest, level: float) -> ForestRow:
    key = forest.value
    start = f"{key}_" if f"{key}_low" in row else ""
    numbers = (row.get(of) for of in (key, f"{start}low", f"{start}high"))
    value, low, high = (math.nan if x is None else x for x in numbers)
    ends, text = None, number(value, 3)
    if math.isfinite(low) and math.isfinite(high):
        text += f" {interval_text(low, high)}"
        ends = Interval(
            low=low, high=high, level=level, kind="confidence", method="",
            target="items",
        )  # fmt: skip
    return ForestRow(
        label=row[forest.label],
        detail=f"p {p_text(row['p_value'])}" if "p_value" in row else "",
        value=value if math.isfinite(value) else None,
        interval=ends,
        text=text,
        has_zero="p_value" in row,
        group=": ".join(filter(None, (row["group"], row["judge"]))),
    )


def _judge_drawing(
    name: str, forest: _Forest, shown: Sequence[Row], of: Row, level: float
) -> Drawing:
    rows = [_forest_row(row, forest, level) for row in shown]
    ends, right, mark = [row.interval.high for row in rows if row.interval], 1.03, None
    if forest.margin:
        at = forest.margin * of["epsilon"]
        mark = at, f"ε = {of['epsilon']:g}: limit of what is acceptable"
        right = max(*(ends or [1.0]), at) + 0.05
    elif name == "strengths":
        right = max(ends or [1.0]) * 1.05
    texts = "; ".join(f"{row.label} ({row.group}): {row.text}" for row in rows)
    caption = forest.caption.format(**of)
    return Drawing(
        name=name,
        caption=caption,
        alt=f"{caption} {texts}.",
        content=Drawn(FOREST, (rows, forest.axis.format(**of), right, mark)),
        stamp="",
    )


def main_picture(answers: Sequence[Answer], questions: Questions) -> Drawn:
    """Return the picture of an answer, of every part, else of the estimates."""
    for answer in answers:
        if answer.figure:
            return Drawn(_DRAWERS[answer.name], (answer.figure, answer.of))
    for drawing in judge_drawings(answers, questions.level):
        return drawing.content
    shown = answers[:1] if answers[0].name == "agreement" else answers
    rows = [row for answer in shown for row in answer.estimates]
    return agreement_forest(rows, questions.target or "items")


def forest_drawing(answers: Sequence[Answer], questions: Questions) -> Drawing | None:
    """Return the estimates and their intervals; None where none is on that axis."""
    every = [row for answer in answers for row in answer.estimates]
    if not (rows := [row for row in every if not is_in_units(row)]):
        return None
    intervals = (row.estimate.interval for row in rows)
    ends = [of for of in intervals if of is not None and of.reason is None]
    dots = f"Estimates (dots){' and their intervals' if ends else ''}."
    texts = "; ".join(
        f"{row.title}{f' ({row.group})' if row.group else ''}: "
        f"{number(row.estimate.value, 3)}"
        for row in rows
    )
    return Drawing(
        name="forest",
        caption=dots,
        alt=f"{dots} {texts}.",
        content=agreement_forest(rows, questions.target or "items"),
        stamp="",
    )


def _pairs(seen: PartSeen) -> Drawing | None:
    # limits are of measurements, which hardly ever agree
    of = None if seen.questions.command == "limits" else seen.diagnosis
    if of is None or len(of.raters) < 3 or not np.isfinite(of.pair_values).any():
        return None
    title = seen.questions.title(seen.entry)
    name = title + "," * (", " in title)
    i, j = np.unravel_index(np.nanargmin(of.pair_values), of.pair_values.shape)
    least = number(float(of.pair_values[i, j]), 3)
    panel = (
        "; beside it the change without each rater"
        if np.isfinite(of.changes).any()
        else ""
    )
    ends = (
        f", with {percent(of.level)} % confidence intervals"
        if np.isfinite(of.change_low).any()
        else ""
    )
    return seen.drawing(
        "pairs",
        "masrel.plots._rater_pairs:pairs_picture",
        (of, name),
        f"{name} of every two raters{panel}{ends}.",
        f"{name} of every two of {counted(len(of.raters), 'rater')}: from {least} "
        f"({of.raters[i]} and {of.raters[j]}) to "
        f"{number(float(np.nanmax(of.pair_values)), 3)}.",
    )


def _confusion(seen: PartSeen) -> Drawing | None:
    raters, of = seen.raters, seen.diagnosis
    if seen.coded is None or not seen.has_few_grades:
        return None
    if of is not None and of.reference is not None:
        table = of.confusion.sum(axis=0)
        names = of.reference, raters[0] if len(raters) == 1 else "the other raters"
    elif len(raters) == 2:
        table, names = contingency_table(seen.coded), (raters[0], raters[1])
    else:
        return None
    grades = seen.file.scale.grades
    same, n = int(np.trace(table)), int(table.sum())
    title = f"Grades of {names[1]} by those of {names[0]}"
    return seen.drawing(
        "confusion",
        f"{_GRADES}:confusion_picture",
        (table, grades, names, seen.file.is_ordered),
        f"{title}: number of times that each pair was given, shaded by its share of "
        "the row. Frames mark the same grade.",
        f"{title}: {same} of {n} pairs are the same grade.",
    )


def _grades(seen: PartSeen) -> Drawing | None:
    if seen.coded is None or not seen.has_few_grades or len(seen.raters) > _MOST_RATERS:
        return None
    grades = seen.file.scale.grades
    counts = item_counts(seen.coded.codes.T, len(grades))
    return seen.drawing(
        "grades",
        f"{_GRADES}:grades_picture",
        (counts, seen.raters, grades, seen.file.is_ordered),
        "Use of each grade: its share of each rater's ratings.",
    )


def _categories(seen: PartSeen) -> Drawing | None:
    of, grades = seen.diagnosis, seen.file.scale.grades
    if of is None or not seen.has_few_grades or len(of.category_values) != len(grades):
        return None
    ends = (of.category_low, of.category_high)
    level = f" ({percent(of.level)} % confidence interval)"
    return seen.drawing(
        "categories",
        f"{_GRADES}:categories_picture",
        (of.category_values, *ends, of.category_counts, grades, of.level),
        "Agreement on each grade: of the ratings with this grade, the share that "
        "another rater of the item "
        f"matched{level if np.isfinite(ends[0]).any() else ''}.",
    )


def _bland_altman(seen: PartSeen) -> Drawing | None:
    for answer in seen.answers:
        if answer.name.startswith("limits"):
            raters, result = dict(answer.figure)[seen.group]
            break
    else:
        if seen.coded is None or not seen.is_measured or len(seen.raters) != 2:
            return None
        raters = seen.raters
        result = limits_of_agreement(seen.coded, level=seen.questions.level)
    return seen.drawing(
        "bland_altman",
        "masrel.plots._limits_figure:limits_pictures",
        ([("", (raters, result))], seen.questions.unit or ""),
        f"{' and '.join(raters)} against their mean: the differences, and the limits "
        "between which 95 % of single measurements are expected."
        if len(raters) > 2 or isinstance(result, RepeatedLimits)
        else (
            f"Difference between {raters[0]} and {raters[1]} against their mean, with "
            "the mean difference and the limits between which 95 % of differences are "
            "expected."
        ),
    )


def _components(seen: PartSeen) -> Drawing | None:
    names = [row.estimate.coefficient for of in seen.answers for row in of.estimates]
    if seen.coded is None or not any(name.startswith("icc") for name in names):
        return None
    return seen.drawing(
        "components",
        "masrel.plots._rater_pairs:components_picture",
        (variance_components(seen.coded),),
        "Shares of the variance of a rating: between items, between raters, and the "
        "rest.",
    )


def _items(seen: PartSeen) -> Drawing | None:
    if seen.coded is None or seen.disputed.size == 0 or len(seen.raters) > _MOST_RATERS:
        return None
    shown, scale = seen.disputed, seen.file.scale
    return seen.drawing(
        "items",
        f"{_GRADES}:items_picture",
        (
            seen.coded.codes[shown],
            [seen.items[place] for place in shown],
            seen.raters,
            scale.grades,
            seen.file.is_ordered,
            np.array(scale.values, dtype=np.float64),
        ),
        f"Ratings of {seen.how_many(len(shown))}.",
    )


PICTURES: dict[str, tuple[str, Callable[[PartSeen], Drawing | None]]] = {
    "pairs": ("raters", _pairs),
    "confusion": ("raters", _confusion),
    "bland_altman": ("raters", _bland_altman),
    "grades": ("grades", _grades),
    "categories": ("grades", _categories),
    "items": ("items", _items),
    "components": ("variance", _components),
}
"""Pictures by name: the section of a page that has them, and what makes them."""


def parts_seen(
    file: RatingsFile, questions: Questions, answers: Sequence[Answer]
) -> list[PartSeen]:
    """Return every part of the ratings, as pictures see it."""
    return [
        PartSeen(
            file=file, part=part, group=group, questions=questions, answers=answers
        )
        for part, group, _ in parts_of(file)
    ]


def picture_of(
    name: str,
    file: RatingsFile,
    questions: Questions,
    answers: Sequence[Answer],
    *,
    group: str = "",
) -> Drawn:
    """Return a picture by its name, or refuse one that these ratings have not."""
    check_option("picture", name, ("forest", *PICTURES))
    if name == "forest":
        drawing = forest_drawing(answers, questions)
    else:
        parts = {seen.group: seen for seen in parts_seen(file, questions, answers)}
        if group:
            check_option("group", group, parts)
        with warnings.catch_warnings(action="ignore", category=MasrelWarning):
            drawing = PICTURES[name][1](parts[group or next(iter(parts))])
    if drawing is None:
        raise ParameterError(
            f"picture: {name!r} is not available for these ratings; {_NEEDS[name]}"
        )
    return drawing.content


# What the ratings of each picture must have
_NEEDS = {
    "forest": "it shows coefficients of agreement",
    "pairs": "it needs three raters or more",
    "confusion": "it needs two raters, or Reading(reference=…), and 2 to 20 grades",
    "bland_altman": "it needs measurements of two raters",
    "grades": "it needs ratings that show who rated what, and 2 to 20 grades",
    "categories": "it needs ratings that show who rated what, and 2 to 20 grades",
    "items": "it needs items that raters disagree on",
    "components": "it needs an ICC among the coefficients, and ratings that show who "
    "rated what",
}
