"""Sections `speeds` and `traces`: how fast raters stretched, and the torque it made."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from masrel.analysis import Speed, Speeds, SpeedSummary
from masrel.elbow import (
    ConstantSpeed,
    ElbowParameters,
    JointModel,
    Outline,
    Trace,
    evaluate,
    outline,
    trace,
)
from masrel.protocol import Protocol, joint_model
from masrel.protocol._kinds import DEFAULT_KIND
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
from masrel.report._measured_torque import measured_blocks
from masrel.report._tables import (
    Column,
    Table,
    Value,
    as_entered,
    number,
    whole_or_tenths,
)

_PANELS_PER_FIGURE = 4
_N_POINTS = 200  # of a line: a panel is not much wider

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
    if _has_many(speeds.values):
        text += (
            " Where a rater stretched the arm more than once, n counts stretches that "
            "reached ν_th."
        )
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
    graded: dict[tuple[str, str, str], tuple[float, ...]] = {}
    for value in speeds.values:
        key = (value.session, value.model, value.rater)
        known[key] = (*known.get(key, ()), value.mean_speed_deg_s)
        if value.is_graded:
            graded[key] = (*graded.get(key, ()), value.mean_speed_deg_s)
    columns = [
        SpeedColumn(
            model=s.name,
            session=s.session,
            speeds=tuple(
                known.get((s.session, s.name, r), ()) for r in material.raters
            ),
            mean=s.mean,
            graded=tuple(
                graded.get((s.session, s.name, r), ()) for r in material.raters
            ),
        )
        for s in speeds.by_model
    ]
    text = "; ".join(
        f"{s.name} in {s.session}: mean {number(s.mean, 0)}, "
        f"{number(s.least, 0)} to {number(s.most, 0)} deg/s"
        for s in speeds.by_model
    )
    of = "rater for every model, and the mean over raters"
    if _has_many(speeds.values):
        of = "stretch of every rater for every model, and the mean over stretches"
    caption = (
        f"Mean stretching speed of every {of} (bar). Dashed: ν_L, below which the "
        "catch angle stays the same."
    )
    if graded:
        caption += " Ringed: the stretch that the rater said the grade rests on."
    return Drawing(
        name="speeds",
        caption=caption,
        alt=f"Dot plot of speeds. {text}.",
        content=SpeedDots(
            columns=tuple(columns),
            raters=material.raters,
            slowest=material.protocol.elbow.slowest_mean_speed_deg_s,
        ),
        stamp=material.stamp,
    )


def _has_many(speeds: Sequence[Speed]) -> bool:
    # whether there was more than one stretch to a presentation
    return any(speed.stretch is not None and speed.stretch > 1 for speed in speeds)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stretch:
    speed: Speed  # whose it is, and how fast
    trace: Outline | Trace  # of the exact law, or samples of another kind
    peak: float  # its largest torque, N·m


def traces_section(material: Material) -> Section:
    """Show the torque each model makes at each rater's mean speed."""
    speeds, protocol = material.analysis.speeds, material.protocol
    title = "Torque traces"
    if speeds is None or not speeds.values:
        return absent_section("traces", title, speeds.reason if speeds else None)
    moved = [v for v in speeds.values if v.mean_speed_deg_s >= _SLOWEST_DRAWN_DEG_S]
    if not moved:
        return absent_section("traces", title, f"every speed is {_TOO_SLOW}")
    session = next(s for s in material.sessions if s in {v.session for v in moved})
    end_deg = min(protocol.stretch.end_deg, protocol.elbow.range_end_deg)
    values = [value for value in moved if value.session == session]
    stretches = _stretches(protocol, values, end_deg)
    kind = {
        "published": "published mean speeds",
        "simulated": "mean speeds of the simulated hands",
        "simulated device": "mean speeds of the simulated hands",
    }.get(material.data, "recorded mean speeds")
    each = "stretch" if _has_many(values) else "rater"
    text = (
        "These traces are reconstructions, not measurements: each model is stretched "
        f"at constant speed from {as_entered(protocol.stretch.start_deg)}° to "
        f"{as_entered(end_deg)}°, at the {kind} of session "
        f"{session}, one line a {each}. Torque resists extension; the arm's own "
        "inertia is not in it."
    )
    if any(value.is_graded for value in values):
        text += " A thicker line is the stretch that the rater said the grade rests on."
    n_still = sum(v.session == session for v in speeds.values) - len(values)
    if n_still:
        text += f" Speeds {_TOO_SLOW}, which are not drawn: {n_still}."
    drawings = [
        _trace_drawing(material, stretches[first : first + _PANELS_PER_FIGURE], nth)
        for nth, first in enumerate(
            range(0, len(stretches), _PANELS_PER_FIGURE), start=1
        )
    ]
    table = _peak_table(material, stretches, session)
    return Section(
        name="traces",
        title=title,
        blocks=(Paragraph(text=text), *drawings, table, *measured_blocks(material)),
    )


