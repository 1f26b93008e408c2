"""The puck as a device: opening, options, torque mode, closing; its properties."""

from dataclasses import replace
from math import degrees, radians
from pathlib import Path

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import (
    BusError,
    DeviceError,
    DeviceTimeoutError,
    IdledError,
    LimitExceededError,
    ParameterError,
)
from masrel.lab.hess import RealClock, SimulatedClock, open_device
from masrel.lab.hess.puck import (
    PuckOptions,
    property_table,
    read_property_table,
    zero,
)
from tests.lab.hess.puck.rig import (
    PUCK,
    PuckDevice,
    PuckNode,
    bench,
    fault,
    loose,
    n_memory_writes,
    opened,
    presented,
    puck_options,
    told,
    unopened,
)
from tests.lab.hess.rig import stretching

STAT, MODE, CTS, IPNM, GRPA = 5, 8, 68, 86, 26


def failing(*faults, **options) -> tuple[SimulatedClock, PuckDevice]:
    """A device that holds 2 N·m on a puck that fails."""
    clock = SimulatedClock()
    device = opened(clock, loose(), emulator={"faults": faults}, **options)
    device.command(2.0)
    return clock, device


def wait(clock: SimulatedClock, time_s: float) -> None:
    clock.sleep_until_ns(clock.now_ns() + round(time_s * 1e9))


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
    with opened(SimulatedClock(), stretching(), puck=6) as device:
        assert ("GRPB", 2) in told(device)  # pucks 5 to 7 are in the other group


def test_one_that_is_awake_keeps_its_position() -> None:
    options = {"emulator": {"awake": True}, "angle_after_reset": None}
    with opened(SimulatedClock(), loose(90.0), **options) as device:
        assert not {"STAT", "P"} & {name for name, _ in told(device)}
        assert degrees(device.read().angle) == pytest.approx(90.0, abs=0.0024)


def test_a_driver_that_was_killed_leaves_no_torque_to_the_next() -> None:
    with opened(SimulatedClock(), loose(), emulator={"awake": True}) as device:
        device.command(-3.0)
        device._bring_up()  # what the next driver does on the same puck
        assert ("T", 0) in told(device)[-13:]
        assert device.emulator.torque == 0


# The last of these is awake, but zeroed at another turn: 90 deg with the gear of
# another device
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
        ({"wake_s": 1.5}, {}, "puck 1: no answer for property 5"),
        ({}, {"largest_torque": 60.0}, "needs a largest_torque of 1 to 8191 current"),
        ({}, {"largest_torque": 0.001}, "needs a largest_torque of 1 to 8191 current"),
        (
            {"awake": True},
            {"gear_ratio": 8.0, "largest_torque": 9.0},
            r"it reports 211\.\d; run masrel device zero",
        ),
        (
            {"faults": (fault("dropped-torques", 0.0),)},
            {},
            r"needs a property T that reads back .* reads 0",
        ),
    ],
)
def test_what_it_cannot_drive_is_not_opened_and_the_bus_is_left_to_others(
    emulator: dict, changes: dict, words: str
) -> None:
    hand = loose(90.0)
    options = puck_options(hand, emulator=emulator, **changes)
    with pytest.raises(DeviceError, match=words):
        open_device("puck", clock=SimulatedClock(), hand=hand, options=options)
    well = puck_options(hand, emulator={})
    again = replace(well, channel=options.channel)
    with open_device("puck", clock=SimulatedClock(), hand=hand, options=again):
        pass


@pytest.mark.parametrize("kind", ["bus-off", "dropped-replies", "dropped-torques"])
def test_a_puck_that_fails_while_it_is_activated_is_idled(kind) -> None:
    device = unopened(loose(), fault(kind, 0.0, end_s=0.06))
    with pytest.raises(DeviceError):
        device.open()
    assert not device.is_open
    assert device.emulator.mode == 0


@pytest.mark.parametrize(
    ("interface", "channel", "error", "words"),
    [
        ("virtual", "empty", DeviceTimeoutError, "no answer for property 5"),
        ("socketcan", "can-none", BusError, "cannot open channel 'can-none' of inter"),
        ("telepathy", "1", BusError, "of interface 'telepathy'"),
        # Each of python-can's interfaces says so in a way of its own.
        *(
            (
                name,
                "0",
                BusError,
                f"puck: cannot open channel '0' of interface '{name}'",
            )
            for name in (
                *("canalystii", "kvaser", "neovi"),
                *("pcan", "slcan", "socketcand"),
            )
        ),
    ],
)
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_bus_or_an_adapter_that_is_not_there_is_said(
    interface: str, channel: str, error: type[DeviceError], words: str
) -> None:
    options = PuckOptions(interface=interface, channel=channel)
    with pytest.raises(error, match=words):
        open_device("puck", clock=RealClock(), options=options)


