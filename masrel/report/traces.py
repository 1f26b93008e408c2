"""Section `traces`: torque and angle of every rater's stretch, from the model."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from masrel.analysis import Speed
from masrel.elbow import ConstantSpeed, ElbowParameters, peak_torque, trace
from masrel.protocol import elbow_parameters
from masrel.report._tables import Column, Table, as_entered, number, whole_or_tenths
from masrel.report.material import (
    Drawing,
    Material,
    Paragraph,
    Section,
    absent_section,
)

if TYPE_CHECKING:
    from masrel.report.figures import Drawn, TracePanel

__all__ = ["traces_section"]

PANELS_PER_FIGURE = 4

SLOWEST_DRAWN_DEG_S = 1.0
"""Slower is no stretch, and its trace would last for minutes."""


def traces_section(material: Material) -> Section:
    """Show the torque each model makes at each rater's mean speed."""
    speeds = material.analysis.speeds
    title = "Torque traces"
    if speeds is None or not speeds.values:
        why = None if speeds is None else speeds.reason
        return absent_section("traces", title, why)
    moved = [v for v in speeds.values if v.mean_speed_deg_s >= SLOWEST_DRAWN_DEG_S]
    if not moved:
        return absent_section("traces", title, f"every speed is {_TOO_SLOW}")
    session = next(s for s in material.sessions if s in {v.session for v in moved})
    values = [value for value in moved if value.session == session]
    n_still = sum(v.session == session for v in speeds.values) - len(values)
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
            Paragraph(text=_about(material, session, n_still)),
            *drawings,
            _peak_table(material, values, models, session),
        ),
    )


_TOO_SLOW = f"below {as_entered(SLOWEST_DRAWN_DEG_S)} deg/s"


def _about(material: Material, session: str, n_still: int) -> str:
    kind = {
        "published": "published mean speeds",
        "simulated": "mean speeds of the simulated hands",
    }.get(material.data, "recorded mean speeds")
    start = as_entered(material.protocol.stretch.start_deg)
    end, rate_hz = as_entered(_end_deg(material)), material.protocol.device.rate_hz
    about = (
        "These traces are reconstructions, not measurements: each model is stretched "
        f"at constant speed from {start}° to {end}°, at the {kind} of session "
        f"{session}, one line a rater. Torque resists extension; the arm's own inertia "
        "is not in it. Torque and phases are what the control law sends at "
        f"{as_entered(rate_hz)} Hz."
    )
    if n_still:
        about += f" Speeds {_TOO_SLOW}, which are not drawn: {n_still}."
    return about


def _end_deg(material: Material) -> float:
    protocol = material.protocol
    return min(protocol.stretch.end_deg, protocol.elbow.range_end_deg)


def _stretch(material: Material, speed: Speed) -> tuple[ElbowParameters, ConstantSpeed]:
    motion = ConstantSpeed(
        start=math.radians(material.protocol.stretch.start_deg),
        end=math.radians(_end_deg(material)),
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
    peaks: dict[tuple[str, str], float] = {}
    for value in values:
        key = (value.model, value.rater)
        peak = peak_torque(*_stretch(material, value))
        peaks[key] = max(peak, peaks.get(key, peak))
    rows = []
    notes = ["Computed from the exact events of the motion, not from the samples."]
    if len(peaks) < len(values):
        notes.append("Of repeated presentations the largest peak is given.")
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
        notes=tuple(notes),
        data=material.data,
    )
