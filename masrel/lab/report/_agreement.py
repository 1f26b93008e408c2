"""Sections `agreement`, `test-retest` and `categories`: what raters agree on.

The first table of coefficients is short, and has every field in the CSV.
"""

import dataclasses
import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby

import numpy as np

from masrel.agreement import COEFFICIENTS, BandScale, category_kappa, code_ratings
from masrel.analysis._file_estimates import AgreementRow, lower_bound
from masrel.errors import MasrelWarning
from masrel.estimates import Estimate, Interval
from masrel.intervals.diagnosis import _category_arrays
from masrel.lab.analysis import PlannedEstimate
from masrel.lab.analysis._plan import with_level
from masrel.lab.protocol import EstimatePlan
from masrel.lab.ratings import Ratings, rating_matrix
from masrel.lab.report._material import (
    INTERVAL,
    MANY_RATERS,
    NOT_THERE,
    SUPPLEMENT,
    TARGETS,
    Material,
    are_too_few,
    at_ranks,
    coefficient_name,
    estimate_titles,
    interval_cells,
    interval_name,
    lacking,
    main_estimate,
    meaning,
    too_few,
)
from masrel.pages._sections import Content, Drawing, Paragraph
from masrel.plots._drawn_values import FOREST, Drawn, ForestRow
from masrel.tables._answer_tables import word_of, words_note
from masrel.tables._estimate_words import forest_row
from masrel.tables._tables import (
    Column,
    Table,
    Value,
    counted,
    interval_text,
    number,
    percent,
    table_of,
)

_AGREEMENTS = (
    "p_o: observed agreement; p_e: agreement expected by chance, 0 where the "
    "coefficient takes none off."
)

_BANDS: BandScale = "landis_koch"

_COLUMNS = (
    Column(key="id", heading="Id", where="csv"),
    Column(key="title", heading="Estimate", align="left"),
    Column(key="value", heading="Value", digits=3),
    Column(key="interval_shown", heading="Interval", where="page"),
    Column(key="low", heading="Low", where="csv"),
    Column(key="high", heading="High", where="csv"),
    Column(key="n_items", heading="Models"),
    Column(key="n_raters", heading="Raters"),
    Column(key="interval", heading="Method", align="left"),
    Column(key="target", heading="Generalises to", align="left"),
    Column(key="coefficient", heading="Coefficient", where="csv"),
    Column(key="models", heading="Models", where="csv"),
    Column(key="sessions", heading="Session", align="left"),
    Column(key="strength", heading="At least", align="left"),
    Column(key="observed", heading="p_o", digits=3),
    Column(key="chance", heading="p_e", digits=3),
    Column(key="reason", heading="Reason", where="csv"),
)
_SHORT = ("title", "value", "interval_shown", "n_items", "n_raters")


def estimates_section(material: Material) -> Iterator[Content]:
    """Show the plan's estimates with their intervals, or why one is not there."""
    rows = [
        row for row in _rows(material, material.analysis.estimates) if not row.rater
    ]
    if not rows:
        return
    table = _estimate_table(material, rows, rows, "agreement", "Estimates of agreement")
    short = tuple(
        column if column.key in _SHORT else dataclasses.replace(column, where="csv")
        for column in _COLUMNS
    )
    notes = tuple(_short_notes(rows, material.analysis.level))
    yield dataclasses.replace(table, columns=short, notes=notes)
    yield _forest(material, rows, "agreement", "Agreement")
    yield SUPPLEMENT
    yield dataclasses.replace(table, caption=f"{table.caption}, and how each was made")
    yield from _meanings(rows)


def retest_section(material: Material) -> Iterator[Content]:
    """Show the agreement of raters with themselves: of all, and of each alone."""
    planned = [p for p in material.analysis.estimates if p.line.kind == "test-retest"]
    if every := [row for row in _rows(material, planned) if row.estimate is not None]:
        name, caption = "test_retest", "Agreement of raters with themselves"
        rows = _few_of_many(every)
        yield _forest(material, rows, name, caption)
        yield SUPPLEMENT
        yield _estimate_table(material, every, rows, name, caption)
        yield from _meanings(rows)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Row:
    """One row of a table or a forest: an estimate, or why there is none."""

    line: EstimatePlan
    title: str  # of the line
    rater: str  # whose agreement with him- or herself it is; "" of all
    coefficient: str
    estimate: Estimate | None
    instead: str  # what is shown where there is none
    reason: str | None  # why there is none
    earned: AgreementRow | None  # what the best word that it reaches is known from

    @property
    def label(self) -> str:
        """What it is called in a table."""
        return f"{self.title}: {self.rater}" if self.rater else self.title

    @property
    def interval(self) -> Interval | None:
        """The interval of the estimate."""
        return None if self.estimate is None else self.estimate.interval