def _stretches(
    protocol: Protocol, speeds: Sequence[Speed], end_deg: float
) -> list[tuple[str, list[_Stretch]]]:
    # by model, in the protocol's order: each at constant speed over the whole range
    stretches = []
    for model in protocol.models:
        of_model = [speed for speed in speeds if speed.model == model.id]
        if of_model:
            joint = joint_model(protocol, model.id)
            stretches.append((model.id, _of_model(protocol, joint, of_model, end_deg)))
    return stretches


def _of_model(
    protocol: Protocol, joint: JointModel, speeds: Sequence[Speed], end_deg: float
) -> list[_Stretch]:
    start, rate_hz = math.radians(protocol.stretch.start_deg), protocol.device.rate_hz
    end = min(math.radians(end_deg), joint.range_end)
    motions = [
        ConstantSpeed(start=start, end=end, speed=math.radians(speed.mean_speed_deg_s))
        for speed in speeds
    ]
    made: Sequence[Outline | Trace]
    if isinstance(joint, ElbowParameters):
        made = [outline(joint, motion, n_points=_N_POINTS) for motion in motions]
        peaks = evaluate(joint, motions, ["peak_torque"]).column("peak_torque").tolist()
    else:
        made = [trace(joint, motion, rate_hz=rate_hz) for motion in motions]
        peaks = [float(line.torque.max()) for line in made]
    return [
        _Stretch(speed=speed, trace=line, peak=peak)
        for speed, line, peak in zip(speeds, made, peaks, strict=True)
    ]


def _trace_drawing(
    material: Material, stretches: Sequence[tuple[str, list[_Stretch]]], nth: int
) -> Drawing:
    # of the models of the nth figure
    intended = {m.id: m.intended_grade for m in material.protocol.models}
    panels = []
    for model, made in stretches:
        speeds = [stretch.speed.mean_speed_deg_s for stretch in made]
        digits = whole_or_tenths(speeds)
        slowest, fastest = number(min(speeds), digits), number(max(speeds), digits)
        grade = ""
        if intended[model] is not None:
            grade = f" ({material.protocol.scale.name} {intended[model]})"
        traces = [stretch.trace for stretch in made]
        panels.append(
            TracePanel(
                title=f"{model}{grade}\n{slowest} to {fastest} deg/s",
                stretches=tuple(
                    (t.time, np.degrees(t.angle), t.torque, t.phase) for t in traces
                ),
                graded=tuple(stretch.speed.is_graded for stretch in made),
            )
        )
    listed = ", ".join(model for model, _ in stretches)
    made_of = [stretch.speed for _, made in stretches for stretch in made]
    whose = "every stretch's" if _has_many(made_of) else "every rater's"
    shape = (
        "Torque rises slowly, jumps at the catch, falls to a residual, and rises again "
        "after the catch; the"
    )
    if _of_other_kinds(material) & {model for model, _ in stretches}:
        shape = "The"
    return Drawing(
        name=f"traces_{nth}",
        caption=(
            f"Reconstructed torque (top) and angle (bottom) of {listed} at {whose} "
            "mean speed. Thin grey: before the catch; thick: catch; dashed: "
            "after the catch; a dot marks where a phase begins."
        ),
        alt=(
            f"Torque and angle against time for {listed}. {shape} "
            "peaks are in the table of peak torques."
        ),
        content=TraceColumns(panels=tuple(panels)),
        stamp=material.trace_stamp,
    )


def _of_other_kinds(material: Material) -> set[str]:
    return {m.id for m in material.protocol.models if m.kind != DEFAULT_KIND}


def _peak_table(
    material: Material, stretches: Sequence[tuple[str, list[_Stretch]]], session: str
) -> Table:
    present = {stretch.speed.rater for _, made in stretches for stretch in made}
    raters = [rater for rater in material.raters if rater in present]
    notes = [
        "The largest torque of all phases, be it in the catch or at the end of the "
        "stretch, computed from the exact events of the motion, not from the samples."
    ]
    rows: list[tuple[Value, ...]] = []
    has_repeats = has_many = False
    for model, made in stretches:
        peaks: dict[str, float] = {}
        for stretch in made:
            rater = stretch.speed.rater
            peaks[rater] = max(stretch.peak, peaks.get(rater, stretch.peak))
        has_repeats = has_repeats or len(peaks) < len(made)
        has_many = has_many or _has_many([stretch.speed for stretch in made])
        of_raters = [peaks.get(rater) for rater in raters]
        rows.append((model, *of_raters, min(peaks.values()), max(peaks.values())))
    others = [model for model, _ in stretches if model in _of_other_kinds(material)]
    if others:
        notes.append(f"Of {', '.join(others)} it is the largest sample.")
    if has_many:
        notes.append("Of several stretches the largest peak is given.")
    elif has_repeats:
        notes.append("Of repeated presentations the largest peak is given.")
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
