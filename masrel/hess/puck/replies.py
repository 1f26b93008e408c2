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
    """What a puck answers when it is asked for a property.

    Attributes
    ----------
    property_id : int
        Number of the property.
    value : int
        Its value, signed.
    """

    property_id: int
    value: int


def encode_reply(property_id: int, value: int, *, size: int = 6) -> bytes:
    """Return the data with which a puck answers.

    Parameters
    ----------
    property_id : int
        Number of the property, 0 to 127.
    value : int
        Its value.
    size : {6, 4}, optional
        Bytes of the frame: a value of 32 or of 16 bits.

    Returns
    -------
    bytes
        Number, zero, value with its lowest byte first.

    Raises
    ------
    FrameError
        If there is no such number or size, or the value does not fit.

    Examples
    --------
    >>> encode_reply(5, 2, size=4).hex(" ")
    '85 00 02 00'
    """
    if size not in (4, 6):
        raise FrameError(f"reply: needs 4 or 6 bytes, got {size}")
    head = bytes((SET_FLAG | checked_property(property_id), 0))
    return head + little_endian(value, size - 2)


def decode_reply(data: bytes) -> PropertyValue:
    """Read a puck's answer.

    Parameters
    ----------
    data : bytes
        Data of a frame to the group of ordinary replies.

    Returns
    -------
    PropertyValue
        Property and value. The second byte carries nothing and is not looked at.

    Raises
    ------
    FrameError
        If it is not four or six bytes of which the first is 80 or above.

    Examples
    --------
    >>> decode_reply(bytes.fromhex("8500ffff"))
    PropertyValue(property_id=5, value=-1)
    """
    if len(data) not in (4, 6) or not data[0] & SET_FLAG:
        raise FrameError(
            "reply: needs 4 or 6 bytes, the first from 80 up, "
            f"got {data.hex(' ') or 'none'}"
        )
    value = int.from_bytes(data[2:], "little", signed=True)
    return PropertyValue(data[0] & PROPERTY_MASK, value)
