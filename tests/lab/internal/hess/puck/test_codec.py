"""The codec against bytes worked out by hand, and both ways for every value."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import FrameError
from masrel.lab.hess.puck._bus import (
    HOST,
    POSITION_GROUP,
    PROPERTY_GROUP,
    TORQUE_GROUP,
    decode_position,
    decode_request,
    decode_torques,
    decode_value,
    encode_get,
    encode_position,
    encode_value,
    from_node,
    split_identifier,
)
from tests.lab.hess.puck.rig import packed_torques

int32 = st.integers(-(2**31), 2**31 - 1)
numbers = st.integers(0, 127)


# Identifiers


def test_the_identifiers_of_puck_1_are_those_of_the_manual() -> None:
    # G FFFFF TTTTT: 1 00001 00110; 1 00001 00011; 1 00000 00001
    assert from_node(1, PROPERTY_GROUP) == 0b1_00001_00110 == 0x426
    assert from_node(1, POSITION_GROUP) == 0b1_00001_00011 == 0x423
    assert from_node(HOST, TORQUE_GROUP) == 0b1_00000_00001 == 0x401


def test_the_safety_module_broadcasts_on_1344() -> None:
    assert split_identifier(1344) == (10, 0, True)


def test_every_identifier_comes_apart_and_goes_together_again() -> None:
    for identifier in range(0x800):
        sender, receiver, is_group = split_identifier(identifier)
        assert identifier == is_group << 10 | sender << 5 | receiver
        if is_group:
            assert from_node(sender, receiver) == identifier


# Requests and replies


def test_asking_for_a_position_is_one_byte() -> None:
    assert encode_get(48) == b"\x30"  # P is 48


def test_setting_is_number_zero_and_the_value_lowest_byte_first() -> None:
    # T is 42: 0x80 + 42 = 0xaa; 1000 = 0x03e8; -1000 = 2**32 - 1000 = 0xfffffc18
    assert encode_value(42, 1000) == bytes.fromhex("aa00e8030000")
    assert encode_value(42, -1000) == bytes.fromhex("aa0018fcffff")
    assert encode_value(8, 2) == bytes.fromhex("880002000000")  # MODE torque


def test_a_reply_of_four_bytes_has_its_sign_in_the_last() -> None:
    assert decode_value(bytes.fromhex("85000200")) == (5, 2)
    assert decode_value(bytes.fromhex("aa0018fc")) == (42, -1000)
    # CTS of an optical encoder, 40960 = 0xa000: negative unless it comes in six
    assert decode_value(bytes.fromhex("c400 00a0")) == (68, -24576)
    assert decode_value(bytes.fromhex("c400 00a0 0000")) == (68, 40960)


@given(numbers)
def test_a_request_comes_back(number: int) -> None:
    assert decode_request(encode_get(number)) == (number, None)


@given(numbers, int32)
def test_a_setting_comes_back(number: int, value: int) -> None:
    assert decode_request(encode_value(number, value)) == (number, value)


@given(numbers, int32)
def test_a_reply_of_six_bytes_comes_back(number: int, value: int) -> None:
    assert decode_value(encode_value(number, value)) == (number, value)


def test_every_reply_of_four_bytes_comes_back() -> None:
    for value in range(-(2**15), 2**15):
        assert decode_value(encode_value(48, value, size=4)) == (48, value)


# What is no frame


@given(st.binary(max_size=12))
def test_decoding_raises_its_own_error_or_none(data: bytes) -> None:
    # Any other exception fails the test; what decodes has one of the sizes below.
    sizes = {
        decode_request: (1, 4, 6),
        decode_value: (4, 6),
        decode_position: (3, 6),
        decode_torques: (8,),
    }
    for decode, right in sizes.items():
        try:
            decode(data)
        except FrameError:
            continue
        assert len(data) in right


@given(st.binary(max_size=8))
def test_what_is_decoded_is_what_those_bytes_are_the_frame_of(data: bytes) -> None:
    # Nothing is lost but the second byte of a frame with a value, which says nothing
    try:
        number, value = decode_request(data)
    except FrameError:
        flagged = data[:1] >= b"\x80"
        assert len(data) not in ((4, 6) if flagged else (1,))
        return
    if value is None:
        assert encode_get(number) == data
    else:
        short = encode_value(number, value, size=len(data))
        assert (short[0], short[2:]) == (data[0], data[2:])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: encode_get(128), "property: needs 0 to 127, got 128"),
        (lambda: encode_get(-1), "property: needs 0 to 127, got -1"),
        (lambda: encode_value(42, 2**31), "value: needs 32 bits with sign"),
        (lambda: encode_value(42, 2**15, size=4), "value: needs 16 bits with sign"),
        (lambda: decode_request(b"\xaa"), "request: needs 4 or 6 bytes"),
        (lambda: decode_request(b"\x2a\x00\x01\x00"), "got 2a 00 01 00"),
        (lambda: decode_request(b""), "got none"),
        (lambda: decode_value(b"\x85\x00\x02"), "reply: needs 4 or 6 bytes"),
        (lambda: decode_value(b"\x05\x00\x02\x00"), "the first from 80 up"),
    ],
)
def test_what_is_no_frame_or_fits_in_none_is_refused(call, words: str) -> None:
    with pytest.raises(FrameError, match=words):
        call()


# Positions


def test_positions_come_highest_byte_first_in_22_bits() -> None:
    assert decode_position(bytes.fromhex("000102")) == 258
    assert decode_position(bytes.fromhex("1fffff")) == 2**21 - 1
    assert decode_position(bytes.fromhex("200000")) == -(2**21)
    assert decode_position(bytes.fromhex("3fffff")) == -1
    # with a second encoder
    assert decode_position(bytes.fromhex("000001 3ffffe")) == 1


@pytest.mark.parametrize("top_bits", [0x00, 0x40, 0x80, 0xC0])
def test_the_two_bits_above_a_position_change_nothing(top_bits: int) -> None:
    data = bytes([top_bits | 0x12, 0x34, 0x56])
    assert decode_position(data) == 0x123456


def positions_come_back(counts: range) -> bool:
    return all(decode_position(encode_position(count)) == count for count in counts)


def test_positions_come_back() -> None:
    assert positions_come_back(range(-(2**21), 2**21, 61))
    assert positions_come_back(range(-(2**21), -(2**21) + 300))
    assert positions_come_back(range(2**21 - 300, 2**21))
    assert positions_come_back(range(-300, 300))


@pytest.mark.slow
def test_every_position_comes_back() -> None:
    assert positions_come_back(range(-(2**21), 2**21))


@given(int32, int32, st.booleans())
def test_a_position_is_the_count_up_to_whole_wraps(
    counts: int, secondary: int, flagged: bool
) -> None:
    data = encode_position(counts, flagged=flagged)
    got = decode_position(data)
    assert -(2**21) <= got < 2**21
    assert (got - counts) % 2**22 == 0
    assert decode_position(data + encode_position(secondary)) == got


@pytest.mark.parametrize("data", [b"", b"\x00\x01", bytes(4), bytes(5), bytes(7)])
def test_what_is_no_position_is_refused(data: bytes) -> None:
    with pytest.raises(FrameError, match="position: needs 3 or 6 bytes"):
        decode_position(data)


# Packed torques

torques = st.integers(-8192, 8191)


def test_packed_torques_are_four_times_14_bits() -> None:
    # 5 = 00000000000101, -5 = 11111111111011, 8191 = 01..1, -8192 = 10..0
    bits = "00000000000101" + "11111111111011" + "0" + "1" * 13 + "1" + "0" * 13
    data = b"\xaa" + int(bits, 2).to_bytes(7, "big")
    assert packed_torques(5, -5, 8191, -8192) == data
    assert decode_torques(data) == (5, -5, 8191, -8192)


def test_every_packed_torque_comes_back_from_every_place() -> None:
    for torque in range(-8192, 8192):
        sent = (torque, -1 - torque, torque ^ 1, 0)
        assert decode_torques(packed_torques(*sent)) == sent


@given(torques, torques, torques, torques)
def test_packed_torques_come_back(a: int, b: int, c: int, d: int) -> None:
    assert decode_torques(packed_torques(a, b, c, d)) == (a, b, c, d)


@pytest.mark.parametrize("data", [b"\xaa" + bytes(6), b"\x2a" + bytes(7)])
def test_what_is_no_frame_of_packed_torques_is_refused(data: bytes) -> None:
    with pytest.raises(FrameError, match="torques: need 8 bytes"):
        decode_torques(data)
