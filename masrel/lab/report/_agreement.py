"""Sections `agreement`, `test-retest` and `categories`: what raters agree on.

The table of coefficients is narrow on a page, and has every field in the CSV.
"""

import dataclasses
import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import attrgetter

import numpy as np

from masrel.agreement import COEFFICIENTS, BandScale, category_kappa, code_ratings
from masrel.analysis._file_estimates import AgreementRow, lower_bound
from masrel.errors import MasrelWarning
from masrel.estimates import Estimate, Interval
from masrel.intervals.diagnosis import _category_arrays
from masrel.lab.analysis import PlannedEstimate
from masrel.lab.analysis._plan import with_level
from masrel.lab.ratings import Ratings, rating_matrix
from masrel.lab.report._material import (
    MANY_RATERS,
    NOT_THERE,
    TARGETS,
    Material,
    at_ranks,
    coefficient_name,
    interval_name,
    lacking,
    main_estimate,
    meaning,
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
)

_AGREEMENTS = (
    "p_o: observed agreement; p_e: agreement expected by chance, 0 where the "
    "coefficient takes none off."
)

_BANDS: BandScale = "landis_koch"

_COLUMNS = (
    Column(key="id", heading="Estimate", align="left"),
    Column(key="coefficient", heading="Coefficient", align="left"),
    Column(key="models_shown", heading="Models", align="left", where="page"),
    Column(key="models", heading="Models", where="csv"),
    Column(key="sessions", heading="Session", align="left"),
    Column(key="n_items", heading="n models", where="csv"),
    Column(key="n_raters", heading="Raters"),
    Column(key="value", heading="Value", digits=3),
    Column(key="interval_shown", heading="Interval", where="page"),
    Column(key="low", heading="Low", digits=3, where="csv"),
    Column(key="high", heading="High", digits=3, where="csv"),
    Column(key="interval", heading="Interval", where="csv"),
    Column(key="target", heading="Generalises to", where="csv"),
    Column(key="strength", heading="At least", align="left"),
    Column(key="observed", heading="p_o", digits=3),
    Column(key="chance", heading="p_e", digits=3),
    Column(key="reason", heading="Reason", where="csv"),
)

_LETTERS = "ᵃᵇᶜᵈᵉᶠᵍʰⁱʲᵏˡᵐⁿᵒᵖʳˢᵗᵘᵛʷˣʸᶻ"  # they stand high without any markup


_OF_KIND = {
    "inter-rater": ("agreement", "Agreement between raters"),
    "test-retest": ("test_retest", "Agreement of raters with themselves"),
}
"""Kind of a line of the plan to the name of its table and figure, and their caption."""


def estimates_section(material: Material, *, kind: str) -> Iterator[Content]:
    """Show the plan's estimates of a kind with their intervals, or why not."""
    planned = [p for p in material.analysis.estimates if p.line.kind == kind]
    name, caption = _OF_KIND[kind]
    if not planned:
        yield Paragraph(text="The plan asks for no such estimate.", absent=True)
        return
    if all(entry.estimate is None and not entry.by_rater for entry in planned):
        for entry in planned:
            text = f"{entry.line.id} is not in these data: {entry.reason}."
            yield Paragraph(text=text, absent=True)
        return
    every = estimate_rows(material, planned)
    rows = _few_of_many(every)
    yield _estimate_table(every, rows, name=name, caption=caption, data=material.data)
    intervals = [row.interval for row in rows if row.interval is not None]
    for text in dict.fromkeys(meaning(interval) for interval in intervals):
        yield Paragraph(text=text)
    yield _forest(material, rows, name, caption)


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimateRow:
    """One row of a table or a forest: an estimate, or why there is none."""

    name: str  # id of the line of the plan, and the rater if it is one rater's
    coefficient: str  # its name for a reader
    # models, sessions: what it was estimated from
    models: str
    sessions: str
    estimate: Estimate | None
    interval: Interval | None  # of the estimate
    reason: str | None  # why there is none
    single: bool  # whether it is one rater's agreement with him- or herself
    earned: AgreementRow | None  # what the best word that it reaches is known from


