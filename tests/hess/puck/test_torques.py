"""Packed torques against bytes worked out by hand, and both ways for every value."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import FrameError
from masrel.hess.puck.torques import (
    HIGHEST_TORQUE,
    LOWEST_TORQUE,
    decode_torques,
    encode_torques,
)

torques = st.integers(LOWEST_TORQUE, HIGHEST_TORQUE)


def test_packed_torques_are_four_times_14_bits() -> None:
    # 5 = 00000000000101, -5 = 11111111111011, 8191 = 01..1, -8192 = 10..0
    bits = "00000000000101" + "11111111111011" + "0" + "1" * 13 + "1" + "0" * 13
    data = b"\xaa" + int(bits, 2).to_bytes(7, "big")
    assert encode_torques(5, -5, 8191, -8192) == data
    assert decode_torques(data) == (5, -5, 8191, -8192)


def test_every_packed_torque_comes_back_from_every_place() -> None:
    for torque in range(LOWEST_TORQUE, HIGHEST_TORQUE + 1):
        sent = (torque, -1 - torque, torque ^ 1, 0)
        assert decode_torques(encode_torques(*sent)) == sent


@given(torques, torques, torques, torques)
def test_packed_torques_come_back(a: int, b: int, c: int, d: int) -> None:
    assert decode_torques(encode_torques(a, b, c, d)) == (a, b, c, d)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: encode_torques(0, 8192, 0, 0), "torque: needs -8192 to 8191"),
        (lambda: encode_torques(0, 0, 0, -8193), "torque: needs -8192 to 8191"),
        (lambda: decode_torques(b"\xaa" + bytes(6)), "torques: need 8 bytes"),
        (lambda: decode_torques(b"\x2a" + bytes(7)), "torques: need 8 bytes"),
        (lambda: encode_torques(0, 0, 0, 0, property_id=128), "needs 0 to 127"),
    ],
)
def test_what_is_no_such_frame_or_fits_in_none_is_refused(call, words: str) -> None:
    with pytest.raises(FrameError, match=words):
        call()
