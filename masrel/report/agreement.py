"""Sections `agreement` and `test-retest`: coefficients with their intervals."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from masrel.analysis import PlannedEstimate
from masrel.report.estimate_rows import (
    TARGETS,
    EstimateRow,
    estimate_rows,
    interval_name,
    meanings,
)
from masrel.report.material import Drawing, Material, Paragraph, Section
from masrel.report.tables import ABSENT, LANDIS_KOCH, Column, Table, Value, strength

if TYPE_CHECKING:
    from masrel.report.figures import Drawn

__all__ = ["agreement_section", "agreement_table", "retest_section"]

COLUMNS = (
    Column(key="id", heading="Estimate", align="left"),
    Column(key="coefficient", heading="Coefficient", align="left"),
    Column(key="models", heading="Models", align="left"),
    Column(key="sessions", heading="Session", align="left"),
    Column(key="n_items", heading="n models"),
    Column(key="n_raters", heading="n raters"),
    Column(key="value", heading="Value", digits=3),
    Column(key="low", heading="Low", digits=3),
    Column(key="high", heading="High", digits=3),
    Column(key="interval", heading="Interval", align="left"),
    Column(key="target", heading="Speaks of", align="left"),
    Column(key="strength", heading="Strength", align="left"),
    Column(key="observed", heading="Observed", digits=3),
    Column(key="chance", heading="By chance", digits=3),
)


def agreement_section(material: Material) -> Section:
    """Show the inter-rater estimates of the plan.

    Parameters
    ----------
    material : Material
        What the report is made from.

    Returns
    -------
    Section
        The section.
    """
    title = "Agreement between raters"
    blocks = _blocks(material, "inter-rater", "agreement", title)
    return Section(name="agreement", title=title, blocks=blocks)


def retest_section(material: Material) -> Section:
    """Show the test-retest estimates of the plan, and each rater's own.

    Parameters
    ----------
    material : Material
        What the report is made from.

    Returns
    -------
    Section
        The section.
    """
    caption = "Agreement of raters with themselves"
    blocks = _blocks(material, "test-retest", "test_retest", caption)
    return Section(name="test-retest", title="Test-retest agreement", blocks=blocks)


def agreement_table(
    rows: Sequence[EstimateRow], *, name: str, caption: str, data: str
) -> Table:
    """Make a table of estimates.

    Parameters
    ----------
    rows : sequence of EstimateRow
        The estimates.
    name, caption : str
        Name of its file and what it shows.
    data : str
        Where the data come from.

    Returns
    -------
    Table
        One row per estimate: interval, method, target and numbers.
    """
    notes = [f"{row.name}: {remark}" for row in rows for remark in row.remarks]
    if any(_word(row) is not None for row in rows):
        notes.append(LANDIS_KOCH)
    return Table(
        name=name,
        caption=caption,
        columns=COLUMNS,
        rows=tuple(_cells(row) for row in rows),
        notes=tuple(notes),
        data=data,
    )


def _blocks(
    material: Material, kind: str, name: str, caption: str
) -> tuple[Paragraph | Table | Drawing, ...]:
    planned = [p for p in material.analysis.estimates if p.line.kind == kind]
    if not planned:
        return (Paragraph(text="The plan asks for no such estimate.", absent=True),)
    missing = tuple(_missing(entry) for entry in planned if _is_missing(entry))
    if len(missing) == len(planned):
        return missing
    rows = estimate_rows(planned)
    table = agreement_table(rows, name=name, caption=caption, data=material.data)
    said = tuple(Paragraph(text=text) for text in meanings(rows))
    return (table, *said, _forest(material, rows, name, caption), *missing)


def _is_missing(entry: PlannedEstimate) -> bool:
    return entry.estimate is None and not entry.by_rater


def _missing(entry: PlannedEstimate) -> Paragraph:
    text = f"{entry.line.id}: not in these data. {entry.reason}"
    return Paragraph(text=text, absent=True)


def _word(row: EstimateRow) -> str | None:
    if row.estimate is None:
        return None
    word = strength(row.estimate.coefficient, row.estimate.value)
    return None if word == ABSENT else word


def _cells(row: EstimateRow) -> tuple[Value, ...]:
    head = (row.name, row.coefficient, row.models, row.sessions)
    estimate, interval = row.estimate, row.interval
    if estimate is None:
        return (*head, *[None] * 5, row.text, *[None] * 4)
    ends = (None, None, None, None)
    if interval is not None:
        ends = (
            interval.low,
            interval.high,
            interval_name(interval),
            TARGETS[interval.target],
        )
    return (
        *head,
        estimate.n_items,
        estimate.n_raters,
        estimate.value,
        *ends,
        _word(row),
        estimate.observed,
        estimate.chance,
    )


def _forest(
    material: Material, rows: Sequence[EstimateRow], name: str, caption: str
) -> Drawing:
    def draw() -> "Drawn":
        from masrel.report import figures

        lines = [
            figures.ForestRow(
                label=f"{row.coefficient}, {row.name}",
                detail=row.detail,
                value=None if row.estimate is None else row.estimate.value,
                low=None if row.interval is None else row.interval.low,
                high=None if row.interval is None else row.interval.high,
                text=row.text,
            )
            for row in rows
        ]
        axis = "agreement (1 is perfect, 0 is what chance gives a κ)"
        return figures.draw_forest(lines, axis_label=axis, stamp=material.stamp)

    told = "; ".join(f"{row.coefficient}, {row.name}: {row.text}" for row in rows)
    return Drawing(
        name=name,
        caption=f"{caption}: estimates (diamonds) and their intervals (bars).",
        alt=f"Forest plot. {told}.",
        draw=draw,
    )
