"""The grid of one session's grades: models by raters, as a table and a figure."""

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

from masrel.report._tables import Column, Table, counted
from masrel.report.material import Drawing, Material

if TYPE_CHECKING:
    from masrel.report.figures import Drawn

__all__ = ["grade_grid"]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Grid:
    raters: tuple[str, ...]
    models: tuple[str, ...]
    intended: tuple[str | None, ...]  # by model
    # by model and rater, the grades of every presentation; none is missing
    grades: tuple[tuple[tuple[str, ...], ...], ...]


def grade_grid(material: Material, session: str) -> tuple[Table, Drawing]:
    """Lay out the grades of a session."""
    grid = _grid(material, session)
    return _table(material, session, grid), _drawing(material, session, grid)


def _grid(material: Material, session: str) -> _Grid:
    table = material.ratings.table
    rows = table[table["session"] == session].sort_values("repeat", kind="stable")
    present, known = set(rows["rater"]), set(rows["model"])
    raters = tuple(r.id for r in material.protocol.raters if r.id in present)
    models = [model for model in material.protocol.models if model.id in known]
    given: dict[tuple[str, str], list[str]] = {}
    for model, rater, grade in zip(
        rows["model"], rows["rater"], rows["grade"], strict=True
    ):
        if isinstance(grade, str):
            given.setdefault((model, rater), []).append(grade)
    return _Grid(
        raters=raters,
        models=tuple(model.id for model in models),
        intended=tuple(model.intended_grade for model in models),
        grades=tuple(
            tuple(tuple(given.get((model.id, rater), ())) for rater in raters)
            for model in models
        ),
    )


def _table(material: Material, session: str, grid: _Grid) -> Table:
    n_missing = sum(not cell for row in grid.grades for cell in row)
    notes = [f"{counted(n_missing, 'rating')} missing, shown as –."]
    return Table(
        name=f"grades_{session}",
        caption=f"Grades of session {session}: models by raters",
        columns=(
            Column(key="model", heading="Model", align="left"),
            Column(key="intended_grade", heading="Intended", align="center"),
            *(Column(key=name, heading=name, align="center") for name in grid.raters),
        ),
        rows=tuple(
            (model, intended, *(", ".join(cell) or None for cell in row))
            for model, intended, row in zip(
                grid.models, grid.intended, grid.grades, strict=True
            )
        ),
        notes=tuple(notes if n_missing else ()),
        data=material.data,
    )


def _drawing(material: Material, session: str, grid: _Grid) -> Drawing:
    def draw() -> "Drawn":
        from masrel.report import figures

        drawn = figures.GradeGrid(
            models=grid.models,
            raters=grid.raters,
            intended=grid.intended,
            grades=grid.grades,
            scale=material.ratings.scale.grades,
        )
        return figures.draw_grades(drawn, stamp=material.stamp)

    caption = f"Grades of session {session}. Darker is a higher grade"
    if any(intended is not None for intended in grid.intended):
        caption += "; a frame marks a grade other than the intended one"
    return Drawing(
        name=f"grades_{session}", caption=f"{caption}.", alt=_alt(grid), draw=draw
    )


def _alt(grid: _Grid) -> str:
    parts = []
    for model, intended, row in zip(
        grid.models, grid.intended, grid.grades, strict=True
    ):
        counts = Counter(grade for cell in row for grade in cell)
        listed = ", ".join(f"{n} of grade {grade}" for grade, n in counts.items())
        meant = "" if intended is None else f" (intended {intended})"
        parts.append(f"{model}{meant}: {listed or 'no grades'}")
    return "Grid of grades. " + "; ".join(parts) + "."
