"""Stretches, joints and counters that the tests of the elbow share."""

import csv
from math import radians
from pathlib import Path
from typing import NamedTuple

from hypothesis import strategies as st

from masrel.lab.elbow import ConstantSpeed, ElbowParameters, MinimumJerk, Motion

PUBLISHED = Path(__file__).parents[3] / "studies/hess2012/ratings/published.csv"

START_DEG, END_DEG = 30.0, 146.0


class Published(NamedTuple):
    model: str
    speed_deg_s: float


def table_v() -> list[Published]:
    """The 32 models and mean speeds of Table V."""
    with PUBLISHED.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return [Published(row["model"], float(row["mean_speed_deg_s"])) for row in rows]


def constant(
    speed_deg_s: float, *, start_deg: float = START_DEG, end_deg: float = END_DEG
) -> ConstantSpeed:
    return ConstantSpeed(
        start=radians(start_deg), end=radians(end_deg), speed=radians(speed_deg_s)
    )


def minimum_jerk(
    speed_deg_s: float, *, start_deg: float = START_DEG, end_deg: float = END_DEG
) -> MinimumJerk:
    return MinimumJerk(
        start=radians(start_deg), end=radians(end_deg), mean_speed=radians(speed_deg_s)
    )


@st.composite
def joints(draw: st.DrawFn, *, inertia: bool = True) -> ElbowParameters:
    """Draw a joint around those of Table III, its constants changed as well."""

    def between(low: float, high: float) -> float:
        return draw(st.floats(low, high))

    return ElbowParameters(
        catch_angle_constant=radians(between(95.0, 135.0)),
        catch_torque_constant=between(0.0, 5.0),
        residual_ratio=between(0.0, 0.95),
        catch_travel=radians(between(5.0, 70.0)),
        inertia=draw(st.sampled_from([0.0, 0.05])) if inertia else 0.0,
        damping=between(0.0, 2.0),
        stiffness=between(0.0, 5.0),
        catch_slope=between(0.1, 0.5),
        peak_duration=between(0.02, 0.2),
        post_catch_stiffness=between(0.0, 8.0),
        post_catch=draw(st.sampled_from(["continuous", "additive"])),
    )


@st.composite
def motions(draw: st.DrawFn) -> Motion:
    """Draw a stretch at 5 to 200 deg/s, of either kind, short or beyond the limit."""
    kind = draw(st.sampled_from([constant, minimum_jerk]))
    start = draw(st.floats(0.0, 60.0))
    end = draw(st.floats(80.0, 175.0))
    return kind(draw(st.floats(5.0, 200.0)), start_deg=start, end_deg=end)
