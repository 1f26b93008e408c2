"""Sections `agreement`, `test-retest` and `categories`: what raters agree on.

The first table of coefficients is short, and has every field in the CSV.
"""

import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np

from masrel.agreement import COEFFICIENTS, BandScale, category_kappa, code_ratings
from masrel.analysis._file_estimates import (
    AgreementRow,
    Answer,
    Explanation,
    lower_bound,
)
from masrel.errors import MasrelWarning
from masrel.estimates import Estimate, Interval
from masrel.intervals.diagnosis import _category_arrays
from masrel.lab._study_files import once
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
    at_ranks,
    coefficient_name,
    estimate_titles,
    few,
    lacking,
    lines_of,
    macros,
    main_estimate,
    too_few,
)
from masrel.pages._sections import Content, Drawing
from masrel.plots._drawn_values import FOREST, Drawn, ForestRow
from masrel.tables._answer_tables import answer_table, word_of
from masrel.tables._estimate_words import forest_row
from masrel.tables._tables import (
    Column,
    Table,
    Value,
    interval_text,
    number,
    percent,
    table_of,
)

_AGREEMENTS = (
    "p_o: observed agreement; p_e: agreement expected by chance, 0 if the "
    "coefficient does not allow for chance."
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
    Column(key="standard_error", heading="SE", where="csv"),
    Column(key="median", heading="Median", where="csv"),
    Column(key="interval", heading="Method", where="csv"),
    Column(key="target", heading="Generalises to", where="csv"),
    Column(key="coefficient", heading="Coefficient", where="csv"),
    Column(key="models", heading="Models", where="csv"),
    Column(key="sessions", heading="Session", where="csv"),
    Column(key="strength", heading="At least", align="left"),
    Column(key="observed", heading="p_o", digits=3),
    Column(key="chance", heading="p_e", digits=3),
    Column(key="reason", heading="Reason", where="csv"),
)
_OF_JUDGES = (
    Column(key="id", heading="Id", where="csv"),
    Column(key="judge", heading="Judge", align="left"),
    Column(key="session", heading="Session", align="left"),
    Column(key="n_humans", heading="Humans"),
    Column(key="n_rejected", heading="Not worse"),
    Column(key="winning_rate", heading="Winning rate", digits=3),
    Column(key="advantage", heading="Advantage", digits=3),
    Column(key="epsilon", heading="ε"),
    Column(key="n_items", heading="Presentations"),
    Column(key="passes", heading="Passes", align="left"),
    Column(key="reason", heading="Reason", where="csv"),
)
_JUDGED = (
    "Not worse: number of humans who are better than the judge by less than ε, if at "
    "all; half of them are enough (alternative annotator test). Advantage: how often "
    "the judge is at least as close to the other humans as a human is, averaged over "
    "humans."
)
_SHORT = ("title", "value", "interval_shown", "n_items", "n_raters")


def estimates_section(material: Material) -> Iterator[Content]:
    """Show the plan's estimates with their intervals, or why one is not there."""
    (rows, table), _ = estimate_tables(material)
    if rows:
        short = tuple(
            column if column.key in _SHORT else replace(column, where="csv")
            for column in _COLUMNS
        )
        notes = tuple(lines_of(_say().short(rows, material.analysis.level)))
        caption = "Estimates of agreement"
        yield replace(table, caption=caption, columns=short, notes=notes)
        yield _forest(material, rows, "agreement", "Agreement")
        yield from judge_tables(material)
        yield SUPPLEMENT
        yield table


def judge_tables(material: Material) -> Iterator[Table]:
    """Show whether a judge of the plan may replace a human; nothing without one."""
    rows: list[dict[str, Value]] = []
    for entry in material.analysis.judges:
        line, result = entry.line, entry.result
        of_result: dict[str, Value] = {}
        if result is not None:
            of_result = {
                "n_humans": len(result.humans),
                "n_rejected": sum(human.is_rejected for human in result.humans),
                "winning_rate": result.winning_rate,
                "advantage": result.advantage,
                "epsilon": result.epsilon,
                "n_items": result.n_items,
                "passes": "yes" if result.is_passed else "no",
            }
        head = {"id": line.id, "judge": line.judge, "session": line.session}
        rows.append({**head, "reason": entry.reason, **of_result})
    if rows:
        whys = (f"{row['judge']}: {row['reason']}." for row in rows if row["reason"])
        caption, notes = "Judges beside the raters", (_JUDGED, *whys)
        yield table_of(
            "judges", caption, _OF_JUDGES, rows, data=material.data, notes=notes
        )


