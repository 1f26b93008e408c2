"""Section `traces`: torque and angle of every rater's stretch, from the model."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from masrel.analysis import Speed
from masrel.elbow import ConstantSpeed, ElbowParameters, peak_torque, trace
from masrel.protocol import elbow_parameters
from masrel.report.material import (
    Drawing,
    Material,
    Paragraph,
    Section,
    absent_section,
)
from masrel.report.tables import Column, Table, as_given, number, whole_or_tenths

if TYPE_CHECKING:
    from masrel.report.figures import Drawn, TracePanel

__all__ = ["traces_section"]

PANELS_PER_FIGURE = 4


def traces_section(material: Material) -> Section:
    """Show the torque each model makes at each rater's mean speed.

    Parameters
    ----------
    material : Material
        What the report is made from.

    Returns
    -------
    Section
        The section.
    """
    speeds = material.analysis.speeds
    title = "Torque traces"
    if speeds is None or not speeds.values:
        why = None if speeds is None else speeds.reason
        return absent_section("traces", title, why)
    session = next(s for s in material.sessions if s in _sessions_of(speeds.values))
    values = [value for value in speeds.values if value.session == session]
    models = [
        model.id
        for model in material.protocol.models
        if any(value.model == model.id for value in values)
    ]
    drawings = [
        _drawing(material, values, models[first : first + PANELS_PER_FIGURE], first)
        for first in range(0, len(models), PANELS_PER_FIGURE)
    ]
    return Section(
        name="traces",
        title=title,
        blocks=(
            Paragraph(text=_about(material, session)),
            *drawings,
            _peak_table(material, values, models, session),
        ),
    )


def _sessions_of(values: Sequence[Speed]) -> set[str]:
    return {value.session for value in values}


def _about(material: Material, session: str) -> str:
    kind = {
        "published": "published mean speeds",
        "simulated": "mean speeds of the simulated hands",
    }.get(material.data, "recorded mean speeds")
    start = as_given(material.protocol.stretch.start_deg)
    return (
        "These traces are reconstructions, not measurements: each model is stretched "
        f"at constant speed from {start}° to the end "
        f"of the range at the {kind} of session {session}, one line a rater. Torque "
        "resists extension; the arm's own inertia is not in it. Torque and phases are "
        "what the control law sends at 1 kHz."
    )


def _stretch(material: Material, speed: Speed) -> tuple[ElbowParameters, ConstantSpeed]:
    stretch = material.protocol.stretch
    end = min(stretch.end_deg, material.protocol.elbow.range_end_deg)
    motion = ConstantSpeed(
        start=math.radians(stretch.start_deg),
        end=math.radians(end),
        speed=math.radians(speed.mean_speed_deg_s),
    )
    return elbow_parameters(material.protocol, speed.model), motion


def _drawing(
    material: Material, values: Sequence[Speed], models: Sequence[str], first: int
) -> Drawing:
    def draw() -> "Drawn":
        from masrel.report import figures

        panels = [_panel(material, values, model) for model in models]
        return figures.draw_traces(panels, stamp=material.trace_stamp)

    page = first // PANELS_PER_FIGURE + 1
    listed = ", ".join(models)
    return Drawing(
        name=f"traces_{page}",
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
        draw=draw,
    )


def _panel(material: Material, values: Sequence[Speed], model: str) -> "TracePanel":
    import numpy as np

    from masrel.report import figures

    stretches = []
    for value in values:
        if value.model != model:
            continue
        parameters, motion = _stretch(material, value)
        drawn = trace(parameters, motion, rate_hz=material.protocol.device.rate_hz)
        stretches.append(
            (
                drawn.time,
                np.degrees(drawn.angle),
                drawn.torque,
                drawn.phase.astype(np.float64),
            )
        )
    intended = {m.id: m.intended_grade for m in material.protocol.models}[model]
    scale = material.protocol.scale.name
    title = model if intended is None else f"{model} ({scale} {intended})"
    speeds = [v.mean_speed_deg_s for v in values if v.model == model]
    digits = whole_or_tenths(speeds)
    slowest, fastest = number(min(speeds), digits), number(max(speeds), digits)
    title += f"\n{slowest} to {fastest} deg/s"
    return figures.TracePanel(title=title, stretches=tuple(stretches))


def _peak_table(
    material: Material, values: Sequence[Speed], models: Sequence[str], session: str
) -> Table:
    present = {value.rater for value in values}
    raters = [rater for rater in material.raters if rater in present]
    peaks = {
        (value.model, value.rater): peak_torque(*_stretch(material, value))
        for value in values
    }
    rows = []
    for model in models:
        own = [peaks.get((model, rater)) for rater in raters]
        known = [peak for peak in own if peak is not None]
        rows.append((model, *own, min(known), max(known)))
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
        notes=("Computed from the exact events of the motion, not from the samples.",),
        data=material.data,
    )
