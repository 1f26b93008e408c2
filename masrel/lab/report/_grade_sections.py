"""Grades beside what they should be, and answers, without saying who gave them."""

import math
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Decimal
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from masrel.intervals.diagnosis import _share_interval
from masrel.lab._study_files import once
from masrel.lab.analysis import QuestionSummary
from masrel.lab.analysis._descriptions import FEWEST_RATERS
from masrel.lab.report._material import (
    INTERVAL,
    MANY_RATERS,
    MODEL,
    SUPPLEMENT,
    Material,
    few,
    lacking,
)
from masrel.pages._sections import Content, Drawing, Paragraph
from masrel.plots._drawn_values import Drawn
from masrel.tables._tables import (
    Column,
    Table,
    Value,
    counted,
    interval_text,
    number,
    percent,
)


def grades_section(material: Material) -> Iterator[Content]:
    """Show every grade of every session, as a grid of models by raters."""
    felt = felt_sentences(material)
    if not material.sessions:
        yield lacking("there are no ratings")
    elif felt:
        yield Paragraph(text=felt)
    grids = [_grid(material, session) for session in material.sessions]
    blocks = [
        block
        for grid in grids
        for block in (
            _counted_blocks if len(grid.raters) > MANY_RATERS else _grid_blocks
        )(material, grid)
    ]
    yield from (block for block in blocks if isinstance(block, Drawing))
    yield SUPPLEMENT
    yield from (block for block in blocks if isinstance(block, Table))


def felt_sentences(material: Material) -> str:
    """Say how often the arm was stretched, and how often nothing could be felt."""
    made = material.analysis.presentations
    if made is None:
        return ""
    sentences, n_slow = [], made.n_below_threshold + made.n_no_catch
    if made.n_stretches != made.n_presentations:
        mean = number(made.n_stretches / made.n_presentations, 1)
        sentences.append(
            f"The arm was stretched {made.n_stretches} times in "
            f"{counted(made.n_presentations, 'presentation')}, {mean} times each."
        )
    if n_slow:
        sentences.append(
            f"In {n_slow} of {counted(made.n_presentations, 'presentation')} the "
            "stretches were too slow to feel the catch: none reached ν_th in "
            f"{made.n_below_threshold}, and none came as far as the model's catch at "
            f"that speed in {made.n_no_catch}."
        )
    if made.n_grip_lost:
        sentences.append(
            f"In {made.n_grip_lost} of {counted(made.n_presentations, 'presentation')} "
            "the arm came loose and the model let it go: the rater may not have felt "
            "the whole model."
        )
    return " ".join(sentences)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Grid:
    """Grades of one session, one row a model and one column a rater."""

    session: str
    raters: list[str]
    models: list[str]
    rows: list[tuple[Value, ...]]  # as a table has them
    # (n_models, n_raters, most presentations): of the scale, -1 where there is none
    codes: NDArray[np.intp]
    aims: list[int]  # codes of the intended grades, -1 for none
    notes: list[str]
    words: str  # what a reader who cannot see it needs to know

    @property
    def has_aims(self) -> bool:
        """Whether a model has an intended grade."""
        return max(self.aims) >= 0


