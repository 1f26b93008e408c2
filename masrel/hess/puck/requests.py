"""What a host asks or tells a Puck: bytes to values and back.

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

__all__ = ["Request", "decode_request", "encode_get", "encode_set"]


class Request(NamedTuple):
    """What a puck is asked or told."""

    property_id: int  # number of the property
    value: int | None  # what it is set to; None when it is asked for


def encode_get(property_id: int) -> bytes:
    """Return the data that ask for a property."""
    return bytes((checked_property(property_id),))


def encode_set(property_id: int, value: int) -> bytes:
    """Return the data that set a property."""
    head = bytes((SET_FLAG | checked_property(property_id), 0))
    return head + little_endian(value, 4)


def decode_request(data: bytes) -> Request:
    """Read what a host asks or tells a puck."""
    if len(data) == 1 and not data[0] & SET_FLAG:
        return Request(data[0], None)
    if len(data) in (4, 6) and data[0] & SET_FLAG:
        value = int.from_bytes(data[2:], "little", signed=True)
        return Request(data[0] & PROPERTY_MASK, value)
    raise FrameError(
        "request: needs 1 byte below 80 or 4 or 6 bytes from 80 up, "
        f"got {data.hex(' ') or 'none'}"
    )
