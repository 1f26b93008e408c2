"""Section `traces`: the torque that models make at the speeds of the raters."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from masrel.lab.analysis import Speed
from masrel.lab.elbow import (
    ConstantSpeed,
    ElbowParameters,
    Outline,
    Trace,
    evaluate,
    outline,
    trace,
)
from masrel.lab.protocol import Protocol, joint_model
from masrel.lab.protocol._kinds import DEFAULT_KIND
from masrel.lab.report._figure_data import (
    FIGURES,
    MANY_MODELS,
    MANY_RATERS,
    MANY_STRETCHES,
    TraceBand,
    TracePanel,
)
from masrel.lab.report._material import Material
from masrel.lab.report._measured_torque import measured_blocks
from masrel.lab.report._stretches import at_ranks, has_many, whole_or_tenths
from masrel.pages._sections import Drawing, Paragraph, Section, absent_section
from masrel.plots._drawn_values import Drawn
from masrel.tables._tables import Column, Table, Value, as_entered, number

_PANELS_PER_FIGURE, _SMALL_PANELS_PER_FIGURE = 4, 24
_N_POINTS = 200  # of a line: a panel is not much wider
_N_IN_BAND = 100  # lines that a band rests on
_BAND_SHARES = (0.05, 0.25, 0.75, 0.95)

# Slower is no stretch, and its trace would last for minutes.
_SLOWEST_DRAWN_DEG_S = 1.0

_TOO_SLOW = f"below {as_entered(_SLOWEST_DRAWN_DEG_S)} deg/s"


_Line = Outline | Trace  # of the exact law, or samples of another kind


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stretch:
    speed: Speed  # whose it is, and how fast
    peak: float  # its largest torque, N·m


@dataclass(frozen=True, slots=True, kw_only=True)
class _Model:
    id: str
    stretches: tuple[_Stretch, ...]
    # what is drawn: every stretch, or a few of many
    shown: tuple[_Stretch, ...]
    lines: tuple[_Line, ...]  # of those that are shown
    band: TraceBand | None  # of all, where they are many


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
    models = _models(protocol, values, end_deg)
    text = _traces_text(material, values, end_deg)
    n_still = sum(v.session == session for v in speeds.values) - len(values)
    if n_still:
        text += f" Speeds {_TOO_SLOW}, which are not drawn: {n_still}."
    has_angle = len(models) <= MANY_MODELS
    size = _PANELS_PER_FIGURE if has_angle else _SMALL_PANELS_PER_FIGURE
    drawings = [
        _trace_drawing(material, models[first : first + size], nth, has_angle=has_angle)
        for nth, first in enumerate(range(0, len(models), size), start=1)
    ]
    table = _peak_table(material, models, session)
    return Section(
        name="traces",
        title=title,
        blocks=(Paragraph(text=text), *drawings, table, *measured_blocks(material)),
    )


def _traces_text(material: Material, values: Sequence[Speed], end_deg: float) -> str:
    # the values are of one session
    session, start_deg = values[0].session, material.protocol.stretch.start_deg
    kind = {
        "published": "published mean speeds",
        "simulated": "mean speeds of the simulated hands",
        "simulated device": "mean speeds of the simulated hands",
    }.get(material.data, "recorded mean speeds")
    each = "stretch" if has_many(values) else "rater"
    most = max(Counter(value.model for value in values).values())
    of_many = f", or a few of more than {MANY_STRETCHES}" * (most > MANY_STRETCHES)
    text = (
        "These traces are reconstructions, not measurements: each model is stretched "
        f"at constant speed from {as_entered(start_deg)}° to "
        f"{as_entered(end_deg)}°, at the {kind} of session "
        f"{session}, one line a {each}{of_many}. Torque resists extension; the arm's "
        "own inertia is not in it."
    )
    if any(value.is_graded for value in values):
        text += " A thicker line is the stretch that the rater said the grade rests on."
    return text


def _models(
    protocol: Protocol, speeds: Sequence[Speed], end_deg: float
) -> list[_Model]:
    # in the protocol's order: each at constant speed over the whole range
    models = []
    for model in protocol.models:
        of_model = [speed for speed in speeds if speed.model == model.id]
        if of_model:
            models.append(_model(protocol, model.id, of_model, end_deg))
    return models


def _model(
    protocol: Protocol, model: str, speeds: Sequence[Speed], end_deg: float
) -> _Model:
    joint = joint_model(protocol, model)
    start, rate_hz = math.radians(protocol.stretch.start_deg), protocol.device.rate_hz
    end = min(math.radians(end_deg), joint.range_end)

    def lines_at(speeds_deg_s: Sequence[float]) -> list[_Line]:
        motions = [_motion(start, end, speed) for speed in speeds_deg_s]
        if isinstance(joint, ElbowParameters):
            return [outline(joint, motion, n_points=_N_POINTS) for motion in motions]
        return [trace(joint, motion, rate_hz=rate_hz) for motion in motions]

    known = [speed.mean_speed_deg_s for speed in speeds]
    shown, band = list(range(len(known))), None
    if len(known) > MANY_STRETCHES:
        ranks = at_ranks(known)
        shown = [ranks[name] for name in ("lowest", "median", "highest")]
        steps = (np.arange(_N_IN_BAND) + 0.5) / _N_IN_BAND
        band = _band(lines_at(np.quantile(known, steps).tolist()))
    if isinstance(joint, ElbowParameters):
        motions = [_motion(start, end, speed) for speed in known]
        peaks = evaluate(joint, motions, ["peak_torque"]).column("peak_torque").tolist()
    else:
        peaks = [float(line.torque.max()) for line in lines_at(known)]
    stretches = [
        _Stretch(speed=speed, peak=peak)
        for speed, peak in zip(speeds, peaks, strict=True)
    ]
    return _Model(
        id=model,
        stretches=tuple(stretches),
        shown=tuple(stretches[i] for i in shown),
        lines=tuple(lines_at([known[i] for i in shown])),
        band=band,
    )


def _motion(start: float, end: float, speed_deg_s: float) -> ConstantSpeed:
    return ConstantSpeed(start=start, end=end, speed=math.radians(speed_deg_s))


def _band(lines: Sequence[_Line]) -> TraceBand:
    # lines at evenly spaced quantiles of the speeds: as many are below each time's
    # quantile as of all stretches; the slower half goes on to the end of the band
    ends = np.array([line.time[-1] for line in lines])
    time = np.linspace(0.0, float(np.median(ends)), _N_POINTS)
    under_way = time <= ends[:, np.newaxis]  # (n_lines, n_points)
    n_under_way = under_way.sum(axis=0)

    def ends_of(values: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
        known = [
            np.interp(time, line.time, of_line)
            for line, of_line in zip(lines, values, strict=True)
        ]
        ordered = np.sort(np.where(under_way, np.stack(known), np.inf), axis=0)
        shown = np.empty((len(_BAND_SHARES), time.size))
        for n in np.unique(n_under_way):
            of_n = n_under_way == n
            shown[:, of_n] = np.quantile(ordered[:n, of_n], _BAND_SHARES, axis=0)
        return shown

    return TraceBand(
        time=time,
        angle=ends_of([np.degrees(line.angle) for line in lines]),
        torque=ends_of([line.torque for line in lines]),
    )


def _trace_drawing(
    material: Material, models: Sequence[_Model], nth: int, *, has_angle: bool
) -> Drawing:
    # of the models of the nth figure
    intended = {m.id: m.intended_grade for m in material.protocol.models}
    panels = []
    for model in models:
        speeds = [stretch.speed.mean_speed_deg_s for stretch in model.stretches]
        digits = whole_or_tenths(speeds)
        slowest, fastest = number(min(speeds), digits), number(max(speeds), digits)
        grade = ""
        if intended[model.id] is not None:
            grade = f" ({material.protocol.scale.name} {intended[model.id]})"
        names = [stretch.speed.rater for stretch in model.shown]
        panels.append(
            TracePanel(
                title=f"{model.id}{grade}\n{slowest} to {fastest} deg/s",
                traces=model.lines,
                graded=tuple(stretch.speed.is_graded for stretch in model.shown),
                names=() if model.band is None else tuple(names),
                band=model.band,
            )
        )
    listed = ", ".join(model.id for model in models)
    shape = (
        "Torque rises slowly, jumps at the catch, falls to a residual, and rises again "
        "after the catch; the"
    )
    if _of_other_kinds(material) & {model.id for model in models}:
        shape = "The"
    what = "Torque and angle" if has_angle else "Torque"
    return Drawing(
        name=f"traces_{nth}",
        caption=_trace_caption(models, listed, has_angle=has_angle),
        alt=(
            f"{what} against time for {listed}. {shape} "
            "peaks are in the table of peak torques."
        ),
        content=Drawn(
            FIGURES + "_trace_figures:trace_figure", (tuple(panels), has_angle)
        ),
        stamp=material.trace_stamp,
    )


def _trace_caption(models: Sequence[_Model], listed: str, *, has_angle: bool) -> str:
    made_of = [stretch.speed for model in models for stretch in model.stretches]
    whose = "every stretch's" if has_many(made_of) else "every rater's"
    what = "torque (top) and angle (bottom)" if has_angle else "torque"
    met = np.unique(np.concatenate([line.phase for m in models for line in m.lines]))
    words = "; ".join(_PHASE_LOOKS[code] for code in met)
    # one phase has nothing to be told from
    looks = f"{words}; a dot marks where a phase begins." if len(met) > 1 else ""
    n_most = max((len(m.stretches) for m in models if m.band is not None), default=0)
    if not n_most:
        text = f"Reconstructed {what} of {listed} at {whose} mean speed. {looks}"
        return text.rstrip()
    return (
        f"Reconstructed {what} of {listed} at the mean speeds of up to {n_most} "
        "stretches. Shaded: the middle 50 % and 90 % at each time, while half of the "
        "stretches go on. Lines: the slowest, the median and the fastest, each with "
        f"its rater. {looks}".rstrip()
    )


_PHASE_LOOKS = (
    "Thin grey: before the catch",
    "thick: catch",
    "dashed: after the catch",
)


def _of_other_kinds(material: Material) -> set[str]:
    return {m.id for m in material.protocol.models if m.kind != DEFAULT_KIND}


def _peak_notes(
    material: Material, models: Sequence[_Model], raters: Sequence[str]
) -> list[str]:
    notes = [
        "The largest torque of all phases, be it in the catch or at the end of the "
        "stretch, computed from the exact events of the motion, not from the samples."
    ]
    others = [m.id for m in models if m.id in _of_other_kinds(material)]
    if others:
        notes.append(f"Of {', '.join(others)} it is the largest sample.")
    made = [stretch.speed for model in models for stretch in model.stretches]
    if has_many(made):
        notes.append("Of several stretches the largest peak is given.")
    elif len({(speed.model, speed.rater) for speed in made}) < len(made):
        notes.append("Of repeated presentations the largest peak is given.")
    if len(raters) > MANY_RATERS:
        notes.append(f"The file has the peaks of all {len(raters)} raters.")
    return notes


def _peak_row(model: _Model, raters: Sequence[str]) -> tuple[Value, ...]:
    peaks: dict[str, float] = {}
    for stretch in model.stretches:
        rater = stretch.speed.rater
        peaks[rater] = max(stretch.peak, peaks.get(rater, stretch.peak))
    median = float(np.median(list(peaks.values())))
    ends = min(peaks.values()), median, max(peaks.values())
    return (model.id, *(peaks.get(rater) for rater in raters), *ends)


def _peak_table(material: Material, models: Sequence[_Model], session: str) -> Table:
    present = {stretch.speed.rater for model in models for stretch in model.stretches}
    raters = [rater for rater in material.raters if rater in present]
    by_rater = [
        Column(
            key=f"{rater}_nm",
            heading=rater,
            digits=2,
            where="csv" if len(raters) > MANY_RATERS else "everywhere",
        )
        for rater in raters
    ]
    return Table(
        name="peak_torque",
        caption=(
            f"Peak model torque at each rater's mean speed, session {session} (N·m)"
        ),
        columns=(
            Column(key="model", heading="Model", align="left"),
            *by_rater,
            Column(key="least_nm", heading="Least", digits=2),
            Column(key="median_nm", heading="Median", digits=2),
            Column(key="most_nm", heading="Most", digits=2),
        ),
        rows=tuple(_peak_row(model, raters) for model in models),
        notes=tuple(_peak_notes(material, models, raters)),
        data=material.data,
    )