def _grid(material: Material, session: str) -> _Grid:
    grades = material.ratings.scale.grades
    ratings = [row for row in material.ratings.rows if row.session == session]
    cells: dict[tuple[str, str], list[str]] = defaultdict(list)
    for row in sorted(ratings, key=attrgetter("repeat")):
        cells[row.model, row.rater] += [] if row.grade is None else [row.grade]
    rated, rating = ({key[i] for key in cells} for i in range(2))
    models = [model for model in material.protocol.models if model.id in rated]
    raters = [rater.id for rater in material.protocol.raters if rater.id in rating]
    shape = len(models), len(raters), max(1, *map(len, cells.values()))
    codes, words = np.full(shape, -1), []
    rows: list[tuple[Value, ...]] = []
    for i, model in enumerate(models):
        of_raters = [cells[model.id, rater] for rater in raters]
        for k, of_rater in enumerate(of_raters):
            codes[i, k, : len(of_rater)] = [grades.index(grade) for grade in of_rater]
        texts = [", ".join(of_rater) or None for of_rater in of_raters]
        rows.append((model.id, model.intended_grade, *texts))
        counts = Counter(grade for of_rater in of_raters for grade in of_rater)
        aim = f" (intended {model.intended_grade})" * bool(model.intended_grade)
        text = ", ".join(f"{n} of grade {grade}" for grade, n in counts.items())
        words.append(f"{model.id}{aim}: {text or 'no grades'}")
    n_missing = int((codes.max(axis=2) < 0).sum())
    notes = [f"{counted(n_missing, 'rating')} missing, shown as –."] * bool(n_missing)
    if excluded := [r for r in raters if r in material.analysis.excluded]:
        text = f"Excluded from every number of this report: {', '.join(excluded)}."
        notes.append(text)
    aims = [model.intended_grade for model in models]
    return _Grid(
        session=session,
        raters=raters,
        models=[model.id for model in models],
        rows=rows,
        codes=codes,
        aims=[-1 if aim is None else grades.index(aim) for aim in aims],
        notes=notes,
        words="; ".join(words),
    )


_INTENDED = Column(key="intended_grade", heading="Intended", align="center")


def _grid_blocks(material: Material, grid: _Grid) -> Iterator[Content]:
    scale = material.ratings.scale
    raters = [Column(key=name, heading=name, align="center") for name in grid.raters]
    yield Table(
        name=f"grades_{grid.session}",
        caption=f"Grades of session {grid.session}: models by raters",
        columns=(MODEL, _INTENDED, *raters),
        rows=tuple(grid.rows),
        notes=tuple(grid.notes),
        data=material.data,
    )
    is_ordered = _is_ordered(material)
    caption = [
        f"Grades of session {grid.session}.",
        *["Darker: a higher grade."] * is_ordered,
        *["Framed: a grade other than the intended one."] * grid.has_aims,
        *["Blank: no rating."] * bool((grid.codes.max(axis=2) < 0).any()),
    ]
    pictured = (
        *(grid.codes, grid.models, grid.raters, scale.grades, is_ordered),
        *(np.array(scale.values), grid.aims if grid.has_aims else None),
    )
    yield Drawing(
        name=f"grades_{grid.session}",
        caption=" ".join(caption),
        alt=f"Grid of grades. {grid.words}.",
        content=Drawn("masrel.plots._grades:items_picture", pictured),
        stamp=material.stamp,
    )


def _is_ordered(material: Material) -> bool:
    # whether the scale has an order, as far as a protocol tells
    protocol = material.protocol
    return (
        "order" in (protocol.report.sections or ())
        or any(line.weights != "identity" for line in protocol.analysis.estimates)
        or any(grade[0].isdecimal() for grade in material.ratings.scale.grades)
    )


def _counted_blocks(material: Material, grid: _Grid) -> Iterator[Content]:
    # of many raters: how often each grade was given; the CSV has who gave it
    grades = material.ratings.scale.grades
    every = np.arange(len(grades))
    codes = grid.codes.reshape(len(grid.models), -1)
    counts = (codes[:, :, None] == every).sum(axis=1)
    n_raters = counted(len(grid.raters), "rater")
    text = f"How often {n_raters} gave each grade in session {grid.session}"
    yield Table(
        name=f"grades_{grid.session}",
        caption=text,
        columns=(
            *(MODEL, _INTENDED),
            *(Column(key=name, heading=name, where="csv") for name in grid.raters),
            *(Column(key=f"n_{g}", heading=g, where="page") for g in grades),
        ),
        rows=tuple(
            (*row, *of_row)
            for row, of_row in zip(grid.rows, counts.tolist(), strict=True)
        ),
        notes=(*grid.notes, "The file has the grades of every rater."),
        data=material.data,
    )
    text += ". Darker: a larger share of the model's grades"
    text += "; the intended grade is framed" * grid.has_aims
    framed = np.array(grid.aims)[:, None] == every
    pictured = (counts, grid.models, grades, framed, ("model", "grade given"))
    yield Drawing(
        name=f"grades_{grid.session}",
        caption=f"{text}.",
        alt=f"Counts of grades. {grid.words}.",
        content=Drawn("masrel.plots._grades:counts_picture", pictured),
        stamp=material.stamp,
    )


