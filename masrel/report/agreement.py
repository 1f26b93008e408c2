"""Sections `agreement` and `test-retest`: coefficients with their intervals."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from masrel.analysis import PlannedEstimate
from masrel.report._tables import Table
from masrel.report.estimate_rows import EstimateRow, estimate_rows, meanings
from masrel.report.estimate_table import estimate_table
from masrel.report.material import Drawing, Material, Paragraph, Section

if TYPE_CHECKING:
    from masrel.report.figures import Drawn

__all__ = ["agreement_section", "retest_section"]


_MARKS = (
    "confidence as lines with ends, credible as broad bars, with the posterior density "
    "or the resamples above where there are any"
)


def agreement_section(material: Material) -> Section:
    """Show the inter-rater estimates of the plan."""
    title = "Agreement between raters"
    blocks = _blocks(material, "inter-rater", "agreement", title)
    return Section(name="agreement", title=title, blocks=blocks)


def retest_section(material: Material) -> Section:
    """Show the test-retest estimates of the plan, and each rater's own."""
    caption = "Agreement of raters with themselves"
    blocks = _blocks(material, "test-retest", "test_retest", caption)
    return Section(name="test-retest", title="Test-retest agreement", blocks=blocks)


def _blocks(
    material: Material, kind: str, name: str, caption: str
) -> tuple[Paragraph | Table | Drawing, ...]:
    planned = [p for p in material.analysis.estimates if p.line.kind == kind]
    if not planned:
        return (Paragraph(text="The plan asks for no such estimate.", absent=True),)
    if all(_is_missing(entry) for entry in planned):
        return tuple(_missing(entry) for entry in planned)
    rows = estimate_rows(planned)
    table = estimate_table(rows, name=name, caption=caption, data=material.data)
    said = tuple(Paragraph(text=text) for text in meanings(rows))
    return (table, *said, _forest(material, rows, name, caption))


def _is_missing(entry: PlannedEstimate) -> bool:
    return entry.estimate is None and not entry.by_rater


def _missing(entry: PlannedEstimate) -> Paragraph:
    text = f"{entry.line.id} is not in these data: {entry.reason}."
    return Paragraph(text=text, absent=True)


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
                interval=row.interval,
                text=row.text,
                has_zero=row.has_zero,
            )
            for row in rows
        ]
        axis = "agreement (1 is perfect)"
        return figures.draw_forest(lines, axis_label=axis, stamp=material.stamp)

    told = "; ".join(f"{row.coefficient}, {row.name}: {row.text}" for row in rows)
    return Drawing(
        name=name,
        caption=(
            f"{caption}: estimates (dots) and their intervals, {_MARKS}. Dashed: what "
            "chance gives."
        ),
        alt=f"Forest plot. {told}.",
        draw=draw,
    )
