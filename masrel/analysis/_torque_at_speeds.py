"""The torque that models make at the mean speeds of raters' stretches."""

import math
from collections.abc import Sequence

from masrel.analysis._results import Speed
from masrel.elbow import ConstantSpeed, ElbowParameters, Trace, peak_torque, trace
from masrel.protocol import Protocol, elbow_parameters


def stretch_end_deg(protocol: Protocol) -> float:
    """Return where a stretch ends at the latest, deg."""
    return min(protocol.stretch.end_deg, protocol.elbow.range_end_deg)


def peak_torques(
    protocol: Protocol, speeds: Sequence[Speed]
) -> dict[tuple[str, str], float]:
    """Return by model and rater the largest peak of the exact law, N·m."""
    peaks: dict[tuple[str, str], float] = {}
    for speed, joint, motion in _stretches(protocol, speeds):
        key = (speed.model, speed.rater)
        peak = peak_torque(joint, motion)
        peaks[key] = max(peak, peaks.get(key, peak))
    return peaks


def commanded_traces(protocol: Protocol, speeds: Sequence[Speed]) -> list[Trace]:
    """Return what the controller commands in each stretch, at the device's rate."""
    rate_hz = protocol.device.rate_hz
    return [
        trace(joint, motion, rate_hz=rate_hz)
        for _, joint, motion in _stretches(protocol, speeds)
    ]


def _stretches(
    protocol: Protocol, speeds: Sequence[Speed]
) -> list[tuple[Speed, ElbowParameters, ConstantSpeed]]:
    # each at constant speed from the start to the end of the range
    start = math.radians(protocol.stretch.start_deg)
    end = math.radians(stretch_end_deg(protocol))
    models = dict.fromkeys(speed.model for speed in speeds)
    joints = {model: elbow_parameters(protocol, model) for model in models}
    return [
        (
            speed,
            joints[speed.model],
            ConstantSpeed(
                start=start, end=end, speed=math.radians(speed.mean_speed_deg_s)
            ),
        )
        for speed in speeds
    ]
