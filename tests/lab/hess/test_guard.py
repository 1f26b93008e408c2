"""The guard of models that are not passive: energy, torque, lost grip, and the ramp."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import radians
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from masrel.lab.elbow import (
    MODELS,
    STANDARD_MODELS,
    ElbowParameters,
    Hold,
    Joined,
    MinimumJerk,
    Reversed,
)
from masrel.lab.hess import (
    Controller,
    DeviceLimits,
    Friction,
    MotionHand,
    Presented,
    SimulatedClock,
    StretchRules,
    open_device,
    run_presentation,
)
from masrel.lab.hess import render as rendered

from .rig import LIMITS, START, ScriptedDevice, present

OUT = MinimumJerk(start=START, end=radians(130.0), mean_speed=radians(80.0))
SPEED = radians(90.0)

FULL = Joined(
    [
        OUT,
        Hold(start=OUT.end, duration=1.0),
        Reversed(motion=MinimumJerk(start=START, end=OUT.end, mean_speed=SPEED)),
    ]
)

Law = Callable[[float, float, float], float]


@dataclass
class Joint:
    """Any law of time, angle and speed, as a model and its own stepper."""

    law: Law
    is_passive: bool = False
    releases: list[float] = field(default_factory=list)
    phase: int = 0

    kind: ClassVar[str] = "test"
    range_end: ClassVar[float] = radians(146.0)
    speed_threshold: ClassVar[float] = radians(20.0)

    def stepper(self, start_angle: float) -> "Joint":
        self.start = start_angle
        return self

    def step(self, time_s: float, angle: float, velocity: float) -> float:
        return self.law(time_s, angle, velocity)

    def release(self) -> None:
        self.releases.append(1.0)

    def largest_torque(self, **_stretch: float) -> float:
        return 1.0

    def largest_slope(self, **_stretch: float) -> tuple[float, float]:
        return 0.0, 0.0


def helping(_time_s: float, _angle: float, velocity: float) -> float:
    return -0.8 * velocity  # drives whatever moves


def at_constant_speed(
    joint: Joint, *, limits: DeviceLimits = LIMITS, duration_s: float = 1.1
) -> tuple[ScriptedDevice, Presented]:
    clock = SimulatedClock()
    device = ScriptedDevice(clock, lambda time_s: START + SPEED * time_s)
    controller = Controller(joint, start_angle=START, compensation=0.0)
    device.open()
    presented = run_presentation(
        device, controller, clock=clock, limits=limits, max_duration_s=duration_s
    )
    device.close()
    return device, presented


def there_and_back(joint: Joint) -> Presented:
    # 100 deg of extension in a second, and back in another
    clock = SimulatedClock()
    device = ScriptedDevice(
        clock, lambda t: START + radians(50.0) * (1.0 - math.cos(math.pi * t))
    )
    with device:
        return run_presentation(
            device,
            Controller(joint, start_angle=START),
            clock=clock,
            limits=LIMITS,
            max_duration_s=2.0,
            end_angle=4.0,
        )


def assert_ramps_to_zero(device: ScriptedDevice, presented: Presented) -> None:
    # in a straight line within 50 ms from what was sent last; then it is let go
    fault = presented.fault
    assert fault is not None
    after = [(t * 1e-9, x) for t, x in device.commands if t * 1e-9 > fault.time_s]
    times, torques = np.array(after[:50]).T
    line = fault.torque_nm * (1.0 - (times - fault.time_s) / 0.05)
    np.testing.assert_allclose(torques, line, atol=1e-9)
    assert times[-1] <= fault.time_s + 0.05 + 1e-9
    assert torques[-1] == pytest.approx(0.0, abs=1e-9)
    assert {torque for _, torque in after[50:]} <= {0.0}
    assert not device.is_open


# Energy


def test_energy_beyond_the_tank_is_a_fault_with_the_ramp() -> None:
    # By hand: at a speed v the model gives 0.8 v² = 1.974 W, so 1 J takes 0.507 s;
    # the filtered speed comes 5.6 ms late.
    device, presented = at_constant_speed(Joint(helping))
    fault = presented.fault
    assert fault is not None
    assert fault.kind == "energy"
    assert fault.message.startswith(
        "energy: needs a model that has given the arm at most 1 J more than it took, "
        "got 1.00"
    )
    assert fault.time_s == pytest.approx(1.0 / (0.8 * SPEED**2) + 1 / 180, abs=0.002)
    assert fault.torque_nm == pytest.approx(-0.8 * SPEED, rel=1e-3)
    assert_ramps_to_zero(device, presented)


def test_the_balance_counts_so_that_a_spring_may_give_back_what_it_took() -> None:
    # 3 N·m/rad over 100 deg hold 4.6 J, four times the tank; led back without a fault.
    spring = Joint(lambda _t, angle, _v: 3.0 * (angle - START))
    presented = there_and_back(spring)
    assert presented.fault is None
    # ... and one that gives back half as much again is one
    joint = Joint(lambda t, angle, _v: (3.0 if t < 1.0 else 4.5) * (angle - START))
    presented = there_and_back(joint)
    assert presented.fault is not None
    assert presented.fault.kind == "energy"
    assert presented.fault.time_s > 1.0


def test_what_a_model_took_in_one_stretch_it_may_not_give_in_the_next() -> None:
    # Three stretches by 100 deg in a second each. By hand: the damper takes
    # 0.8 ∫v² dt = 0.8·(100 deg·π/2)²/2 = 3.0 J every second until 4 s, and then gives
    # it: 1 J when ∫v² has come to a third of that, 0.414 s later.
    joint = Joint(lambda t, _a, velocity: math.copysign(0.8, 4.0 - t) * velocity)
    clock = SimulatedClock()
    device = ScriptedDevice(
        clock, lambda t: START + radians(50.0) * (1.0 - math.cos(math.pi * t))
    )
    with device:
        presented = run_presentation(
            device,
            Controller(joint, start_angle=START),
            clock=clock,
            limits=LIMITS,
            end_angle=4.0,
            stretches=StretchRules(n=3),
        )
    assert presented.fault is not None
    assert presented.fault.kind == "energy"
    assert presented.fault.time_s == pytest.approx(4.414 + 1.0 / 180.0, abs=0.005)


def test_a_larger_tank_lets_more_pass() -> None:
    limits = replace(LIMITS, active_energy=3.0)
    _, presented = at_constant_speed(Joint(helping), limits=limits)
    assert presented.fault is None


# Torque


def test_a_torque_beyond_that_of_active_models_is_not_sent_nor_cut_off() -> None:
    device, presented = at_constant_speed(Joint(lambda t, _a, _v: 1.5 + 20.0 * t))
    fault = presented.fault
    assert fault is not None
    assert fault.kind == "active-torque"
    assert fault.message == (
        "active torque: needs at most 10 N·m of a model that is not passive, got "
        "10.020 N·m"
    )
    assert max(torque for _, torque in device.commands) == pytest.approx(10.0)
    assert_ramps_to_zero(device, presented)


def test_no_number_is_not_sent() -> None:
    device, presented = at_constant_speed(
        Joint(lambda t, _a, _v: 1.0 if t < 0.1 else math.nan)
    )
    assert presented.fault is not None
    assert presented.fault.kind == "model"
    assert all(math.isfinite(torque) for _, torque in device.commands)


@pytest.mark.parametrize("is_passive", [False, True])
@pytest.mark.parametrize("value", [None, "1", [1.0], math.nan, math.inf, -math.inf, 1j])
def test_a_model_that_gives_no_number_is_a_fault_with_the_ramp(
    value: object, is_passive: bool
) -> None:
    def law(time_s: float, _angle: float, _velocity: float) -> float:
        return 1.5 if time_s < 0.1 else value  # type: ignore[return-value]

    device, presented = at_constant_speed(Joint(law, is_passive=is_passive))
    assert presented.fault is not None
    assert presented.fault.kind == "model"
    assert presented.fault.message == (
        f"model: needs a torque that is a finite number, got {value!r}"
    )
    assert presented.fault.torque_nm == 1.5
    assert_ramps_to_zero(device, presented)
    assert presented.recording.columns["model_torque_nm"].tolist() == (
        [1.5] * presented.recording.n_samples
    )


# Slip


def test_a_lost_grip_is_a_fault_with_the_ramp_in_every_phase() -> None:
    joint = Joint(lambda t, _a, _v: min(1.0 + 20.0 * t, 6.0))
    rendering = rendered(joint, OUT, hand=MotionHand(OUT, slip_time=0.6))
    fault, columns = rendering.presented.fault, rendering.presented.recording.columns
    assert fault is not None
    assert fault.kind == "slip"
    assert fault.message.startswith(
        "slip: needs an arm whose speed changes by at most 0.78 of a loose arm's 31 "
        "deg/s in 6 ms, got 2"
    )
    assert 0.6 < fault.time_s < 0.62
    assert joint.releases == [1.0]
    assert rendering.presented.recording.facts["grip_lost"] is True
    after = columns["time_s"] > fault.time_s + 1e-9
    line = fault.torque_nm * (1.0 - (columns["time_s"][after] - fault.time_s) / 0.05)
    np.testing.assert_allclose(columns["command_torque_nm"][after], line, atol=1e-6)


def test_an_arm_that_slows_down_at_once_is_a_lost_grip() -> None:
    # by far more than 1 N·m takes off a loose arm in that time
    clock = SimulatedClock()
    device = ScriptedDevice(
        clock, lambda t: START + SPEED * min(t, 0.5) + SPEED / 3.0 * max(t - 0.5, 0.0)
    )
    controller = Controller(Joint(lambda _t, _a, _v: 1.0), start_angle=START)
    device.open()
    presented = run_presentation(
        device, controller, clock=clock, limits=LIMITS, max_duration_s=1.0
    )
    assert presented.fault is not None
    assert presented.fault.kind == "slip"
    assert 0.5 < presented.fault.time_s < 0.52
    assert_ramps_to_zero(device, presented)


def test_an_arm_that_is_thrown_the_way_it_is_pushed_is_a_lost_grip() -> None:
    # Too weak for a sudden fall of speed: 1.5 N·m on 0.06 kg·m² gain 14 deg/s in 10 ms.
    weak = Joint(lambda _t, _a, _v: 1.5)
    presented = rendered(weak, OUT, hand=MotionHand(OUT, slip_time=0.6)).presented
    assert presented.fault is not None
    assert presented.fault.kind == "slip"
    assert presented.fault.message.startswith(
        "slip: needs an arm that moves at most 180 deg/s the way a model pushes it "
        "that is not passive, got -18"
    )
    # By hand, without friction: from 149 deg/s to -180 at 1.5/0.0597 = 25.1 rad/s²
    # takes 0.229 s, and the speed comes 5.6 ms late.
    assert presented.fault.time_s == pytest.approx(0.6 + 0.229 + 0.0056, abs=0.01)


def test_moving_the_arm_back_is_no_lost_grip() -> None:
    joint = Joint(lambda _t, angle, velocity: 2.0 * (angle - START) + 0.2 * velocity)
    joint.phase = 1
    presented = there_and_back(joint)
    assert presented.fault is None
    assert presented.recording.facts["grip_lost"] is False


# Whatever a model does


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.floats(-12.0, 12.0), min_size=1, max_size=12),
    st.floats(0.0, 3.0),
    st.floats(0.05, 2.0),
)
def test_no_model_gives_more_than_the_tank_nor_more_torque_than_the_limit(
    levels: list[float], gain: float, tank: float
) -> None:
    # torque that goes to one level after another, and helps every motion beside
    def law(time_s: float, _angle: float, velocity: float) -> float:
        level = levels[int(time_s * 20.0) % len(levels)]
        return level * min(1.0, 5.0 * time_s) - gain * velocity

    limits = DeviceLimits(active_energy=tank)
    presented = rendered(Joint(law), FULL, limits=limits).presented
    columns, fault = presented.recording.columns, presented.fault
    end_s = math.inf if fault is None else fault.time_s - 1e-9
    sent = columns["time_s"] < end_s
    torques = columns["model_torque_nm"][sent]
    angles = np.radians(columns["angle_deg"][sent])
    given_up_to = -np.cumsum(torques[:-1] * np.diff(angles))
    assert float(given_up_to.max(initial=0.0)) <= tank + 1e-12
    assert float(np.abs(torques).max(initial=0.0)) <= limits.active_torque
    if fault is not None:  # what is left of it goes to zero within 50 ms
        after = np.abs(columns["command_torque_nm"][~sent])
        assert np.all(np.diff(after) <= 1e-9)
        assert after.size == 0 or after[-1] == 0.0


# Who is guarded


def test_a_passive_model_is_not_guarded() -> None:
    joint = Joint(helping, is_passive=True)
    assert not Controller(joint, start_angle=START).is_guarded
    _, presented = at_constant_speed(joint)
    assert presented.fault is None


@pytest.mark.parametrize("name", sorted(STANDARD_MODELS))
def test_the_papers_own_law_keeps_the_papers_own_release(name: str) -> None:
    assert not Controller(STANDARD_MODELS[name], start_angle=START).is_guarded
    limits = replace(LIMITS, active_torque=0.1, active_energy=1e-6)
    presented = present(name, 92.0, limits=limits, slip_time=0.9)
    assert presented.fault is None
    assert presented.recording.facts["grip_lost"] is True


# Every registered model, rendered; and of those that are not passive guard and ramp

GUARDED = {
    kind: model()
    for kind, model in MODELS.items()
    if kind != ElbowParameters.kind and not model().is_passive
}


@pytest.mark.parametrize("kind", ["lead-pipe-rigidity", "contracture"])
def test_a_passive_model_is_rendered_there_and_back_without_a_guard(kind: str) -> None:
    joint = MODELS[kind]()
    end = min(OUT.end, joint.range_end)
    out = MinimumJerk(start=START, end=end, mean_speed=SPEED)
    motion = Joined([out, Hold(start=end, duration=1.0), Reversed(motion=out)])
    # guarded it would have no fault either
    limits = DeviceLimits(active_energy=1e-9, active_torque=1e-9)
    rendering = rendered(joint, motion, limits=limits)
    assert rendering.presented.fault is None
    assert rendering.max_angle_error < radians(1.2)  # 12 N·m on 600 N·m/rad
    assert rendering.energy_taken > 1.0
    assert rendering.energy_given < 0.01  # a spring that was not at rest
    assert rendering.damping_needed < Friction().viscous


def assert_rendered_a_ramp(presented: Presented, kind: str) -> None:
    fault, columns = presented.fault, presented.recording.columns
    assert fault is not None
    assert fault.kind == kind
    since = columns["time_s"] - fault.time_s
    ramp = since > -1e-9
    line = np.maximum(fault.torque_nm * (1.0 - since[ramp] / 0.05), -math.inf)
    np.testing.assert_allclose(columns["command_torque_nm"][ramp], line, atol=1e-6)
    assert since[-1] == pytest.approx(0.05, abs=1e-6) or fault.torque_nm == 0.0
    assert columns["command_torque_nm"][-1] == pytest.approx(0.0, abs=1e-9)


def test_the_guarded_models_are_those_with_a_delay_a_trigger_or_a_change_in_time() -> (
    None
):
    assert sorted(GUARDED) == [
        "clasp-knife",
        "clonus",
        "cogwheel-rigidity",
        "dystonia",
        "threshold-stretch-reflex",
    ]


@pytest.mark.parametrize("kind", GUARDED)
def test_with_the_default_limits_it_is_rendered_there_and_back(kind: str) -> None:
    rendering = rendered(GUARDED[kind], FULL)
    assert rendering.presented.fault is None
    assert rendering.presented.recording.facts["grip_lost"] is False
    assert rendering.max_angle_error < radians(0.5)
    assert rendering.rms_torque_error < 0.25
    assert rendering.energy_given < 0.02  # of the 1 J that it might
    assert rendering.damping_needed < Friction().viscous


@pytest.mark.parametrize("kind", GUARDED)
def test_a_tank_too_small_is_a_fault_with_the_ramp(kind: str) -> None:
    # Begun in the middle and flexed, each of them pushes the arm the way it goes.
    flexed = Reversed(
        motion=MinimumJerk(start=START, end=radians(85.0), mean_speed=radians(30.0))
    )
    limits = DeviceLimits(active_energy=0.002)
    presented = rendered(GUARDED[kind], flexed, limits=limits).presented
    assert_rendered_a_ramp(presented, "energy")
    columns, fault = presented.recording.columns, presented.fault
    sent = columns["time_s"] < fault.time_s - 1e-9
    torques = columns["model_torque_nm"][sent]
    angles = np.radians(columns["angle_deg"][sent])
    given = -float((torques[:-1] * np.diff(angles)).sum())
    assert 0.001 < given <= 0.002  # what was given until the tick before the fault


@pytest.mark.parametrize("kind", GUARDED)
def test_a_torque_above_that_of_active_models_is_a_fault_with_the_ramp(
    kind: str,
) -> None:
    peak = rendered(GUARDED[kind], FULL).peak_torque
    limits = DeviceLimits(active_torque=0.8 * peak)
    presented = rendered(GUARDED[kind], FULL, limits=limits).presented
    assert_rendered_a_ramp(presented, "active-torque")
    asked = presented.recording.columns["model_torque_nm"]
    fault_s = presented.fault.time_s
    sent = presented.recording.columns["time_s"] < fault_s - 1e-9
    assert float(np.abs(asked[sent]).max()) <= 0.8 * peak


@pytest.mark.parametrize("kind", GUARDED)
def test_an_arm_that_slips_where_it_resists_most_is_a_fault_with_the_ramp(
    kind: str,
) -> None:
    clean = rendered(GUARDED[kind], FULL).presented.recording.columns
    top = int(np.argmax(clean["model_torque_nm"]))
    slip = float(clean["time_s"][top]) - 0.002
    clock = SimulatedClock()
    controller = Controller(
        GUARDED[kind], start_angle=START, slip_speed_drop=radians(20.0)
    )
    hand = MotionHand(FULL, slip_time=slip)
    with open_device("simulated", clock=clock, hand=hand) as device:
        presented = run_presentation(
            device,
            controller,
            clock=clock,
            limits=LIMITS,
            max_duration_s=FULL.duration,
            end_angle=4.0,
        )
    assert_rendered_a_ramp(presented, "slip")
    assert slip < presented.fault.time_s < slip + 0.03


@pytest.mark.parametrize("slip_s", [0.2, 0.5, 0.8, 1.1, 1.5, 2.0, 2.5])
@pytest.mark.parametrize("kind", GUARDED)
def test_an_arm_that_is_let_go_anywhere_stays_slow_or_is_stopped(
    kind: str, slip_s: float
) -> None:
    hand = MotionHand(FULL, slip_time=slip_s)
    presented = rendered(GUARDED[kind], FULL, hand=hand).presented
    assert presented.fault is None or presented.fault.kind == "slip"
    speeds = presented.recording.columns["velocity_deg_s"]
    assert float(np.abs(speeds).max()) < 183.0
    if kind == "clonus":  # whose constant torque goes on pulling
        assert presented.fault is not None