def retest_section(material: Material) -> Iterator[Content]:
    """Show the agreement of raters with themselves: of all, and of each alone."""
    _, (rows, table) = estimate_tables(material)
    if rows:
        yield _forest(material, rows, table.name, table.caption)
        yield SUPPLEMENT
        yield table


@once
def estimate_tables(material: Material) -> Sequence[tuple[Sequence["_Row"], Table]]:
    """Return the tables of the plan's estimates and of raters with themselves."""
    # each with the rows that a page has of it
    every = [*_rows(material)]
    lines = [row for row in every if not row.rater]
    again = [row for row in every if row.estimate and row.line.kind == "test-retest"]
    captions = {
        "agreement": "Estimates of agreement, and how each was made",
        "test_retest": "Agreement of raters with themselves",
    }
    return [
        _with_table(material, of, name, caption)
        for of, (name, caption) in zip((lines, again), captions.items(), strict=True)
    ]


def _say() -> Any:
    return macros("estimates.txt", {"targets": TARGETS})


@dataclass(frozen=True, slots=True, kw_only=True)
class _Row:
    """One row of a table or a forest: an estimate, or why it is absent."""

    line: EstimatePlan
    title: str  # of the line
    label: str  # what it is called in a table: the title, and the rater
    rater: str  # whose agreement with him- or herself it is; "" of all
    coefficient: str
    estimate: Estimate | None
    interval: Interval | None  # of the estimate
    instead: str  # what is shown where there is none
    reason: str | None  # why there is none
    earned: AgreementRow | None  # what the best word that it reaches is known from


def _rows(material: Material) -> Iterator[_Row]:
    # each line of the plan, followed by those of its raters
    titles = estimate_titles([p.line for p in material.analysis.estimates])
    for entry in material.analysis.estimates:
        for nth, (rater, coefficient, estimate) in enumerate(_estimates(entry)):
            label = ": ".join(filter(None, (titles[entry.line.id], rater)))
            yield _Row(
                line=entry.line,
                title=titles[entry.line.id],
                label=label,
                rater=rater,
                coefficient=coefficient_name(coefficient, entry.line.weights),
                estimate=estimate,
                interval=None if estimate is None else estimate.interval,
                instead="of each rater" if entry.by_rater else NOT_THERE,
                reason=entry.reason,
                earned=_earned(material, entry, nth, estimate, label),
            )


def _estimates(entry: PlannedEstimate) -> list[tuple[str, str, Estimate | None]]:
    # rater, coefficient and estimate: of all raters, then of each alone
    return [("", entry.line.coefficient, entry.estimate)] + [
        (each.rater, each.estimate.coefficient, each.estimate)
        for each in entry.by_rater
    ]


def _earned(
    material: Material,
    entry: PlannedEstimate,
    nth: int,
    estimate: Estimate | None,
    title: str,
) -> AgreementRow | None:
    if estimate is None:
        return None

    def at_level(level: float) -> Estimate:
        ratings = material.ratings.without(material.analysis.excluded)
        again = with_level(entry, material.protocol, ratings, level)
        return _estimates(again)[nth][2] or estimate

    is_raw = not COEFFICIENTS[estimate.coefficient].chance_corrected
    median, n_undefined = (
        getattr(estimate.interval, name, None) for name in ("median", "n_undefined")
    )
    return AgreementRow(
        keys={},
        title=title,
        estimate=estimate,
        notes=(
            *([] if median is None else [f"posterior median {number(median, 3)}"]),
            *[f"undefined on {n_undefined} resamples"] * bool(n_undefined),
        ),
        lower_bound=None if is_raw else lower_bound(estimate, at_level),
    )


