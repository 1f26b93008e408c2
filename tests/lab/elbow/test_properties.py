"""What must hold of every motion: phases, resampling, dimensions, continuity."""

from dataclasses import replace
from itertools import pairwise
from math import pi

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from masrel.lab.elbow import (
    ConstantSpeed,
    ElbowParameters,
    Hold,
    Joined,
    MinimumJerk,
    Motion,
    Part,
    Recorded,
    Reversed,
    Trapezoid,
    events,
    impulse,
    interrupted,
    peak_torque,
    torque,
    work,
)
from masrel.lab.recording import PHASES
from tests.lab.elbow.scenes import KINDS, random_scene
from tests.lab.elbow.stretches import joints, motions


@st.composite
def scenes(draw: st.DrawFn) -> tuple[ElbowParameters, Motion]:
    """Draw a scene of any kind, at the speeds of a study."""
    seed, kind = draw(st.integers(0, 10_000)), draw(st.sampled_from(KINDS))
    joint, motion = random_scene(np.random.default_rng(seed), kind, wide=False)
    assume(motion.start < joint.range_end)
    return joint, motion


@given(scene=scenes())
def test_phases_never_go_backwards_within_a_stretch(
    scene: tuple[ElbowParameters, Motion],
) -> None:
    joint, motion = scene
    found = events(joint, motion)
    for one, after in pairwise(found.phases):
        assert (one.end, one.end_angle) == (after.start, after.start_angle)
        forward = PHASES.index(after.name) == PHASES.index(one.name) + 1
        # back to pre-catch only when slow or flexed; from a catch straight to
        # pre-catch when flexed, or when its post-catch is of no length
        assert forward or after.name == "pre-catch"
    assert found.phases[0].start == 0.0
    assert found.phases[-1].end == found.end


@given(scene=scenes())
def test_events_of_a_stretch_are_in_order_and_stretches_do_not_overlap(
    scene: tuple[ElbowParameters, Motion],
) -> None:
    joint, motion = scene
    found = events(joint, motion)
    marks = [0.0]
    for stretch in found.stretches:
        order = (
            stretch.onset,
            stretch.catch,
            stretch.catch_end,
            stretch.post_catch_end,
        )
        marks += [mark for mark in order if mark is not None]
        if stretch.catch is not None:
            assert stretch.catch < stretch.peak_end <= found.end
    marks.append(found.end)
    assert marks == sorted(marks)


@given(scene=scenes())
def test_a_second_catch_needs_the_arm_flexed_in_between(
    scene: tuple[ElbowParameters, Motion],
) -> None:
    joint, motion = scene
    caught = [s for s in events(joint, motion).stretches if s.catch is not None]
    for one, after in pairwise(caught):
        speeds = motion.velocity(np.linspace(one.catch, after.catch, 2001))
        assert speeds.min() <= -joint.speed_threshold * (1 - 1e-3)


# Samples added on the lines between samples change nothing, wherever they are.
@given(seed=st.integers(0, 10_000), more=st.lists(st.floats(0.01, 0.99), max_size=8))
def test_refining_a_recording_changes_no_event(seed: int, more: list[float]) -> None:
    joint, motion = random_scene(
        np.random.default_rng(seed), "recorded, linear", wide=False
    )
    assume(motion.start < joint.range_end)
    assert isinstance(motion, Recorded)
    times = np.unique([*motion._knots, *(share * motion.duration for share in more)])
    finer = Recorded(time=times, angle=motion.angle(times), interpolation="linear")
    one, other = events(joint, motion), events(joint, finer)
    assert len(one.stretches) == len(other.stretches)
    for a, b in zip(one.stretches, other.stretches, strict=True):
        for name in ("onset", "catch", "catch_end", "post_catch_end"):
            # a new sample is rounded by 2e-16 rad, at a speed of 3 deg/s or more
            x, y = getattr(a, name), getattr(b, name)
            assert (x is None) == (y is None), name
            assert x is None or x == pytest.approx(y, abs=1e-11), name