# Waking, configuring, zeroing: what is refused of a puck that answers oddly


def zeroed(
    monkeypatch: pytest.MonkeyPatch,
    values: dict[int, list[int]] | None = None,
    counts: int | None = None,
    angle_deg: float = 90.0,
) -> int:
    """Zero a puck of which some properties, and maybe the position, read otherwise."""
    get, position = PuckNode.get, PuckNode.position

    def said(node: PuckNode, number: int, **options: float) -> int:
        value = get(node, number, **options)
        others = (values or {}).get(number, [value])  # in turn, the last one for ever
        return others.pop(0) if len(others) > 1 else others[0]

    def at(node: PuckNode, number: int, **options: float) -> tuple[int, int]:
        time_ns, count = position(node, number, **options)
        return time_ns, count if counts is None else counts

    monkeypatch.setattr(PuckNode, "get", said)
    monkeypatch.setattr(PuckNode, "position", at)
    one = bench()
    with one.link:
        return zero(one.link, one.clock, PuckOptions(), angle=radians(angle_deg))


@pytest.mark.parametrize(
    ("values", "counts", "words"),
    [
        ({STAT: [0]}, None, "puck 1: needs STAT 2 after waking, got 0"),
        ({CTS: [0]}, None, "puck 1: needs CTS and IPNM above 0, got 0 and 2700"),
        ({IPNM: [-3]}, None, "puck 1: needs CTS and IPNM above 0, got 4096 and -3"),
        ({GRPA: [9]}, None, "puck 1: needs GRPA 0, reads 9"),
        ({MODE: [3]}, None, "puck 1: needs MODE 0, reads 3"),
        # under torque
        ({MODE: [0, 2]}, None, "needs MODE 0 to be zeroed, is 2"),
        ({}, 19248, "needs a position of 19251 counts after zeroing, got 19248"),
    ],
)
def test_answers_that_make_no_sense_are_refused(
    values: dict[int, list[int]], counts: int | None, words: str, monkeypatch
) -> None:
    with pytest.raises(DeviceError, match=words):
        zeroed(monkeypatch, values, counts)


def test_a_count_or_two_beside_the_angle_is_there(monkeypatch) -> None:
    assert zeroed(monkeypatch, counts=19251 + 2) == 19253


# Options


@pytest.mark.parametrize("angle_deg", [-0.1, 180.1, float("nan")])
def test_no_arm_is_beyond_its_ends(angle_deg: float, monkeypatch) -> None:
    with pytest.raises(ParameterError, match="angle: needs 0 to 180 degrees"):
        zeroed(monkeypatch, angle_deg=angle_deg)


# Numbers of properties, of a firmware or from a file

# The least that a table needs
REQUIRED = {
    **{"MODE": 8, "T": 42, "MT": 43, "P": 48, "CTS": 68},
    **{"IPNM": 86, "GRPA": 26, "GRPB": 27, "GRPC": 28},
}


@pytest.mark.parametrize("firmware", [65, 113, 119, 131, 132, 148, 200])
def test_known_firmware_has_the_numbers_that_the_driver_needs(firmware: int) -> None:
    table = property_table(firmware)
    assert {name: table.number(name) for name in REQUIRED} == REQUIRED
    two = (table.number("EN"), table.number("HOLD"))
    assert two == ((94, 77) if firmware >= 132 else (77, 94))  # they change places


@given(st.integers(-1, 64) | st.integers(114, 118))
def test_unknown_firmware_is_refused(firmware: int) -> None:
    with pytest.raises(DeviceError, match=rf"puck: needs firmware .* got {firmware}$"):
        property_table(firmware)


@pytest.mark.parametrize("name", ["SAVE", "LOAD", "DEF", "LOCK", "KP"])
def test_what_writes_its_memory_is_never_set(name: str) -> None:
    words = f"{name} writes the puck's permanent memory"
    if name == "KP":
        words = "property KP is not in this firmware's"
    with pytest.raises(DeviceError, match=words):
        property_table(148).settable(name)


