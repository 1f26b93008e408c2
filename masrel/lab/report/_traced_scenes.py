"""Scenes, a model stretched by a motion each: their JSON, their text, their figures.

Of any joint, also the angles of the Tardieu scale.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from masrel._input import refuse
from masrel.errors import ParameterError
from masrel.lab import elbow
from masrel.lab.elbow import (
    ElbowParameters,
    JointModel,
    Motion,
    Outline,
    evaluate,
    outline,
    residual_torque,
    tardieu,
    times_at,
    trace,
)
from masrel.lab.elbow._torque import line
from masrel.lab.elbow.tone import ToneModel
from masrel.lab.recording import PHASES, _Floats
from masrel.plots._drawn_values import Drawn
from masrel.tables._tables import aligned, fixed_or_significant, significant

_FIGURES = "masrel.lab.report._stretch_figures:"

SCENE_OUTPUTS = {
    "residual-torque": ("residual_torque_nm", "residual torque", "N·m"),
    "work": ("work_j", "work", "J"),
    "impulse": ("impulse_nms", "impulse", "N·m·s"),
}
"""What may be computed beside events and peak: key in the document, name, and unit."""

SCENE_VIEWS = ("angle", "time", "catch", "schematic")
"""What a figure may show."""

# Where torque may be computed: a list of the document, its key of the place, and a unit
_PLACES = (("torque_at_s", "time_s", "s"), ("torque_at_deg", "angle_deg", "deg"))

_RATE_HZ = 1000  # of the samples that phases and lines of other kinds are made of

SCENE_STAMP = "computed from the joint model, not measured"
"""What figures say of their data."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """A joint and a motion."""

    title: str
    model: str  # name of the model
    kind: str  # kind of the motion
    speed_deg_s: float | None  # its speed, if it is named after one
    # start_deg, end_deg: where it starts and ends
    start_deg: float
    end_deg: float
    joint: JointModel
    motion: Motion


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantities:
    """What is computed of every scene beside events and peak."""

    outputs: tuple[str, ...] = ()  # of a spastic elbow
    times: tuple[float, ...] = ()  # where torque is computed, s
    angles: tuple[float, ...] = ()  # where it is computed, deg


def scene_document(scene: Scene, quantities: Quantities) -> dict[str, object]:
    """Return the events of a scene, its peak torque, and what else was requested."""
    joint, motion, kind = scene.joint, scene.motion, {}
    if isinstance(joint, ElbowParameters):
        events = _of_elbow(joint, motion, quantities)
    else:
        kind, events = {"kind": joint.kind}, _of_tone(joint, motion, quantities)
    document: dict[str, object] = {
        "model": scene.model,
        **kind,
        "motion": scene.kind,
        "speed_deg_s": scene.speed_deg_s,
        "from_deg": scene.start_deg,
        "to_deg": scene.end_deg,
        **events,
    }
    for key, number in document.items():
        if isinstance(number, float) and not math.isfinite(number):
            raise ParameterError(
                f"{key}: needs a number that a float can hold, got "
                f"{significant(number)}; some parameter or speed is too large"
            )
    return document


def _of_elbow(
    joint: ElbowParameters, motion: Motion, quantities: Quantities
) -> dict[str, object]:
    events, outputs = elbow.events(joint, motion), {}
    for name in quantities.outputs:
        number = getattr(elbow, name.replace("-", "_"))(joint, motion)
        outputs[SCENE_OUTPUTS[name][0]] = None if math.isnan(number) else number
    return {
        "catch_angle_deg": _degrees(events.catch_angle),
        "mean_speed_deg_s": _degrees(events.mean_speed),
        "peak_torque_nm": elbow.peak_torque(joint, motion),
        "phases": [
            {
                "name": span.name,
                "start_s": span.start,
                "end_s": span.end,
                "start_deg": math.degrees(span.start_angle),
                "end_deg": math.degrees(span.end_angle),
            }
            for span in events.phases
        ],
        **outputs,
        **_torques(
            quantities,
            partial(elbow.torque, joint, motion),
            partial(elbow.torque_at, joint, motion),
        ),
    }


def _of_tone(
    joint: ToneModel, motion: Motion, quantities: Quantities
) -> dict[str, object]:
    late = [t for t in quantities.times if not 0.0 <= t <= motion.duration]
    refuse(
        (quantities.outputs, f"--output: needs spastic elbows, got {joint.kind}"),
        (
            late,
            "--at-s: needs times within the motion, 0 to "
            f"{significant(motion.duration)} s, got {significant(sum(late[:1]))}",
        ),
    )
    events = joint.events(motion)
    caught = [event.angle for event in events if event.name == joint.catch_event]
    sampled = trace(joint, motion, rate_hz=_RATE_HZ)
    every = np.append(sampled.time, motion.duration)
    at_events = joint.torque(motion, [event.time for event in events])
    begins = np.flatnonzero(np.diff(sampled.phase, prepend=-1)).tolist()
    return {
        "catch_angle_deg": _degrees(next(iter(caught), None)),
        "mean_speed_deg_s": None,
        # of every millisecond and every event
        "peak_torque_nm": float(max(*joint.torque(motion, every), *at_events)),
        "phases": [
            {
                "name": PHASES[sampled.phase[begin]],
                "start_s": float(every[begin]),
                "end_s": float(every[end]),
                "start_deg": math.degrees(motion.angle(every[begin])),
                "end_deg": math.degrees(motion.angle(every[end])),
            }
            for begin, end in pairwise([*begins, sampled.phase.size])
        ],
        "events": [
            {
                "name": event.name,
                "time_s": event.time,
                "angle_deg": math.degrees(event.angle),
            }
            for event in events
        ],
        **_torques(
            quantities,
            partial(joint.torque, motion),
            lambda angles: joint.torque(motion, times_at(motion, angles)),
        ),
    }


def _degrees(angle: float | None) -> float | None:
    return None if angle is None else math.degrees(angle)


_TorqueOf = Callable[[Sequence[float]], "_Floats"]


def _torques(
    quantities: Quantities, at_times: _TorqueOf, at_angles: _TorqueOf
) -> dict[str, object]:
    # the torque at each time, s, and where each angle, rad, is first reached
    requested: dict[str, object] = {}
    angles = [math.radians(angle) for angle in quantities.angles]
    for (key, place, _), at, torques in (
        (_PLACES[0], quantities.times, partial(at_times, quantities.times)),
        (_PLACES[1], quantities.angles, partial(at_angles, angles)),
    ):
        if at:
            rows = zip(at, torques().tolist(), strict=True)
            requested[key] = [{place: x, "torque_nm": torque} for x, torque in rows]
    return requested


def scene_text(document: dict[str, Any], title: str) -> str:
    """Return the document of one scene for a person."""
    columns = (("start_s", 3), ("end_s", 3), ("start_deg", 2), ("end_deg", 2))
    rows = [["phase", "start s", "end s", "start deg", "end deg"]]
    rows += [
        [span["name"], *(fixed_or_significant(span[key], n) for key, n in columns)]
        for span in document["phases"]
    ]
    lines = [title]
    for name, *cells in rows:
        # as wide as an ordinary stretch needs; a long number keeps its distance
        widths = zip(cells, (9, 9, 11, 9), strict=True)
        padded = (text.rjust(max(width, len(text) + 2)) for text, width in widths)
        lines.append(name.ljust(11) + "".join(padded))
    lines += [
        f"{event['name']} at {fixed_or_significant(event['time_s'], 3)} s, "
        f"{fixed_or_significant(event['angle_deg'], 2)} deg"
        for event in document.get("events", ())  # of another kind of joint
    ]
    values = [("peak torque", document["peak_torque_nm"], "N·m")]
    values += [
        (name, document[key], unit)
        for key, name, unit in SCENE_OUTPUTS.values()
        if key in document
    ]
    values += [
        (f"torque at {significant(row[place])} {unit}", row["torque_nm"], "N·m")
        for key, place, unit in _PLACES
        for row in document.get(key, ())
    ]
    lines += [
        f"{name} none: the stretch has no catch"
        if value is None
        else f"{name} {fixed_or_significant(value, 3)} {unit}"
        for name, value, unit in values
    ]
    return "\n".join(lines)


def scenes_text(documents: Sequence[dict[str, Any]]) -> str:
    """Return the documents of many scenes for a person, one a line."""
    keys = ["speed_deg_s", "catch_angle_deg", "mean_speed_deg_s", "peak_torque_nm"]
    keys += [key for key, *_ in SCENE_OUTPUTS.values() if key in documents[0]]
    places = [
        f"torque_nm at {significant(row[place])} {unit}"
        for key, place, unit in _PLACES
        for row in documents[0].get(key, ())
    ]
    # two more spaces than there are between numbers set names off
    width = max(8, *(len(document["model"]) + 2 for document in documents))
    rows = [["model".ljust(width), *keys, *places]]
    for document in documents:
        torques = [
            row["torque_nm"] for key, *_ in _PLACES for row in document.get(key, ())
        ]
        cells = [*(document[key] for key in keys), *torques]
        rows.append(
            [
                document["model"],
                *("–" if c is None else fixed_or_significant(c, 3) for c in cells),
            ]
        )
    numeric: list[Literal["right"]] = ["right"] * (len(rows[0]) - 1)
    return "\n".join(aligned(rows, ["left", *numeric]))


def scenes_content(scenes: Sequence[Scene], view: str) -> Drawn:
    """Return what a figure of scenes shows, refusing what cannot be drawn."""
    models: dict[str, list[Scene]] = {}
    for scene in scenes:
        models.setdefault(scene.model, []).append(scene)
    max_speeds = max(map(len, models.values()))
    is_large = len(models) > 4 or max_speeds > 5
    refuse(
        (
            len(models) > 5 or (view != "catch" and is_large),
            "--figure: shows 4 models at 5 speeds at most, or with --view catch 5 "
            f"models, got {len(models)} and {max_speeds}",
        ),
        (
            view in ("catch", "schematic") and len(_elbows(scenes)) < len(scenes),
            f"--view {view}: shows the catch of a spastic elbow, got other kinds too",
        ),
        (
            view == "schematic" and len(scenes) != 1,
            f"--view schematic: shows one scene, got {len(scenes)}",
        ),
    )
    if view == "catch":
        curves = tuple(_catches(*of_model) for of_model in models.items())
        return Drawn(_FIGURES + "catch_figure", (curves,))
    if view == "schematic":
        return Drawn(_FIGURES + "schematic_figure", _schematic(scenes[0]))
    panels = tuple(
        (
            *(name, [line(scene.joint, scene.motion) for scene in of]),
            *([False] * len(of), [*map(_label, of)], None),
        )
        for name, of in models.items()
    )
    return Drawn(_FIGURES + "trace_figure", (panels, view))


def _elbows(scenes: Sequence[Scene]) -> list[ElbowParameters]:
    joints = [scene.joint for scene in scenes]
    return [joint for joint in joints if isinstance(joint, ElbowParameters)]


def _label(scene: Scene) -> str:
    speed = scene.speed_deg_s
    return scene.kind if speed is None else f"{significant(speed)} deg/s"


def _schematic(
    scene: Scene,
) -> tuple[str, Outline, tuple[float, float, float], str]:
    (joint,) = _elbows([scene])
    line = outline(joint, scene.motion)
    if line.events.catch_speed is None or line.events.peak_end is None:
        raise ParameterError("--view schematic: needs a stretch that catches")
    rise = joint.catch_torque_constant * line.events.catch_speed
    residual = residual_torque(joint, scene.motion)
    pre_end = residual - joint.residual_share * rise
    share = {"residual": "Q", "decrease": "(1-Q)"}[joint.residual_reading]
    name = rf"${share}\,H\,v_c$"
    return scene.title, line, (pre_end, pre_end + rise, residual), name


def _catches(name: str, scenes: Sequence[Scene]) -> tuple[object, ...]:
    joints, motions = _elbows(scenes), [scene.motion for scene in scenes]
    names = ("mean_speed", "catch_angle", "catch", "catch_end")
    outputs = evaluate(joints, motions, names)
    caught, n = np.flatnonzero(np.isfinite(outputs.column("catch"))), len(scenes)
    refuse(
        (n < 2, f"--view catch: needs two or more speeds, got {n}"),
        (
            caught.size < 2,
            f"--view catch: needs two or more speeds at which {name} catches, got "
            f"{caught.size} of {n}",
        ),
    )
    caught = caught[np.argsort(outputs.column("mean_speed")[caught])]
    mean, angle, catch, end = outputs.values[caught].T
    # from the catch angle on to where the catch ends; nan where the motion ends first
    travel = [
        float(motions[i].angle(until, origin)) if np.isfinite(until) else np.nan
        for i, until, origin in zip(
            caught.tolist(), end.tolist(), angle.tolist(), strict=True
        )
    ]
    clamps = joints[0].slowest_mean_speed, joints[0].fastest_mean_speed
    return (
        name,
        np.degrees(mean),
        np.degrees(angle),
        np.degrees(np.array(travel) / (end - catch)),
        end - catch,
        tuple(map(math.degrees, clamps)),
    )


def tardieu_document(
    model: str, joint: JointModel, start_deg: float, speeds: Sequence[float]
) -> dict[str, object]:
    """Return R2, R1, their difference and the catch at V1, V2 and V3 of a joint."""
    # speeds: V1, V2 and V3, deg/s
    first, second, third = map(math.radians, speeds)
    made = tardieu(
        joint, start_angle=math.radians(start_deg), speeds=(first, second, third)
    )
    return {
        "model": model,
        "kind": joint.kind,
        "from_deg": start_deg,
        "r2_deg": math.degrees(made.range_angle),
        "r1_deg": math.degrees(made.catch_angle),
        "difference_deg": math.degrees(made.difference),
        "catches": [
            {
                "name": f"V{nth}",
                "speed_deg_s": math.degrees(speed),
                "catch_angle_deg": _degrees(angle),
            }
            for nth, (speed, angle) in enumerate(
                zip(made.speeds, made.catch_angles, strict=True), start=1
            )
        ],
    }


def tardieu_text(documents: Sequence[dict[str, Any]]) -> str:
    """Return Tardieu's angles for a person, a joint a line."""
    heads = [
        f"{catch['name']} {significant(catch['speed_deg_s'])} deg/s"
        for catch in documents[0]["catches"]
    ]
    rows = [["model", "R2 deg", "R1 deg", "R2 - R1", *heads]]
    for document in documents:
        angles = [document[key] for key in ("r2_deg", "r1_deg", "difference_deg")]
        angles += [catch["catch_angle_deg"] for catch in document["catches"]]
        cells = ["–" if a is None else fixed_or_significant(a, 2) for a in angles]
        rows.append([document["model"], *cells])
    numeric: list[Literal["right"]] = ["right"] * (len(rows[0]) - 1)
    return "\n".join(
        (
            *aligned(rows, ["left", *numeric]),
            "R2: where the range ends at V1. R1: the catch at V3, or R2 without one. "
            "Then the catch at each speed.",
        )
    )
