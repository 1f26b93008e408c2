"""The puck's device above the bus: opening, options, torque mode, closing."""

from dataclasses import replace
from math import degrees

import pytest

from masrel.errors import (
    BusError,
    DeviceError,
    DeviceTimeoutError,
    IdledError,
    LimitExceededError,
    ParameterError,
)
from masrel.lab.hess import (
    BackendOptions,
    RealClock,
    SimulatedClock,
    open_device,
)
from masrel.lab.hess.puck import EmulatorOptions, PuckOptions, property_table
from tests.lab.hess.puck.rig import (
    PUCK,
    fault,
    loose,
    opened,
    presented,
    puck_options,
    stretching,
    told,
)

# Opening


def test_it_wakes_is_told_everything_and_goes_into_torque_mode() -> None:
    with opened(SimulatedClock(), stretching()) as device:
        assert told(device) == [
            ("STAT", 2),
            ("T", 0),
            ("MODE", 0),
            ("GRPA", 0),
            ("GRPB", 1),
            ("GRPC", 4),
            ("MT", 4021),  # 28 N·m / (18.8 / 2700) = 4021.3
            ("P", 6417),  # 30 deg * 77004.8 / 360 = 6417.07
            ("T", 0),
            ("MODE", 2),
            ("T", 1),
            ("T", 0),
        ]
        assert device.emulator.n_disturbances == 0
        assert device.identity.firmware == 148
        assert device.transmission == PUCK


def test_one_that_is_awake_keeps_its_position() -> None:
    hand = loose(90.0)
    options = {"emulator": {"awake": True}, "angle_after_reset": None}
    with opened(SimulatedClock(), hand, **options) as device:
        assert not {"STAT", "P"} & {name for name, _ in told(device)}
        assert degrees(device.read().angle) == pytest.approx(90.0, abs=0.0024)


def test_pucks_5_to_7_listen_to_the_other_packed_group() -> None:
    with opened(SimulatedClock(), stretching(), puck=6) as device:
        assert ("GRPB", 2) in told(device)


@pytest.mark.parametrize(
    ("emulator", "changes", "words"),
    [
        ({}, {"angle_after_reset": None}, "does not know where the arm is; hold"),
        ({"role": 2}, {}, "puck 1: needs a motor's puck, its ROLE is 2"),
        ({"role": 0x105}, {}, "its ROLE is 5"),
        (
            {"firmware": 116, "properties": property_table(148)},
            {},
            "needs firmware 65 to 113, or 119 or later, got 116",
        ),
        ({"units_per_nm": 2700, "wake_s": 1.5}, {}, "puck 1: no answer for property 5"),
        ({}, {"largest_torque": 60.0}, "largest_torque needs 1 to 8191 current units"),
        ({}, {"largest_torque": 0.001}, "largest_torque needs 1 to 8191 current units"),
    ],
)
def test_what_it_cannot_drive_is_not_opened(
    emulator: dict, changes: dict, words: str
) -> None:
    with pytest.raises(DeviceError, match=words):
        opened(SimulatedClock(), stretching(), emulator=emulator, **changes)


def test_a_table_of_ones_own_opens_an_unknown_firmware() -> None:
    table = property_table(148)
    emulator = {"firmware": 116, "properties": table}
    options = {"emulator": emulator, "properties": table}
    with opened(SimulatedClock(), stretching(), **options) as device:
        assert device.identity.firmware == 116


def test_an_arm_that_cannot_be_there_is_refused() -> None:
    # Awake, but zeroed at another turn: 90 deg with the gear of another device
    options = {"emulator": {"awake": True}, "gear_ratio": 8.0, "largest_torque": 9.0}
    with pytest.raises(
        DeviceError, match=r"it reports 211\.\d; run masrel device zero"
    ):
        opened(SimulatedClock(), loose(90.0), **options)


def test_nobody_there_is_said() -> None:
    options = PuckOptions(interface="virtual", channel="empty")
    with pytest.raises(DeviceTimeoutError, match="puck 1: no answer for property 5"):
        open_device("puck", clock=RealClock(), options=options)


def test_a_bus_that_is_not_there_is_said() -> None:
    options = PuckOptions(interface="socketcan", channel="can-none")
    with pytest.raises(BusError, match="cannot open channel 'can-none' of interface"):
        open_device("puck", clock=RealClock(), options=options)


