"""The JSON, the text and the figures of scenes: a model stretched by a motion each."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from masrel.errors import ParameterError
from masrel.lab.report._figure_data import (
    FIGURES,
    CatchCurve,
    CatchSchematic,
    StretchLine,
    StretchPanel,
)
from masrel.lab.report._tone_scenes import tone_document, tone_line, torque_rows
from masrel.plots._drawn_values import Drawn
from masrel.tables._tables import aligned, fixed_or_significant, significant

if TYPE_CHECKING:
    from masrel.lab.elbow import ElbowParameters, JointModel, Motion

SCENE_OUTPUTS = {
    "residual-torque": "residual_torque_nm",
    "work": "work_j",
    "impulse": "impulse_nms",
}
"""What may be computed beside events and peak, and its key in the document."""

SCENE_VIEWS = ("angle", "time", "catch", "schematic")
"""What a figure may show."""

_LINES = {
    "residual_torque_nm": ("residual torque", "N·m"),
    "work_j": ("work", "J"),
    "impulse_nms": ("impulse", "N·m·s"),
}

# Where torque may be computed: a list of the document, its key of the place, and a unit
_PLACES = (("torque_at_s", "time_s", "s"), ("torque_at_deg", "angle_deg", "deg"))

_N_PIXELS = 800  # points a line has: a panel is less wide than that

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
    joint: "JointModel"
    motion: "Motion"


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantities:
    """What is computed of every scene beside events and peak."""

    outputs: tuple[str, ...] = ()  # of a spastic elbow
    times: tuple[float, ...] = ()  # where torque is computed, s
    angles: tuple[float, ...] = ()  # where it is computed, deg


def scene_document(scene: Scene, quantities: Quantities) -> dict[str, object]:
    """Return the events of a scene, its peak torque, and what else was requested."""
    from masrel.lab import elbow

    joint, motion = scene.joint, scene.motion
    if not isinstance(joint, elbow.ElbowParameters):
        return tone_document(scene, quantities)
    events = elbow.events(joint, motion)
    angle, speed = events.catch_angle, events.mean_speed
    document: dict[str, object] = {
        "model": scene.model,
        "motion": scene.kind,
        "speed_deg_s": scene.speed_deg_s,
        "from_deg": scene.start_deg,
        "to_deg": scene.end_deg,
        "catch_angle_deg": None if angle is None else math.degrees(angle),
        "mean_speed_deg_s": None if speed is None else math.degrees(speed),
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
    }
    if quantities != Quantities():
        document |= _requested(joint, motion, quantities)
    for key, number in document.items():
        if isinstance(number, float) and not math.isfinite(number):
            raise ParameterError(
                f"{key}: needs a number that a float can hold, got "
                f"{significant(number)}; some parameter or speed is too large"
            )
    return document


def _requested(
    joint: "ElbowParameters", motion: "Motion", quantities: Quantities
) -> dict[str, object]:
    from masrel.lab import elbow

    requested: dict[str, object] = {}
    functions = {
        "residual-torque": elbow.residual_torque,
        "work": elbow.work,
        "impulse": elbow.impulse,
    }
    for name in quantities.outputs:
        value = functions[name](joint, motion)
        requested[SCENE_OUTPUTS[name]] = None if math.isnan(value) else value
    if times := quantities.times:
        torques = elbow.torque(joint, motion, times)
        requested["torque_at_s"] = torque_rows("time_s", times, torques)
    if angles := quantities.angles:
        torques = elbow.torque_at(joint, motion, [math.radians(a) for a in angles])
        requested["torque_at_deg"] = torque_rows("angle_deg", angles, torques)
    return requested


def scene_text(document: dict[str, Any], title: str) -> str:
    """Return the document of one scene for a person."""
    rows = [["phase", "start s", "end s", "start deg", "end deg"]]
    for span in document["phases"]:
        times = [fixed_or_significant(span[key], 3) for key in ("start_s", "end_s")]
        angles = [
            fixed_or_significant(span[key], 2) for key in ("start_deg", "end_deg")
        ]
        rows.append([span["name"], *times, *angles])
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
    for key, (name, unit) in _LINES.items():
        if key in document:
            values.append((name, document[key], unit))
    for key, place, unit in _PLACES:
        for row in document.get(key, ()):
            name = f"torque at {significant(row[place])} {unit}"
            values.append((name, row["torque_nm"], "N·m"))
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
    keys += [key for key in _LINES if key in documents[0]]
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


def check_view(scenes: Sequence[Scene], view: str) -> None:
    """Refuse a figure that cannot be drawn, before anything is computed for it."""
    models = _by_model(scenes)
    max_speeds = max(map(len, models.values()))
    if len(models) > 5 or (view != "catch" and (len(models) > 4 or max_speeds > 5)):
        raise ParameterError(
            "--figure: shows 4 models at 5 speeds at most, or with --view catch 5 "
            f"models, got {len(models)} and {max_speeds}"
        )
    if view in ("catch", "schematic") and len(_elbows(scenes)) < len(scenes):
        raise ParameterError(
            f"--view {view}: shows the catch of a spastic elbow, got other kinds too"
        )
    if view == "catch":
        _check_catches(models)
    if view == "schematic":
        if len(scenes) != 1:
            raise ParameterError(
                f"--view schematic: shows one scene, got {len(scenes)}"
            )
        if not _n_caught(scenes):
            raise ParameterError("--view schematic: needs a stretch that catches")


def _check_catches(models: dict[str, list[Scene]]) -> None:
    for name, scenes in models.items():
        if len(scenes) < 2:
            raise ParameterError(
                f"--view catch: needs two or more speeds, got {len(scenes)}"
            )
        if (n_caught := _n_caught(scenes)) < 2:
            raise ParameterError(
                f"--view catch: needs two or more speeds at which {name} catches, got "
                f"{n_caught} of {len(scenes)}"
            )


def _elbows(scenes: Sequence[Scene]) -> list["ElbowParameters"]:
    from masrel.lab.elbow import ElbowParameters

    joints = [scene.joint for scene in scenes]
    return [joint for joint in joints if isinstance(joint, ElbowParameters)]


def _n_caught(scenes: Sequence[Scene]) -> int:
    import numpy as np

    from masrel.lab.elbow import evaluate

    motions = [scene.motion for scene in scenes]
    outputs = evaluate(_elbows(scenes), motions, ["catch"])
    return int(np.isfinite(outputs.column("catch")).sum())


def scenes_content(scenes: Sequence[Scene], view: str) -> Drawn:
    """Return what a figure of scenes shows."""
    models = _by_model(scenes).items()
    if view == "catch":
        curves = tuple(_curve(*of_model) for of_model in models)
        return Drawn(FIGURES + "_scene_figures:catch_figure", (curves,))
    if view == "schematic":
        shown = _schematic(scenes[0])
        return Drawn(FIGURES + "_scene_figures:schematic_figure", (shown,))
    against: Literal["angle", "time"] = "angle" if view == "angle" else "time"
    panels = tuple(_panel(*of_model) for of_model in models)
    return Drawn(FIGURES + "_scene_figures:stretch_figure", (panels, against))


def _by_model(scenes: Sequence[Scene]) -> dict[str, list[Scene]]:
    models: dict[str, list[Scene]] = {}
    for scene in scenes:
        models.setdefault(scene.model, []).append(scene)
    return models


def _panel(name: str, scenes: Sequence[Scene]) -> StretchPanel:
    return StretchPanel(title=name, lines=tuple(map(_line, scenes)))


def _line(scene: Scene) -> StretchLine:
    import numpy as np

    from masrel.lab.elbow import ElbowParameters, outline

    if not isinstance(scene.joint, ElbowParameters):
        return tone_line(scene)
    line = outline(scene.joint, scene.motion, n_points=_N_PIXELS)
    speed = scene.speed_deg_s
    return StretchLine(
        label=scene.kind if speed is None else f"{significant(speed)} deg/s",
        time=line.time,
        angle=np.degrees(line.angle),
        torque=line.torque,
        phases=tuple((s.name, s.start, s.end) for s in line.events.phases),
    )


def _schematic(scene: Scene) -> CatchSchematic:
    from masrel.lab.elbow import outline, residual_torque

    (joint,) = _elbows([scene])
    line = outline(joint, scene.motion, n_points=_N_PIXELS)
    events = line.events
    if events.catch is None or events.catch_speed is None or events.peak_end is None:
        raise ParameterError("--view schematic: needs a stretch that catches")
    rise = joint.catch_torque_constant * events.catch_speed
    residual = residual_torque(joint, scene.motion)
    pre_end = residual - joint.residual_share * rise
    return CatchSchematic(
        title=scene.title,
        time=line.time,
        torque=line.torque,
        phases=tuple((s.name, s.start, s.end) for s in events.phases),
        catch=events.catch,
        peak_end=events.peak_end,
        catch_end=events.end if events.catch_end is None else events.catch_end,
        pre_end=pre_end,
        peak=pre_end + rise,
        residual=residual,
        residual_name=(
            r"$Q\,H\,v_c$"
            if joint.residual_reading == "residual"
            else r"$(1-Q)\,H\,v_c$"
        ),
    )


def _curve(name: str, scenes: Sequence[Scene]) -> CatchCurve:
    import numpy as np

    from masrel.lab.elbow import evaluate

    joints = _elbows(scenes)
    motions = [scene.motion for scene in scenes]
    outputs = evaluate(
        joints, motions, ("mean_speed", "catch_angle", "catch", "catch_end")
    )
    caught = np.flatnonzero(np.isfinite(outputs.column("catch")))
    caught = caught[np.argsort(outputs.column("mean_speed")[caught])]
    mean, angle, catch, end = outputs.values[caught].T
    duration = end - catch
    # from the catch angle on to where the catch ends; nan where the motion ends first
    travel = [
        float(motions[i].angle(until, origin)) if np.isfinite(until) else np.nan
        for i, until, origin in zip(
            caught.tolist(), end.tolist(), angle.tolist(), strict=True
        )
    ]
    return CatchCurve(
        label=name,
        mean_speed=np.degrees(mean),
        catch_angle=np.degrees(angle),
        catch_speed=np.degrees(np.array(travel) / duration),
        duration=duration,
        clamps=(
            math.degrees(joints[0].slowest_mean_speed),
            math.degrees(joints[0].fastest_mean_speed),
        ),
    )
