"""Positions as a Puck sends them: highest byte first, 22 bits, unlike all else.

Source: Barrett WAM Arm User's Manual D1001 AH.00, p. 48.
"""

from typing import NamedTuple

from masrel.errors import FrameError

__all__ = ["Position", "decode_position", "encode_position"]

_TOP_BIT = 0x800000
_MASK = 0x3FFFFF  # 22 bits
_SIGN = 0x200000


class Position(NamedTuple):
    """What a puck answers when it is asked for its position."""

    counts: int  # lowest 22 bits of the encoder's count, signed: it wraps
    secondary: int | None  # the same of a second encoder; None without one


def encode_position(
    counts: int, secondary: int | None = None, *, flagged: bool = False
) -> bytes:
    """Return the data with which a puck answers a request for its position."""
    flag = _TOP_BIT if flagged else 0
    data = (flag | counts & _MASK).to_bytes(3, "big")
    if secondary is None:
        return data
    return data + (secondary & _MASK).to_bytes(3, "big")


def decode_position(data: bytes) -> Position:
    """Read a puck's position."""
    if len(data) not in (3, 6):
        raise FrameError(f"position: needs 3 or 6 bytes, got {data.hex(' ') or 'none'}")
    secondary = _signed_position(data[3:]) if len(data) == 6 else None
    return Position(_signed_position(data[:3]), secondary)


def _signed_position(data: bytes) -> int:
    field = int.from_bytes(data, "big") & _MASK
    return (field ^ _SIGN) - _SIGN
