"""Sections `grades`, `intended` and `in-person`: every grade, and what it should be."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from masrel.lab.report._figure_data import MANY_RATERS
from masrel.lab.report._material import Material, has_order
from masrel.pages._sections import Drawing, Paragraph, Section, absent_section
from masrel.plots._drawn_values import Drawn
from masrel.scales import Scale
from masrel.tables._tables import Column, Table, Value, counted, number


def grades_section(material: Material) -> Section:
    """Show every grade of every session, as a grid of models by raters."""
    blocks: list[Paragraph | Table | Drawing] = []
    for session in material.sessions:
        blocks += _grid_blocks(material, session, _grid(material, session))
    felt = felt_sentences(material)
    if felt and blocks:
        blocks.insert(0, Paragraph(text=felt))
    if not blocks:
        blocks.append(Paragraph(text="These data hold no ratings.", absent=True))
    return Section(name="grades", title="Grades", blocks=tuple(blocks))


def felt_sentences(material: Material) -> str:
    """Say how often the arm was stretched, and how often nothing could be felt."""
    made = material.analysis.presentations
    if made is None:
        return ""
    sentences, n_slow = [], made.n_below_threshold + made.n_no_catch
    if made.n_stretches != made.n_presentations:
        mean = number(made.n_stretches / made.n_presentations, 1)
        sentences.append(
            f"Raters stretched the arm {made.n_stretches} times in "
            f"{counted(made.n_presentations, 'presentation')}, {mean} times each."
        )
    if n_slow:
        sentences.append(
            f"In {n_slow} of {counted(made.n_presentations, 'presentation')} the "
            "stretches were too slow to feel the catch: none reached ν_th in "
            f"{made.n_below_threshold}, and none came to the catch that the model has "
            f"at that speed in {made.n_no_catch}."
        )
    if made.n_grip_lost:
        sentences.append(
            f"In {made.n_grip_lost} of {counted(made.n_presentations, 'presentation')} "
            "the arm came loose and the model let it go: the grade may be of less than "
            "the model has."
        )
    return " ".join(sentences)


@dataclass(frozen=True, slots=True)
class _Grid:
    """Grades of one session, one row a model and one column a rater."""

    raters: tuple[str, ...]
    models: tuple[str, ...]
    intended: tuple[str | None, ...]  # by model
    # by model and rater, the grades of every presentation in order; no None
    grades: tuple[tuple[tuple[str, ...], ...], ...]

    @property
    def has_aims(self) -> bool:
        """Whether a model has an intended grade."""
        return any(intended is not None for intended in self.intended)


def _grid(material: Material, session: str) -> _Grid:
    rows = [row for row in material.ratings.rows if row.session == session]
    grades: dict[tuple[str, str], tuple[str, ...]] = {}
    for row in sorted(rows, key=attrgetter("repeat")):
        if row.grade is not None:
            key = row.model, row.rater
            grades[key] = (*grades.get(key, ()), row.grade)
    with_rows, with_columns = {row.model for row in rows}, {row.rater for row in rows}
    models = [model for model in material.protocol.models if model.id in with_rows]
    raters = [r.id for r in material.protocol.raters if r.id in with_columns]
    return _Grid(
        raters=tuple(raters),
        models=tuple(model.id for model in models),
        intended=tuple(model.intended_grade for model in models),
        grades=tuple(
            tuple(grades.get((model.id, rater), ()) for rater in raters)
            for model in models
        ),
    )


def _grid_blocks(
    material: Material, session: str, grid: _Grid
) -> tuple[Table, Drawing]:
    table_rows: list[tuple[Value, ...]] = [
        (model, intended, *(", ".join(grades) or None for grades in cells))
        for model, intended, cells in zip(
            grid.models, grid.intended, grid.grades, strict=True
        )
    ]
    n_missing = sum(not grades for cells in grid.grades for grades in cells)
    notes = [f"{counted(n_missing, 'rating')} missing, shown as –."] * bool(n_missing)
    excluded = [r for r in grid.raters if r in material.analysis.excluded]
    if excluded:
        notes.append(
            f"Excluded from every number of this report: {', '.join(excluded)}."
        )
    if len(grid.raters) > MANY_RATERS:
        return _counted_blocks(material, session, grid, table_rows, notes)
    table = Table(
        name=f"grades_{session}",
        caption=f"Grades of session {session}: models by raters",
        columns=(
            Column(key="model", heading="Model", align="left"),
            Column(key="intended_grade", heading="Intended", align="center"),
            *(Column(key=name, heading=name, align="center") for name in grid.raters),
        ),
        rows=tuple(table_rows),
        notes=tuple(notes),
        data=material.data,
    )
    is_ordered = has_order(material)
    caption = [
        f"Grades of session {session}.",
        *["Darker: a higher grade."] * is_ordered,
        *["Framed: a grade other than the intended one."] * grid.has_aims,
        *["Blank: no rating."] * bool(n_missing),
    ]
    scale = material.ratings.scale
    pictured = (
        *(_codes(grid, scale), grid.models, grid.raters, scale.grades, is_ordered),
        *(np.array(scale.values), _aims(grid, scale) if grid.has_aims else None),
    )
    drawing = Drawing(
        name=f"grades_{session}",
        caption=" ".join(caption),
        alt=f"Grid of grades. {'; '.join(_grades_by_model(grid))}.",
        content=Drawn("masrel.plots._grades:items_picture", pictured),
        stamp=material.stamp,
    )
    return table, drawing


def _codes(grid: _Grid, scale: Scale) -> NDArray[np.intp]:
    # (n_models, n_raters, most presentations), -1 where there is no grade
    most = max(len(grades) for cells in grid.grades for grades in cells)
    codes = np.full((len(grid.models), len(grid.raters), max(most, 1)), -1)
    for row, cells in enumerate(grid.grades):
        for column, grades in enumerate(cells):
            codes[row, column, : len(grades)] = list(map(scale.grades.index, grades))
    return codes


def _aims(grid: _Grid, scale: Scale) -> list[int]:
    return [-1 if aim is None else scale.grades.index(aim) for aim in grid.intended]


def _grades_by_model(grid: _Grid) -> Iterator[str]:
    by_model = zip(grid.models, grid.intended, grid.grades, strict=True)
    for model, intended, cells in by_model:
        counts = Counter(grade for grades in cells for grade in grades)
        text = ", ".join(f"{n} of grade {grade}" for grade, n in counts.items())
        aim = "" if intended is None else f" (intended {intended})"
        yield f"{model}{aim}: {text or 'no grades'}"


def _counted_blocks(
    material: Material,
    session: str,
    grid: _Grid,
    rows: list[tuple[Value, ...]],
    notes: list[str],
) -> tuple[Table, Drawing]:
    # of many raters: how often each grade was given; the CSV has who gave it
    scale = material.ratings.scale
    codes = _codes(grid, scale).reshape(len(grid.models), -1)
    every = np.arange(len(scale.grades))
    counts = (codes[:, :, None] == every).sum(axis=1)
    n_raters = counted(len(grid.raters), "rater")
    by_rater = [Column(key=name, heading=name, where="csv") for name in grid.raters]
    by_grade = [Column(key=f"n_{g}", heading=g, where="page") for g in scale.grades]
    table = Table(
        name=f"grades_{session}",
        caption=f"How often {n_raters} gave each grade in session {session}",
        columns=(
            Column(key="model", heading="Model", align="left"),
            Column(key="intended_grade", heading="Intended", align="center"),
            *by_rater,
            *by_grade,
        ),
        rows=tuple(
            (*row, *of_row) for row, of_row in zip(rows, counts.tolist(), strict=True)
        ),
        notes=(*notes, "The file has the grades of every rater."),
        data=material.data,
    )
    caption = f"How often {n_raters} gave each grade in session {session}. Darker is"
    caption += " more often, of the grades of the model"
    if grid.has_aims:
        caption += "; the intended grade is framed"
    framed = np.array(_aims(grid, scale))[:, None] == every
    names = "model", "grade given"
    drawing = Drawing(
        name=f"grades_{session}",
        caption=f"{caption}.",
        alt=f"Counts of grades. {'; '.join(_grades_by_model(grid))}.",
        content=Drawn(
            "masrel.plots._grades:counts_picture",
            (counts, grid.models, scale.grades, framed, names),
        ),
        stamp=material.stamp,
    )
    return table, drawing


def intended_section(material: Material) -> Section:
    """Show how many raters gave each standard model its intended grade."""
    result = material.analysis.intended
    title = "Agreement with the intended grade"
    if result is None or not result.models:
        return absent_section("intended", title, result.reason if result else None)
    table = Table(
        name="intended",
        caption=f"Raters who gave the intended grade, session {result.session}",
        columns=(
            Column(key="model", heading="Model", align="left"),
            Column(key="intended_grade", heading="Intended grade", align="center"),
            Column(key="n_ratings", heading="Ratings"),
            Column(key="n_agree", heading="As intended"),
            Column(key="percent", heading="Percent", digits=1),
        ),
        rows=tuple(
            (row.model, row.intended_grade, row.n_ratings, row.n_agree, row.percent)
            for row in result.models
        ),
        notes=() if result.reason is None else (f"Mean or SD: {result.reason}.",),
        data=material.data,
    )
    text = (
        f"Mean over the {counted(len(result.models), 'standard model')}: "
        f"{number(result.mean, 1)} % (standard deviation between models "
        f"{number(result.sd, 1)}, n − 1)."
    )
    return Section(name="intended", title=title, blocks=(table, Paragraph(text=text)))


def in_person_section(material: Material) -> Section:
    """Show grades given to patients beside those given to their models."""
    result = material.analysis.in_person
    title = "In-person and haptic grades"
    if result is None or result.n_pairs == 0:
        return absent_section("in-person", title, result.reason if result else None)
    percent = number(100 * result.n_equal / result.n_pairs, 1)
    text = f"{result.n_equal} of {result.n_pairs} pairs are equal ({percent} %)."
    if result.n_unpaired:
        text += f" Entries that lack one of the two grades: {result.n_unpaired}."
    entries = () if material.in_person is None else material.in_person.rows
    notes = (
        f"{row.rater}, {row.model} (subject {row.subject}, source table "
        f"{row.source_table}): {row.note}"
        for row in entries
        if row.note
    )
    table = Table(
        name="in_person",
        caption=(
            "Grade of the patient in person and of the model built from that patient, "
            f"by the same rater (session {result.session})"
        ),
        columns=(
            Column(key="model", heading="Model", align="left"),
            Column(key="rater", heading="Rater", align="left"),
            Column(key="in_person", heading="In person", align="center"),
            Column(key="haptic", heading="Haptic", align="center"),
            Column(key="equal", heading="Equal", align="center"),
        ),
        rows=tuple(
            (p.model, p.rater, p.in_person, p.haptic, "yes" if equal else "no")
            for p in result.pairs
            for equal in [p.in_person == p.haptic]
        ),
        notes=tuple(dict.fromkeys(notes)),
        data=material.data,
    )
    return Section(name="in-person", title=title, blocks=(Paragraph(text=text), table))
