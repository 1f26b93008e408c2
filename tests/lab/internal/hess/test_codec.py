"""The bus: bytes by hand and both ways for every value, python-can at the other end."""

import math
import time

import can
import numpy as np
import pytest
from can.interfaces.virtual import VirtualBus
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import BusError, FrameError
from masrel.lab.elbow import STANDARD_MODELS, ConstantSpeed, trace
from masrel.lab.hess import RealClock
from masrel.lab.hess.puck import Frame, Link, PuckOptions
from masrel.lab.hess.puck._bus import (
    POSITION_GROUP,
    PROPERTY_GROUP,
    decode_position,
    decode_request,
    decode_value,
    encode_get,
    encode_position,
    encode_value,
    from_node,
    reply_identifiers,
)
from masrel.lab.hess.puck._puck_options import Transmission
from tests.lab.hess.puck.rig import PUCK, open_link
from tests.lab.hess.rig import END, MODELS, START, controls

int32 = st.integers(-(2**31), 2**31 - 1)
numbers = st.integers(0, 127)
torques = st.integers(-8192, 8191)


# Bytes by hand. G FFFFF TTTTT are identifiers; P is 48, T 42, MODE 8, CTS 68.
@pytest.mark.parametrize(
    ("made", "expected"),
    [
        (from_node(1, PROPERTY_GROUP), 0b1_00001_00110),
        (from_node(1, POSITION_GROUP), 0b1_00001_00011),
        (reply_identifiers(1), (0x423, 0x426)),
        (encode_get(48), b"\x30"),
        # 0x80 + 42 = 0xaa; 1000 = 0x03e8; -1000 = 2**32 - 1000 = 0xfffffc18
        (encode_value(42, 1000), bytes.fromhex("aa00e8030000")),
        (encode_value(42, -1000), bytes.fromhex("aa0018fcffff")),
        (encode_value(8, 2), bytes.fromhex("880002000000")),
        # A reply of four bytes has its sign in the last
        (decode_value(bytes.fromhex("85000200")), (5, 2)),
        (decode_value(bytes.fromhex("aa0018fc")), (42, -1000)),
        # CTS of an optical encoder, 40960 = 0xa000: negative unless it comes in six
        (decode_value(bytes.fromhex("c400 00a0")), (68, -24576)),
        (decode_value(bytes.fromhex("c400 00a0 0000")), (68, 40960)),
        # Positions: highest byte first, 22 bits, whatever the two above; a second one
        (decode_position(bytes.fromhex("000102")), 258),
        (decode_position(bytes.fromhex("1fffff")), 2**21 - 1),
        (decode_position(bytes.fromhex("200000")), -(2**21)),
        (decode_position(bytes.fromhex("3fffff")), -1),
        (decode_position(bytes.fromhex("000001 3ffffe")), 1),
        *(
            (decode_position(bytes([top | 0x12, 0x34]) + b"\x56"), 0x123456)
            for top in (0x00, 0x40, 0x80, 0xC0)
        ),
    ],
)
def test_bytes_and_identifiers_are_those_of_the_manual(made, expected) -> None:
    assert made == expected


@given(numbers, int32)
def test_requests_and_values_come_back(number: int, value: int) -> None:
    assert decode_request(encode_get(number)) == (number, None)
    assert decode_request(encode_value(number, value)) == (number, value)
    assert decode_value(encode_value(number, value)) == (number, value)


def test_every_reply_of_four_bytes_comes_back() -> None:
    for value in range(-(2**15), 2**15):
        short = b"\xb0\x00" + value.to_bytes(2, "little", signed=True)
        assert decode_value(short) == (48, value)


@pytest.mark.parametrize("step", [61, pytest.param(1, marks=pytest.mark.slow)])
def test_every_position_comes_back(step: int) -> None:
    ends = (range(-(2**21), -(2**21) + 300), range(2**21 - 300, 2**21))
    for counts in (range(-(2**21), 2**21, step), range(-300, 300), *ends):
        assert all(decode_position(encode_position(count)) == count for count in counts)


@given(int32, st.sampled_from([0x00, 0x40, 0x80, 0xC0]), st.binary(max_size=3))
def test_a_position_is_the_count_up_to_whole_wraps(
    counts: int, above: int, second: bytes
) -> None:
    first, *others = encode_position(counts)
    got = decode_position(bytes((first | above, *others)) + second.rjust(3)[:3])
    assert -(2**21) <= got < 2**21
    assert (got - counts) % 2**22 == 0


