"""The puck's device from inside: hardware or not, the codec under the law, the bus."""

from math import radians

import can
import numpy as np
import pytest

from masrel.errors import DeviceError
from masrel.lab.elbow import STANDARD_MODELS, ConstantSpeed, trace
from masrel.lab.hess import Controller, DeviceSetup, RealClock, SimulatedClock
from masrel.lab.hess.puck import PuckOptions
from masrel.lab.hess.puck._bus import (
    decode_position,
    decode_request,
    encode_position,
    encode_value,
)
from masrel.lab.hess.puck._puck_device import (
    PuckDevice,
    build,
)
from masrel.lab.hess.puck._puck_options import FaultKind
from tests.lab.hess.puck.rig import (
    END,
    PUCK,
    START,
    fault,
    loose,
    opened,
    puck_options,
    told,
)


@pytest.mark.parametrize(
    ("interface", "channel", "simulated"),
    [
        ("socketcan", "can0", False),
        ("pcan", "PCAN_USBBUS1", False),
        ("socketcan", "vcan0", True),
        ("virtual", "here", True),
        ("udp_multicast", "239.0.0.1", True),
    ],
)
def test_it_says_whether_hardware_may_move(
    interface: str, channel: str, simulated: bool
) -> None:
    options = PuckOptions(interface=interface, channel=channel)
    device = build(DeviceSetup(clock=RealClock(), options=options))
    assert device.simulated is simulated


def test_a_driver_that_was_killed_leaves_no_torque_to_the_next() -> None:
    clock, hand = SimulatedClock(), loose(90.0)
    with opened(clock, hand, emulator={"awake": True}) as device:
        device.command(-3.0)
        held = device.emulator
        device._bring_up()  # what the next driver does on the same puck
        assert ("T", 0) in told(device)[-13:]
        assert held.torque == 0


@pytest.mark.parametrize("kind", ["bus-off", "dropped-replies", "dropped-torques"])
def test_a_puck_that_fails_while_it_is_activated_is_idled(kind: FaultKind) -> None:
    hand = loose()
    faults = (fault(kind, 0.0, end_s=0.06),)
    options = puck_options(hand, emulator={"faults": faults})
    setup = DeviceSetup(clock=SimulatedClock(), hand=hand, options=options)
    device = build(setup)
    with pytest.raises(DeviceError):
        device.open()
    assert isinstance(device, PuckDevice)
    assert not device.is_open
    assert device.emulator.mode == 0


@pytest.mark.parametrize(
    ("faults", "said"),
    [
        ((), "the bus cannot be left"),
        ((fault("unplugged", 0.4),), "SWITCH ITS SUPPLY OFF"),  # more important
    ],
)
def test_an_adapter_that_does_not_let_go_is_a_fault_of_the_bus(faults, said) -> None:
    # As one on a serial port does that has been pulled out
    clock = SimulatedClock()
    device = opened(clock, loose(), emulator={"faults": faults})
    bus = device._link._bus
    shut_down = bus.shutdown

    def failing() -> None:
        shut_down()
        raise can.CanOperationError("no such port")

    bus.shutdown = failing
    clock.sleep_until_ns(clock.now_ns() + 500_000_000)
    with pytest.raises(DeviceError, match=said):
        device.close()
    bus.shutdown = shut_down


# The same law


@pytest.mark.parametrize("model", ["HM1", "HM2", "HM3", "HM4"])
@pytest.mark.parametrize("speed_deg_s", [15.0, 72.0, 120.0])
def test_the_codec_changes_the_law_by_its_quantum(
    model: str, speed_deg_s: float
) -> None:
    # The controller is fed the motion as the puck counts it, with the motion's own
    # speed; what it asks for passes the bus. Against elbow.trace, which sees neither.
    parameters = STANDARD_MODELS[model]
    motion = ConstantSpeed(start=START, end=END, speed=radians(speed_deg_s))
    exact = trace(parameters, motion, rate_hz=1000)
    controller = Controller(parameters, start_angle=START, compensation=0.0)
    sent = np.empty(exact.time.size)
    phases = np.empty(exact.time.size, dtype=int)
    for number, (time_s, angle, speed) in enumerate(
        zip(exact.time, exact.angle, exact.velocity, strict=True)
    ):
        counts = decode_position(encode_position(PUCK.counts(float(angle))))
        torque = controller.step(float(time_s), PUCK.angle(counts), float(speed))
        _, units = decode_request(encode_value(42, PUCK.units(torque)))
        assert units is not None
        sent[number] = PUCK.torque(units)
        phases[number] = controller.phase
    same = phases == exact.phase
    assert np.sum(~same) <= 2  # a catch may begin or end one sample aside
    # Half a unit of torque; and half a count of angle, which (5) feels three times, as
    # the end of pre-catch by k, the start of post-catch and the angle now by k_post:
    # 0.0035 N·m and 0.00004 rad * (3.15 + 2 * 5.8) N·m/rad = 0.0006 N·m
    springs = 3.15 + 2.0 * 5.8
    quantum = 0.5 * PUCK.torque_step + 0.5 * PUCK.angle_step * springs
    # Where the catch or its end falls one sample later, what follows starts there.
    aside = radians(speed_deg_s) * 0.001 * springs if not same.all() else 0.0
    assert np.max(np.abs(sent - exact.torque)[same]) <= quantum * (1.0 + 1e-9) + aside