def test_a_table_of_ones_own_opens_an_unknown_firmware(tmp_path: Path) -> None:
    path = tmp_path / "puck.toml"
    lines = [f"{name} = {number}" for name, number in REQUIRED.items()]
    path.write_text("\n".join(["[properties]", *lines]))
    table = read_property_table(path)
    assert table.numbers == REQUIRED
    emulator = {"firmware": 116, "properties": table}
    options = {"emulator": emulator, "properties": table}
    with opened(SimulatedClock(), stretching(), **options) as device:
        assert device.is_open


# In torque mode


def test_it_refuses_a_torque_above_its_own_limit() -> None:
    with opened(SimulatedClock(), loose(), largest_torque=10.0) as device:
        for torque in (9.99, -9.99):
            device.command(torque)
            with pytest.raises(LimitExceededError, match="at most 10 N·m") as caught:
                device.command(torque + 0.02 * (1 if torque > 0.0 else -1))
            assert caught.value.kind == "torque"


def test_a_mode_that_was_changed_is_noticed_when_checked() -> None:
    clock, device = failing(fault("idled", 0.05))
    with device:
        device.check()
        wait(clock, 0.1)
        with pytest.raises(IdledError, match="something else set it to 0"):
            device.check()


def test_a_puck_that_does_not_say_its_mode_is_noticed_when_checked() -> None:
    clock, device = failing(fault("dropped-replies", 0.01, end_s=0.1))
    with device:
        wait(clock, 0.02)
        device.check()
        device.check()
        with pytest.raises(DeviceTimeoutError, match="3 times in a row"):
            device.check()
        wait(clock, 0.1)


@pytest.mark.parametrize(
    "traits",
    [
        {"counts_per_turn": 40960},
        {"units_per_nm": 2562},
        {"firmware": 65},
    ],
)
def test_a_presentation_runs_on_every_kind_of_puck(traits: dict) -> None:
    done, device, _ = presented(**traits)
    assert done.fault is None
    assert done.recording.facts["ended"] == "arrived"
    assert n_memory_writes(device.emulator) == 0


def test_what_is_recorded_is_what_the_puck_was_told() -> None:
    done, device, _ = presented()
    commands = done.recording.columns["command_torque_nm"][:-1].tolist()
    units = [value for name, value in told(device) if name == "T"]
    n_before = 4  # bringing it up; then the end, closing, idling
    sent = units[n_before : n_before + len(commands)]
    assert sent == [PUCK.units(torque) for torque in commands]
    off = [
        abs(PUCK.torque(unit) - torque)
        for unit, torque in zip(sent, commands, strict=True)
    ]
    assert max(off) <= 0.5 * PUCK.torque_step * (1.0 + 1e-12)


# Closing


def test_closing_zeroes_idles_and_waits_for_the_word() -> None:
    _, device = failing()
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
    clock, device = failing(fault("unplugged", 0.01))
    wait(clock, 0.02)
    begun_ns = clock.now_ns()
    with pytest.raises(DeviceError, match=r"not idle after 100 ms .* ITS SUPPLY OFF"):
        device.close()
    assert 0.1 <= (clock.now_ns() - begun_ns) * 1e-9 < 0.112
    assert device.emulator.torque == -287  # it holds it for ever


@pytest.mark.parametrize(
    ("one", "waited_s", "options"),
    [
        # Asleep after it was reset, 8 is no longer its mode but the lock of its memory
        (fault("reset", 0.01), 0.02, {}),
        # Off for 30 ms, which nobody has noticed yet
        (fault("bus-off", 0.01, end_s=0.04), 0.015, {}),
        # A torque that does not read back can be gone without
        (fault("dropped-torques", 0.0), 0.0, {"checks_torque": False}),
    ],
)
def test_a_puck_that_comes_back_is_idled_and_its_memory_not_written(
    one, waited_s: float, options: dict
) -> None:
    clock, device = failing(one, **options)
    assert device.is_open
    wait(clock, waited_s)
    device.close()
    assert device.emulator.mode == 0
    assert n_memory_writes(device.emulator) == 0


@pytest.mark.parametrize(
    ("faults", "said"),
    [
        ((), "the bus cannot be left"),
        ((fault("unplugged", 0.4),), "SWITCH ITS SUPPLY OFF"),  # more important
    ],
)
def test_an_adapter_that_does_not_let_go_is_a_fault_of_the_bus(faults, said) -> None:
    # As one on a serial port does that has been pulled out
    clock, device = failing(*faults)
    bus = device._link._bus
    shut_down = bus.shutdown

    def stuck() -> None:
        shut_down()
        raise can.CanOperationError("no such port")

    bus.shutdown = stuck
    wait(clock, 0.5)
    with pytest.raises(DeviceError, match=said):
        device.close()
    bus.shutdown = shut_down
