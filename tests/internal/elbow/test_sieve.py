"""Events in 16 digits where these settle them, in 32 where they do not."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from masrel.elbow import STANDARD_MODELS, MinimumJerk, events, torque_traces
from masrel.elbow.scenes import sieve
from masrel.elbow.scenes.course import nearest
from masrel.elbow.scenes.digits import DIGITS_16
from masrel.elbow.scenes.quintic import quintic_courses
from masrel.elbow.scenes.sieve import quintic_courses_for_samples
from masrel.elbow.scenes.table import joints_of, motions_of
from tests.elbow.scenes import random_scene
from tests.elbow.stretches import counted, minimum_jerk, table_v

HM3 = STANDARD_MODELS["HM3"]
FLAGS = ("moves", "catches", "leaves", "slows")
TIMES = {
    "catch": "catches",
    "catch_end": "leaves",
    "post_end": "slows",
}


def columns(scenes):
    joints, motions = zip(*scenes, strict=True)
    return joints_of(joints), motions_of(motions, "mean_speed")


@pytest.mark.parametrize("wide", [False, True])
def test_what_16_digits_settle_is_what_32_find(wide: bool) -> None:
    scenes = [
        random_scene(np.random.default_rng([seed, 15]), "minimum jerk", wide=wide)
        for seed in range(4000)
    ]
    joints, motions = columns([s for s in scenes if s[1].start < s[0].range_end])
    with np.errstate(all="ignore"):
        quick = quintic_courses(joints, motions, DIGITS_16)
    exact = quintic_courses(joints, motions)
    sure = ~quick.is_doubtful & ~exact.is_doubtful
    assert sure.sum() > 0.5 * sure.size
    duration = ((motions.end - motions.start) / motions.speed)[sure]
    for name in FLAGS:
        assert (getattr(quick, name) == getattr(exact, name))[sure].all()
    for name, flag in TIMES.items():
        known = getattr(exact, flag)
        one, other = (nearest(getattr(c, name), known)[sure] for c in (quick, exact))
        # a hundredth of what the samples are held to
        assert np.nanmax(np.abs(one - other) / duration) < 1e-12
    way = (motions.end - motions.start)[sure]
    angles = [nearest(c.catch_angle, exact.catches)[sure] for c in (quick, exact)]
    assert np.nanmax(np.abs(angles[0] - angles[1]) / np.maximum(way, 1.0)) < 1e-14
    speeds = [nearest(c.catch_speed, exact.catches)[sure] for c in (quick, exact)]
    # 6e-15; with zeros as badly defined as they come, 1.5e-14
    assert np.nanmax(np.abs(speeds[0] - speeds[1]) / motions.speed[sure]) < 1e-14


def test_plain_stretches_are_settled_by_16_digits() -> None:
    scenes = [
        (STANDARD_MODELS[r.model], minimum_jerk(r.speed_deg_s)) for r in table_v()
    ]
    with counted(sieve, "quintic_courses") as calls:
        quintic_courses_for_samples(*columns(scenes), 1000.0)
    assert calls == [1]


# 1e-12 of the duration is what 16 digits are held to above, and a tenth of the margin.
@pytest.mark.parametrize("late_s", [-2e-12, -1e-15, 0.0, 1e-15, 2e-12, 1e-10])
def test_an_event_at_a_sample_is_asked_again(late_s: float) -> None:
    # a rate at which the tenth sample is the catch, or nearly
    stretch = minimum_jerk(92.0)
    rate_hz = 10.0 / (events(HM3, stretch).catch + late_s)
    with counted(sieve, "quintic_courses") as calls:
        quintic_courses_for_samples(*columns([(HM3, stretch)] * 3), rate_hz)
    assert calls == [1 if late_s > 1e-11 else 2]
    row = torque_traces(HM3, stretch, rate_hz=rate_hz)[0]
    # the catch's torque jumps by H v_c, the law before it moves by far less
    rise = HM3.catch_torque_constant * events(HM3, stretch).catch_speed
    jumped = np.flatnonzero(np.diff(row) > 0.9 * rise) + 1
    assert jumped.tolist() == [10 if 10 / rate_hz >= events(HM3, stretch).catch else 11]


def test_rows_asked_again_stand_where_they_were() -> None:
    stretches = [minimum_jerk(speed) for speed in (92.0, 64.0, 75.0)]
    rate_hz = 10.0 / events(HM3, stretches[1]).catch
    scenes = [(HM3, stretch) for stretch in stretches]
    found = quintic_courses_for_samples(*columns(scenes), rate_hz)
    assert found.catch.high.tolist() == pytest.approx(
        [events(HM3, stretch).catch for stretch in stretches], rel=1e-14
    )
    assert float(found.catch.high[1]) == events(HM3, stretches[1]).catch
    assert found.catch.low[1] != 0.0
    assert found.catch.low[0] == 0.0


def test_a_late_end_of_the_catch_is_settled_and_a_latest_is_not() -> None:
    # At share 1e-4 from the end a place is told to 1e-16 / (30 · 0.022²) = 7e-15, at
    # 1e-6 to 2e-13.
    stretch = MinimumJerk(start=radians(30), end=radians(140), mean_speed=radians(92))
    catch = events(HM3, stretch).catch_angle
    for share, doubt in ((1e-4, False), (1e-6, True)):
        travel = stretch.end - catch - share * (stretch.end - stretch.start)
        joint = replace(HM3, catch_travel=travel)
        with np.errstate(all="ignore"):
            found = quintic_courses(*columns([(joint, stretch)]), DIGITS_16)
        assert found.is_doubtful.tolist() == [doubt]


@pytest.mark.parametrize("apart", [-5e-12, 5e-12])
def test_an_end_of_the_catch_near_the_end_of_the_stretch_is_asked_again(
    apart: float,
) -> None:
    cut = replace(HM3, range_end=radians(130))
    stretch = minimum_jerk(92.0)
    travel = cut.range_end - events(cut, stretch).catch_angle + apart
    joint = replace(cut, catch_travel=travel)
    with np.errstate(all="ignore"):
        found = quintic_courses(*columns([(joint, stretch)]), DIGITS_16)
    assert found.is_doubtful.all()
    exact = quintic_courses_for_samples(*columns([(joint, stretch)]), 1000.0)
    assert exact.leaves.tolist() == [apart < 0.0]