_TOO_SLOW = "Grades after stretches that never reached ν_th do not count as intended."


def intended_section(material: Material) -> Iterator[Content]:
    """Show how many raters gave each standard model its intended grade."""
    result = material.analysis.intended
    if result is None or not result.models:
        yield lacking(None if result is None else result.reason)
        return
    made = material.analysis.presentations
    yield Table(
        name="intended",
        caption=f"Raters who gave the intended grade, session {result.session}",
        columns=(
            MODEL,
            Column(key="intended_grade", heading="Intended grade", align="center"),
            Column(key="n_ratings", heading="Ratings"),
            Column(key="n_agree", heading="As intended"),
            Column(key="percent", heading="Percent", digits=1),
        ),
        rows=tuple(
            (row.model, row.intended_grade, row.n_ratings, row.n_agree, row.percent)
            for row in result.models
        ),
        notes=(
            *(() if result.reason is None else (f"Mean or SD: {result.reason}.",)),
            *(_TOO_SLOW,) * bool(made and made.n_below_threshold),
        ),
        data=material.data,
    )
    yield Paragraph(
        text=f"Mean over the {counted(len(result.models), 'standard model')}: "
        f"{number(result.mean, 1)} % (standard deviation between models "
        f"{number(result.sd, 1)}, n − 1)."
    )


def in_person_section(material: Material) -> Iterator[Content]:
    """Show grades given to patients beside those given to their models."""
    result = material.analysis.in_person
    if result is None or not result.n_pairs:
        yield lacking(None if result is None else result.reason)
        return
    percents = number(100 * result.n_equal / result.n_pairs, 1)
    text = f"{result.n_equal} of {result.n_pairs} pairs are equal ({percents} %)."
    if result.n_unpaired:
        text += f" Entries that lack one of the two grades: {result.n_unpaired}."
    yield Paragraph(text=text)
    entries = () if material.in_person is None else material.in_person.rows
    notes = (
        f"{row.rater}, {row.model} (subject {row.subject}, source table "
        f"{row.source_table}): {row.note}"
        for row in entries
        if row.note
    )
    yield Table(
        name="in_person",
        caption=(
            "Grades of the patient in person and of the model built from that patient, "
            f"by the same rater (session {result.session})"
        ),
        columns=(
            MODEL,
            Column(key="rater", heading="Rater", align="left"),
            Column(key="in_person", heading="In person", align="center"),
            Column(key="haptic", heading="Haptic", align="center"),
            Column(key="equal", heading="Equal", align="center"),
        ),
        rows=tuple(
            (p.model, p.rater, p.in_person, p.haptic, ("no", "yes")[is_equal])
            for p in result.pairs
            for is_equal in [p.in_person == p.haptic]
        ),
        notes=tuple(dict.fromkeys(notes)),
        data=material.data,
    )


@once
def given_grades(material: Material) -> tuple[str, list[str], NDArray[np.int64]]:
    """Return a session, the intended grades of its models, and the grades given."""
    # the first session with grades; (n_intended, n_raters, n_grades) counts, none where
    # no model that was graded has an intended grade
    aims = {model.id: model.intended_grade for model in material.protocol.models}
    ratings = material.ratings.without(material.analysis.excluded)
    graded = [row for row in ratings.rows if row.grade is not None]
    present = {row.session for row in graded}
    session = next((s for s in material.sessions if s in present), "")
    n_given = Counter(
        (aims[r.model], r.rater, r.grade) for r in graded if r.session == session
    )
    grades, raters = ratings.scale.grades, sorted({rater for _, rater, _ in n_given})
    intended = [grade for grade in grades if grade in {aim for aim, *_ in n_given}]
    counts = [[[n_given[a, r, g] for g in grades] for r in raters] for a in intended]
    return session, intended, np.array(counts, dtype=np.int64)