def _few_of_many(rows: Sequence[_Row]) -> list[_Row]:
    # five raters of each line of the plan that has too many to look at
    shown: list[_Row] = []
    for _, group in groupby(rows, key=lambda row: (row.title, row.rater == "")):
        alike = list(group)
        if len(alike) > MANY_RATERS:
            values = [row.estimate.value if row.estimate else math.nan for row in alike]
            alike = [
                replace(
                    alike[at],
                    rater=f"{alike[at].rater} ({rank})",
                    label=f"{alike[at].label} ({rank})",
                )
                for rank, at in at_ranks(values).items()
            ]
        shown += alike
    return shown


def _with_table(
    material: Material, every: Sequence[_Row], name: str, caption: str
) -> tuple[Sequence[_Row], Table]:
    # the rows of a page, and the table, whose file has every one
    rows = _few_of_many(every)
    earned = tuple(row.earned for row in rows if row.earned is not None)
    notes = answer_table(
        Answer(name="agreement", estimates=earned),
        bands=_BANDS if any(word_of(row, _BANDS) for row in earned) else None,
        detail="all",
        items="models",
        in_sentences=False,
        data=material.data,
    ).notes
    five = "Only five raters are shown, chosen by their value; the file has all."
    notes = (
        *(note for note in notes if not isinstance(note, Explanation)),
        *[_AGREEMENTS] * bool(earned),
        *(f"{row.label}: {row.reason}." for row in rows if row.reason),
        *[five] * (len(rows) < len(every)),
    )
    table = partial(table_of, name, caption, _COLUMNS, data=material.data, notes=notes)
    page = table([*map(_cells, rows)])
    return rows, table([*map(_cells, every)], page_rows=page.rows)


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
        cells |= {
            "interval_shown": too_few(estimate)
            or interval_text(interval.low, interval.high),
            "low": interval.low,
            "high": interval.high,
            "interval": f"{percent(interval.level)} % {interval.kind}, "
            f"{interval.method}",
            "target": TARGETS[interval.target],
            "median": interval.median,
        }
    return cells | {
        "value": estimate.value,
        "standard_error": estimate.standard_error,
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
    say, has_raters = _say(), any(row.rater for row in rows)
    lines = tuple(_forest_line(row, say, has_raters=has_raters) for row in rows)
    texts = (f"{line.group} {line.label}: {line.text}".strip() for line in lines)
    return Drawing(
        name=name,
        caption=" ".join(lines_of(say.looks(caption, lines))),
        alt=f"Forest plot. {'; '.join(texts)}.",
        content=Drawn(FOREST, (lines, "agreement (1 is perfect)")),
        stamp=material.stamp,
    )


def _forest_line(row: _Row, say: Any, *, has_raters: bool) -> ForestRow:
    # beside raters a line of the plan is the heading of what is of it
    label, group = ("all raters", row.title) if has_raters else (row.title, "")
    if (estimate := row.estimate) is None:
        return ForestRow(label=label, text=row.instead, has_zero=False)
    if too_few(estimate):
        estimate = replace(estimate, interval=None)
    if row.rater:
        return forest_row(f"{row.rater}, {row.coefficient}", estimate, group=group)
    detail = str(say.detail(row.interval, row.title))
    return forest_row(label, estimate, detail=detail, group=group)


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
            "Agreement: how often a grade that one rater gave was also given by "
            f"another rater of the model. Interval: its {percent(level)} % confidence "
            "interval for these raters on other models like these. κ: Fleiss' κ of the "
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
    keys = ("counts", "values", "low", "high")
    columns = [arrays[f"category_{key}"].tolist() for key in keys]
    # only models that were given a grade say how well raters agree on it
    of_grade = (codes[:, :, None] == np.arange(len(grades))).any(axis=1).sum(axis=0)
    columns.append(of_grade.tolist())
    for grade, n, value, *ends, n_models, kappa in zip(
        grades, *columns, kappas, strict=True
    ):
        if n:
            shown = few(ends, model=n_models) or interval_text(*ends)
            yield grade, n, value, shown, *ends, kappa
        else:
            yield grade, n, *[None] * 5
