"""Sections `speeds` and `traces`: how fast raters stretched, and the torque it made."""

from collections.abc import Sequence

import numpy as np

from masrel.analysis import Speed, Speeds, SpeedSummary
from masrel.analysis._descriptions import (
    commanded_traces,
    peak_torques,
    stretch_end_deg,
)
from masrel.report._figure_data import (
    SpeedColumn,
    SpeedDots,
    TraceColumns,
    TracePanel,
)
from masrel.report._material import (
    Drawing,
    Material,
    Paragraph,
    Section,
    absent_section,
)
from masrel.report._tables import Column, Table, as_entered, number, whole_or_tenths

_PANELS_PER_FIGURE = 4

# Slower is no stretch, and its trace would last for minutes.
_SLOWEST_DRAWN_DEG_S = 1.0

_TOO_SLOW = f"below {as_entered(_SLOWEST_DRAWN_DEG_S)} deg/s"


def speeds_section(material: Material) -> Section:
    """Show the mean speeds per model and per rater."""
    speeds = material.analysis.speeds
    title = "Stretching speeds"
    if speeds is None or not speeds.values:
        return absent_section("speeds", title, speeds.reason if speeds else None)
    text = (
        "Mean speed of the phase before the catch, which sets the catch angle by "
        "equation (2); below ν_L the catch angle no longer changes."
    )
    if speeds.n_missing:
        text += f" Ratings whose speed is not known: {speeds.n_missing}."
    digits = whole_or_tenths([speed.mean_speed_deg_s for speed in speeds.values])
    return Section(
        name="speeds",
        title=title,
        blocks=(
            Paragraph(text=text),
            _summary_table(material, speeds.by_model, "model", digits),
            _speed_drawing(material, speeds),
            _summary_table(material, speeds.by_rater, "rater", digits),
        ),
    )


