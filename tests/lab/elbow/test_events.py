"""Exact events: Table V's phases, hand values, 40-digit roots, and what must hold."""

from dataclasses import replace
from math import degrees, nextafter, radians

import pytest
from hypothesis import given

from masrel.errors import ParameterError
from masrel.lab.elbow import (
    STANDARD_MODELS,
    ConstantSpeed,
    ElbowParameters,
    Events,
    Joined,
    MinimumJerk,
    Motion,
    Reversed,
    events,
)
from tests.lab.elbow.stretches import (
    CountedMotion,
    Published,
    constant,
    joints,
    minimum_jerk,
    motions,
    table_v,
)

TABLE_V = table_v()

TO_LIMIT = ["pre-catch", "catch"]  # the joint limit is reached inside the catch
THROUGH = ["pre-catch", "catch", "post-catch"]


def names(found: Events) -> list[str]:
    return [span.name for span in found.phases]


def paper_says(model: str) -> list[str]:
    """Section III.C: no post-catch for MAS 1, one for the other three."""
    return TO_LIMIT if model == "HM1" else THROUGH


def misread(range_end_deg: float) -> list[Published]:
    """Stretches of Table V whose phases are not the paper's, at an end of range."""
    wrong = []
    for row in TABLE_V:
        joint = replace(STANDARD_MODELS[row.model], range_end=radians(range_end_deg))
        found = events(joint, constant(row.speed_deg_s, end_deg=range_end_deg))
        if names(found) != paper_says(row.model):
            wrong.append(row)
    return wrong


# The published table


@pytest.mark.parametrize("row", TABLE_V, ids=lambda row: f"{row.model}-{row[1]:g}")
def test_every_stretch_of_table_v_has_the_phases_of_the_paper(row: Published) -> None:
    found = events(STANDARD_MODELS[row.model], constant(row.speed_deg_s))
    assert names(found) == paper_says(row.model)


# At constant speed the catch ends at L - α v + D. The first HM1 to get there is the
# fastest, 123 deg/s: 130 - 43.05 + 60 = 146.95 deg. The last HM2 is the slowest,
# 70 deg/s (two raters): 120 - 24.5 + 50 = 145.5 deg. Only between the two do all 32
# stretches behave as the paper says: the window is 1.45 deg wide, and 146 is in it.


@pytest.mark.parametrize("range_end_deg", [145.6, 146.0, 146.9])
def test_inside_the_narrow_window_all_32_stretches_agree(range_end_deg: float) -> None:
    assert misread(range_end_deg) == []


def test_below_the_window_the_slowest_hm2_meets_the_limit_in_the_catch() -> None:
    assert misread(145.4) == [("HM2", 70.0), ("HM2", 70.0)]


def test_above_the_window_the_fastest_hm1_gets_through_the_catch() -> None:
    assert misread(147.0) == [("HM1", 123.0)]


def at_pre_catch_speed(
    joint: ElbowParameters, speed_deg_s: float, *, aim_deg: float
) -> MinimumJerk:
    """Make the minimum-jerk stretch whose mean speed before the catch is given."""
    low, high = 0.5 * speed_deg_s, 1.5 * speed_deg_s
    for _ in range(50):
        middle = 0.5 * (low + high)
        found = events(joint, minimum_jerk(middle, end_deg=aim_deg))
        if found.mean_speed is None or found.mean_speed < radians(speed_deg_s):
            low = middle
        else:
            high = middle
    return minimum_jerk(high, end_deg=aim_deg)


# Table V's speeds are means of the pre-catch phase. A minimum-jerk stretch that has
# them there, and is aimed beyond the limit that stops it, shows the same phases.
@pytest.mark.parametrize("row", TABLE_V, ids=lambda row: f"{row.model}-{row[1]:g}")
def test_minimum_jerk_at_the_pre_catch_speeds_shows_them_too(row: Published) -> None:
    joint = STANDARD_MODELS[row.model]
    motion = at_pre_catch_speed(joint, row.speed_deg_s, aim_deg=165.0)
    found = events(joint, motion)
    assert found.mean_speed == pytest.approx(radians(row.speed_deg_s), rel=1e-12)
    assert names(found) == paper_says(row.model)


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
    assert found.onset == 0.0
    assert found.catch == pytest.approx(52.8 / 92, rel=1e-15)
    assert degrees(found.catch_angle) == pytest.approx(82.8, rel=1e-15)
    assert degrees(found.catch_speed) == pytest.approx(92.0, rel=1e-15)
    assert degrees(found.mean_speed) == pytest.approx(92.0, rel=1e-15)
    assert found.peak_end == pytest.approx(52.8 / 92 + 0.1, rel=1e-15)
    assert found.catch_end == pytest.approx(0.9, rel=1e-15)
    assert found.post_catch_end is None
    assert found.end == pytest.approx(116 / 92, rel=1e-15)
    angles = [degrees(span.end_angle) for span in found.phases]
    assert angles == pytest.approx([82.8, 112.8, 146.0], rel=1e-14)