@pytest.mark.parametrize(
    "interface", ["canalystii", "kvaser", "neovi", "pcan", "slcan", "socketcand"]
)
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_adapter_that_is_not_there_is_said(interface: str) -> None:
    # Each of python-can's interfaces says so in a way of its own.
    options = PuckOptions(interface=interface, channel="0")
    words = f"puck: cannot open channel '0' of interface '{interface}'"
    with pytest.raises(BusError, match=words):
        open_device("puck", clock=RealClock(), options=options)


def test_an_interface_that_nobody_knows_is_said() -> None:
    options = PuckOptions(interface="telepathy", channel="1")
    with pytest.raises(BusError, match="of interface 'telepathy'"):
        open_device("puck", clock=RealClock(), options=options)


# Options


class Foreign(BackendOptions):
    pass


@pytest.mark.parametrize(
    ("setup", "words"),
    [
        ({}, "puck: needs options that say on which bus it is"),
        ({"options": Foreign()}, "of type PuckOptions, got Foreign"),
        ({"options": PuckOptions()}, "needs a real clock"),
        ({"options": PuckOptions(), "hand": loose()}, "got a hand alone"),
        (
            {"options": puck_options(loose())},
            "got an emulator alone",
        ),
    ],
)
def test_a_setup_that_contradicts_itself_is_refused(setup: dict, words: str) -> None:
    with pytest.raises(DeviceError, match=words):
        open_device("puck", clock=SimulatedClock(), **setup)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"puck": 8}, "puck: needs a motor's node, 1 to 7, got 8"),
        ({"gear_ratio": 0.0}, "gear_ratio: needs more than 0"),
        ({"patience_s": -1.0}, "patience_s: needs more than 0"),
        ({"largest_torque": float("nan")}, "largest_torque: needs more than 0"),
        ({"direction": 0}, "direction: needs 1 or -1, got 0"),
        ({"poll_ticks": 0}, "poll_ticks: needs 1 or more, got 0"),
        ({"angle_after_reset": 4.0}, "angle_after_reset: needs 0 to 180 degrees"),
        ({"emulator": EmulatorOptions()}, "interface: needs 'virtual'"),
    ],
)
def test_options_out_of_range_are_refused(changes: dict, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        PuckOptions(**changes)


@pytest.mark.parametrize(
    ("interface", "channel", "moves"),
    [
        ("socketcan", "can0", True),
        ("pcan", "PCAN_USBBUS1", True),
        ("socketcan", "vcan0", False),
        ("virtual", "here", False),
        ("udp_multicast", "239.0.0.1", False),
    ],
)
def test_options_say_whether_hardware_may_move(
    interface: str, channel: str, moves: bool
) -> None:
    options = PuckOptions(interface=interface, channel=channel)
    assert options.moves_hardware is moves


# In torque mode


def test_it_says_when_the_encoder_was_sampled() -> None:
    clock = SimulatedClock()
    with opened(clock, loose()) as device:
        asked_ns = clock.now_ns()
        assert device.read().time_ns == asked_ns + 75_000


def test_it_refuses_a_torque_above_its_own_limit() -> None:
    with opened(SimulatedClock(), loose(), largest_torque=10.0) as device:
        device.command(9.99)
        with pytest.raises(LimitExceededError, match="at most 10 N·m") as caught:
            device.command(10.01)
        assert caught.value.kind == "torque"


def test_a_mode_that_was_changed_is_noticed_when_checked() -> None:
    clock = SimulatedClock()
    with opened(clock, loose(), emulator={"faults": (fault("idled", 0.05),)}) as device:
        device.check()
        clock.sleep_until_ns(clock.now_ns() + 100_000_000)
        with pytest.raises(IdledError, match="somebody else has set it to 0"):
            device.check()


def test_a_puck_that_does_not_say_its_mode_is_noticed_when_checked() -> None:
    clock = SimulatedClock()
    faults = (fault("dropped-replies", 0.01, end_s=0.1),)
    with opened(clock, loose(), emulator={"faults": faults}) as device:
        clock.sleep_until_ns(clock.now_ns() + 20_000_000)
        device.check()
        device.check()
        with pytest.raises(DeviceTimeoutError, match="3 times in a row"):
            device.check()
        clock.sleep_until_ns(clock.now_ns() + 100_000_000)


@pytest.mark.parametrize(
    "traits",
    [
        {"is_flagged": True},
        {"has_secondary": True},
        {"reply_bytes": 4},
        {"is_noisy": True},
        {"counts_per_turn": 40960},
        {"units_per_nm": 2562},
        {"firmware": 65},
    ],
)
def test_a_presentation_runs_on_every_kind_of_puck(traits: dict) -> None:
    done, device, _ = presented(**traits)
    assert done.fault is None
    assert done.recording.facts["ended"] == "arrived"
    assert device.emulator.n_memory_writes == 0


# A presentation


def test_what_is_recorded_is_what_the_puck_was_told() -> None:
    done, device, _ = presented()
    commands = done.recording.columns["command_torque_nm"]
    units = [
        setting.value for setting in device.emulator.settings if setting.name == "T"
    ]
    n_before, n_after = 4, 3  # bringing it up; the end, closing, idling
    told_units = units[n_before : len(units) - n_after + 1]
    assert told_units[: commands.size - 1] == [
        PUCK.units(float(torque)) for torque in commands[:-1]
    ]
    off = [
        abs(PUCK.torque(unit) - torque)
        for unit, torque in zip(told_units, commands[:-1], strict=False)
    ]
    assert max(off) <= 0.5 * PUCK.torque_step * (1.0 + 1e-12)


# Closing


def test_closing_zeroes_idles_and_waits_for_the_word() -> None:
    clock = SimulatedClock()
    device = opened(clock, loose())
    device.command(2.0)
    device.close()
    assert told(device)[-5:] == [
        ("T", -287),
        ("T", 0),
        ("T", 0),
        ("MODE", 0),
        ("MODE", 0),
    ]
    assert device.emulator.mode == 0


def test_a_puck_that_does_not_confirm_is_called_out() -> None:
    clock = SimulatedClock()
    device = opened(clock, loose(), emulator={"faults": (fault("unplugged", 0.01),)})
    device.command(2.0)
    clock.sleep_until_ns(clock.now_ns() + 20_000_000)
    begun_ns = clock.now_ns()
    with pytest.raises(DeviceError, match=r"not idle after 100 ms .* ITS SUPPLY OFF"):
        device.close()
    assert 0.1 <= (clock.now_ns() - begun_ns) * 1e-9 < 0.112
    assert device.emulator.torque == -287  # it holds it for ever


def test_an_opening_that_fails_leaves_the_bus_to_others() -> None:
    hand = loose()
    options = puck_options(hand, emulator={"role": 2})
    with pytest.raises(DeviceError):
        open_device("puck", clock=SimulatedClock(), hand=hand, options=options)
    again = replace(options, emulator=EmulatorOptions())
    with open_device(
        "puck", clock=SimulatedClock(), hand=hand, options=again
    ) as device:
        assert device.is_open


def test_a_puck_that_was_reset_is_not_told_to_idle() -> None:
    # Asleep, 8 is no longer its mode but the lock of its memory
    clock = SimulatedClock()
    device = opened(clock, loose(), emulator={"faults": (fault("reset", 0.01),)})
    device.command(2.0)
    clock.sleep_until_ns(clock.now_ns() + 20_000_000)
    device.close()
    assert device.emulator.n_memory_writes == 0


def test_a_torque_that_does_not_read_back_can_be_gone_without() -> None:
    faults = (fault("dropped-torques", 0.0),)
    clock, hand = SimulatedClock(), loose()
    with pytest.raises(DeviceError, match=r"needs a T that reads back .* reads 0"):
        opened(clock, hand, emulator={"faults": faults})
    options = {"emulator": {"faults": faults}, "checks_torque": False}
    with opened(SimulatedClock(), loose(), **options) as device:
        device.command(1.0)
        assert device.is_open


def test_a_bus_that_comes_back_while_closing_is_used() -> None:
    # Off for 30 ms, which nobody has noticed yet
    clock = SimulatedClock()
    faults = (fault("bus-off", 0.01, end_s=0.04),)
    device = opened(clock, loose(), emulator={"faults": faults})
    device.command(2.0)
    clock.sleep_until_ns(clock.now_ns() + 15_000_000)
    device.close()
    assert device.emulator.mode == 0
