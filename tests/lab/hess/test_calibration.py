"""A calibration finds what was put into a simulated device, and refuses what is off."""

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import radians

import numpy as np
import pytest

from masrel.errors import DeviceError
from masrel.lab.hess import (
    BackendOptions,
    Device,
    Friction,
    Hand,
    PlantParameters,
    SimulatedClock,
    SimulatedOptions,
    TorqueSensor,
    open_device,
)
from masrel.lab.hess._calibration import (
    GainPoint,
    Measured,
    carry,
    encoder_noise,
    fit_gain,
    measure_free_arm,
)
from masrel.lab.hess.moteus import MoteusEmulatorOptions, MoteusOptions
from masrel.lab.hess.puck import EmulatorOptions, InjectedFault, PuckOptions

from .faults import FaultyDevice
from .puck.rig import loose
from .rig import END

NOISE_DEG, DELAY_MS, INERTIA, GAIN = 0.006, 3.5, 0.0897, 1.05
ARM = PlantParameters(
    friction=Friction(viscous=0.25, coulomb=0.12), arm_inertia=0.08, delay=0.003
)
TRUTH = {
    "encoder_noise_deg": NOISE_DEG,
    "delay_ms": DELAY_MS,  # 3 of delay and .5 of lag
    "inertia_kg_m2": INERTIA,  # .08 and the motor's .0097
    "viscous_nms_rad": 0.25,
    "coulomb_nm": 0.12,
    "torque_gain": GAIN,
}
LOADS = (0.6, 1.2, 2.4, -0.6, -1.2, -2.4)  # N·m


def calibrated(
    opened: Callable[[Hand], tuple[SimulatedClock, Device]],
    loads: Sequence[float] = LOADS,
) -> dict[str, Measured]:
    """All that is measured on a device, with weights on its arm."""
    hand = loose(60.0)
    clock, device = opened(hand)
    with device:
        values = measure_free_arm(device, clock)
        points = []
        for load in loads:
            hand.load = load
            points += carry(device, clock, load)
            hand.load = 0.0
    gain = fit_gain(points)
    for name in ("inertia_kg_m2", "viscous_nms_rad", "coulomb_nm"):
        values[name] = values[name].scaled(gain["torque_gain"])
    return values | gain


def simulated(hand: Hand, gain: float = GAIN) -> tuple[SimulatedClock, Device]:
    """A simulated device with noise, whose motor gives more than it is told."""
    clock, noise, step = SimulatedClock(), random.Random(1), radians(0.005)

    def noisy(_, reading):
        angle = reading.angle + noise.gauss(0.0, radians(NOISE_DEG))
        return reading._replace(angle=round(angle / step) * step)

    options = SimulatedOptions(arm=ARM)
    inner = open_device(
        "simulated", clock=clock, hand=hand, range_end=END, options=options
    )
    return clock, FaultyDevice(
        inner, clock, read_fault=noisy, send_fault=lambda _, torque: gain * torque
    )


# Whether 95 % intervals hold all six numbers is a matter of the seed: two of twelve did
# not. The gain's error is a few hundred thousandths, so this says nothing of .01.
def test_a_simulated_device_is_as_it_was_made() -> None:
    found = calibrated(simulated)
    for name, truth in TRUTH.items():
        assert found[name].low <= truth <= found[name].high, name
        assert found[name].value == pytest.approx(truth, rel=0.03), name


def emulated(
    name: str, hand: Hand, gain: float, **arm: float
) -> tuple[SimulatedClock, Device]:
    """An emulated amplifier whose motor gives so many times what it says."""
    faults = (InjectedFault(kind="scaled-torque", start_s=0.0, size=gain),)
    told = {"arm": replace(ARM, **arm), "faults": faults}
    where = {"interface": "virtual", "channel": f"calibrated-{name}"}
    options: BackendOptions = MoteusOptions(
        **where, emulator=MoteusEmulatorOptions(**told)
    )
    if name == "puck":
        puck = PuckOptions(**where).emulated(hand.start)
        options = replace(puck, emulator=EmulatorOptions(**told))
    clock = SimulatedClock()
    return clock, open_device(
        name, clock=clock, hand=hand, range_end=END, options=options
    )


# A frame takes .11 or .14 ms, and the arm moves in steps of .05
@pytest.mark.slow
@pytest.mark.parametrize(("name", "frame_ms"), [("puck", 0.11), ("moteus", 0.14)])
def test_an_emulated_amplifier_is_as_it_was_made(name: str, frame_ms: float) -> None:
    noise = radians(0.004)
    found = calibrated(
        lambda hand: emulated(name, hand, GAIN, encoder_noise=noise, step_ns=50_000),
        loads=LOADS[1:4],
    )
    truths = {**TRUTH, "encoder_noise_deg": 0.004, "delay_ms": DELAY_MS + frame_ms}
    for key, truth in truths.items():
        more = 0.025 if key == "delay_ms" else 0.0
        assert found[key].low - more <= truth <= found[key].high + more, key