def _shares(
    counts: NDArray[np.int64], chosen: Sequence[int], level: float
) -> NDArray[np.float64]:
    # (n_intended, n_raters, n_grades) -> (3, n_intended): share and interval of those
    # grades that are the chosen one
    wholes = counts.sum(axis=2).astype(np.float64)  # (n_intended, n_raters)
    parts = counts[np.arange(len(chosen)), :, chosen].astype(np.float64)
    low, high = _share_interval(
        level,
        parts=parts.sum(axis=1),
        wholes=wholes.sum(axis=1),
        squares=(parts**2).sum(axis=1),
        products=(parts * wholes).sum(axis=1),
        whole_squares=(wholes**2).sum(axis=1),
        n_items=(wholes > 0.0).sum(axis=1).astype(np.float64),
    )
    return np.array([parts.sum(axis=1) / wholes.sum(axis=1), low, high])


def confusion_section(material: Material) -> Iterator[Content]:
    """Show which grades models of each intended grade were given."""
    session, intended, by_rater = given_grades(material)
    if not intended:
        yield lacking("no model with an intended grade has ratings")
        return
    grades, level = material.ratings.scale.grades, material.analysis.level
    caption = f"Grades given for each intended grade, session {session}"
    shares = _shares(by_rater, [grades.index(aim) for aim in intended], level)
    n_raters = by_rater.shape[1]
    counts = by_rater.sum(axis=1)  # (n_intended, n_grades)
    framed = np.array([[grade == aim for grade in grades] for aim in intended])
    yield Paragraph(
        text=f"{counts[framed].sum()} of {counted(int(counts.sum()), 'grade')} of "
        "models with an intended grade are as intended."
    )
    texts = [
        f"intended {aim}: "
        + ", ".join(f"{n} of {g}" for g, n in zip(grades, of_aim, strict=True) if n)
        for aim, of_aim in zip(intended, counts.tolist(), strict=True)
    ]
    pictured = (counts, intended, grades, framed, ("intended grade", "grade given"))
    yield Drawing(
        name="confusion",
        caption=(
            f"{caption}. Darker: a larger share of the row; the intended grade is "
            "framed."
        ),
        alt=f"Counts of grades given. {'; '.join(texts)}.",
        content=Drawn("masrel.plots._grades:counts_picture", (*pictured, "")),
        stamp=material.stamp,
    )
    yield SUPPLEMENT
    yield Table(
        name="confusion",
        caption=caption,
        columns=(
            Column(key="intended_grade", heading="Intended", align="left"),
            *(Column(key=f"grade_{grade}", heading=grade) for grade in grades),
            Column(key="n_ratings", heading="Ratings"),
            Column(key="percent", heading="As intended (%)", digits=1),
            *INTERVAL,
        ),
        rows=tuple(
            (
                *(aim, *of_aim, sum(of_aim), 100.0 * value),
                few((low, high), rater=n_raters)
                or interval_text(100.0 * low, 100.0 * high, 1),
                *(100.0 * low, 100.0 * high),
            )
            for aim, of_aim, (value, low, high) in zip(
                intended, counts.tolist(), shares.T.tolist(), strict=True
            )
        ),
        notes=(
            "Rows: the grade a model was built for; columns: the grades given. "
            + "Those left of the intended one are too low and those right of it too "
            "high. "
            * _is_ordered(material)
            + f"Interval: {percent(level)} % confidence interval of the percentage, "
            "for other raters like these on these models.",
        ),
        data=material.data,
    )


_RECONSTRUCTED = (
    "Reconstructed answers are one set that fits the published mean and standard "
    "deviation, not the answers that were given."
)

