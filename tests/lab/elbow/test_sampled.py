"""The sampled law: against the exact one, sample by sample by hand, and released."""

from math import floor, radians

import numpy as np
import pytest

from masrel.lab.elbow import (
    STANDARD_MODELS,
    ElbowParameters,
    Motion,
    SampledJoint,
    events,
)
from masrel.lab.elbow._law import CATCH, POST_CATCH, PRE_CATCH
from tests.lab.elbow.stretches import constant, minimum_jerk

HM3 = STANDARD_MODELS["HM3"]

Sample = tuple[float, float, float]


def samples(joint: ElbowParameters, motion: Motion, rate_hz: float) -> list[Sample]:
    end = events(joint, motion).end
    times = np.arange(floor(end * rate_hz) + 1) / rate_hz
    columns = (times, motion.angle(times), motion.velocity(times))
    return list(zip(*(column.tolist() for column in columns), strict=True))


def stepped(
    parameters: ElbowParameters, motion: Motion, rate_hz: float
) -> tuple[SampledJoint, list[int], list[float]]:
    joint = SampledJoint(parameters, start_angle=motion.start)
    phases, torques = [], []
    for sample in samples(parameters, motion, rate_hz):
        torques.append(joint.step(*sample))
        phases.append(joint.phase)
    return joint, phases, torques


def first(phases: list[int], code: int) -> int | None:
    return phases.index(code) if code in phases else None


def move(joint: SampledJoint, angle_deg: float, speed_deg_s: float, time: float) -> int:
    joint.step(time, radians(angle_deg), radians(speed_deg_s))
    return joint.phase


# Against the exact law


# A sample sees an event up to one period late; the end of the catch is measured from
# a catch seen late, so up to two. Movement onset is seen late as well, which makes the
# mean speed of minimum jerk larger and its catch earlier by less than one period.
@pytest.mark.parametrize("rate_hz", [250.0, 1000.0, 4000.0, 16000.0])
@pytest.mark.parametrize("model", STANDARD_MODELS)
@pytest.mark.parametrize("motion", [constant(97.3), minimum_jerk(97.3)])
def test_sampled_events_approach_the_exact_ones(
    rate_hz: float, model: str, motion: Motion
) -> None:
    joint = STANDARD_MODELS[model]
    found = events(joint, motion)
    sampled, phases, _ = stepped(joint, motion, rate_hz)
    assert -1 < sampled.catch_time * rate_hz - found.catch * rate_hz <= 1 + 1e-9
    if found.catch_end is None:
        assert POST_CATCH not in phases
    else:
        late = first(phases, POST_CATCH) - found.catch_end * rate_hz
        assert -1 < late <= 3
    # angles follow at the speed of the motion, at most 1.875 times the mean
    slack = 1.875 * radians(97.3) / rate_hz
    assert sampled.catch_angle == pytest.approx(found.catch_angle, abs=slack)
    # v̄ moves with the onset seen late: by at most (v̄ - ν_th)·period/(t_c - onset)
    share = 1.0 / rate_hz / (found.catch - found.onset)
    assert sampled.mean_speed == pytest.approx(found.mean_speed, rel=2 * share)


# By hand: HM3, stretched from 30 deg at 100 deg/s, seen at nine times only.
#   0.00 s  30 deg  onset, and θ_rest
#   0.45 s  75 deg  v̄ = 45/0.45 = 100; θ_catch = 115 - 35 = 80 deg, not exceeded
#   0.60 s  90 deg  exceeded: the catch, seen late
#   0.65 s  95 deg  0.05 s since the catch: the peak
#   0.75 s 105 deg  0.15 s since the catch: the residual level
#   0.89 s 119 deg  29 deg travelled since 90, not more than D = 30
#   1.00 s 130 deg  40 deg travelled: post-catch, from here
#   1.10 s 140 deg  10 deg further
# Torque in N·m·deg/rad: pre-catch 1.26 · 100 + 3.15 · (θ - 30); at 90 deg 126 + 189 =
# 315; H·v_c = 280: peak 595; residual 315 + 168 = 483; then 483 + 5.8 · 10 = 541.
def test_the_coarse_stretch_by_hand() -> None:
    joint = SampledJoint(HM3, start_angle=radians(30.0))
    rows = [
        (0.0, 30.0, PRE_CATCH, 126.0),
        (0.25, 55.0, PRE_CATCH, 126.0 + 3.15 * 25),
        (0.45, 75.0, PRE_CATCH, 126.0 + 3.15 * 45),
        (0.6, 90.0, CATCH, 595.0),
        (0.65, 95.0, CATCH, 595.0),
        (0.75, 105.0, CATCH, 483.0),
        (0.89, 119.0, CATCH, 483.0),
        (1.0, 130.0, POST_CATCH, 483.0),
        (1.1, 140.0, POST_CATCH, 541.0),
    ]
    for time, angle_deg, phase, level in rows:
        value = joint.step(time, radians(angle_deg), radians(100.0))
        assert joint.phase == phase
        assert value == pytest.approx(radians(level), rel=1e-13)
    assert joint.catch_time == 0.6
    assert joint.catch_angle == radians(90.0)
    assert joint.mean_speed == pytest.approx(radians(100.0), rel=1e-15)


# Slow, flexed, released


@pytest.mark.parametrize("until", [0.6, 1.05])  # in the catch, in post-catch
def test_release_returns_to_pre_catch_and_the_stretch_does_not_catch_again(
    until: float,
) -> None:
    joint = SampledJoint(HM3, start_angle=radians(30.0))
    time = 0.0
    while time < until:
        move(joint, 30.0 + 100.0 * time, 100.0, time)
        time += 0.01
    assert joint.phase in (CATCH, POST_CATCH)
    joint.release()
    assert joint.phase == PRE_CATCH
    angle, velocity = radians(30.0 + 100.0 * time), radians(100.0)
    value = joint.step(time, angle, velocity)
    assert value == 1.26 * velocity + 3.15 * (angle - radians(30.0))
    for i in range(1, 20):
        assert move(joint, 30.0 + 100.0 * time + i, 100.0, time + 0.01 * i) == PRE_CATCH


def test_flexing_ends_the_stretch_and_arms_the_next() -> None:
    joint = SampledJoint(HM3, start_angle=radians(30.0))

    def stretch(start: float) -> list[int]:
        return [move(joint, 30.0 + i, 100.0, start + 0.01 * i) for i in range(1, 110)]

    once = stretch(0.0)
    assert first(once, CATCH) is not None
    assert once[-1] == POST_CATCH
    assert move(joint, 139.0, 0.0, 1.2) == PRE_CATCH  # it stopped
    # moved on without having been flexed: not another catch
    assert {move(joint, 139.0 + i, 100.0, 1.3 + 0.01 * i) for i in range(5)} == {
        PRE_CATCH
    }
    assert move(joint, 100.0, -60.0, 2.0) == PRE_CATCH
    assert stretch(3.0) == once


def test_flexing_in_the_catch_ends_it() -> None:
    joint = SampledJoint(HM3, start_angle=radians(30.0))
    for i in range(56):
        move(joint, 30.0 + i, 100.0, 0.01 * i)
    assert joint.phase == CATCH
    assert move(joint, 84.0, -20.0, 0.6) == PRE_CATCH
