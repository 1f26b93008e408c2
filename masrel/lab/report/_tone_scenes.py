"""The JSON and the text of scenes of other kinds of joints, and Tardieu's angles.

In: a joint that is no spastic elbow, and a motion. Out: its events and its torque along
the motion; of any joint the angles of the Tardieu scale.
"""

import math
from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any, Literal

from masrel.errors import ParameterError
from masrel.lab.recording import PHASES
from masrel.lab.report._figure_data import StretchLine
from masrel.tables._tables import aligned, fixed_or_significant, significant

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from masrel.lab.elbow import JointModel
    from masrel.lab.elbow.tone import ToneModel
    from masrel.lab.report._traced_scenes import Quantities, Scene

_RATE_HZ = 1000  # of the samples that phases and lines are made of


def tone_document(scene: "Scene", quantities: "Quantities") -> dict[str, object]:
    """Return the events of a scene, its peak torque, and torques at places."""
    if quantities.outputs:
        raise ParameterError(f"--output: needs spastic elbows, got {scene.joint.kind}")
    import numpy as np

    joint, motion = _tone_of(scene), scene.motion
    events = joint.events(motion)
    caught = [event for event in events if event.name == joint.catch_event]
    line = tone_line(scene)
    at_events = joint.torque(motion, [event.time for event in events])
    return {
        "model": scene.model,
        "kind": joint.kind,
        "motion": scene.kind,
        "speed_deg_s": scene.speed_deg_s,
        "from_deg": scene.start_deg,
        "to_deg": scene.end_deg,
        "catch_angle_deg": math.degrees(caught[0].angle) if caught else None,
        "mean_speed_deg_s": None,
        # of every millisecond and every event
        "peak_torque_nm": float(np.concatenate((line.torque, at_events)).max()),
        "phases": [
            {
                "name": name,
                "start_s": start,
                "end_s": end,
                "start_deg": math.degrees(motion.angle(start)),
                "end_deg": math.degrees(motion.angle(end)),
            }
            for name, start, end in line.phases
        ],
        "events": [
            {
                "name": event.name,
                "time_s": event.time,
                "angle_deg": math.degrees(event.angle),
            }
            for event in events
        ],
        **_torques_at(scene, quantities),
    }


def _torques_at(scene: "Scene", quantities: "Quantities") -> dict[str, object]:
    from masrel.lab.elbow import times_at

    joint, motion = _tone_of(scene), scene.motion
    requested: dict[str, object] = {}
    if times := quantities.times:
        late = [time for time in times if not 0.0 <= time <= motion.duration]
        if late:
            raise ParameterError(
                "--at-s: needs times within the motion, 0 to "
                f"{significant(motion.duration)} s, got {significant(late[0])}"
            )
        torques = joint.torque(motion, list(times))
        requested["torque_at_s"] = torque_rows("time_s", times, torques)
    if angles := quantities.angles:
        reached = times_at(motion, [math.radians(angle) for angle in angles])
        torques = joint.torque(motion, reached)
        requested["torque_at_deg"] = torque_rows("angle_deg", angles, torques)
    return requested


def torque_rows(
    key: str, places: Sequence[float], torques: "NDArray[np.float64]"
) -> list[dict[str, float]]:
    """Return the torque at each time or angle, which have this key."""
    return [
        {key: place, "torque_nm": torque}
        for place, torque in zip(places, torques.tolist(), strict=True)
    ]


def _tone_of(scene: "Scene") -> "ToneModel":
    from masrel.lab.elbow.tone import ToneModel

    if not isinstance(scene.joint, ToneModel):
        raise ParameterError(
            f"--model: needs a law with exact events, got {scene.model}"
        )
    return scene.joint


def tone_line(scene: "Scene") -> StretchLine:
    """Return the exact torque of every millisecond, and the phases at these."""
    import numpy as np

    from masrel.lab.elbow import trace

    joint, motion = _tone_of(scene), scene.motion
    sampled = trace(joint, motion, rate_hz=_RATE_HZ)
    time = np.append(sampled.time, motion.duration)
    spans, first = [], 0
    for code, group in groupby(sampled.phase.tolist()):
        n = len(list(group))
        spans.append((PHASES[code], float(time[first]), float(time[first + n])))
        first += n
    speed = scene.speed_deg_s
    return StretchLine(
        label=scene.kind if speed is None else f"{significant(speed)} deg/s",
        time=time,
        angle=np.degrees(motion.angle(time)),
        torque=joint.torque(motion, time),
        phases=tuple(spans),
    )


def tardieu_document(
    model: str, joint: "JointModel", start_deg: float, speeds: Sequence[float]
) -> dict[str, object]:
    """Return R2, R1, their difference and the catch at V1, V2 and V3 of a joint."""
    # speeds: V1, V2 and V3, deg/s; none for the usual ones
    from masrel.lab.elbow import tardieu

    start = math.radians(start_deg)
    if speeds:
        first, second, third = map(math.radians, speeds)
        made = tardieu(joint, start_angle=start, speeds=(first, second, third))
    else:
        made = tardieu(joint, start_angle=start)
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
                "catch_angle_deg": None if angle is None else math.degrees(angle),
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
