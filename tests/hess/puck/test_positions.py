"""Positions against bytes worked out by hand, and both ways for every value."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import FrameError
from masrel.hess.puck.positions import Position, decode_position, encode_position

int32 = st.integers(-(2**31), 2**31 - 1)


def test_positions_come_highest_byte_first_in_22_bits() -> None:
    assert decode_position(bytes.fromhex("000102")) == Position(258, None)
    assert decode_position(bytes.fromhex("1fffff")) == Position(2**21 - 1, None)
    assert decode_position(bytes.fromhex("200000")) == Position(-(2**21), None)
    assert decode_position(bytes.fromhex("3fffff")) == Position(-1, None)
    # with a second encoder
    assert decode_position(bytes.fromhex("000001 3ffffe")) == Position(1, -2)


@pytest.mark.parametrize("top_bits", [0x00, 0x40, 0x80, 0xC0])
def test_the_two_bits_above_a_position_change_nothing(top_bits: int) -> None:
    data = bytes([top_bits | 0x12, 0x34, 0x56])
    assert decode_position(data).counts == 0x123456


def positions_come_back(counts: range) -> bool:
    return all(
        decode_position(encode_position(count)).counts == count for count in counts
    )


def test_positions_come_back() -> None:
    assert positions_come_back(range(-(2**21), 2**21, 61))
    assert positions_come_back(range(-(2**21), -(2**21) + 300))
    assert positions_come_back(range(2**21 - 300, 2**21))
    assert positions_come_back(range(-300, 300))


@pytest.mark.slow
def test_every_position_comes_back() -> None:
    assert positions_come_back(range(-(2**21), 2**21))


@given(int32, st.none() | int32, st.booleans())
def test_a_position_is_the_count_up_to_whole_wraps(
    counts: int, secondary: int | None, flagged: bool
) -> None:
    got = decode_position(encode_position(counts, secondary, flagged=flagged))
    assert -(2**21) <= got.counts < 2**21
    assert (got.counts - counts) % 2**22 == 0
    assert (got.secondary is None) == (secondary is None)
    if secondary is not None and got.secondary is not None:
        assert (got.secondary - secondary) % 2**22 == 0


@pytest.mark.parametrize("data", [b"", b"\x00\x01", bytes(4), bytes(5), bytes(7)])
def test_what_is_no_position_is_refused(data: bytes) -> None:
    with pytest.raises(FrameError, match="position: needs 3 or 6 bytes"):
        decode_position(data)
