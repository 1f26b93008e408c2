"""One scene of ``masrel trace``, a model and a motion, and what JSON says of it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from masrel.cli.options import grouped
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.elbow import ElbowParameters, Events, Motion

__all__ = ["OUTPUTS", "Scene", "Wanted", "document", "output_options"]

OUTPUTS = {
    "residual-torque": "residual_torque_nm",
    "work": "work_j",
    "impulse": "impulse_nms",
}
"""What may be asked for beside the peak, and its key in the document."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """A model and a motion."""

    model: str  # name of the model
    kind: str  # kind of the motion
    speed_deg_s: float | None  # its speed, if it is named after one
    # start_deg, end_deg: where it starts and ends
    start_deg: float
    end_deg: float
    parameters: "ElbowParameters"  # the joint
    motion: "Motion"  # the motion

    @property
    def title(self) -> str:
        """Name of the scene."""
        if self.speed_deg_s is None:
            return f"{self.model}, {self.kind}"
        return f"{self.model}, {self.kind} {self.speed_deg_s:g} deg/s"


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """What is asked of every scene beside events and peak."""

    outputs: tuple[str, ...]  # of `OUTPUTS`
    times: tuple[float, ...]  # times at which the torque is asked for, s
    angles: tuple[float, ...]  # angles where it is asked for, deg


output_options = grouped(
    "wanted",
    Wanted,
    click.option(
        "--output", "outputs", type=click.Choice(tuple(OUTPUTS)), multiple=True,
        help="What to compute beside events and peak; may be given again.",
    ),
    click.option(
        "--at-s", "times", type=float, multiple=True, help="Torque at this time."
    ),
    click.option(
        "--at-deg", "angles", type=float, multiple=True,
        help="Torque where this angle is first reached.",
    ),
)  # fmt: skip
"""The options of outputs, given to a command as one argument `wanted`."""


def document(scene: Scene, wanted: Wanted) -> dict[str, object]:
    """Solve a scene."""
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
    made.update(_asked(scene, wanted, found))
    _refuse_infinite(scene, made)
    return made


def _asked(scene: Scene, wanted: Wanted, found: "Events") -> dict[str, object]:
    from masrel import elbow

    joint, motion = scene.parameters, scene.motion
    functions = {
        "residual-torque": elbow.residual_torque,
        "work": elbow.work,
        "impulse": elbow.impulse,
    }
    made: dict[str, object] = {}
    for name in wanted.outputs:
        value = functions[name](joint, motion)
        made[OUTPUTS[name]] = None if math.isnan(value) else value
    if times := wanted.times:
        values = elbow.torque(joint, motion, times, found=found).tolist()
        made["torque_at_s"] = _pairs("time_s", times, values)
    if angles := wanted.angles:
        values = elbow.torque_at(joint, motion, [math.radians(a) for a in angles])
        made["torque_at_deg"] = _pairs("angle_deg", angles, values.tolist())
    return made


def _refuse_infinite(scene: Scene, made: dict[str, object]) -> None:
    numbers = {key: value for key, value in made.items() if isinstance(value, float)}
    for key, value in numbers.items():
        if not math.isfinite(value):
            raise ParameterError(
                f"{scene.title}: {key}: needs a number that a float can hold, got "
                f"{value:g}; some parameter or speed is too large"
            )


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
