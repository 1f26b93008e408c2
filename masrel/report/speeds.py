"""Section `speeds`: how fast the raters stretched each model."""

from typing import TYPE_CHECKING

from masrel.analysis import Speeds, SpeedSummary
from masrel.report._tables import Column, Table, number, whole_or_tenths
from masrel.report.material import (
    Drawing,
    Material,
    Paragraph,
    Section,
    absent_section,
)

if TYPE_CHECKING:
    from masrel.report.figures import Drawn, SpeedColumn

__all__ = ["speeds_section"]


def speeds_section(material: Material) -> Section:
    """Show the mean speeds per model and per rater."""
    found = material.analysis.speeds
    if found is None or not found.values:
        why = None if found is None else found.reason
        return absent_section("speeds", "Stretching speeds", why)
    about = (
        "Mean speed of the phase before the catch, which sets the catch angle by "
        "equation (2); below ν_L the catch angle no longer changes."
    )
    if found.n_missing:
        about += f" Ratings whose speed is not known: {found.n_missing}."
    return Section(
        name="speeds",
        title="Stretching speeds",
        blocks=(
            Paragraph(text=about),
            _summary(material, found.by_model, "speeds_by_model", "model"),
            _drawing(material, found),
            _summary(material, found.by_rater, "speeds_by_rater", "rater"),
        ),
    )


def _summary(
    material: Material, summaries: tuple[SpeedSummary, ...], name: str, what: str
) -> Table:
    speeds = material.analysis.speeds
    values = [] if speeds is None else [v.mean_speed_deg_s for v in speeds.values]
    digits = whole_or_tenths(values)
    return Table(
        name=name,
        caption=f"Mean stretching speeds per {what} (deg/s)",
        columns=(
            Column(key=what, heading=what.capitalize(), align="left"),
            Column(key="session", heading="Session", align="left"),
            Column(key="n", heading="n"),
            Column(key="mean_deg_s", heading="Mean", digits=1),
            Column(key="sd_deg_s", heading="SD (n − 1)", digits=1),
            Column(key="least_deg_s", heading="Least", digits=digits),
            Column(key="most_deg_s", heading="Most", digits=digits),
        ),
        rows=tuple(
            (s.name, s.session, s.n, s.mean, s.sd, s.least, s.most) for s in summaries
        ),
        data=material.data,
    )


def _drawing(material: Material, found: Speeds) -> Drawing:
    def draw() -> "Drawn":
        from masrel.report import figures

        return figures.draw_speeds(
            _columns(material, found),
            raters=material.raters,
            slowest=material.protocol.elbow.slowest_mean_speed_deg_s,
            stamp=material.stamp,
        )

    told = "; ".join(
        f"{s.name} in {s.session}: mean {number(s.mean, 0)}, "
        f"{number(s.least, 0)} to {number(s.most, 0)} deg/s"
        for s in found.by_model
    )
    return Drawing(
        name="speeds",
        caption=(
            "Mean stretching speed of every rater for every model, and the mean over "
            "raters (bar). Dashed: ν_L, below which the catch angle stays the same."
        ),
        alt=f"Dot plot of speeds. {told}.",
        draw=draw,
    )


def _columns(material: Material, found: Speeds) -> "list[SpeedColumn]":
    from masrel.report.figures import SpeedColumn

    known: dict[tuple[str, str, str], list[float]] = {}
    for value in found.values:
        key = (value.session, value.model, value.rater)
        known.setdefault(key, []).append(value.mean_speed_deg_s)
    return [
        SpeedColumn(
            model=summary.name,
            session=summary.session,
            speeds=tuple(
                tuple(known.get((summary.session, summary.name, rater), ()))
                for rater in material.raters
            ),
            mean=summary.mean,
        )
        for summary in found.by_model
    ]