def _rows(material: Material, planned: Sequence[PlannedEstimate]) -> Iterator[_Row]:
    # each line of the plan, followed by those of its raters
    titles = estimate_titles([p.line for p in material.analysis.estimates])
    for entry in planned:
        for nth, (rater, coefficient, estimate) in enumerate(_estimates(entry)):
            yield _Row(
                line=entry.line,
                title=titles[entry.line.id],
                rater=rater,
                coefficient=coefficient_name(coefficient, entry.line.weights),
                estimate=estimate,
                instead="of each rater" if entry.by_rater else NOT_THERE,
                reason=entry.reason,
                earned=_earned(material, entry, nth, estimate),
            )


def _estimates(entry: PlannedEstimate) -> list[tuple[str, str, Estimate | None]]:
    # rater, coefficient and estimate: of all raters, then of each alone
    return [("", entry.line.coefficient, entry.estimate)] + [
        (each.rater, each.estimate.coefficient, each.estimate)
        for each in entry.by_rater
    ]


def _earned(
    material: Material, entry: PlannedEstimate, nth: int, estimate: Estimate | None
) -> AgreementRow | None:
    if estimate is None:
        return None

    def at_level(level: float) -> Estimate:
        ratings = material.ratings.without(material.analysis.excluded)
        again = with_level(entry, material.protocol, ratings, level)
        return _estimates(again)[nth][2] or estimate

    is_raw = not COEFFICIENTS[estimate.coefficient].chance_corrected
    bound = None if is_raw else lower_bound(estimate, at_level)
    title = coefficient_name(estimate.coefficient)
    return AgreementRow(keys={}, title=title, estimate=estimate, lower_bound=bound)


def _few_of_many(rows: Sequence[_Row]) -> list[_Row]:
    # five raters of each line of the plan that has too many to look at
    shown: list[_Row] = []
    for _, group in groupby(rows, key=lambda row: (row.title, row.rater == "")):
        alike = list(group)
        if len(alike) > MANY_RATERS:
            values = [row.estimate.value if row.estimate else math.nan for row in alike]
            alike = [
                dataclasses.replace(alike[at], rater=f"{alike[at].rater} ({rank})")
                for rank, at in at_ranks(values).items()
            ]
        shown += alike
    return shown


def _short_notes(rows: Sequence[_Row], level: float) -> Iterator[str]:
    # at most three: the supplement says the rest
    intervals = [row.interval for row in rows if row.interval is not None]
    kinds = sorted({f"{of.kind} for {TARGETS[of.target]}" for of in intervals})
    if kinds:
        yield (
            f"Intervals of {percent(level)} %: {', '.join(kinds)}. How each was made, "
            "and what to know of it, is in the supplement, Estimates in full."
        )
    absent = (row.reason for row in rows if row.instead == NOT_THERE)
    undefined = (row.estimate.reason for row in rows if row.estimate)
    for what, reasons in (("Not in these data", absent), ("Undefined", undefined)):
        if texts := [*dict.fromkeys(filter(None, reasons))]:
            yield f"{what}: {'; '.join(texts)}."


def _meanings(rows: Sequence[_Row]) -> Iterator[Paragraph]:
    intervals = [row.interval for row in rows if row.interval is not None]
    for text in dict.fromkeys(map(meaning, intervals)):
        yield Paragraph(text=text)


def _estimate_table(
    material: Material,
    every: Sequence[_Row],
    rows: Sequence[_Row],
    name: str,
    caption: str,
) -> Table:
    # rows: those of a page; the file has every one
    remarks: dict[str, list[str]] = {}  # a text to the rows it is of
    for row in rows:
        # what a reader must know before relying on it
        texts = [row.reason, None if row.estimate is None else row.estimate.reason]
        if (interval := row.interval) is not None:
            if interval.median is not None:
                texts.append(f"posterior median {number(interval.median, 3)}")
            texts += [*interval.notes, interval.reason]
            if interval.n_undefined:
                texts.append(f"undefined on {interval.n_undefined} resamples")
        for text in dict.fromkeys(text.rstrip(".") for text in texts if text):
            remarks.setdefault(text, []).append(row.label)
    notes = [f"{'; '.join(names)}: {text}." for text, names in remarks.items()]
    earned = [row.earned for row in rows if row.earned is not None]
    if earned:
        notes.append(_AGREEMENTS)
    if any(word_of(row, _BANDS) for row in earned):
        notes.append(words_note(earned, _BANDS))
    if len(rows) < len(every):
        notes.append("Of many raters, five by their value; the file has all.")
    table = partial(table_of, name, caption, _COLUMNS, data=material.data)
    shown = table([*map(_cells, rows)]).rows
    return table([*map(_cells, every)], page_rows=shown, notes=tuple(notes))


def _cells(row: _Row) -> dict[str, Value]:
    line, estimate, interval = row.line, row.estimate, row.interval
    cells: dict[str, Value] = {
        "id": f"{line.id}: {row.rater}" if row.rater else line.id,
        "title": row.label,
        "coefficient": row.coefficient,
        "models": line.models,
        "sessions": " and ".join(line.sessions),
        "reason": row.reason,
    }
    if estimate is None:
        return {**cells, "interval_shown": row.instead}
    if interval is not None:
        text = interval_text(interval.low, interval.high)
        cells |= {
            "interval_shown": too_few(estimate) or text,
            "low": interval.low,
            "high": interval.high,
            "interval": interval_name(interval),
            "target": TARGETS[interval.target],
        }
    return cells | {
        "value": estimate.value,
        "n_items": estimate.n_items,
        "n_raters": 1 if row.rater else estimate.n_raters,
        "strength": None if row.earned is None else word_of(row.earned, _BANDS),
        "observed": estimate.observed,
        "chance": estimate.chance,
        "reason": estimate.reason,
    }