# What is no frame


@given(st.binary(max_size=12))
def test_decoding_raises_its_own_error_or_none(data: bytes) -> None:
    # Any other exception fails the test; what decodes has one of the sizes below.
    sizes = {
        decode_request: (1, 4, 6),
        decode_value: (4, 6),
        decode_position: (3, 6),
    }
    for decode, right in sizes.items():
        try:
            decode(data)
        except FrameError:
            continue
        assert len(data) in right


@pytest.mark.parametrize(
    ("call", "argument", "words"),
    [
        (encode_get, 128, "property: needs 0 to 127, got 128"),
        (encode_get, -1, "property: needs 0 to 127, got -1"),
        (lambda value: encode_value(42, value), 2**31, "needs 32 bits with sign"),
        (decode_request, b"\xaa", "request: needs 4 or 6 bytes"),
        (decode_request, b"\x2a\x00\x01\x00", "got 2a 00 01 00"),
        (decode_request, b"", "got none"),
        (decode_value, b"\x85\x00\x02", "reply: needs 4 or 6 bytes"),
        (decode_value, b"\x05\x00\x02\x00", "the first from 80 up"),
        *(
            (decode_position, bytes(n), "position: needs 3 or 6 bytes")
            for n in (0, 2, 4, 5, 7)
        ),
    ],
)
def test_what_is_no_frame_or_fits_in_none_is_refused(call, argument, words) -> None:
    with pytest.raises(FrameError, match=words):
        call(argument)


# Counts and units at the elbow

BACKWARDS = Transmission(counts_per_turn=4096, units_per_nm=2700, direction=-1)
both = st.sampled_from([PUCK, BACKWARDS])


def test_one_count_and_one_unit_by_hand_and_rounding_without_bias() -> None:
    # 360 / (4096 * 18.8) = 360 / 77004.8 = 0.0046750...
    assert math.degrees(PUCK.angle_step) == pytest.approx(360 / 77004.8, rel=1e-15)
    assert PUCK.torque_step == pytest.approx(0.006962962962962963, rel=1e-15)
    # the motor's continuous 1.490 N·m are 1.490 * 2700 = 4023 units and 28.01 N·m
    assert PUCK.torque(-4023) == pytest.approx(28.012, abs=1e-9)
    # Over whole steps, errors to the nearest sum to 0; rounding down would leave half
    # a unit, 0.0035 N·m.
    sent = [number * PUCK.torque_step / 16 for number in range(-1600, 1601)]
    errors = [PUCK.torque(PUCK.units(torque)) - torque for torque in sent]
    assert abs(sum(errors) / len(errors)) < 1e-5


def test_resisting_extension_pulls_towards_where_counts_shrink() -> None:
    for puck in (PUCK, BACKWARDS):
        extension = puck.counts(1.0) - puck.counts(0.5)
        assert puck.units(3.0) * extension < 0


@given(both, int32, torques, st.floats(-30.0, 30.0), st.floats(0.0, math.pi))
def test_counts_and_units_come_back_and_values_to_half_a_step(
    puck: Transmission, counts: int, units: int, torque: float, angle: float
) -> None:
    assert puck.counts(puck.angle(counts)) == counts
    assert puck.units(puck.torque(units)) == units
    off = abs(puck.torque(puck.units(torque)) - torque)
    assert off <= puck.torque_step * (0.5 + 1e-12)
    off = abs(puck.angle(puck.counts(angle)) - angle)
    assert off <= puck.angle_step * (0.5 + 1e-9)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("speed_deg_s", [15.0, 72.0, 120.0])
