"""Sections `speeds` and `traces`: how fast raters stretched, and what torque that made.

Measured torque is shown with the commanded torque if recordings have it.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Literal

import numpy as np

from masrel.lab.analysis import Speed, SpeedSummary
from masrel.lab.elbow import (
    ConstantSpeed,
    ElbowParameters,
    JointModel,
    Motion,
    evaluate,
    torque,
)
from masrel.lab.elbow._torque import Line, line
from masrel.lab.protocol import Model, Protocol, joint_model
from masrel.lab.recording import (
    MEASURED_TORQUE,
    Recording,
    _Floats,
    read_recording,
    stretches,
)
from masrel.lab.report._material import (
    FIGURES,
    MANY_MODELS,
    MANY_RATERS,
    MANY_STRETCHES,
    MODEL,
    SUPPLEMENT,
    Material,
    at_ranks,
    lacking,
    lines_of,
    macros,
    text_of,
)
from masrel.pages._sections import Content, Drawing, Paragraph
from masrel.plots._drawn_values import Drawn
from masrel.tables._tables import SIMULATED, Column, Table, Value, as_entered, number

_PANELS_PER_FIGURE, _SMALL_PANELS_PER_FIGURE = 4, 24
_N_POINTS = 200  # of a line: a panel is not much wider
_N_IN_BAND = 50  # lines that a band rests on
_BAND_SHARES = (0.05, 0.25, 0.75, 0.95)
_AROUND_S = 0.25  # shown before and after a measured stretch

# Slower is no stretch, and its trace would last for minutes.
_SLOWEST_DRAWN_DEG_S = 1.0
_TOO_SLOW = f"below {as_entered(_SLOWEST_DRAWN_DEG_S)} deg/s"


def speeds_section(material: Material) -> Iterator[Content]:
    """Show the mean speeds per model and per rater."""
    speeds = material.analysis.speeds
    if speeds is None or not speeds.values:
        yield lacking(None if speeds is None else speeds.reason)
        return
    has_many = _has_many(speeds.values)
    text = text_of("speeds.txt", "speeds", speeds.n_missing, has_many)
    yield Paragraph(text=text)
    by_model, by_rater = speed_tables(material)
    yield by_model
    texts = "; ".join(
        f"{s.name} in {s.session}: mean {number(s.mean, 0)}, "
        f"{number(s.least, 0)} to {number(s.most, 0)} deg/s"
        for s in speeds.by_model
    )
    slowest = material.protocol.elbow.slowest_mean_speed_deg_s
    n_raters = len(material.raters)
    yield Drawing(
        name="speeds",
        caption=text_of(
            *("speeds.txt", "speeds_caption", n_raters, n_raters > MANY_RATERS),
            *(has_many, any(speed.is_graded for speed in speeds.values)),
        ),
        alt=f"Dot plot of speeds. {texts}.",
        content=Drawn(
            FIGURES + "_study_figures:speed_figure", (speeds, material.raters, slowest)
        ),
        stamp=material.stamp,
    )
    yield by_rater


def speed_tables(material: Material) -> list[Table]:
    """Return the mean speeds per model and per rater; nothing where none is known."""
    speeds = material.analysis.speeds
    if speeds is None or not speeds.values:
        return []
    digits = _whole_or_tenths([speed.mean_speed_deg_s for speed in speeds.values])
    by = {"model": speeds.by_model, "rater": speeds.by_rater}
    return [_speeds_table(material, of, name, digits) for name, of in by.items()]


def _speeds_table(
    material: Material, summaries: Sequence[SpeedSummary], by: str, digits: int
) -> Table:
    rows: list[tuple[Value, ...]] = [
        (s.name, s.session, s.n, s.mean, s.sd, s.least, s.most) for s in summaries
    ]
    shown, counts = [], []  # five raters of sessions of many
    for session in dict.fromkeys(s.session for s in summaries):
        here = [i for i, s in enumerate(summaries) if s.session == session]
        if by == "model" or len(here) <= MANY_RATERS:
            shown += [rows[i] for i in here]
            continue
        counts.append(f"{len(here)} of session {session}")
        for rank, at in at_ranks([summaries[i].mean for i in here]).items():
            name, *cells = rows[here[at]]
            shown.append((f"{name} ({rank})", *cells))
    note = "Five raters by their mean speed, of {}; the file has all."
    return Table(
        name=f"speeds_by_{by}",
        caption=f"Mean stretching speeds per {by} (deg/s)",
        columns=(
            Column(key=by, heading=by.capitalize(), align="left"),
            Column(key="session", heading="Session", align="left"),
            Column(key="n", heading="n"),
            Column(key="mean_deg_s", heading="Mean", digits=1),
            Column(key="sd_deg_s", heading="SD (n − 1)", digits=1),
            Column(key="least_deg_s", heading="Min", digits=digits),
            Column(key="most_deg_s", heading="Max", digits=digits),
        ),
        rows=tuple(rows),
        page_rows=tuple(shown),
        notes=(note.format(" and ".join(counts)),) if counts else (),
        data=material.data,
    )


def _has_many(speeds: Sequence[Speed]) -> bool:
    # whether there was more than one stretch to a presentation
    return any(speed.stretch is not None and speed.stretch > 1 for speed in speeds)


def _whole_or_tenths(values: Sequence[float]) -> int:
    # the decimals a column of measurements needs: 0 if all are whole
    known = [value for value in values if math.isfinite(value)]
    return 0 if all(float(value).is_integer() for value in known) else 1


@dataclass(frozen=True, slots=True, kw_only=True)
class TracedModel:
    """A model at the speeds of the raters."""

    id: str
    joint: JointModel
    title: str  # the model, its intended grade, and the range of speeds
    speeds: Sequence[Speed]
    peaks: Sequence[float]  # largest torque at each speed, N·m
    # what is drawn: the line of every speed, or of a few of many
    shown: Sequence[Speed]
    lines: Sequence[Line]
    # of many: where most are at each "time", s, while half of them go on: (n_points,)
    # and "angle", deg, and "torque", N·m, from the lowest to the highest, (4, n_points)
    band: Mapping[str, _Floats] | None


def traces_section(material: Material) -> Iterator[Content]:
    """Show the torque each model makes at each rater's mean speed."""
    protocol, speeds = material.protocol, material.analysis.speeds
    if speeds is None:
        yield lacking(None)
        return
    moved = [s for s in speeds.values if s.mean_speed_deg_s >= _SLOWEST_DRAWN_DEG_S]
    if not moved:
        yield lacking(speeds.reason or f"every speed is {_TOO_SLOW}")
        return
    session = next(s for s in material.sessions if s in {v.session for v in moved})
    values = [value for value in moved if value.session == session]
    end_deg = min(protocol.stretch.end_deg, protocol.elbow.range_end_deg)
    n_still = sum(v.session == session for v in speeds.values) - len(values)
    n_most = max(Counter(value.model for value in values).values())
    text = text_of(
        *("speeds.txt", "traces", material.origin, protocol.stretch.start_deg, end_deg),
        *(session, _has_many(values), MANY_STRETCHES if n_most > MANY_STRETCHES else 0),
        *(any(value.is_graded for value in values), _TOO_SLOW, n_still),
    )
    yield Paragraph(text=text)
    models = [
        _traced(protocol, model, of_model, end_deg)
        for model in protocol.models
        if (of_model := [value for value in values if value.model == model.id])
    ]
    has_angle = len(models) <= MANY_MODELS
    size = _PANELS_PER_FIGURE if has_angle else _SMALL_PANELS_PER_FIGURE
    for nth, first in enumerate(range(0, len(models), size), start=1):
        shown = models[first : first + size]
        yield _traces_drawing(material, shown, nth, has_angle=has_angle)
        if nth == 1:
            yield SUPPLEMENT
    yield _peak_table(material, models, session)
    yield from measured_blocks(material)


