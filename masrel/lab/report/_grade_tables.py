"""Sections `categories` and `confusion`: agreement on each grade, and grades given."""

from masrel.lab.analysis._category_agreement import category_agreement
from masrel.lab.analysis._exclusions import analysed_ratings
from masrel.lab.analysis._given_grades import GivenGrades, given_grades
from masrel.lab.report._figure_data import FIGURES
from masrel.lab.report._material import Material
from masrel.lab.report._result import main_estimate
from masrel.pages._sections import Drawing, Paragraph, Section, absent_section
from masrel.plots._drawn_values import Drawn
from masrel.tables._tables import Column, Table, Value, counted, percent

_CATEGORIES = "Agreement on each grade"
_CONFUSION = "Grades given for each intended grade"
_FEW = 10  # models, below which the intervals of a grade say next to nothing


def categories_section(material: Material) -> Section:
    """Show how well raters agree on each grade, by the ratings of the main estimate."""
    entry = main_estimate(material.analysis)
    if entry is None:
        reason = "the plan asks for no estimate of agreement between raters"
        return absent_section("categories", _CATEGORIES, reason)
    if entry.estimate is None:
        return absent_section("categories", _CATEGORIES, entry.reason)
    level = material.analysis.level
    ratings = analysed_ratings(material.ratings, material.analysis.excluded)
    rows: list[tuple[Value, ...]] = []
    for row in category_agreement(entry, ratings, level):
        numbers: tuple[Value, ...] = (None,) * 4
        if row.n_ratings:
            numbers = (row.agreement, row.low, row.high, row.kappa)
        rows.append((row.grade, row.n_ratings, *numbers))
    n_models = len(entry.models)
    notes = [
        "Agreement: how often, where one rater gave the grade, another rater of the "
        f"model gave it too. Low, High: its {percent(level)} % confidence interval for "
        "these raters on other models like these. κ: Fleiss', of the grade against all "
        "others."
    ]
    if n_models < _FEW:
        notes.append(
            f"The intervals are wide, as they rest on {counted(n_models, 'model')}."
        )
    of = f"{entry.line.models} models, session {entry.line.sessions[0]}"
    table = Table(
        name="categories",
        caption=f"{_CATEGORIES} of the scale, {of}",
        columns=(
            Column(key="grade", heading="Grade", align="left"),
            Column(key="n_ratings", heading="Ratings"),
            Column(key="agreement", heading="Agreement", digits=3),
            Column(key="low", heading="Low", digits=3),
            Column(key="high", heading="High", digits=3),
            Column(key="kappa", heading="κ", digits=3),
        ),
        rows=tuple(rows),
        notes=tuple(notes),
        data=material.data,
    )
    return Section(name="categories", title=_CATEGORIES, blocks=(table,))


def shows_confusion(material: Material) -> bool:
    """Say whether a model with an intended grade has ratings."""
    return bool(_grades_met(material)[1])


def confusion_section(material: Material) -> Section:
    """Show which grades models of each intended grade were given."""
    session, rows = _grades_met(material)
    if session is None or not rows:
        reason = "no model with an intended grade has ratings"
        return absent_section("confusion", _CONFUSION, reason)
    grades = material.ratings.scale.grades
    met = sum(row.counts[grades.index(row.intended)] for row in rows)
    text = (
        f"Of {counted(sum(row.n for row in rows), 'grade')} of models with an intended "
        f"grade, {met} are the intended one."
    )
    blocks = (
        Paragraph(text=text),
        _confusion_drawing(material, session, rows),
        _confusion_table(material, session, rows),
    )
    return Section(name="confusion", title=_CONFUSION, blocks=blocks)


def _grades_met(material: Material) -> tuple[str | None, tuple[GivenGrades, ...]]:
    analysis = material.analysis
    ratings = analysed_ratings(material.ratings, analysis.excluded)
    return given_grades(material.protocol, ratings, analysis.level)


def _confusion_table(
    material: Material, session: str, rows: tuple[GivenGrades, ...]
) -> Table:
    level = percent(material.analysis.level)
    return Table(
        name="confusion",
        caption=f"{_CONFUSION}, session {session}",
        columns=(
            Column(key="intended_grade", heading="Intended", align="left"),
            *(
                Column(key=f"grade_{g}", heading=g)
                for g in material.ratings.scale.grades
            ),
            Column(key="n_ratings", heading="Ratings"),
            Column(key="percent", heading="As intended (%)", digits=1),
            Column(key="low", heading="Low", digits=1),
            Column(key="high", heading="High", digits=1),
        ),
        rows=tuple(
            (
                row.intended,
                *row.counts,
                row.n,
                *(100.0 * share for share in (row.share, row.low, row.high)),
            )
            for row in rows
        ),
        notes=(
            "Rows: the grade a model was built for; columns: the grades given. Where "
            "the scale has an order, those left of the intended one are too low and "
            f"those right of it too high. Low, High: {level} % confidence interval of "
            "the percentage, for other raters like these on these models.",
        ),
        data=material.data,
    )


def _confusion_drawing(
    material: Material, session: str, rows: tuple[GivenGrades, ...]
) -> Drawing:
    grades, level = material.ratings.scale.grades, material.analysis.level
    texts = [
        f"intended {row.intended}: "
        + ", ".join(f"{n} of {g}" for g, n in zip(grades, row.counts, strict=True) if n)
        for row in rows
    ]
    return Drawing(
        name="confusion",
        caption=(
            f"{_CONFUSION}, session {session}. Above: how often; darker is a larger "
            "part of the row, and the intended grade is framed. Below: the part as "
            f"intended, with its {percent(level)} % confidence interval for other "
            "raters like these."
        ),
        alt=f"Counts of grades given. {'; '.join(texts)}.",
        content=Drawn(FIGURES + "_study_figures:aim_pictures", (rows, grades, level)),
        stamp=material.stamp,
    )
