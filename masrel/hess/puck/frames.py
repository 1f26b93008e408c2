"""The Puck's CAN frames: bytes to values and back, as pure functions.

Source: Barrett WAM Arm User's Manual D1001 AH.00, pp. 46-48. What the pages leave
open is decided here as the two public drivers of the arm do it, and so that a decoder
takes whatever either of them takes.
"""

from typing import NamedTuple

from masrel.errors import FrameError

__all__ = [
    "HIGHEST_TORQUE",
    "LOWEST_TORQUE",
    "Position",
    "PropertyValue",
    "Request",
    "decode_position",
    "decode_reply",
    "decode_request",
    "decode_torques",
    "encode_get",
    "encode_position",
    "encode_reply",
    "encode_set",
    "encode_torques",
]

LOWEST_TORQUE, HIGHEST_TORQUE = -8192, 8191  # 14 bits of a packed torque

_SET_FLAG = 0x80
_PROPERTY_MASK = 0x7F
_POSITION_MASK = 0x3FFFFF  # 22 bits
_POSITION_SIGN = 0x200000
_TORQUE_MASK = 0x3FFF
_TORQUE_SIGN = 0x2000
_N_PACKED = 4


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


class Position(NamedTuple):
    """What a puck answers when it is asked for its position.

    Attributes
    ----------
    counts : int
        Lowest 22 bits of the encoder's count, signed: it wraps.
    secondary : int or None
        The same of a second encoder; None without one.
    """

    counts: int
    secondary: int | None


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
    return bytes((_checked_property(property_id),))


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
    head = bytes((_SET_FLAG | _checked_property(property_id), 0))
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
    head = bytes((_SET_FLAG | _checked_property(property_id), 0))
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


def encode_position(
    counts: int, secondary: int | None = None, *, flagged: bool = False
) -> bytes:
    """Return the data with which a puck answers a request for its position.

    Parameters
    ----------
    counts : int
        The encoder's count; its lowest 22 bits are sent.
    secondary : int or None, optional
        The same of a second encoder.
    flagged : bool, optional
        Whether bit 7 of the first byte is set: one public driver demands it, the
        manual's example has it clear.

    Returns
    -------
    bytes
        Three or six bytes, highest first.

    Examples
    --------
    >>> encode_position(-1).hex(" "), encode_position(-1, flagged=True).hex(" ")
    ('3f ff ff', 'bf ff ff')
    """
    flag = _SET_FLAG << 16 if flagged else 0
    data = (flag | counts & _POSITION_MASK).to_bytes(3, "big")
    if secondary is None:
        return data
    return data + (secondary & _POSITION_MASK).to_bytes(3, "big")


def decode_position(data: bytes) -> Position:
    """Read a puck's position.

    Parameters
    ----------
    data : bytes
        Data of a frame to the group of positions.

    Returns
    -------
    Position
        Count, and that of a second encoder if it came. The two bits above the count
        are not looked at: no two sources agree on them.

    Raises
    ------
    FrameError
        If it is not three or six bytes.

    Examples
    --------
    >>> decode_position(bytes.fromhex("bfffff"))
    Position(counts=-1, secondary=None)
    """
    if len(data) not in (3, 6):
        raise FrameError(f"position: needs 3 or 6 bytes, got {data.hex(' ') or 'none'}")
    secondary = _signed_position(data[3:]) if len(data) == 6 else None
    return Position(_signed_position(data[:3]), secondary)


def encode_torques(
    first: int, second: int, third: int, fourth: int, *, property_id: int = 42
) -> bytes:
    """Return the data that set the torques of four pucks at once.

    The driver does not use it: on a bus with other pucks the frame sets the torque
    of each of them, and which of the four a puck obeys hangs on its PIDX and groups.

    Parameters
    ----------
    first, second, third, fourth : int
        Torques, current units; -8192 to 8191.
    property_id : int, optional
        Number of the property T.

    Returns
    -------
    bytes
        Eight bytes: 80 + the number, then four times 14 bits, highest first.

    Raises
    ------
    FrameError
        If one does not fit, or there is no such number.

    Examples
    --------
    >>> encode_torques(1, -1, 0, 0).hex(" ")
    'aa 00 07 ff f0 00 00 00'
    """
    packed = 0
    for torque in (first, second, third, fourth):
        if not LOWEST_TORQUE <= torque <= HIGHEST_TORQUE:
            raise FrameError(
                f"torque: needs {LOWEST_TORQUE} to {HIGHEST_TORQUE}, got {torque}"
            )
        packed = packed << 14 | torque & _TORQUE_MASK
    head = bytes((_SET_FLAG | _checked_property(property_id),))
    return head + packed.to_bytes(7, "big")


def decode_torques(data: bytes) -> tuple[int, ...]:
    """Read the torques of four pucks.

    Parameters
    ----------
    data : bytes
        Data of a frame to the group of packed torques.

    Returns
    -------
    tuple of int
        Four torques, current units.

    Raises
    ------
    FrameError
        If it is not eight bytes of which the first is 80 or above.

    Examples
    --------
    >>> decode_torques(bytes.fromhex("aa0007fff0000000"))
    (1, -1, 0, 0)
    """
    if len(data) != 8 or not data[0] & _SET_FLAG:
        raise FrameError(
            "torques: need 8 bytes, the first from 80 up, "
            f"got {data.hex(' ') or 'none'}"
        )
    packed = int.from_bytes(data[1:], "big")
    fields = (
        packed >> 14 * place & _TORQUE_MASK for place in reversed(range(_N_PACKED))
    )
    return tuple((field ^ _TORQUE_SIGN) - _TORQUE_SIGN for field in fields)


def _checked_property(property_id: int) -> int:
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


def _signed_position(data: bytes) -> int:
    field = int.from_bytes(data, "big") & _POSITION_MASK
    return (field ^ _POSITION_SIGN) - _POSITION_SIGN
