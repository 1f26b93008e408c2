"""Sections `categories` and `confusion`: agreement on each grade, and grades given."""

from collections import Counter

from masrel.analysis._category_agreement import category_agreement
from masrel.analysis._exclusions import analysed_ratings
from masrel.report._material import Material, Paragraph, Section, absent_section
from masrel.report._result import main_estimate
from masrel.report._tables import Column, Table, Value, counted, percent

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
        "Agreement: of the ratings in the grade, the part that meets the same of "
        f"another rater. Low, High: its {percent(level)} % confidence interval for "
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


def confusion_section(material: Material) -> Section:
    """Show which grades models of each intended grade were given."""
    grades = material.ratings.scale.grades
    session, met = _met(material)
    if not met:
        reason = "no model with an intended grade has ratings"
        return absent_section("confusion", _CONFUSION, reason)
    rows: list[tuple[Value, ...]] = []
    for aim in grades:
        counts = [met[aim, grade] for grade in grades]
        if n := sum(counts):
            rows.append((aim, *counts, n, 100.0 * met[aim, aim] / n))
    text = (
        f"Of {counted(met.total(), 'grade')} of models with an intended grade, "
        f"{sum(met[aim, aim] for aim in grades)} are the intended one."
    )
    table = Table(
        name="confusion",
        caption=f"{_CONFUSION}, session {session}",
        columns=(
            Column(key="intended_grade", heading="Intended", align="left"),
            *(Column(key=f"grade_{g}", heading=g) for g in grades),
            Column(key="n_ratings", heading="Ratings"),
            Column(key="percent", heading="As intended (%)", digits=1),
        ),
        rows=tuple(rows),
        notes=(
            "Rows: the grade a model was built for; columns: the grades given. Where "
            "the scale has an order, those left of the intended one are too low and "
            "those right of it too high.",
        ),
        data=material.data,
    )
    blocks = (Paragraph(text=text), table)
    return Section(name="confusion", title=_CONFUSION, blocks=blocks)


def _met(material: Material) -> tuple[str | None, Counter[tuple[str, str]]]:
    # the first session that has ratings, and how often grades met intended ones there
    intended = {model.id: model.intended_grade for model in material.protocol.models}
    ratings = analysed_ratings(material.ratings, material.analysis.excluded)
    table = ratings.table[ratings.table["grade"].notna()]
    present = set(table["session"])
    session = next((s for s in material.sessions if s in present), None)
    table = table[table["session"] == session]
    pairs = zip(table["model"], table["grade"], strict=True)
    aims = ((intended[model], grade) for model, grade in pairs)
    return session, Counter((aim, grade) for aim, grade in aims if aim is not None)
