"""The grid of one session's grades: models by raters, as a table and a figure."""

from collections import Counter
from typing import TYPE_CHECKING

from masrel.report.material import Drawing, Material
from masrel.report.tables import Column, Table, counted

if TYPE_CHECKING:
    from masrel.report.figures import Drawn

__all__ = ["grade_grid"]

# by model and rater, the grades of every presentation; none is missing
_Grades = tuple[tuple[tuple[str, ...], ...], ...]


def grade_grid(material: Material, session: str) -> tuple[Table, Drawing]:
    """Lay out the grades of a session.

    Parameters
    ----------
    material : Material
        What the report is made from.
    session : str
        The session.

    Returns
    -------
    tuple of Table and Drawing
        The same grades to read and to see.
    """
    raters, models, grades = _cells(material, session)
    intended = {m.id: m.intended_grade for m in material.protocol.models}
    n_missing = sum(not cell for row in grades for cell in row)
    table = Table(
        name=f"grades_{session}",
        caption=f"Grades of session {session}: models by raters",
        columns=(
            Column(key="model", heading="Model", align="left"),
            Column(key="intended_grade", heading="Intended", align="center"),
            *(Column(key=rater, heading=rater, align="center") for rater in raters),
        ),
        rows=tuple(
            (model, intended[model], *(", ".join(cell) or None for cell in row))
            for model, row in zip(models, grades, strict=True)
        ),
        notes=(f"{counted(n_missing, 'rating')} missing, shown as –.",)
        if n_missing
        else (),
        data=material.data,
    )

    def draw() -> "Drawn":
        from masrel.report import figures

        grid = figures.GradeGrid(
            models=models,
            raters=raters,
            intended=tuple(intended[model] for model in models),
            grades=grades,
            scale=material.ratings.scale.grades,
        )
        return figures.draw_grades(grid, stamp=material.stamp)

    return table, Drawing(
        name=f"grades_{session}",
        caption=(
            f"Grades of session {session}. Darker is a higher grade; a frame marks a "
            "grade other than the intended one."
        ),
        alt=_alt(models, grades, intended),
        draw=draw,
    )


def _cells(
    material: Material, session: str
) -> tuple[tuple[str, ...], tuple[str, ...], _Grades]:
    table = material.ratings.table
    rows = table[table["session"] == session].sort_values("repeat", kind="stable")
    present = set(rows["rater"])
    raters = tuple(r.id for r in material.protocol.raters if r.id in present)
    known = set(rows["model"])
    models = tuple(m.id for m in material.protocol.models if m.id in known)
    given: dict[tuple[str, str], list[str]] = {}
    for model, rater, grade in zip(
        rows["model"], rows["rater"], rows["grade"], strict=True
    ):
        if isinstance(grade, str):
            given.setdefault((model, rater), []).append(grade)
    grades = tuple(tuple(tuple(given.get((m, r), ())) for r in raters) for m in models)
    return raters, models, grades


def _alt(
    models: tuple[str, ...],
    grades: _Grades,
    intended: dict[str, str | None],
) -> str:
    parts = []
    for model, row in zip(models, grades, strict=True):
        counts = Counter(grade for cell in row for grade in cell)
        listed = ", ".join(f"{n} of grade {grade}" for grade, n in counts.items())
        aim = intended[model]
        meant = "" if aim is None else f" (intended {aim})"
        parts.append(f"{model}{meant}: {listed or 'no grades'}")
    return "Grid of grades. " + "; ".join(parts) + "."