def _forest(
    material: Material, rows: Sequence[_Row], name: str, caption: str
) -> Drawing:
    lines = [_forest_line(row, has_raters=any(of.rater for of in rows)) for row in rows]
    texts = "; ".join(
        f"{line.group} {line.label}: {line.text}".strip() for line in lines
    )
    return Drawing(
        name=name,
        caption=" ".join(_looks(lines, caption)),
        alt=f"Forest plot. {texts}.",
        content=Drawn(FOREST, (tuple(lines), "agreement (1 is perfect)")),
        stamp=material.stamp,
    )


def _forest_line(row: _Row, *, has_raters: bool) -> ForestRow:
    # beside raters a line of the plan is the heading of what is of it
    estimate, interval = row.estimate, row.interval
    label, group = ("all raters", row.title) if has_raters else (row.title, "")
    if estimate is None:
        return ForestRow(label=label, text=row.instead, has_zero=False)
    models, detail = counted(estimate.n_items, "model"), ""
    if row.rater:
        label = f"{row.rater}, {row.coefficient}"
    else:
        detail = f"{models}, {counted(estimate.n_raters, 'rater')}"
    if interval is not None and detail:
        kind = interval.kind + ", one-sided" * interval.is_one_sided
        detail += f"; {kind}, {TARGETS[interval.target]}"
    if too_few(estimate):
        estimate = dataclasses.replace(estimate, interval=None)
    return forest_row(label, estimate, detail=detail, group=group)


def _looks(lines: Sequence[ForestRow], caption: str) -> Iterator[str]:
    # what is drawn of them, and nothing else
    intervals = [line.interval for line in lines if line.interval is not None]
    kinds = {interval.kind for interval in intervals}
    shapes = [of.distribution.continuous for of in intervals if of.distribution]
    looks = {"confidence": "lines with ends", "credible": "broad bars"}
    marks = [f"{kind} intervals ({looks[kind]})" for kind in sorted(kinds)]
    marks.insert(0, "estimates (dots)")
    yield f"{caption}: {', '.join(marks)}."
    if True in shapes:
        yield "Filled curves: posterior densities, each to its own height."
    if False in shapes:
        yield "Blue, above: resamples, each row to its own height."
    if any(line.has_zero for line in lines):
        yield "Dashed: what chance gives."


def categories_section(material: Material) -> Iterator[Content]:
    """Show how well raters agree on each grade, by the ratings of the main estimate."""
    entry = main_estimate(material.analysis)
    if entry is None or entry.estimate is None:
        reason = "the plan asks for no estimate of agreement between raters"
        yield lacking(reason if entry is None else entry.reason)
        return
    level = material.analysis.level
    ratings = material.ratings.without(material.analysis.excluded)
    of = f"{entry.line.models} models, session {entry.line.sessions[0]}"
    yield Table(
        name="categories",
        caption=f"Agreement on each grade of the scale, {of}",
        columns=(
            Column(key="grade", heading="Grade", align="left"),
            Column(key="n_ratings", heading="Ratings"),
            Column(key="agreement", heading="Agreement", digits=3),
            *INTERVAL,
            Column(key="kappa", heading="κ", digits=3),
        ),
        rows=tuple(_category_rows(entry, ratings, level)),
        notes=(
            "Agreement: how often, where one rater gave the grade, another rater of "
            f"the model gave it too. Interval: its {percent(level)} % confidence "
            "interval for these raters on other models like these. κ: Fleiss', of the "
            "grade against all others.",
        ),
        data=material.data,
    )


def _category_rows(
    entry: PlannedEstimate, ratings: Ratings, level: float
) -> Iterator[tuple[Value, ...]]:
    # specific agreement on each grade with its interval, models random, and Fleiss'
    # kappa of the grade against all others
    matrix = rating_matrix(ratings, session=entry.line.sessions[0], models=entry.models)
    grades = ratings.scale.grades
    codes = code_ratings(matrix.grades, grades).codes
    # of a grade that nobody gave
    with warnings.catch_warnings(action="ignore", category=MasrelWarning):
        freq = np.ones(len(codes), dtype=np.int64)
        arrays = _category_arrays(codes, freq, len(grades), level)
        kappas = [
            category_kappa(matrix.grades, grade, categories=grades).value
            for grade in grades
        ]
    few = are_too_few(counted(len(entry.models), "model"))
    keys = ("counts", "values", "low", "high")
    columns = [arrays[f"category_{key}"].tolist() for key in keys]
    for grade, n, value, *ends, kappa in zip(grades, *columns, kappas, strict=True):
        if n:
            yield grade, n, value, *interval_cells(*ends, few=few), kappa
        else:
            yield grade, n, *[None] * 5
