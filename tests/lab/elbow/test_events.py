"""Exact events: Table V's phases, hand values, and what must hold."""

from dataclasses import replace
from math import degrees, radians

import pytest

from masrel.lab.elbow import (
    STANDARD_MODELS,
    ConstantSpeed,
    ElbowParameters,
    Events,
    events,
)
from tests.lab.elbow.stretches import (
    Published,
    constant,
    minimum_jerk,
    table_v,
)

TABLE_V = table_v()


def names(found: Events) -> list[str]:
    return [span.name for span in found.phases]


def misread(range_end_deg: float) -> list[Published]:
    """Stretches of Table V whose phases are not the paper's, at an end of range."""
    wrong = []
    for row in TABLE_V:
        joint = replace(STANDARD_MODELS[row.model], range_end=radians(range_end_deg))
        found = events(joint, constant(row.speed_deg_s, end_deg=range_end_deg))
        # Section III.C: no post-catch for MAS 1, one for the other three
        after = ["post-catch"] * (row.model != "HM1")
        if names(found) != ["pre-catch", "catch", *after]:
            wrong.append(row)
    return wrong


# The published table


# At constant speed the catch ends at L - α v + D. The first HM1 to get there is the
# fastest, 123 deg/s: 130 - 43.05 + 60 = 146.95 deg. The last HM2 is the slowest,
# 70 deg/s (two raters): 120 - 24.5 + 50 = 145.5 deg. Only between the two do all 32
# stretches behave as the paper says: the window is 1.45 deg wide, and 146 is in it.


@pytest.mark.parametrize(
    ("range_end_deg", "wrong"),
    [
        # the slowest HM2 meets the limit in the catch
        (145.4, [("HM2", 70.0), ("HM2", 70.0)]),
        *((end, []) for end in (145.6, 146.0, 146.9)),
        (147.0, [("HM1", 123.0)]),  # the fastest HM1 gets through the catch
    ],
)
def test_inside_a_narrow_window_all_stretches_have_the_phases_of_the_paper(
    range_end_deg: float, wrong: list[Published]
) -> None:
    assert len(TABLE_V) == 32
    assert misread(range_end_deg) == wrong


def test_minimum_jerk_at_the_same_mean_of_the_whole_differs_in_two() -> None:
    # It is faster than its mean before the catch, so HM1 catches sooner and the two
    # fastest raters get through. The arm stops by itself: pre-catch comes last.
    differ = []
    for row in TABLE_V:
        found = events(STANDARD_MODELS[row.model], minimum_jerk(row.speed_deg_s))
        if ("post-catch" in names(found)) != (row.model != "HM1"):
            differ.append(row)
    assert differ == [("HM1", 122.0), ("HM1", 123.0)]


# By hand


def test_hm3_at_92_deg_s_by_hand() -> None:
    # θ_catch = 115 - 0.35 · 92 = 82.8 deg, after 52.8/92 s from 30 deg; the peak lasts
    # 0.1 s; the catch ends at 82.8 + 30 = 112.8 deg, after 82.8/92 = 0.9 s; the
    # stretch at 146 deg, after 116/92 s. Speed is above 20 deg/s from the first.
    found = events(STANDARD_MODELS["HM3"], constant(92.0))
    seconds = {
        "onset": 0.0,
        "catch": 52.8 / 92,
        "peak_end": 52.8 / 92 + 0.1,
        "catch_end": 0.9,
        "end": 116 / 92,
    }
    times = {name: getattr(found, name) for name in seconds}
    assert times == pytest.approx(seconds, rel=1e-15, abs=0.0)
    degrees_of = {"catch_angle": 82.8, "catch_speed": 92.0, "mean_speed": 92.0}
    values = {name: degrees(getattr(found, name)) for name in degrees_of}
    assert values == pytest.approx(degrees_of, rel=1e-15)
    assert found.post_catch_end is None
    angles = [degrees(span.end_angle) for span in found.phases]
    assert angles == pytest.approx([82.8, 112.8, 146.0], rel=1e-14)


@pytest.mark.parametrize(
    ("model", "speed_deg_s", "catch_deg"),
    [
        ("HM3", 40.0, 94.0),  # (6), first line: 115 - 0.35 · 60
        ("HM3", 60.0, 94.0),
        ("HM3", 61.0, 93.65),  # (2): 115 - 21.35
        ("HM4", 142.0, 60.3),  # ν_H = 50/0.35 = 142.857: 110 - 49.7
        ("HM4", 143.0, 60.0),  # (6), third line
        ("HM4", 190.0, 60.0),
        ("HM1", 200.0, 60.0),  # ν_H = 70/0.35 = 200 itself: 130 - 70
    ],
)
def test_catch_angle_is_clamped_at_both_ends(
    model: str, speed_deg_s: float, catch_deg: float
) -> None:
    found = events(STANDARD_MODELS[model], constant(speed_deg_s))
    assert degrees(found.catch_angle) == pytest.approx(catch_deg, rel=1e-14)


def test_at_the_speed_of_the_smallest_angle_the_line_of_slower_speeds_holds() -> None:
    # (6) with ν_L above ν_H = (L - θ_L) / α = (1.90625 - 1.25) / 0.375 = 1.75 rad/s:
    # up to ν_H the catch is at L - α ν_L = 0.78125 rad, beyond it at θ_L = 1.25 rad.
    joint = ElbowParameters(
        catch_angle_constant=1.90625,
        catch_torque_constant=2.0,
        residual_ratio=0.4,
        catch_travel=0.25,
        catch_slope=0.375,
        slowest_mean_speed=3.0,
        smallest_catch_angle=1.25,
    )
    for start in (0.1, 0.3, 0.5):  # the mean speed is a quotient, rounded either way
        at = events(joint, ConstantSpeed(start=start, end=2.5, speed=1.75))
        assert at.catch_angle == pytest.approx(0.78125, abs=1e-15)
    beyond = events(joint, ConstantSpeed(start=0.5, end=2.5, speed=1.75 * (1 + 1e-12)))
    assert beyond.catch_angle == pytest.approx(1.25, abs=1e-15)
