"""The rules that tie the constants of a joint to each other."""

import math
from collections.abc import Iterator
from typing import Any

from masrel.protocol.wording import with_id

__all__ = ["joint_rules"]

Values = dict[str, Any]


def joint_rules(values: Values) -> Iterator[str]:
    """Check shared constants, and those of each model, against each other."""
    elbow = values.get("elbow") or {}
    yield from _smallest_catch_angle(elbow)
    yield from _rise(elbow, elbow, "elbow")
    yield from _rest(elbow, values, "elbow")
    for index, model in enumerate(values.get("models") or []):
        if model is not None:
            for problem in _model(model, values, f"models[{index}]"):
                yield f"{problem}{with_id(model)}"


def _model(model: Values, values: Values, where: str) -> Iterator[str]:
    own = {k: v for k, v in (model.get("constants") or {}).items() if v is not None}
    joint = {**(values.get("elbow") or {}), **own}
    constant = model.get("catch_angle_constant_deg")  # L of (2)
    if constant is not None:
        yield from _catch_angle(constant, joint, f"{where}.catch_angle_constant_deg")
    yield from _rise(own, joint, f"{where}.constants")
    if "rest_angle_deg" in own:
        yield from _rest(joint, values, f"{where}.constants")
    elif "stiffness_nm_rad" in own:
        yield from _rest(joint, values, "elbow")


def _smallest_catch_angle(elbow: Values) -> Iterator[str]:
    smallest = elbow.get("smallest_catch_angle_deg")  # θ_L of (6)
    limit = elbow.get("range_end_deg")
    if smallest is not None and limit is not None and smallest >= limit:
        yield (
            f"elbow.smallest_catch_angle_deg: needed less than elbow.range_end_deg "
            f"({limit:g}), got {smallest:g}"
        )


def _catch_angle(constant: float, joint: Values, where: str) -> Iterator[str]:
    smallest = joint.get("smallest_catch_angle_deg")
    slope, slowest = joint.get("catch_slope_s"), joint.get("slowest_mean_speed_deg_s")
    if smallest is None:
        return
    if constant <= smallest:
        yield (
            f"{where}: needed more than elbow.smallest_catch_angle_deg "
            f"({smallest:g}), got {constant:g}"
        )
    elif slope is not None and slowest is not None:
        angle = constant - slope * slowest  # first line of (6), the largest of them
        if angle < smallest:
            yield (
                f"{where}: needed a catch angle at elbow.slowest_mean_speed_deg_s of "
                f"at least elbow.smallest_catch_angle_deg ({smallest:g}), got "
                f"{constant:g} - {slope:g} * {slowest:g} = {angle:g}"
            )


def _rise(own: Values, joint: Values, where: str) -> Iterator[str]:
    rise, peak = own.get("catch_rise_s"), joint.get("peak_duration_s")
    if rise is not None and peak is not None and rise > peak:
        yield (
            f"{where}.catch_rise_s: needed at most elbow.peak_duration_s ({peak:g}), "
            f"got {rise:g}"
        )


def _rest(joint: Values, values: Values, where: str) -> Iterator[str]:
    # An arm that waits where the stretch starts is held by k·(θ_start - θ_rest) of
    # (1); with as much as a frozen encoder is told by, no presentation would begin.
    rest, stiffness = joint.get("rest_angle_deg"), joint.get("stiffness_nm_rad")
    start = (values.get("stretch") or {}).get("start_deg")
    limit = (values.get("device") or {}).get("standing_torque_nm")
    if rest is None or stiffness is None or start is None or limit is None:
        return
    torque = stiffness * math.radians(start - rest)
    if abs(torque) > limit:
        yield (
            f"{where}.rest_angle_deg: needed at most device.standing_torque_nm "
            f"({limit:g} N·m) where the stretch starts, got {stiffness:g} N·m/rad "
            f"times {start:g} - {rest:g} deg = {torque:.3g} N·m"
        )
