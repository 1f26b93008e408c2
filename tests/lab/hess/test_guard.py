"""The guard of models that are not passive: energy, torque, lost grip, and the ramp."""

import math
from math import radians

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
    JointModel,
    MinimumJerk,
    Reversed,
)
from masrel.lab.hess import (
    DeviceLimits,
    Friction,
    MotionHand,
    Presented,
    SimulatedClock,
    StretchRules,
    open_device,
    render,
    run_presentation,
)

from .faults import FaultyDevice
from .rig import (
    START,
    Joint,
    assert_straight_ramp,
    controls,
    present,
    scripted,
    stretching,
)

OUT = MinimumJerk(start=START, end=radians(130.0), mean_speed=radians(80.0))
SPEED = radians(90.0)
BACK = Reversed(motion=MinimumJerk(start=START, end=OUT.end, mean_speed=SPEED))
FULL = Joined([OUT, Hold(start=OUT.end, duration=1.0), BACK])


def to_and_fro(time_s: float) -> float:
    """100 deg of extension in a second, and back in another."""
    return START + radians(50.0) * (1.0 - math.cos(math.pi * time_s))


def even(time_s: float) -> float:
    return START + SPEED * time_s


def slowing(time_s: float) -> float:
    return even(min(time_s, 0.5)) + SPEED / 3.0 * max(time_s - 0.5, 0.0)


def helping(_time_s: float, _angle: float, velocity: float) -> float:
    return -0.8 * velocity  # drives whatever moves


def spring(time_s: float, angle: float, _velocity: float, late: float = 4.5) -> float:
    # 3 N·m/rad over 100 deg hold 4.6 J, four times the tank
    return (3.0 if time_s < 1.0 else late) * (angle - START)


def damper(time_s: float, _angle: float, velocity: float) -> float:
    return math.copysign(0.8, 4.0 - time_s) * velocity


def shown(angle, joint: Joint, **options) -> Presented:
    options = {"max_duration_s": 1.1, "end_angle": 4.0, **options}
    _, presented = scripted(angle, controls(joint, compensation=0.0), **options)
    torques = presented.recording.columns["command_torque_nm"]
    assert np.isfinite(torques).all()
    return presented


THRICE = {"stretches": StretchRules(n=3), "max_duration_s": None}

# By hand: at a speed v `helping` gives 0.8 v² = 1.974 W, so 1 J takes 0.507 s; the
# filtered speed comes 5.6 ms late. The damper takes 0.8 ∫v² dt = 0.8·(100 deg·π/2)²/2 =
# 3.0 J every second until 4 s, and then gives it: 1 J when ∫v² has come to a third of
# that, 0.414 s later. Of an arm that slows down, by far more than 1 N·m takes off a
# loose one in that time.
STOPPED = {
    "energy": (
        *(even, helping, {}, "energy", 1.0 / (0.8 * SPEED**2) + 1 / 180, -0.8 * SPEED),
        "energy: needs a model that gives the arm at most 1 J more than it takes, "
        "got 1.00",
    ),
    "more than it took": (
        *(to_and_fro, spring, {"max_duration_s": 2.0}, "energy", 1.542, None),
        "energy: ",
    ),
    "what it took in another stretch": (
        *(to_and_fro, damper, THRICE, "energy", 4.414 + 1 / 180, None),
        "energy: ",
    ),
    "torque": (
        *(even, lambda t, _a, _v: 1.5 + 20.0 * t, {}, "active-torque", 0.426, 10.0),
        "active torque: needs at most 10 N·m from a model that is not passive, got "
        "10.020 N·m",
    ),
    "no number": (
        *(even, lambda t, _a, _v: 1.0 if t < 0.1 else math.nan, {}, "model", 0.1, 1.0),
        "model: needs a torque that is a finite number, got nan",
    ),
    "an arm that slows down at once": (
        *(slowing, lambda _t, _a, _v: 1.0, {}, "slip", 0.51, 1.0),
        "slip: needs an arm whose speed falls by at most 40 deg/s in 10 ms",
    ),
}