def slower(motion: Motion, factor: float) -> Motion:
    """The same way in `factor` times the time; a power of 2 rounds nothing."""
    if isinstance(motion, ConstantSpeed):
        return replace(motion, speed=motion.speed / factor)
    if isinstance(motion, MinimumJerk):
        return replace(motion, mean_speed=motion.mean_speed / factor)
    if isinstance(motion, Trapezoid):
        rate = motion.acceleration_rate / factor**2
        return replace(motion, speed=motion.speed / factor, acceleration_rate=rate)
    if isinstance(motion, Hold):
        return replace(motion, duration=motion.duration * factor)
    if isinstance(motion, Part):
        return Part(
            motion=slower(motion.motion, factor),
            begin=motion.begin * factor,
            finish=motion.finish * factor,
        )
    if isinstance(motion, Reversed):
        return Reversed(motion=slower(motion.motion, factor))
    if isinstance(motion, Recorded):
        return Recorded(
            time=motion._knots * factor,
            angle=motion._angles,
            interpolation=motion.interpolation,
        )
    assert isinstance(motion, Joined)
    return Joined([slower(one, factor) for one in motion.motions])


# Time is counted in other units: b and H, α and ΔT_peak, the speeds ν and m follow, and
# angles, torques and work are what they were, times and impulse `factor` times that.
@given(scene=scenes(), power=st.integers(-12, 12))
def test_scaling_time_behaves_as_dimensions_say(
    scene: tuple[ElbowParameters, Motion], power: int
) -> None:
    joint, motion = scene
    factor = 2.0**power
    scaled = replace(
        joint,
        damping=joint.damping * factor,
        catch_torque_constant=joint.catch_torque_constant * factor,
        inertia=joint.inertia * factor**2,
        catch_slope=joint.catch_slope * factor,
        peak_duration=joint.peak_duration * factor,
        catch_rise=joint.catch_rise * factor,
        speed_threshold=joint.speed_threshold / factor,
        slowest_mean_speed=joint.slowest_mean_speed / factor,
    )
    other = slower(motion, factor)
    one, two = events(joint, motion), events(scaled, other)
    assert [s.name for s in one.phases] == [s.name for s in two.phases]
    for a, b in zip(one.stretches, two.stretches, strict=True):
        for name in ("onset", "catch", "peak_end", "catch_end", "post_catch_end"):
            x, y = getattr(a, name), getattr(b, name)
            assert (x is None) == (y is None), name
            assert x is None or y == pytest.approx(factor * x, rel=1e-15), name
    assert two.catch_angle == one.catch_angle
    same = pytest.approx(peak_torque(joint, motion), rel=1e-14)
    assert peak_torque(scaled, other) == same
    assert work(scaled, other) == pytest.approx(work(joint, motion), rel=1e-13)
    longer = pytest.approx(factor * impulse(joint, motion), rel=1e-13)
    assert impulse(scaled, other) == longer


@given(joint=joints(inertia=False), motion=motions(), share=st.floats(0.05, 0.95))
def test_torque_is_continuous_but_for_the_documented_steps(
    joint: ElbowParameters, motion: Motion, share: float
) -> None:
    # Up at the catch, down at the end of the peak, and where post-catch ends below
    # ν_th; with the additive reading also where it begins.
    stop = share * motion.duration
    motion = interrupted(motion, at=stop, pause=0.2)
    found = events(joint, motion)
    steps = [stop, stop + 0.2]  # the speed jumps there, and with it b·θ̇
    for s in found.stretches:
        steps += [s.catch, s.peak_end, s.catch_end, s.post_catch_end]
    marks = np.array([mark for mark in steps if mark is not None])
    times = np.linspace(0.0, found.end, 1001)
    values = torque(joint, motion, times)
    width = times[1] - times[0]
    near = (np.abs(times[:-1, None] - marks) <= 1.01 * width).any(axis=1)
    near |= (np.abs(times[1:, None] - marks) <= 1.01 * width).any(axis=1)
    law = joint.stiffness + joint.post_catch_stiffness
    speed = np.abs(motion.velocity(times)).max()
    rate = np.abs(motion.acceleration(times)).max()
    steepest = law * speed + joint.damping * rate
    jumps = np.abs(np.diff(values))[~near]
    assert (jumps <= 1.5 * steepest * width + 1e-9).all()


def test_the_scenes_are_not_all_alike() -> None:
    # The properties above are seen at work: stretches without, with one, and with
    # several catches, with inertia, with both readings.
    drawn = [
        random_scene(np.random.default_rng(seed), kind, wide=False)
        for seed in range(12)
        for kind in KINDS
    ]
    able = [(j, m) for j, m in drawn if m.start < j.range_end]
    n_catches = {
        sum(s.catch is not None for s in events(j, m).stretches) for j, m in able
    }
    assert {0, 1, 2} <= n_catches
    assert {j.post_catch for j, _ in able} == {"additive", "continuous"}
    assert max(m.start for _, m in able) < pi