_WITHHELD = (
    f"If fewer than {FEWEST_RATERS} raters answered a question that is not public, "
    "only n is shown, because more could reveal what one of them answered."
)

_QUESTIONS = (
    Column(key="question", heading="Question", align="left"),
    Column(key="session", heading="Session", align="left"),
    MODEL,
    Column(key="n", heading="n"),
    Column(key="n_missing", heading="Missing"),
    Column(key="mean_sd", heading="Mean ± SD (n − 1)", where="page"),
    Column(key="mean", heading="Mean", where="csv"),
    Column(key="sd", heading="SD (n − 1)", where="csv"),
    Column(key="median", heading="Median"),
    Column(key="least", heading="Min"),
    Column(key="most", heading="Max"),
    Column(key="counts", heading="Answers", align="left"),
)


def questionnaires_section(material: Material) -> Iterator[Content]:
    """Show how each question was answered, over all raters."""
    summaries = material.analysis.questionnaires
    if not any(summary.n for summary in summaries):
        yield from [lacking("there are no answers")] * bool(summaries)
        return
    made_up = [_RECONSTRUCTED] * any(each.is_reconstructed for each in summaries)
    questions = [
        (q, each) for q in material.protocol.questionnaires for each in q.questions
    ]
    for questionnaire, question in questions:
        text = f"{questionnaire.title}: {question.text} ({question.needed})."
        yield Paragraph(text=text)
    # of texts nothing but n is ever shown
    texts = {(q.id, each.id) for q, each in questions if each.type == "text"}
    is_withheld = any(
        each.n and not each.counts and (each.questionnaire, each.question) not in texts
        for each in summaries
    )
    yield Table(
        name="questionnaires",
        caption="Answers to each question, over all raters",
        columns=_QUESTIONS,
        rows=tuple(map(_question_row, summaries)),
        notes=(*made_up, *[_WITHHELD] * is_withheld),
        data="reconstructed" if made_up else material.data,
    )
    # in each session, over all models
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for each in summaries:
        of = "" if each.session is None else f", {each.session}"
        title = f"{each.questionnaire}.{each.question}{of}"
        counts[title].update({count.label: count.n for count in each.counts})
    panels = tuple(
        (t, tuple(c), tuple(c.values())) for t, c in counts.items() if c.total()
    )
    words = (
        f"{title}: {', '.join(f'{n} × {label}' for label, n in of.items() if n)}"
        for title, of in counts.items()
        if of.total()
    )
    if panels:
        yield Drawing(
            name="questionnaires",
            caption=" ".join(("The share of each answer, over all raters.", *made_up)),
            alt=f"Bars of answers. {'; '.join(words)}.",
            content=Drawn("masrel.plots._grades:answer_pictures", (panels,)),
            stamp=_RECONSTRUCTED if made_up else material.stamp,
        )


def _question_row(summary: QuestionSummary) -> tuple[Value, ...]:
    numbers: tuple[Value, ...] = (None,) * 6
    choices = ", ".join(f"{count.label}: {count.n}" for count in summary.counts)
    if not math.isnan(summary.least):
        choices = ""
        both = f"{_half_up(summary.mean, 2)} ± {_half_up(summary.sd, 2)}"
        ends = (summary.median, summary.least, summary.most)
        numbers = (both, summary.mean, summary.sd, *ends)
    return (
        f"{summary.questionnaire}.{summary.question}",
        summary.session,
        summary.model,
        summary.n,
        summary.n_missing,
        *numbers,
        choices or None,
    )


def _half_up(value: float, decimals: int) -> str:
    # rounded as on paper: what lies in the middle goes up
    # Means of a few whole numbers often lie there; a float's own format goes to even.
    if math.isnan(value):
        return "undefined"
    unit = Decimal(1).scaleb(-decimals)
    text = str(Decimal(repr(value)).quantize(unit, ROUND_HALF_UP))
    return text.replace("-", "−")