@pytest.mark.parametrize("row", STOPPED)
def test_what_a_model_may_not_do_is_a_fault_with_the_ramp(row: str) -> None:
    angle, law, options, kind, time_s, torque_nm, words = STOPPED[row]
    presented = shown(angle, Joint(law), **options)
    assert_straight_ramp(presented, kind)
    fault = presented.fault
    assert fault.message.startswith(words)
    assert fault.time_s == pytest.approx(time_s, abs=0.01)
    if torque_nm is not None:
        assert fault.torque_nm == pytest.approx(torque_nm, rel=1e-3)
        torques = presented.recording.columns["command_torque_nm"]
        assert np.abs(torques).max() == pytest.approx(abs(torque_nm), rel=1e-3)


PASSED = {
    "a spring gives back what it took": (
        to_and_fro,
        Joint(lambda *now: spring(*now, late=3.0)),
        {"max_duration_s": 2.0},
    ),
    "a larger tank": (
        even,
        Joint(helping),
        {"limits": DeviceLimits(active_energy=3.0)},
    ),
    "moving the arm back": (
        to_and_fro,
        Joint(lambda _t, angle, v: 2.0 * (angle - START) + 0.2 * v, phase=1),
        {"max_duration_s": 2.0},
    ),
    "a passive model is not guarded": (even, Joint(helping, is_passive=True), {}),
}


@pytest.mark.parametrize("row", PASSED)
def test_what_a_model_may_do_is_no_fault(row: str) -> None:
    angle, joint, options = PASSED[row]
    presented = shown(angle, joint, **options)
    assert presented.fault is None
    assert presented.recording.facts["grip_lost"] is False
    assert controls(joint).is_guarded is not joint.is_passive


@pytest.mark.parametrize("is_passive", [False, True])
@pytest.mark.parametrize("value", [None, "1", [1.0], math.nan, math.inf, -math.inf, 1j])
def test_a_model_that_gives_no_number_is_a_fault_with_the_ramp(
    value: object, is_passive: bool
) -> None:
    joint = Joint(lambda t, _a, _v: 1.5 if t < 0.2 else value, is_passive=is_passive)
    presented = shown(even, joint)
    assert_straight_ramp(presented, "model")
    assert presented.fault.message == (
        f"model: needs a torque that is a finite number, got {value!r}"
    )
    assert presented.fault.torque_nm == 1.5
    assert set(presented.recording.columns["model_torque_nm"]) == {1.5}


# Slip


def test_a_lost_grip_is_a_fault_with_the_ramp_in_every_phase() -> None:
    joint = Joint(lambda t, _a, _v: min(1.0 + 20.0 * t, 6.0))
    presented = render(joint, OUT, hand=MotionHand(OUT, slip_time=0.6)).presented
    assert_straight_ramp(presented, "slip")
    fault = presented.fault
    assert fault.message.startswith(
        "slip: needs an arm whose speed changes by at most 0.78 of a loose arm's 31 "
        "deg/s in 6 ms, got 2"
    )
    assert 0.6 < fault.time_s < 0.62
    assert joint.n_releases == 1
    assert presented.recording.facts["grip_lost"] is True


def test_an_arm_that_is_thrown_the_way_it_is_pushed_is_a_lost_grip() -> None:
    # Too weak for a sudden fall of speed: 1.5 N·m on 0.06 kg·m² gain 14 deg/s in 10 ms.
    weak = Joint(lambda _t, _a, _v: 1.5)
    fault = render(weak, OUT, hand=MotionHand(OUT, slip_time=0.6)).presented.fault
    assert fault is not None
    assert fault.kind == "slip"
    assert fault.message.startswith(
        "slip: needs at most 180 deg/s in the direction in which a model that is not "
        "passive pushes, got -18"
    )
    # By hand, without friction: from 149 deg/s to -180 at 1.5/0.0597 = 25.1 rad/s²
    # takes 0.229 s, and the speed comes 5.6 ms late.
    assert fault.time_s == pytest.approx(0.6 + 0.229 + 0.0056, abs=0.01)


@pytest.mark.parametrize("speed_deg_s", [40.0, 90.0, 131.0])
def test_an_arm_that_slips_under_the_guards_torque_stays_below_the_limit(
    speed_deg_s: float,
) -> None:
    # 10 N·m on 0.06 kg·m² for the 10 ms until it is noticed and half of the 50 ms of
    # the ramp make 336 deg/s; what they brake first, and friction, take some off that.
    limits = DeviceLimits()
    joint = Joint(lambda t, _a, _v: min(1.0 + 30.0 * t, limits.active_torque))
    clock, hand = SimulatedClock(), stretching(speed_deg_s, slip_time=0.5)
    inner = open_device("simulated", clock=clock, hand=hand)
    way: dict[float, float] = {}

    def look(time_s: float, torque: float) -> float:
        way[time_s] = inner.read().angle  # while the torque is taken back, too
        return torque

    with inner, FaultyDevice(inner, clock, send_fault=look) as device:
        presented = run_presentation(
            device, controls(joint), clock=clock, limits=limits
        )
    assert_straight_ramp(presented, "slip")
    assert presented.fault.time_s < 0.515
    assert presented.fault.torque_nm > 9.5
    speeds = np.diff(list(way.values())) / np.diff(list(way))
    assert radians(150.0) < -speeds.min() < limits.speed