def _traced(
    protocol: Protocol, model: Model, speeds: Sequence[Speed], end_deg: float
) -> TracedModel:
    # at constant speed over the whole range
    joint = joint_model(protocol, model.id)
    start = math.radians(protocol.stretch.start_deg)
    end = min(math.radians(end_deg), joint.range_end)

    def stretch(deg_s: float) -> ConstantSpeed:
        return ConstantSpeed(start=start, end=end, speed=math.radians(deg_s))

    known = [speed.mean_speed_deg_s for speed in speeds]
    line_of = partial(line, joint, n_points=_N_POINTS, rate_hz=protocol.device.rate_hz)
    if isinstance(joint, ElbowParameters):
        outputs = evaluate(joint, [*map(stretch, known)], ["peak_torque"])
        peaks = outputs.column("peak_torque").tolist()
    else:
        # of equal stretches once
        largest = {v: float(line_of(stretch(v)).torque.max()) for v in {*known}}
        peaks = [largest[deg_s] for deg_s in known]
    shown, band = list(range(len(known))), None
    if len(known) > MANY_STRETCHES:
        ranks = at_ranks(known)
        shown = [ranks[name] for name in ("lowest", "median", "highest")]
        steps = (np.arange(_N_IN_BAND) + 0.5) / _N_IN_BAND
        quantiles = np.quantile(known, steps).tolist()
        band = _band(joint, [*map(stretch, quantiles)])
    digits = _whole_or_tenths(known)
    grade = ""
    if model.intended_grade is not None:
        grade = f" ({protocol.scale.name} {model.intended_grade})"
    ends = f"{number(min(known), digits)} to {number(max(known), digits)} deg/s"
    return TracedModel(
        id=model.id,
        joint=joint,
        title=f"{model.id}{grade}\n{ends}",
        speeds=speeds,
        peaks=peaks,
        shown=[speeds[i] for i in shown],
        lines=[line_of(stretch(known[i])) for i in shown],
        band=band,
    )


