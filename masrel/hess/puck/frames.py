"""Requests, settings and answers of a Puck: bytes to values and back.

Source: Barrett WAM Arm User's Manual D1001 AH.00, pp. 46-48. What the pages leave
open is decided here as the two public drivers of the arm do it, and so that a decoder
takes whatever either of them takes.
"""

from typing import NamedTuple

from masrel.errors import FrameError

__all__ = [
    "PropertyValue",
    "Request",
    "checked_property",
    "decode_reply",
    "decode_request",
    "encode_get",
    "encode_reply",
    "encode_set",
]

_SET_FLAG = 0x80
_PROPERTY_MASK = 0x7F


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
    head = bytes((_SET_FLAG | checked_property(property_id), 0))
    return head + _little(value, 4)


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
    if len(data) == 1 and not data[0] & _SET_FLAG:
        return Request(data[0], None)
    if len(data) in (4, 6) and data[0] & _SET_FLAG:
        value = int.from_bytes(data[2:], "little", signed=True)
        return Request(data[0] & _PROPERTY_MASK, value)
    raise FrameError(
        "request: needs 1 byte below 80 or 4 or 6 bytes from 80 up, "
        f"got {data.hex(' ') or 'none'}"
    )


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
    head = bytes((_SET_FLAG | checked_property(property_id), 0))
    return head + _little(value, size - 2)


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
    if len(data) not in (4, 6) or not data[0] & _SET_FLAG:
        raise FrameError(
            "reply: needs 4 or 6 bytes, the first from 80 up, "
            f"got {data.hex(' ') or 'none'}"
        )
    value = int.from_bytes(data[2:], "little", signed=True)
    return PropertyValue(data[0] & _PROPERTY_MASK, value)


def checked_property(property_id: int) -> int:
    """Return the number of a property if there can be one.

    Parameters
    ----------
    property_id : int
        Number of the property.

    Returns
    -------
    int
        The same.

    Raises
    ------
    FrameError
        If it is not from 0 to 127.
    """
    if not 0 <= property_id <= _PROPERTY_MASK:
        raise FrameError(f"property: needs 0 to {_PROPERTY_MASK}, got {property_id}")
    return property_id


def _little(value: int, n_bytes: int) -> bytes:
    try:
        return value.to_bytes(n_bytes, "little", signed=True)
    except OverflowError as error:
        raise FrameError(
            f"value: needs {8 * n_bytes} bits with sign, got {value}"
        ) from error