# Whatever a model does


def assert_within(presented: Presented, limits: DeviceLimits) -> float:
    """Energy and torque up to the fault are within the limits -> the energy, J."""
    columns, fault = presented.recording.columns, presented.fault
    sent = columns["time_s"] < (math.inf if fault is None else fault.time_s - 1e-9)
    torques = columns["model_torque_nm"][sent]
    angles = np.radians(columns["angle_deg"][sent])
    given_up_to = -np.cumsum(torques[:-1] * np.diff(angles))
    assert float(given_up_to.max(initial=0.0)) <= limits.active_energy + 1e-12
    assert float(np.abs(torques).max(initial=0.0)) <= limits.active_torque
    # what is left of it goes to zero within 50 ms
    after = np.abs(columns["command_torque_nm"][~sent])
    assert np.all(np.diff(after) <= 1e-9)
    assert after.size == 0 or after[-1] == 0.0
    return float(given_up_to[-1]) if given_up_to.size else 0.0


@settings(max_examples=25, deadline=None)
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
    assert_within(render(Joint(law), FULL, limits=limits).presented, limits)


# Who is guarded, and every registered model rendered, with guard and ramp

GUARDED = {
    kind: model()
    for kind, model in MODELS.items()
    if kind != ElbowParameters.kind and not model().is_passive
}


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


@pytest.mark.parametrize("name", sorted(STANDARD_MODELS))
def test_the_papers_own_law_keeps_the_papers_own_release(name: str) -> None:
    assert not controls(name).is_guarded
    limits = DeviceLimits(active_torque=0.1, active_energy=1e-6)
    presented = present(name, limits=limits, slip_time=0.9)
    assert presented.fault is None
    assert presented.recording.facts["grip_lost"] is True


@pytest.mark.parametrize("kind", ["lead-pipe-rigidity", "contracture", *GUARDED])
def test_with_the_default_limits_it_is_rendered_there_and_back(kind: str) -> None:
    joint: JointModel = MODELS[kind]()
    limits, motion, energy_nm, off_deg = DeviceLimits(), FULL, 0.02, 0.5
    if kind not in GUARDED:  # guarded it would have no fault either
        limits = DeviceLimits(active_energy=1e-9, active_torque=1e-9)
        energy_nm = 0.01  # a spring that was not at rest
        off_deg = 1.2  # 12 N·m on 600 N·m/rad
        end = min(OUT.end, joint.range_end)
        out = MinimumJerk(start=START, end=end, mean_speed=SPEED)
        motion = Joined([out, Hold(start=end, duration=1.0), Reversed(motion=out)])
    rendering = render(joint, motion, limits=limits)
    assert rendering.presented.fault is None
    assert rendering.presented.recording.facts["grip_lost"] is False
    assert rendering.max_angle_error < radians(off_deg)
    assert rendering.energy_given < energy_nm  # of the 1 J that it might
    assert rendering.damping_needed < Friction().viscous
    if kind in GUARDED:
        assert rendering.rms_torque_error < 0.25
    else:
        assert rendering.energy_taken > 1.0


@pytest.mark.parametrize("slip_s", [0.2, 0.5, 0.8, 1.1, 1.5, 2.0, 2.5])
@pytest.mark.parametrize("kind", GUARDED)
def test_an_arm_that_is_let_go_anywhere_stays_slow_or_is_stopped(
    kind: str, slip_s: float
) -> None:
    hand = MotionHand(FULL, slip_time=slip_s)
    presented = render(GUARDED[kind], FULL, hand=hand).presented
    assert presented.fault is None or presented.fault.kind == "slip"
    speeds = presented.recording.columns["velocity_deg_s"]
    assert float(np.abs(speeds).max()) < 183.0
    if kind == "clonus":  # whose constant torque goes on pulling
        assert presented.fault is not None