@pytest.mark.parametrize(
    "name", ["moteus", pytest.param("puck", marks=pytest.mark.slow)]
)
def test_a_motor_of_the_wrong_sign_is_refused(name: str) -> None:
    clock, device = emulated(name, loose(60.0), -1.0)
    with device, pytest.raises(DeviceError, match="extends, it flexes; torque and c"):
        measure_free_arm(device, clock)


def test_an_arm_that_is_weighed_refuses_a_gain_of_one_and_a_half() -> None:
    hand, points = loose(77.0), []
    clock, device = simulated(hand, gain=1.5)
    with device:
        for load in (0.6, -0.6, 1.2, -1.2):
            hand.load = load
            points += carry(device, clock, load)
    with pytest.raises(DeviceError, match=r"gain: needs .* got 1\.50\d times"):
        fit_gain(points)


def test_a_torque_sensor_counts_where_there_is_one() -> None:
    # The masses are a tenth less than was said, and the sensor knows
    hand, clock, points = loose(77.0), SimulatedClock(), []
    options = SimulatedOptions(torque_sensor=TorqueSensor(seed=2))
    inner = open_device("simulated", clock=clock, hand=hand, options=options)
    device = FaultyDevice(inner, clock, send_fault=lambda _, torque: GAIN * torque)
    device.channels = inner.channels
    with device:
        for load in LOADS:
            hand.load = 0.9 * load
            points += carry(device, clock, load)
    gain = fit_gain(points)["torque_gain"]
    assert gain.value == pytest.approx(GAIN, rel=0.003)
    assert gain.low <= GAIN <= gain.high


def points_of(gain: float, n: int = 6) -> list[GainPoint]:
    """What friction of .19 N·m and an offset of .05 leave of a gain."""
    return [
        GainPoint(load, load / gain + 0.05 + 0.19 * way, way)
        for load in np.linspace(-2.0, 2.0, n)
        for way in (1.0, -1.0)
    ]


def test_gain_and_offset_are_those_of_the_line() -> None:
    found = fit_gain(points_of(1.05))
    assert found["torque_gain"].value == pytest.approx(1.05, rel=1e-12)
    assert found["torque_offset_nm"].value == pytest.approx(0.05, rel=1e-12)


def test_the_interval_of_a_gain_is_the_textbook_s() -> None:
    # Slope and its error of a line through three means of two: df 6 - 3, t = 3.1824
    points = points_of(1.0, n=3)
    points[0] = points[0]._replace(sent=points[0].sent + 0.06)
    slope, error = 1.0 - 0.06 * 2.0 / 16.0, math.sqrt(0.0015 / 3.0 / 16.0)
    found = fit_gain(points)["torque_gain"]
    residual = np.linalg.lstsq(
        np.array([[p.against, 1.0, p.direction] for p in points]),
        np.array([p.sent for p in points]),
        rcond=None,
    )[1][0]
    error = math.sqrt(residual / 3.0 / 16.0)
    assert 1.0 / found.value == pytest.approx(slope, rel=1e-12)
    assert 1.0 / found.low == pytest.approx(slope + 3.182446305 * error, rel=1e-9)
    assert 1.0 / found.high == pytest.approx(slope - 3.182446305 * error, rel=1e-9)


@pytest.mark.parametrize("gain", [-1.0, 0.5, 0.89, 1.11, 1.5])
def test_a_gain_that_is_far_off_is_refused(gain: float) -> None:
    with pytest.raises(DeviceError, match=rf"0\.9 to 1\.1 times .*, got {gain:.3f}"):
        fit_gain(points_of(gain))


def test_one_weight_says_no_gain() -> None:
    with pytest.raises(DeviceError, match="needs weights of two masses or more"):
        fit_gain(points_of(1.0)[:2])


# The error of a deviation of 2000 readings is 1.6 %: 5 % is more than three.
@pytest.mark.parametrize("sigma", [0.7, 3.0])
def test_noise_is_what_steps_leave_of_it(sigma: float) -> None:
    rng = np.random.default_rng(4)
    readings = np.round(0.3 + sigma * rng.standard_normal(2000))
    found = encoder_noise(readings.tolist(), step=1.0)
    assert found.value == pytest.approx(sigma, rel=0.05)
    assert found.low < sigma < found.high


def test_readings_that_are_all_the_same_only_bound_the_noise() -> None:
    assert encoder_noise([0.25] * 2000, step=1.0) == (0.0, 0.0, 0.5)


@pytest.mark.parametrize("centre", [0.0, 0.25, 0.5])
def test_noise_below_half_a_step_is_within_its_bounds(centre: float) -> None:
    rng = np.random.default_rng(5)
    readings = np.round(centre + 0.2 * rng.standard_normal(2000))
    found = encoder_noise(readings.tolist(), step=1.0)
    assert found.low <= 0.2 <= found.high
