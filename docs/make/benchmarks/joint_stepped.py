"""The honest rival: many scenes stepped all at once, a numpy operation a sample.

Written from the law alone, as somebody would who has numpy and ten thousand scenes.
"""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Column = Floats | float
Places = Callable[[float], tuple[Floats, Floats]]


def places(kind: str, m: Mapping[str, Floats]) -> tuple[Floats, Places]:
    """Durations of stretches, and their angles and speeds at a time."""
    start, way = m["start"], m["end"] - m["start"]
    if kind == "constant":
        duration = way / m["speed"]
        return duration, lambda t: (start + m["speed"] * t, m["speed"])
    if kind == "minimum jerk":
        duration = way / m["mean_speed"]

        def reach(t: float) -> tuple[Floats, Floats]:
            s = np.minimum(t / duration, 1.0)
            rest = s * (1.0 - s)
            share = s * s * s * (10.0 + s * (6.0 * s - 15.0))
            return start + way * share, 30.0 * m["mean_speed"] * rest * rest

        return duration, reach
    rate, top = m["acceleration_rate"], m["speed"]
    ramp = top / rate
    duration = way / top + ramp

    def ramps(t: float) -> tuple[Floats, Floats]:
        left = np.maximum(duration - t, 0.0)
        down, level = way - 0.5 * rate * left * left, top * (t - 0.5 * ramp)
        travel = np.where(left > ramp, level, down)
        speed = np.where(left > ramp, top, rate * left)
        is_up = t < ramp
        angle = start + np.where(is_up, 0.5 * rate * t * t, travel)
        return angle, np.where(is_up, rate * t, speed)

    return duration, ramps


def step_together(
    p: Mapping[str, Column], start: Floats, duration: Floats, at: Places, rate_hz: float
) -> dict[str, Floats]:
    """Events and peak torque of movements, as samples see them."""
    n, threshold = start.size, p["speed_threshold"]
    phase, is_armed, is_moving = np.zeros(n, int), np.ones(n, bool), np.zeros(n, bool)
    zeros = np.zeros((4, n))
    onset_angle, pre_end, rise, post_angle = zeros
    names = ("onset", "catch", "catch_angle", "catch_speed", "mean_speed", "catch_end")
    out = {name: np.full(n, np.nan) for name in (*names, "post_catch_end")}
    peak = np.full(n, -np.inf)
    fastest = (p["catch_angle_constant"] - p["smallest_catch_angle"]) / p["catch_slope"]
    for i in range(int(np.floor(duration.max() * rate_hz)) + 1):
        t = i / rate_hz
        angle, speed = at(t)
        goes_on = (t <= duration) & (angle <= p["range_end"])
        # flexed faster than ν_th: the stretch is over, and the next may catch
        is_flexed = (speed <= -threshold) & goes_on
        phase = np.where(is_flexed, 0, phase)
        is_armed, is_moving = is_armed | is_flexed, is_moving & ~is_flexed
        # pre-catch: onset, and the catch by (2) and (6)
        is_fast = (speed >= threshold) & goes_on
        in_pre = phase == 0
        begins = in_pre & is_fast & ~is_moving
        out["onset"] = np.where(begins, t, out["onset"])
        onset_angle = np.where(begins, angle, onset_angle)
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = (angle - onset_angle) / (t - out["onset"])
        slowed = np.maximum(mean, p["slowest_mean_speed"])
        line = p["catch_angle_constant"] - p["catch_slope"] * slowed
        goal = np.where(mean > fastest, p["smallest_catch_angle"], line)
        caught = in_pre & is_fast & is_moving & is_armed & (angle > goal)
        is_moving = np.where(in_pre, is_fast, is_moving)
        torque = p["damping"] * speed + p["stiffness"] * (angle - start)  # (1)
        for name, value in (
            ("catch", t), ("catch_angle", angle), ("catch_speed", speed),
            ("mean_speed", mean),
        ):  # fmt: skip
            out[name] = np.where(caught, value, out[name])
        pre_end = np.where(caught, torque, pre_end)
        rise = np.where(caught, p["catch_torque_constant"] * speed, rise)
        # the catch ends by (4), post-catch below the threshold
        travelled = angle - out["catch_angle"] > p["catch_travel"]
        leaves = (phase == 1) & travelled & goes_on
        slows = (phase == 2) & (speed < threshold) & goes_on
        out["catch_end"] = np.where(leaves, t, out["catch_end"])
        out["post_catch_end"] = np.where(slows, t, out["post_catch_end"])
        post_angle = np.where(leaves, angle, post_angle)
        is_armed = is_armed & ~caught
        is_moving = is_moving & ~slows
        phase = np.where(caught, 1, np.where(leaves, 2, np.where(slows, 0, phase)))
        residual = pre_end + p["residual_ratio"] * rise
        in_peak = t - out["catch"] < p["peak_duration"]
        flat = np.where(in_peak, pre_end + rise, residual)  # (3)
        after = residual + p["post_catch_stiffness"] * (angle - post_angle)  # (5)
        torque = np.where(phase == 0, torque, np.where(phase == 1, flat, after))
        peak = np.where(goes_on, np.maximum(peak, torque), peak)
    left = np.where(np.isnan(out["catch_end"]), duration, out["catch_end"])
    out["peak_end"] = np.minimum(out["catch"] + p["peak_duration"], left)
    return out | {"end": duration, "peak_torque": peak}