def test_hm4_at_120_deg_s_leaves_the_catch_during_the_peak() -> None:
    # θ_catch = 110 - 42 = 68 deg; D/v = 10/120 = 0.0833 s, less than the 0.1 s of the
    # peak, which therefore ends with the catch.
    found = events(STANDARD_MODELS["HM4"], constant(120.0))
    assert degrees(found.catch_angle) == pytest.approx(68.0, rel=1e-15)
    assert found.catch_end - found.catch == pytest.approx(10 / 120, rel=1e-14)
    assert found.peak_end == found.catch_end
    assert names(found) == THROUGH


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


def test_a_stretch_that_stops_short_of_the_catch_has_none() -> None:
    found = events(STANDARD_MODELS["HM3"], constant(92.0, end_deg=82.7))
    assert found.onset == 0.0
    assert found.catch is None
    assert names(found) == ["pre-catch"]


def slowed(joint: ElbowParameters, motion: Motion) -> float:
    """When a stretch has last been as fast as ν_th, by halving."""
    if float(motion.velocity(motion.duration)) >= joint.speed_threshold:
        return motion.duration
    low, high = 0.5 * motion.duration, motion.duration
    for _ in range(60):
        middle = 0.5 * (low + high)
        if float(motion.velocity(middle)) >= joint.speed_threshold:
            low = middle
        else:
            high = middle
    return low


# A mean speed of 150.55 deg/s over 47.2 deg: at the end of a short, fast stretch θ
# passes θ_catch by 0.8 deg, and θ_catch, rising as the mean falls, overtakes it again
# before the speed is below ν_th. The catch is still one.
def test_a_catch_that_would_be_overtaken_again_is_found() -> None:
    joint = replace(
        STANDARD_MODELS["HM1"],
        catch_angle_constant=radians(111.84755),
        catch_slope=0.1529606,
    )
    motion = minimum_jerk(150.552909, start_deg=37.98959, end_deg=85.21697)
    found = events(joint, motion)
    slow = slowed(joint, motion)
    assert found.catch < slow
    mean = float(motion.angle(slow) - motion.angle(found.onset)) / (slow - found.onset)
    assert float(motion.angle(slow)) < joint.catch_angle(mean)


def test_a_second_stretch_catches_again_once_the_arm_went_back() -> None:
    out = ConstantSpeed(start=radians(30), end=radians(140), speed=radians(92))
    found = events(STANDARD_MODELS["HM3"], Joined([out, Reversed(motion=out), out]))
    angles = [degrees(stretch.catch_angle or 0.0) for stretch in found.stretches]
    assert angles == pytest.approx([82.8, 82.8], rel=1e-14)


# Slow stretches


@pytest.mark.parametrize("motion", [constant(19.9), minimum_jerk(20 / 1.875 - 0.01)])
def test_a_slow_stretch_never_catches(motion: Motion) -> None:
    # The peak of minimum jerk is 1.875 times its mean: just below 20 deg/s too.
    joint = STANDARD_MODELS["HM4"]
    found = events(joint, motion)
    assert found.onset is None
    assert found.catch is None
    assert names(found) == ["pre-catch"]


def test_the_threshold_itself_moves_but_does_not_catch() -> None:
    # Onset asks for ν_th, the catch of Fig. 7 for more than it.
    joint = STANDARD_MODELS["HM3"]
    at = events(joint, constant(20.0))
    assert at.onset == 0.0
    assert at.catch is None
    above = events(joint, constant(nextafter(20.0, 21.0) + 1e-12))
    assert degrees(above.catch_angle) == pytest.approx(94.0)


# Another implementation: roots to 40 digits, found by scanning


# What must hold for every joint and stretch


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


@given(joint=joints(), motion=motions())
def test_catch_angle_and_travel_obey_equations_2_and_4(
    joint: ElbowParameters, motion: Motion
) -> None:
    found = events(joint, motion)
    if found.catch is None:
        assert set(names(found)) == {"pre-catch"}
        assert (found.catch_angle, found.mean_speed, found.catch_end) == (None,) * 3
        return
    if found.catch > found.onset:
        asked = joint.catch_angle(found.mean_speed)
        assert found.catch_angle == pytest.approx(asked, abs=1e-12)
    assert found.catch_speed >= joint.speed_threshold * (1 - 1e-12)
    if found.catch_end is None:
        end_angle = float(motion.angle(found.end))
        assert end_angle - found.catch_angle <= joint.catch_travel + 1e-15
        return
    # (4) as printed: time since the catch × mean speed since = D
    since = found.catch_end - found.catch
    mean = float(motion.angle(found.catch_end) - motion.angle(found.catch)) / since
    assert since == pytest.approx(joint.catch_travel / mean, rel=1e-12)


@pytest.mark.parametrize("start_deg", [146.0, 150.0])
def test_a_stretch_cannot_start_at_or_beyond_the_end_of_range(start_deg: float) -> None:
    motion = constant(60.0, start_deg=start_deg, end_deg=160.0)
    said = rf"start: needs less than the end of range, 146 degrees, got {start_deg:g}"
    with pytest.raises(ParameterError, match=said):
        events(STANDARD_MODELS["HM1"], motion)


def test_events_ask_for_pieces_and_no_samples() -> None:
    motion = CountedMotion(minimum_jerk(92.0))
    events(STANDARD_MODELS["HM3"], motion)
    assert (motion.n_calls, motion.n_pieces) == (0, 2)