def estimate_rows(
    material: Material, planned: Sequence[PlannedEstimate]
) -> list[EstimateRow]:
    """Return the rows of planned estimates, each followed by those of its raters."""
    return [
        EstimateRow(
            name=name,
            coefficient=coefficient_name(coefficient, entry.line.weights),
            models=entry.line.models,
            sessions=" and ".join(entry.line.sessions),
            estimate=estimate,
            interval=None if estimate is None else estimate.interval,
            reason=entry.reason if name == entry.line.id else None,
            single=name != entry.line.id,
            earned=_earned(material, entry, nth, estimate),
        )
        for entry in planned
        for nth, (name, coefficient, estimate) in enumerate(_estimates(entry))
    ]


def _estimates(entry: PlannedEstimate) -> list[tuple[str, str, Estimate | None]]:
    # name, coefficient and estimate: of all raters, then of each alone
    line = entry.line
    of_all = (line.id, line.coefficient, entry.estimate)
    return [of_all] * (entry.estimate is not None or not entry.by_rater) + [
        (f"{line.id}: {each.rater}", each.estimate.coefficient, each.estimate)
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


def _few_of_many(rows: Sequence[EstimateRow]) -> list[EstimateRow]:
    # five raters of each line of the plan that has too many to look at
    shown: list[EstimateRow] = []
    for single, group in groupby(rows, key=attrgetter("single")):
        of_raters = list(group)
        if single and len(of_raters) > MANY_RATERS:
            values = [
                row.estimate.value if row.estimate else math.nan for row in of_raters
            ]
            of_raters = [
                dataclasses.replace(
                    of_raters[at], name=f"{of_raters[at].name} ({rank})"
                )
                for rank, at in at_ranks(values).items()
            ]
        shown += of_raters
    return shown


def _estimate_table(
    every: Sequence[EstimateRow],
    rows: Sequence[EstimateRow],
    *,
    name: str,
    caption: str,
    data: str,
) -> Table:
    # rows: those of a page; the file has every one
    # On a page an interval is one column, marked with a letter; a note below says what
    # each letter means: level, method, and what the interval generalises to.
    marks: dict[str, str] = {}
    cells: list[tuple[Value, ...]] = []
    remarks: dict[str, list[str]] = {}  # a text to the rows it is of
    for row in rows:
        interval, mark = row.interval, ""
        # what a reader must know before relying on it
        texts = [row.reason, None if row.estimate is None else row.estimate.reason]
        if interval is not None:
            note = (
                f"{interval_name(interval)}; generalises to {TARGETS[interval.target]}"
            )
            nth, again = len(marks) % len(_LETTERS), len(marks) // len(_LETTERS)
            mark = marks.setdefault(note, _LETTERS[nth] * (again + 1))  # a, ..., z, aa
            if interval.median is not None:
                texts.append(f"posterior median {number(interval.median, 3)}")
            texts += [*interval.notes, interval.reason]
            if interval.n_undefined:
                texts.append(f"undefined on {interval.n_undefined} resamples")
        cells.append(_cells(row, mark))
        for text in dict.fromkeys(text.rstrip(".") for text in texts if text):
            remarks.setdefault(text, []).append(row.name)
    notes = [
        *(f"{mark} {note}." for note, mark in marks.items()),
        *(f"{', '.join(names)}: {text}." for text, names in remarks.items()),
    ]
    if any(row.estimate is not None for row in rows):
        notes.append(_AGREEMENTS)
    earned = [row.earned for row in rows if row.earned is not None]
    if any(word_of(row, _BANDS) for row in earned):
        notes.append(words_note(earned, _BANDS))
    if len(rows) < len(every):
        notes.append("Of many raters, five by their value; the file has all.")
    return Table(
        name=name,
        caption=caption,
        columns=_COLUMNS,
        rows=tuple(_cells(row, "") for row in every),
        page_rows=tuple(cells),
        notes=tuple(notes),
        data=data,
    )


def _cells(row: EstimateRow, mark: str) -> tuple[Value, ...]:
    # mark: the letter of its interval
    estimate, interval = row.estimate, row.interval
    head = (row.name, row.coefficient)
    if estimate is None:
        data = (row.models, row.models, row.sessions, None, None)
        return (*head, *data, None, NOT_THERE, *[None] * 7, row.reason)
    ends: tuple[Value, ...] = (None,) * 5
    if interval is not None:
        text = f"{interval_text(interval.low, interval.high)} {mark}"
        words = interval_name(interval), TARGETS[interval.target]
        ends = (text, interval.low, interval.high, *words)
    word = None if row.earned is None else word_of(row.earned, _BANDS)
    return (
        *head,
        f"{estimate.n_items} {row.models}",
        row.models,
        row.sessions,
        estimate.n_items,
        1 if row.single else estimate.n_raters,
        estimate.value,
        *ends,
        word,
        estimate.observed,
        estimate.chance,
        estimate.reason,
    )


def _forest(
    material: Material, rows: Sequence[EstimateRow], name: str, caption: str
) -> Drawing:
    lines = []
    for row in rows:
        # how much it rests on, and what its interval is for
        estimate, interval = row.estimate, row.interval
        detail = f"{row.models} models, {row.sessions}"
        if estimate is not None:
            raters = "twice" if row.single else counted(estimate.n_raters, "rater")
            detail = f"{counted(estimate.n_items, 'model')}, {raters}"
        if interval is not None:
            kind = interval.kind + ", one-sided" * interval.is_one_sided
            detail += f"; {kind}, {TARGETS[interval.target]}"
        label = f"{row.coefficient}, {row.name}"
        lines.append(
            ForestRow(label=label, detail=detail, text=NOT_THERE, has_zero=False)
            if estimate is None
            else forest_row(label, estimate, detail=detail)
        )
    texts = "; ".join(f"{line.label}: {line.text}" for line in lines)
    return Drawing(
        name=name,
        caption=" ".join(_looks(lines, caption)),
        alt=f"Forest plot. {texts}.",
        content=Drawn(FOREST, (tuple(lines), "agreement (1 is perfect)")),
        stamp=material.stamp,
    )


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


_FEW = 10  # models, below which the intervals of a grade say next to nothing


def categories_section(material: Material) -> Iterator[Content]:
    """Show how well raters agree on each grade, by the ratings of the main estimate."""
    entry = main_estimate(material.analysis)
    if entry is None or entry.estimate is None:
        reason = "the plan asks for no estimate of agreement between raters"
        yield lacking(reason if entry is None else entry.reason)
        return
    level, n_models = material.analysis.level, len(entry.models)
    ratings = material.ratings.without(material.analysis.excluded)
    notes = [
        "Agreement: how often, where one rater gave the grade, another rater of the "
        f"model gave it too. Low, High: its {percent(level)} % confidence interval for "
        "these raters on other models like these. κ: Fleiss', of the grade against all "
        "others."
    ]
    if n_models < _FEW:
        text = f"The intervals are wide, as they rest on {counted(n_models, 'model')}."
        notes.append(text)
    of = f"{entry.line.models} models, session {entry.line.sessions[0]}"
    yield Table(
        name="categories",
        caption=f"Agreement on each grade of the scale, {of}",
        columns=(
            Column(key="grade", heading="Grade", align="left"),
            Column(key="n_ratings", heading="Ratings"),
            Column(key="agreement", heading="Agreement", digits=3),
            Column(key="low", heading="Low", digits=3),
            Column(key="high", heading="High", digits=3),
            Column(key="kappa", heading="κ", digits=3),
        ),
        rows=tuple(_category_rows(entry, ratings, level)),
        notes=tuple(notes),
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
    for grade, n, *values in zip(grades, *columns, kappas, strict=True):
        yield grade, n, *(values if n else [None] * 4)
