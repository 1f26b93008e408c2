"""An actuator that does not do what it is told, beside a torque sensor."""

import math

import numpy as np
import pytest

from masrel.lab.hess import (
    HandTraits,
    HumanHand,
    Presented,
    SimulatedClock,
    SimulatedOptions,
    StretchRules,
    TorqueSensor,
    open_device,
    run_presentation,
)
from masrel.lab.recording import MEASURED_TORQUE

from .faults import FaultyDevice
from .rig import END, LIMITS, MODELS, START, assert_straight_ramp, controls

NAN = math.nan
GAINS = {"reversed": -1.0, "doubled": 2.0, "strong": 1.5, "weak": 0.5, "dead": 0.0}


def shown(model: str, seed: int, **faults) -> Presented:
    """Two stretches by a drawn hand on a device with a torque sensor."""
    way = {"start": START, "end": END, "mean_speed": 1.5, "again": (1.6,)}
    traits = HandTraits.sample(np.random.default_rng(seed))
    hand = HumanHand(traits, **way, returns=True, rest=0.5)
    clock = SimulatedClock()
    options = SimulatedOptions(torque_sensor=TorqueSensor(seed=seed))
    inner = open_device(
        "simulated", clock=clock, hand=hand, range_end=END, options=options
    )
    device = FaultyDevice(inner, clock, **faults)
    device.channels = inner.channels
    with inner, device:
        return run_presentation(
            device,
            controls(model),
            clock=clock,
            limits=LIMITS,
            end_angle=END,
            stretches=StretchRules(n=2),
        )


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("wrong", GAINS)
def test_an_actuator_that_does_something_else_is_a_fault(
    model: str, wrong: str
) -> None:
    gain = GAINS[wrong]
    presented = shown(model, 3, send_fault=lambda _, torque: gain * torque)
    assert_straight_ramp(presented, "actuator")
    # at most 60 ms after they differ by 1.5 N·m, and .1 for what friction is not known
    columns = presented.recording.columns
    differs = np.abs((gain - 1.0) * columns["command_torque_nm"]) > 1.6
    least = columns["time_s"][int(np.argmax(differs))]
    assert presented.fault.time_s - least <= 0.060


def test_a_sensor_that_reads_at_every_fourth_tick_is_enough() -> None:
    n_reads = iter(range(10**6))

    def slower(_, reading):
        return reading if next(n_reads) % 4 == 0 else reading._replace(channels=(NAN,))

    with pytest.warns(match="no number"):
        fault = shown(
            "HM3", 3, send_fault=lambda _, torque: -torque, read_fault=slower
        ).fault
    assert fault.kind == "actuator"
    with pytest.warns(match="no number"):
        assert shown("HM3", 3, read_fault=slower).fault is None


def test_a_stuck_sensor_is_a_fault_and_a_silent_one_is_not() -> None:
    def stuck(_, reading):
        return reading._replace(channels=(0.3,))

    def silent(_, reading):
        return reading._replace(channels=(NAN,))

    with pytest.warns(match="stays at"):
        assert shown("HM2", 5, read_fault=stuck).fault.kind == "actuator"
    with pytest.warns(match="no number"):
        presented = shown("HM2", 5, read_fault=silent)
    assert presented.fault is None


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("model", ["HM1", "HM4"])
def test_one_that_does_as_it_is_told_is_none(model: str, seed: int) -> None:
    presented = shown(model, seed)
    assert presented.fault is None
    assert MEASURED_TORQUE.column in presented.recording.columns
