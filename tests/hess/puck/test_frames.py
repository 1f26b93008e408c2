"""The codec against bytes worked out by hand, and both ways for every value."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import FrameError
from masrel.hess.puck.positions import decode_position
from masrel.hess.puck.replies import PropertyValue, decode_reply, encode_reply
from masrel.hess.puck.requests import Request, decode_request, encode_get, encode_set
from masrel.hess.puck.torques import decode_torques

int32 = st.integers(-(2**31), 2**31 - 1)
numbers = st.integers(0, 127)


# Bytes by hand


def test_asking_for_a_position_is_one_byte() -> None:
    assert encode_get(48) == b"\x30"  # P is 48


def test_setting_is_number_zero_and_the_value_lowest_byte_first() -> None:
    # T is 42: 0x80 + 42 = 0xaa; 1000 = 0x03e8; -1000 = 2**32 - 1000 = 0xfffffc18
    assert encode_set(42, 1000) == bytes.fromhex("aa00e8030000")
    assert encode_set(42, -1000) == bytes.fromhex("aa0018fcffff")
    assert encode_set(8, 2) == bytes.fromhex("880002000000")  # MODE torque


def test_a_reply_of_four_bytes_has_its_sign_in_the_last() -> None:
    assert decode_reply(bytes.fromhex("85000200")) == PropertyValue(5, 2)
    assert decode_reply(bytes.fromhex("aa0018fc")) == PropertyValue(42, -1000)
    # CTS of an optical encoder, 40960 = 0xa000: negative unless it comes in six
    assert decode_reply(bytes.fromhex("c400 00a0")) == PropertyValue(68, -24576)
    assert decode_reply(bytes.fromhex("c400 00a0 0000")) == PropertyValue(68, 40960)


# Both ways


@given(numbers)
def test_a_request_comes_back(number: int) -> None:
    assert decode_request(encode_get(number)) == Request(number, None)


@given(numbers, int32)
def test_a_setting_comes_back(number: int, value: int) -> None:
    assert decode_request(encode_set(number, value)) == Request(number, value)


@given(numbers, int32)
def test_a_reply_of_six_bytes_comes_back(number: int, value: int) -> None:
    assert decode_reply(encode_reply(number, value)) == PropertyValue(number, value)


def test_every_reply_of_four_bytes_comes_back() -> None:
    for value in range(-(2**15), 2**15):
        assert decode_reply(encode_reply(48, value, size=4)).value == value


# What is no frame


@given(st.binary(max_size=12))
def test_decoding_raises_its_own_error_or_none(data: bytes) -> None:
    # Any other exception fails the test; what decodes has one of the sizes below.
    sizes = {
        decode_request: (1, 4, 6),
        decode_reply: (4, 6),
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
    # Nothing is lost but what is documented not to be looked at
    try:
        number, value = decode_request(data)
    except FrameError:
        return
    if value is None:
        assert encode_get(number) == data
    else:
        short = encode_reply(number, value, size=len(data))
        assert (short[0], short[2:]) == (data[0], data[2:])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: encode_get(128), "property: needs 0 to 127, got 128"),
        (lambda: encode_get(-1), "property: needs 0 to 127, got -1"),
        (lambda: encode_set(42, 2**31), "value: needs 32 bits with sign"),
        (lambda: encode_reply(42, 2**15, size=4), "value: needs 16 bits with sign"),
        (lambda: encode_reply(42, 1, size=5), "reply: needs 4 or 6 bytes, got 5"),
        (lambda: decode_request(b"\xaa"), "request: needs 1 byte below 80"),
        (lambda: decode_request(b"\x2a\x00\x01\x00"), "got 2a 00 01 00"),
        (lambda: decode_request(b""), "got none"),
        (lambda: decode_reply(b"\x85\x00\x02"), "reply: needs 4 or 6 bytes"),
        (lambda: decode_reply(b"\x05\x00\x02\x00"), "the first from 80 up"),
    ],
)
def test_what_is_no_frame_or_fits_in_none_is_refused(call, words: str) -> None:
    with pytest.raises(FrameError, match=words):
        call()