def test_the_codec_changes_the_law_by_its_quantum(
    model: str, speed_deg_s: float
) -> None:
    # The controller is fed the motion as the puck counts it, with the motion's own
    # speed; what it asks for passes the bus. Against elbow.trace, which sees neither.
    speed = math.radians(speed_deg_s)
    motion = ConstantSpeed(start=START, end=END, speed=speed)
    exact = trace(STANDARD_MODELS[model], motion, rate_hz=1000)
    controller = controls(model, compensation=0.0)
    sent = []
    for time_s, angle, speed_now in zip(
        exact.time.tolist(), exact.angle.tolist(), exact.velocity.tolist(), strict=True
    ):
        counts = decode_position(encode_position(PUCK.counts(angle)))
        torque = controller.step(time_s, PUCK.angle(counts), speed_now)
        _, units = decode_request(encode_value(42, PUCK.units(torque)))
        sent.append((PUCK.torque(units), controller.phase))
    torque, phases = np.array(sent).T
    same = phases == exact.phase
    assert np.sum(~same) <= 2  # a catch may begin or end one sample aside
    # Half a unit of torque; and half a count of angle, which (5) feels three times, as
    # the end of pre-catch by k, the start of post-catch and the angle now by k_post:
    # 0.0035 N·m and 0.00004 rad * (3.15 + 2 * 5.8) N·m/rad = 0.0006 N·m
    springs = 3.15 + 2.0 * 5.8
    quantum = 0.5 * PUCK.torque_step + 0.5 * PUCK.angle_step * springs
    # Where the catch or its end falls one sample later, what follows starts there.
    aside = speed * 0.001 * springs if not same.all() else 0.0
    assert np.max(np.abs(torque - exact.torque)[same]) <= quantum * (1 + 1e-9) + aside


# The bus, against python-can itself at the other end


@pytest.fixture
def ends(request: pytest.FixtureRequest):
    channel = request.node.name
    link = open_link("virtual", channel, clock=RealClock())
    other = can.Bus(interface="virtual", channel=channel, ignore_config=True)
    yield link, other
    link.close()
    other.shutdown()


def test_frames_go_out_and_come_in_as_they_are_and_in_their_order(ends) -> None:
    link, other = ends
    link.send(Frame(0x401, b"\xaa\x00\x01"))
    message = other.recv(0.0)
    assert (message.arbitration_id, bytes(message.data)) == (0x401, b"\xaa\x00\x01")
    assert not message.is_extended_id
    assert not message.is_error_frame
    for number in range(3):
        other.send(can.Message(arbitration_id=number, is_extended_id=False))
    # An error says its class; frames that no puck sends are not of puck 1
    other.send(
        can.Message(arbitration_id=0x40, is_error_frame=True, is_extended_id=False)
    )
    for kind in ("is_extended_id", "is_remote_frame"):
        flags = {"is_extended_id": False, kind: True}
        other.send(can.Message(arbitration_id=0x423, **flags))
    assert [link.receive(0) for _ in range(7)] == [
        *(Frame(number, b"") for number in range(3)),
        Frame(0x40, b"", is_error=True),
        Frame(0, b""),
        Frame(0, b""),
        None,
    ]
    begun = time.monotonic_ns()  # waiting ends at the deadline
    assert link.receive(begun + 20_000_000) is None
    assert time.monotonic_ns() - begun >= 19_000_000


def test_a_closed_bus_is_said_to_be(ends) -> None:
    link, _ = ends
    link.close()
    link.close()  # twice does nothing more
    with pytest.raises(BusError, match="the bus takes no frame") as caught:
        link.send(Frame(1, b""))
    assert caught.value.kind == "bus"
    with pytest.raises(BusError, match="the bus cannot be read"):
        link.receive(0)


@pytest.mark.parametrize(
    ("before", "said"),
    [(None, "the bus cannot be left"), ("still under torque", "still under torque")],
)
def test_a_bus_that_cannot_be_left_hides_no_error_before(before, said: str) -> None:
    class Stuck(VirtualBus):
        def shutdown(self) -> None:
            super().shutdown()
            raise can.CanOperationError("no such port")

    def leave() -> None:
        with Link(Stuck(channel="stuck"), RealClock(), PuckOptions()):
            if before is not None:
                raise BusError(before)

    with pytest.raises(BusError, match=said):
        leave()


@pytest.mark.parametrize("interface", ["socketcan", "pcan"])
def test_the_kernel_is_asked_for_the_answers_of_one_puck_alone(
    interface: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: dict = {}
    real = can.Bus

    def opened(**settings):
        asked.update(settings)
        return real(interface="virtual", channel="filters", ignore_config=True)

    monkeypatch.setattr(can, "Bus", opened)
    accepted = reply_identifiers(1)
    open_link(interface, "can0", clock=RealClock(), accepted=accepted).close()
    filters = [
        {"can_id": identifier, "can_mask": 0x7FF, "extended": False}
        for identifier in (0x423, 0x426)
    ]
    assert asked == {
        "interface": interface,
        "channel": "can0",
        "bitrate": 1_000_000,
        # in another adapter python-can would filter error frames out with the rest
        "can_filters": filters if interface == "socketcan" else None,
        "ignore_config": True,
    }
