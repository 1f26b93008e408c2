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
    """What a puck is asked or told.

    Attributes
    ----------
    property_id : int
        Number of the property.
    value : int or None
        What it is set to; None when it is asked for.
    """

    property_id: int
    value: int | None


def encode_get(property_id: int) -> bytes:
    """Return the data that ask for a property.

    Parameters
    ----------
    property_id : int
        Number of the property, 0 to 127.

    Returns
    -------
    bytes
        One byte.

    Raises
    ------
    FrameError
        If there is no such number.

    Examples
    --------
    >>> encode_get(48).hex()
    '30'
    """
    return bytes((checked_property(property_id),))


def encode_set(property_id: int, value: int) -> bytes:
    """Return the data that set a property.

    Parameters
    ----------
    property_id : int
        Number of the property, 0 to 127.
    value : int
        Value, of 32 bits with sign.

    Returns
    -------
    bytes
        Six bytes: number, zero, value with its lowest byte first. A property of 32
        bits takes two numbers, but is set by the first alone.

    Raises
    ------
    FrameError
        If there is no such number or the value does not fit.

    Examples
    --------
    >>> encode_set(42, -2).hex(" ")
    'aa 00 fe ff ff ff'
    """
    head = bytes((SET_FLAG | checked_property(property_id), 0))
    return head + little_endian(value, 4)


def decode_request(data: bytes) -> Request:
    """Read what a host asks or tells a puck.

    Parameters
    ----------
    data : bytes
        Data of the frame.

    Returns
    -------
    Request
        Property, and the value when it is set.

    Raises
    ------
    FrameError
        If it is neither a request (one byte) nor a setting (four or six).

    Examples
    --------
    >>> decode_request(bytes.fromhex("30")), decode_request(bytes.fromhex("aa00feff"))
    (Request(property_id=48, value=None), Request(property_id=42, value=-2))
    """
    if len(data) == 1 and not data[0] & SET_FLAG:
        return Request(data[0], None)
    if len(data) in (4, 6) and data[0] & SET_FLAG:
        value = int.from_bytes(data[2:], "little", signed=True)
        return Request(data[0] & PROPERTY_MASK, value)
    raise FrameError(
        "request: needs 1 byte below 80 or 4 or 6 bytes from 80 up, "
        f"got {data.hex(' ') or 'none'}"
    )