def _band(joint: JointModel, motions: Sequence[Motion]) -> dict[str, _Floats]:
    # stretches at evenly spaced quantiles of the speeds: as many are below each time's
    # quantile as of all stretches; the slower half goes on to the end of the band
    ends = np.array([motion.duration for motion in motions])
    time = np.linspace(0.0, float(np.median(ends)), _N_POINTS)
    under_way = time <= ends[:, np.newaxis]  # (n_motions, n_points)
    n_under_way = under_way.sum(axis=0)
    torque_of = (
        partial(torque, joint) if isinstance(joint, ElbowParameters) else joint.torque
    )
    at = [(motion, np.minimum(time, motion.duration)) for motion in motions]
    band = {"time": time}
    columns = {
        "angle": [np.degrees(motion.angle(times)) for motion, times in at],
        "torque": [torque_of(motion, times) for motion, times in at],
    }
    for name, column in columns.items():
        ordered = np.sort(np.where(under_way, np.stack(column), np.inf), axis=0)
        band[name] = np.empty((len(_BAND_SHARES), time.size))
        for n in np.unique(n_under_way):
            of_n = n_under_way == n
            band[name][:, of_n] = np.quantile(ordered[:n, of_n], _BAND_SHARES, axis=0)
    return band


def _traces_drawing(
    material: Material, models: Sequence[TracedModel], nth: int, *, has_angle: bool
) -> Drawing:
    listed = ", ".join(model.id for model in models)
    is_elbow = all(isinstance(model.joint, ElbowParameters) for model in models)
    panels = tuple(
        (
            *(model.title, model.lines, [speed.is_graded for speed in model.shown]),
            [] if model.band is None else [speed.rater for speed in model.shown],
            model.band,
        )
        for model in models
    )
    content = (panels, "time" if has_angle else "small")
    phases = np.unique(np.concatenate([of.phase for m in models for of in m.lines]))
    speeds = [speed for model in models for speed in model.speeds]
    n_most = max((len(m.speeds) for m in models if m.band is not None), default=0)
    return Drawing(
        name=f"traces_{nth}",
        caption=text_of(
            *("speeds.txt", "traces_caption", listed, has_angle, _has_many(speeds)),
            *(n_most, phases.tolist()),
        ),
        alt=text_of("speeds.txt", "traces_alt", listed, has_angle, is_elbow),
        content=Drawn(FIGURES + "_stretch_figures:trace_figure", content),
        stamp=material.trace_stamp,
    )