def _summary_table(
    material: Material, summaries: tuple[SpeedSummary, ...], by: str, digits: int
) -> Table:
    return Table(
        name=f"speeds_by_{by}",
        caption=f"Mean stretching speeds per {by} (deg/s)",
        columns=(
            Column(key=by, heading=by.capitalize(), align="left"),
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


def _speed_drawing(material: Material, speeds: Speeds) -> Drawing:
    known: dict[tuple[str, str, str], tuple[float, ...]] = {}
    for value in speeds.values:
        key = (value.session, value.model, value.rater)
        known[key] = (*known.get(key, ()), value.mean_speed_deg_s)
    columns = [
        SpeedColumn(
            model=s.name,
            session=s.session,
            speeds=tuple(
                known.get((s.session, s.name, r), ()) for r in material.raters
            ),
            mean=s.mean,
        )
        for s in speeds.by_model
    ]
    text = "; ".join(
        f"{s.name} in {s.session}: mean {number(s.mean, 0)}, "
        f"{number(s.least, 0)} to {number(s.most, 0)} deg/s"
        for s in speeds.by_model
    )
    return Drawing(
        name="speeds",
        caption=(
            "Mean stretching speed of every rater for every model, and the mean over "
            "raters (bar). Dashed: ν_L, below which the catch angle stays the same."
        ),
        alt=f"Dot plot of speeds. {text}.",
        content=SpeedDots(
            columns=tuple(columns),
            raters=material.raters,
            slowest=material.protocol.elbow.slowest_mean_speed_deg_s,
        ),
        stamp=material.stamp,
    )


def traces_section(material: Material) -> Section:
    """Show the torque each model makes at each rater's mean speed."""
    speeds = material.analysis.speeds
    title = "Torque traces"
    if speeds is None or not speeds.values:
        return absent_section("traces", title, speeds.reason if speeds else None)
    moved = [v for v in speeds.values if v.mean_speed_deg_s >= _SLOWEST_DRAWN_DEG_S]
    if not moved:
        return absent_section("traces", title, f"every speed is {_TOO_SLOW}")
    session = next(s for s in material.sessions if s in {v.session for v in moved})
    values = [value for value in moved if value.session == session]
    n_still = sum(v.session == session for v in speeds.values) - len(values)
    stretched = {value.model for value in values}
    models = [m.id for m in material.protocol.models if m.id in stretched]
    drawings = [
        _trace_drawing(material, values, models, first)
        for first in range(0, len(models), _PANELS_PER_FIGURE)
    ]
    return Section(
        name="traces",
        title=title,
        blocks=(
            Paragraph(text=_about_traces(material, session, n_still)),
            *drawings,
            _peak_table(material, values, models, session),
        ),
    )


def _about_traces(material: Material, session: str, n_still: int) -> str:
    kind = {
        "published": "published mean speeds",
        "simulated": "mean speeds of the simulated hands",
    }.get(material.data, "recorded mean speeds")
    protocol = material.protocol
    text = (
        "These traces are reconstructions, not measurements: each model is stretched "
        f"at constant speed from {as_entered(protocol.stretch.start_deg)}° to "
        f"{as_entered(stretch_end_deg(protocol))}°, at the {kind} of session "
        f"{session}, one line a rater. Torque resists extension; the arm's own inertia "
        "is not in it. Torque and phases are what the control law sends at "
        f"{as_entered(protocol.device.rate_hz)} Hz."
    )
    if n_still:
        text += f" Speeds {_TOO_SLOW}, which are not drawn: {n_still}."
    return text


def _trace_drawing(
    material: Material, values: Sequence[Speed], models: Sequence[str], first: int
) -> Drawing:
    # the models of one figure, from the `first` on
    models = models[first : first + _PANELS_PER_FIGURE]
    panels = [
        _panel(material, model, [value for value in values if value.model == model])
        for model in models
    ]
    listed = ", ".join(models)
    return Drawing(
        name=f"traces_{first // _PANELS_PER_FIGURE + 1}",
        caption=(
            f"Reconstructed torque (top) and angle (bottom) of {listed} at every "
            "rater's mean speed. Thin grey: before the catch; thick: catch; dashed: "
            "after the catch; a dot marks where a phase begins."
        ),
        alt=(
            f"Torque and angle against time for {listed}. Torque rises slowly, jumps "
            "at the catch, falls to a residual, and rises again after the catch; the "
            "peaks are in the table of peak torques."
        ),
        content=TraceColumns(panels=tuple(panels)),
        stamp=material.trace_stamp,
    )


def _panel(material: Material, model: str, values: Sequence[Speed]) -> TracePanel:
    protocol = material.protocol
    intended = {m.id: m.intended_grade for m in protocol.models}[model]
    speeds = [value.mean_speed_deg_s for value in values]
    digits = whole_or_tenths(speeds)
    slowest, fastest = number(min(speeds), digits), number(max(speeds), digits)
    grade = "" if intended is None else f" ({protocol.scale.name} {intended})"
    return TracePanel(
        title=f"{model}{grade}\n{slowest} to {fastest} deg/s",
        stretches=tuple(
            (made.time, np.degrees(made.angle), made.torque, made.phase)
            for made in commanded_traces(protocol, values)
        ),
    )


def _peak_table(
    material: Material, values: Sequence[Speed], models: Sequence[str], session: str
) -> Table:
    present = {value.rater for value in values}
    raters = [rater for rater in material.raters if rater in present]
    peaks = peak_torques(material.protocol, values)
    notes = ["Computed from the exact events of the motion, not from the samples."]
    if len(peaks) < len(values):
        notes.append("Of repeated presentations the largest peak is given.")
    rows = []
    for model in models:
        of_raters = [peaks.get((model, rater)) for rater in raters]
        known = [peak for peak in of_raters if peak is not None]
        rows.append((model, *of_raters, min(known), max(known)))
    return Table(
        name="peak_torque",
        caption=(
            f"Peak model torque at each rater's mean speed, session {session} (N·m)"
        ),
        columns=(
            Column(key="model", heading="Model", align="left"),
            *(Column(key=f"{rater}_nm", heading=rater, digits=2) for rater in raters),
            Column(key="least_nm", heading="Least", digits=2),
            Column(key="most_nm", heading="Most", digits=2),
        ),
        rows=tuple(rows),
        notes=tuple(notes),
        data=material.data,
    )
