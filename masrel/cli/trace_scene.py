"""One scene of ``masrel trace``, a model and a motion: JSON, table row or samples."""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.elbow import ElbowParameters, Events, Motion

__all__ = [
    "OUTPUTS",
    "TRACE_COLUMNS",
    "Scene",
    "document",
    "samples",
    "summary",
    "table",
]

TRACE_COLUMNS = ("time_s", "angle_deg", "velocity_deg_s", "torque_nm", "phase")

OUTPUTS = {
    "residual-torque": ("residual_torque_nm", "residual torque {:.3f} N·m"),
    "work": ("work_j", "work {:.3f} J"),
    "impulse": ("impulse_nms", "impulse {:.3f} N·m·s"),
}
"""What may be asked for beside the peak: key of the document, and line."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """A model and a motion.

    Attributes
    ----------
    model : str
        Name of the model.
    kind : str
        Kind of the motion.
    speed_deg_s : float or None
        Its speed, if it is named after one.
    start_deg, end_deg : float
        Where it starts and ends.
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion.
    """

    model: str
    kind: str
    speed_deg_s: float | None
    start_deg: float
    end_deg: float
    parameters: "ElbowParameters"
    motion: "Motion"

    @property
    def title(self) -> str:
        """Name of the scene."""
        if self.speed_deg_s is None:
            return f"{self.model}, {self.kind}"
        return f"{self.model}, {self.kind} {self.speed_deg_s:g} deg/s"


def document(
    scene: Scene,
    outputs: Sequence[str],
    times: Sequence[float],
    angles: Sequence[float],
) -> dict[str, object]:
    """Solve a scene.

    Parameters
    ----------
    scene : Scene
        The scene.
    outputs : sequence of str
        Of `OUTPUTS`, what is asked for.
    times : sequence of float
        Times at which the torque is asked for, s.
    angles : sequence of float
        Angles where it is asked for, deg.

    Returns
    -------
    dict
        What goes into JSON.
    """
    from masrel import elbow

    joint, motion = scene.parameters, scene.motion
    found = elbow.events(joint, motion)
    made: dict[str, object] = {
        "model": scene.model,
        "motion": scene.kind,
        "speed_deg_s": scene.speed_deg_s,
        "from_deg": scene.start_deg,
        "to_deg": scene.end_deg,
        "catch_angle_deg": _degrees(found.catch_angle),
        "mean_speed_deg_s": _degrees(found.mean_speed),
        "peak_torque_nm": elbow.peak_torque(joint, motion),
        "phases": _phases(found),
    }
    functions = {
        "residual-torque": elbow.residual_torque,
        "work": elbow.work,
        "impulse": elbow.impulse,
    }
    for name in outputs:
        value = functions[name](joint, motion)
        made[OUTPUTS[name][0]] = None if math.isnan(value) else value
    if times:
        values = elbow.torque(joint, motion, times, found=found).tolist()
        made["torque_at_s"] = _pairs("time_s", times, values)
    if angles:
        values = elbow.torque_at(joint, motion, [math.radians(a) for a in angles])
        made["torque_at_deg"] = _pairs("angle_deg", angles, values.tolist())
    return made


def _pairs(
    key: str, places: Sequence[float], values: Sequence[float]
) -> list[dict[str, float]]:
    return [
        {key: place, "torque_nm": value}
        for place, value in zip(places, values, strict=True)
    ]


def _degrees(value: float | None) -> float | None:
    return None if value is None else math.degrees(value)


def _phases(found: "Events") -> list[dict[str, object]]:
    return [
        {
            "name": span.name,
            "start_s": span.start,
            "end_s": span.end,
            "start_deg": math.degrees(span.start_angle),
            "end_deg": math.degrees(span.end_angle),
        }
        for span in found.phases
    ]


def samples(scenes: Sequence[Scene], rate_hz: float) -> str:
    """Write what the controller commands as CSV, scene after scene.

    Parameters
    ----------
    scenes : sequence of Scene
        The scenes; several are told apart by columns of their own.
    rate_hz : float
        Samples a second.

    Returns
    -------
    str
        The table.
    """
    import numpy as np

    from masrel.elbow import trace
    from masrel.recording import PHASES

    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    several = len(scenes) > 1
    writer.writerow((*(("model", "speed_deg_s") if several else ()), *TRACE_COLUMNS))
    for scene in scenes:
        made = trace(scene.parameters, scene.motion, rate_hz=rate_hz)
        columns = (
            made.time.tolist(),
            np.degrees(made.angle).tolist(),
            np.degrees(made.velocity).tolist(),
            made.torque.tolist(),
            [PHASES[code] for code in made.phase.tolist()],
        )
        names = (scene.model, scene.speed_deg_s) if several else ()
        writer.writerows((*names, *row) for row in zip(*columns, strict=True))
    return out.getvalue()


def summary(made: dict[str, object], title: str) -> str:
    """Write the document of one scene for a person.

    Parameters
    ----------
    made : dict
        The document.
    title : str
        Name of the scene.

    Returns
    -------
    str
        Its phases and outputs.
    """
    lines = [
        title,
        f"{'phase':<11}{'start s':>9}{'end s':>9}{'start deg':>11}{'end deg':>9}",
    ]
    phases = made["phases"]
    lines += [
        f"{span['name']:<11}{span['start_s']:>9.3f}{span['end_s']:>9.3f}"
        f"{span['start_deg']:>11.2f}{span['end_deg']:>9.2f}"
        for span in (phases if isinstance(phases, list) else [])
    ]
    lines.append(f"peak torque {made['peak_torque_nm']:.3f} N·m")
    for key, line in OUTPUTS.values():
        if key in made:
            value = made[key]
            lines.append(line.format(math.nan if value is None else value))
    lines += [
        f"torque at {row['time_s']:g} s {row['torque_nm']:.3f} N·m"
        for row in _rows(made, "torque_at_s")
    ]
    lines += [
        f"torque at {row['angle_deg']:g} deg {row['torque_nm']:.3f} N·m"
        for row in _rows(made, "torque_at_deg")
    ]
    return "\n".join(lines)


def _rows(made: dict[str, object], key: str) -> list[dict[str, float]]:
    rows = made.get(key, [])
    return rows if isinstance(rows, list) else []


def table(documents: Sequence[dict[str, object]]) -> str:
    """Write many scenes for a person, one a line.

    Parameters
    ----------
    documents : sequence of dict
        Their documents.

    Returns
    -------
    str
        Model, speed, catch angle, peak torque and what else was asked for.
    """
    extra = [key for key, _ in OUTPUTS.values() if key in documents[0]]
    keys = ["speed_deg_s", "catch_angle_deg", "mean_speed_deg_s", "peak_torque_nm"]
    keys += extra
    widths = [len(key) + 2 for key in keys]
    lines = [
        f"{'model':<8}"
        + "".join(f"{k:>{w}}" for k, w in zip(keys, widths, strict=True))
    ]
    for made in documents:
        cells = [
            f"{'–':>{width}}" if made[key] is None else f"{made[key]:>{width}.3f}"
            for key, width in zip(keys, widths, strict=True)
        ]
        lines.append(f"{made['model']:<8}" + "".join(cells))
    return "\n".join(lines)