def _peak_table(
    material: Material, models: Sequence[TracedModel], session: str
) -> Table:
    peaks = [{speed.rater: -math.inf for speed in model.speeds} for model in models]
    for of_model, model in zip(peaks, models, strict=True):
        for speed, peak in zip(model.speeds, model.peaks, strict=True):
            of_model[speed.rater] = max(peak, of_model[speed.rater])
    raters = [rater for rater in material.raters if any(rater in p for p in peaks)]
    is_many = len(raters) > MANY_RATERS
    where: Literal["csv", "everywhere"] = "csv" if is_many else "everywhere"
    made = [speed for model in models for speed in model.speeds]
    others = [m.id for m in models if not isinstance(m.joint, ElbowParameters)]
    is_again = len({(speed.model, speed.rater) for speed in made}) < len(made)
    say = macros("speeds.txt", {})
    notes = say.peaks(others, _has_many(made), is_again, len(raters) * is_many)
    return Table(
        name="peak_torque",
        caption=(
            f"Peak model torque at each rater's mean speed, session {session} (N·m)"
        ),
        columns=(
            MODEL,
            *(Column(key=f"{r}_nm", heading=r, digits=2, where=where) for r in raters),
            Column(key="least_nm", heading="Min", digits=2),
            Column(key="median_nm", heading="Median", digits=2),
            Column(key="most_nm", heading="Max", digits=2),
        ),
        rows=tuple(
            (
                model.id,
                *map(of_model.get, raters),
                min(of_model.values()),
                float(np.median(list(of_model.values()))),
                max(of_model.values()),
            )
            for of_model, model in zip(peaks, models, strict=True)
        ),
        notes=tuple(lines_of(notes)),
        data=material.data,
    )


def measured_blocks(material: Material) -> Iterator[Paragraph | Drawing]:
    """Yield figures of the first presentation of each model; none without a sensor."""
    folder = material.recordings
    if folder is None or not material.protocol.device.torque_sensor:
        return
    recordings = _first_of_each_model(material, folder)
    if not recordings:
        text = "Measured torque is not in these data: no recording has it."
        yield Paragraph(text=text, absent=True)
    starts = range(0, len(recordings), _PANELS_PER_FIGURE)
    for nth, first in enumerate(starts, start=1):
        shown = recordings[first : first + _PANELS_PER_FIGURE]
        yield _measured_drawing(material, shown, nth)


def _first_of_each_model(material: Material, folder: Path) -> list[Recording]:
    # by model, in the protocol's order; of the first session and rater that have one
    models = [model.id for model in material.protocol.models]
    first: dict[str, Recording] = {}
    for session, rater in product(material.sessions, material.raters):
        if first.keys() >= {*models}:
            break
        for path in sorted((folder / f"{session}_{rater}").glob("*.npz")):
            recording = read_recording(path)
            has_torque = MEASURED_TORQUE in recording.channels
            if has_torque and recording.facts["fault"] is None:
                first.setdefault(str(recording.facts["model"]), recording)
    return [first[model] for model in models if model in first]


MeasuredPanel = tuple[str, _Floats, _Floats, _Floats, _Floats]
"""A title; time, s, angle, deg, and torque that was sent and measured, N·m."""


def measured_panel(recording: Recording, title: str) -> MeasuredPanel:
    """Return what is drawn of one presentation: the first stretch that could catch."""
    first, last, made = 0.0, math.inf, stretches(recording)
    if made:
        stretch = next((each for each in made if each.reached_threshold), made[0])
        first, last = stretch.onset_s - _AROUND_S, stretch.end_s + _AROUND_S
    time = recording.columns["time_s"]
    shown = (time >= first) & (time <= last)
    names = ("angle_deg", "command_torque_nm", MEASURED_TORQUE.column)
    angle, sent, measured = (recording.columns[name][shown] for name in names)
    return title, time[shown] - max(first, 0.0), angle, sent, measured


def _measured_drawing(
    material: Material, recordings: Sequence[Recording], nth: int
) -> Drawing:
    panels = tuple(
        measured_panel(
            recording, "{model}\n{rater}, {session}".format_map(recording.facts)
        )
        for recording in recordings
    )
    listed = ", ".join(str(recording.facts["model"]) for recording in recordings)
    largest = max(float(np.nanmax(measured)) for *_, measured in panels)
    simulated = any(recording.facts["simulated"] for recording in recordings)
    return Drawing(
        name=f"measured_{nth}",
        caption=(
            f"Torque of {listed} measured by the device's sensor (line) and commanded "
            "torque (dashed), above the angle: the first stretch of the first "
            "presentation of each that was fast enough for a catch. The measured "
            "torque includes the device's friction and the inertia of its motor; the "
            "friction compensation was subtracted from the commanded torque."
        ),
        alt=(
            f"Measured and commanded torque against time for {listed}; the largest "
            f"measured torque is {number(largest, 1)} N·m."
        ),
        content=Drawn(FIGURES + "_stretch_figures:measured_figure", (panels,)),
        stamp=SIMULATED if simulated and not material.banner else material.stamp,
    )
