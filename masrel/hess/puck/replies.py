"""What a Puck answers when it is asked for a property: bytes to values and back.

Source: Barrett WAM Arm User's Manual D1001 AH.00, pp. 46-48.
"""

from typing import NamedTuple

from masrel.errors import FrameError
from masrel.hess.puck.frames import (
    PROPERTY_MASK,
    SET_FLAG,
    checked_property,
    little_endian,
)

__all__ = ["PropertyValue", "decode_reply", "encode_reply"]


class PropertyValue(NamedTuple):
    """What a puck answers when it is asked for a property."""

    property_id: int  # number of the property
    value: int  # its value, signed


def encode_reply(property_id: int, value: int, *, size: int = 6) -> bytes:
    """Return the data with which a puck answers."""
    if size not in (4, 6):
        raise FrameError(f"reply: needs 4 or 6 bytes, got {size}")
    head = bytes((SET_FLAG | checked_property(property_id), 0))
    return head + little_endian(value, size - 2)


def decode_reply(data: bytes) -> PropertyValue:
    """Read a puck's answer."""
    if len(data) not in (4, 6) or not data[0] & SET_FLAG:
        raise FrameError(
            "reply: needs 4 or 6 bytes, the first from 80 up, "
            f"got {data.hex(' ') or 'none'}"
        )
    value = int.from_bytes(data[2:], "little", signed=True)
    return PropertyValue(data[0] & PROPERTY_MASK, value)
