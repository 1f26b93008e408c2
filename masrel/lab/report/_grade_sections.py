"""Sections `grades`, `intended` and `in-person`: every grade, and what it should be."""

from collections import Counter
from collections.abc import Iterator
from operator import attrgetter

from masrel.lab.report._figure_data import FIGURES, MANY_RATERS, GradeCounts, GradeGrid
from masrel.lab.report._material import Material
from masrel.pages._sections import Drawing, Paragraph, Section, absent_section
from masrel.plots._drawn_values import Drawn
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


def _grid(material: Material, session: str) -> GradeGrid:
    rows = [row for row in material.ratings.rows if row.session == session]
    grades: dict[tuple[str, str], tuple[str, ...]] = {}
    for row in sorted(rows, key=attrgetter("repeat")):
        if row.grade is not None:
            key = row.model, row.rater
            grades[key] = (*grades.get(key, ()), row.grade)
    with_rows, with_columns = {row.model for row in rows}, {row.rater for row in rows}
    models = [model for model in material.protocol.models if model.id in with_rows]
    raters = [r.id for r in material.protocol.raters if r.id in with_columns]
    return GradeGrid(
        raters=tuple(raters),
        models=tuple(model.id for model in models),
        intended=tuple(model.intended_grade for model in models),
        grades=tuple(
            tuple(grades.get((model.id, rater), ()) for rater in raters)
            for model in models
        ),
        scale=material.ratings.scale.grades,
    )


def _grid_blocks(
    material: Material, session: str, grid: GradeGrid
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
    caption = f"Grades of session {session}. Darker is a higher grade"
    if any(intended is not None for intended in grid.intended):
        caption += "; a frame marks a grade other than the intended one"
    drawing = Drawing(
        name=f"grades_{session}",
        caption=f"{caption}.",
        alt=f"Grid of grades. {'; '.join(_grades_by_model(grid))}.",
        content=Drawn(FIGURES + "_study_figures:grade_figure", (grid,)),
        stamp=material.stamp,
    )
    return table, drawing


def _grades_by_model(grid: GradeGrid) -> Iterator[str]:
    by_model = zip(grid.models, grid.intended, grid.grades, strict=True)
    for model, intended, cells in by_model:
        counts = Counter(grade for grades in cells for grade in grades)
        text = ", ".join(f"{n} of grade {grade}" for grade, n in counts.items())
        aim = "" if intended is None else f" (intended {intended})"
        yield f"{model}{aim}: {text or 'no grades'}"


def _counted_blocks(
    material: Material,
    session: str,
    grid: GradeGrid,
    rows: list[tuple[Value, ...]],
    notes: list[str],
) -> tuple[Table, Drawing]:
    # of many raters: how often each grade was given; the CSV has who gave it
    counts = tuple(
        tuple(map(Counter(g for cell in cells for g in cell).__getitem__, grid.scale))
        for cells in grid.grades
    )
    n_raters = counted(len(grid.raters), "rater")
    by_rater = [Column(key=name, heading=name, where="csv") for name in grid.raters]
    by_grade = [Column(key=f"n_{g}", heading=g, where="page") for g in grid.scale]
    table = Table(
        name=f"grades_{session}",
        caption=f"How often {n_raters} gave each grade in session {session}",
        columns=(
            Column(key="model", heading="Model", align="left"),
            Column(key="intended_grade", heading="Intended", align="center"),
            *by_rater,
            *by_grade,
        ),
        rows=tuple((*row, *of_row) for row, of_row in zip(rows, counts, strict=True)),
        notes=(*notes, "The file has the grades of every rater."),
        data=material.data,
    )
    texts = [
        f"{model}: {', '.join(f'{n} of {g}' for g, n in pairs if n) or 'no grades'}"
        for model, of_model in zip(grid.models, counts, strict=True)
        for pairs in [list(zip(grid.scale, of_model, strict=True))]
    ]
    caption = f"How often {n_raters} gave each grade in session {session}. Darker is"
    caption += " more often, of the grades of the model"
    if any(intended is not None for intended in grid.intended):
        caption += "; the intended grade is framed"
    drawing = Drawing(
        name=f"grades_{session}",
        caption=f"{caption}.",
        alt=f"Counts of grades. {'; '.join(texts)}.",
        content=Drawn(
            FIGURES + "_study_figures:count_figure",
            (
                GradeCounts(
                    models=grid.models,
                    intended=grid.intended,
                    scale=grid.scale,
                    counts=counts,
                ),
            ),
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
