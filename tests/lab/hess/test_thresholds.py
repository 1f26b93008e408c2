"""Arrival, noise and drift: what an encoder may do is a setting."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    Controller,
    DeviceLimits,
    Hand,
    Presented,
    Reading,
    SimulatedClock,
    SimulatedHand,
    StretchRules,
    YieldingHand,
    open_device,
    run_presentation,
)
from masrel.lab.recording import PHASES

from . import faults as f
from .rig import END, START, ScriptedDevice


def presented(
    hand: Hand,
    fault: f.ReadFault | None = None,
    limits: DeviceLimits | None = None,
    longest_s: float | None = 10.0,
    stretches: StretchRules | None = None,
    model: str = "HM3",
) -> Presented:
    clock = SimulatedClock()
    inner = open_device("simulated", clock=clock, hand=hand)
    controller = Controller(STANDARD_MODELS[model], start_angle=hand.start)
    with inner, f.FaultyDevice(inner, read_fault=fault) as device:
        return run_presentation(
            device,
            controller,
            clock=clock,
            limits=limits or DeviceLimits(),
            max_duration_s=longest_s,
            stretches=stretches,
        )


def resting() -> SimulatedHand:
    return SimulatedHand(start=START, end=END, mean_speed=1.0, delay=60.0)


# Drift


@pytest.mark.parametrize("start_s", [0.0, 0.5])
@pytest.mark.parametrize("rate", [-20.0, -8.0, 4.0, 10.0, 15.0, 20.0, 24.0])
def test_a_resting_arm_that_creeps_is_a_fault_below_half_a_newton_metre(
    rate: float, start_s: float
) -> None:
    shown = presented(resting(), f.drifting(start_s, radians(rate)))
    assert shown.fault is not None
    assert shown.fault.kind == "drift"
    assert shown.fault.message.startswith(
        "drift: needs an arm that starts from rest, got an encoder that was at "
    )
    assert shown.fault.time_s == pytest.approx(start_s + 3.0 / abs(rate), abs=0.005)
    assert np.abs(shown.recording.columns["command_torque_nm"]).max() < 0.5


@pytest.mark.parametrize(
    ("rate", "start_s"), [(-3.0, 0.0), (-2.0, 1.23), (1.0, 0.0), (3.0, 1.23)]
)
def test_one_that_creeps_too_slowly_for_that_is_one_below_a_newton_metre(
    rate: float, start_s: float
) -> None:
    # Long before this hand moves, in as many stretches as it likes
    shown = presented(resting(), f.drifting(start_s, radians(rate)), longest_s=60.0)
    assert shown.fault is not None
    assert shown.fault.kind == "drift"
    assert shown.fault.message == (
        "drift: needs an arm that rests or is faster than 4.5 deg/s, got an encoder "
        "that crept by 15 deg"
    )
    assert shown.fault.time_s == pytest.approx(start_s + 15.0 / abs(rate), rel=0.02)
    assert np.abs(shown.recording.columns["command_torque_nm"]).max() < 1.0


def test_one_that_creeps_slower_still_is_a_stretch_that_does_not_end() -> None:
    fault = f.drifting(0.0, radians(0.5))
    rules = StretchRules(n=None, stretch_limit=5.0)
    shown = presented(resting(), fault, None, None, rules)
    assert shown.fault is not None
    assert shown.fault.kind == "stretch-limit"
    assert np.abs(shown.recording.columns["command_torque_nm"]).max() < 1.0


@pytest.mark.parametrize("speed", [5.0, 10.0])
def test_a_whole_stretch_that_is_slow_does_not_creep(speed: float) -> None:
    hand = SimulatedHand(start=START, end=END, mean_speed=radians(speed))
    shown = presented(hand, longest_s=30.0)
    assert (shown.fault, shown.recording.facts["ended"]) == (None, "arrived")


def test_an_encoder_that_drifts_in_whole_steps_is_one_too() -> None:
    clock, step = SimulatedClock(), radians(0.005)
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with ScriptedDevice(
        clock, lambda t: START + round(radians(20.0) * t / step) * step
    ) as device:
        shown = run_presentation(device, controller, clock=clock, limits=DeviceLimits())
    assert shown.fault is not None
    assert shown.fault.kind == "drift"


@pytest.mark.parametrize("kind", [SimulatedHand, YieldingHand])
@pytest.mark.parametrize("speed", [2.0, 4.0, 4.5, 5.0, 7.5, 10.0, 15.0, 20.0, 24.0])
@pytest.mark.parametrize("start_deg", [30.0, 100.003])
def test_a_slow_stretch_is_no_drift(
    kind: type[SimulatedHand], speed: float, start_deg: float
) -> None:
    hand = kind(start=radians(start_deg), end=END, mean_speed=radians(speed))
    # until it has gone as far as a drift may
    assert presented(hand, longest_s=0.2 + 3.0 / speed).fault is None


def test_how_far_it_may_go_and_how_fast_are_settings() -> None:
    fault = f.drifting(0.0, radians(20.0))
    further = presented(resting(), fault, DeviceLimits(drift_angle=radians(6.0))).fault
    assert further is not None
    assert further.time_s == pytest.approx(0.3, abs=0.005)
    slower = DeviceLimits(drift_speed=radians(15.0))
    fault = f.drifting(0.0, radians(20.0))
    other = presented(resting(), fault, slower).fault
    assert other is not None
    assert other.kind == "range"


# Noise and arrival


def noisy(deviation_deg: float) -> f.ReadFault:
    rng = np.random.default_rng(3)

    def fault(_time_s: float, reading: Reading) -> Reading:
        off = radians(deviation_deg) * float(rng.standard_normal())
        return reading._replace(angle=reading.angle + off)

    return fault


def test_an_encoder_with_noise_arrives_where_its_noise_is_stated() -> None:
    hand = SimulatedHand(start=START, end=END, mean_speed=radians(92.0))
    stated = DeviceLimits(encoder_noise=radians(0.02))
    shown = presented(hand, noisy(0.02), stated)
    assert (shown.fault, shown.recording.facts["ended"]) == (None, "arrived")
    assert shown.recording.columns["time_s"][-1] < 2.0
    silent = presented(hand, noisy(0.02), longest_s=2.5)
    assert silent.recording.facts["ended"] == "max-duration"


@pytest.mark.parametrize("model", ["HM1", "HM2", "HM3", "HM4"])
@pytest.mark.parametrize("slips", [False, True], ids=["held", "slips"])
def test_a_grip_is_lost_by_a_slip_and_not_by_the_noise_of_the_encoder(
    model: str, slips: bool
) -> None:
    limits = DeviceLimits(encoder_noise=radians(0.025))
    for speed in (75.0, 105.0):
        hand = SimulatedHand(start=START, end=END, mean_speed=radians(speed))
        held = presented(hand, noisy(0.025), limits, model=model).recording
        assert (held.facts["ended"], held.facts["grip_lost"]) == ("arrived", False)
        if not slips:
            continue
        caught = np.flatnonzero(held.columns["phase"] == PHASES.index("catch"))
        slip_s = float(held.columns["time_s"][caught[caught.size // 3]])
        hand = SimulatedHand(
            start=START, end=END, mean_speed=radians(speed), slip_time=slip_s
        )
        loose = presented(hand, noisy(0.025), limits, model=model).recording
        released = (loose.columns["time_s"] > slip_s) & (loose.columns["phase"] == 0)
        assert loose.facts["grip_lost"] is True
        # 8 ms without noise; at most 19 ms in 60 slips with 0.03 deg
        assert loose.columns["time_s"][released][0] < slip_s + 0.025


@pytest.mark.parametrize("change", ["arrival_angle", "arrival_speed", "arrival_time"])
def test_each_part_of_an_arrival_is_a_setting(change: str) -> None:
    hand = SimulatedHand(start=START, end=END, mean_speed=radians(92.0))
    usual = presented(hand).recording
    values = {
        "arrival_angle": radians(60.0),
        "arrival_speed": radians(200.0),
        "arrival_time": 0.2,
    }
    limits = replace(DeviceLimits(), **{change: values[change]})
    other = presented(hand, limits=limits).recording
    if change == "arrival_angle":  # slow enough only at the end, where it was before
        assert other.n_presented == usual.n_presented
        short = SimulatedHand(start=START, end=radians(100.0), mean_speed=1.5)
        assert presented(short, limits=limits).recording.facts["ended"] == "arrived"
        usual = presented(short, longest_s=1.2).recording
        assert usual.facts["ended"] == "max-duration"  # 46 deg before the end of range
    elif change == "arrival_speed":
        assert other.n_presented < usual.n_presented
    else:
        assert other.n_presented == pytest.approx(usual.n_presented + 100, abs=1)
