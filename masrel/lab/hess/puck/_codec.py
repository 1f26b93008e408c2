"""Frames of the Puck's CAN bus: identifiers and bytes to values, and back.

Source: Barrett WAM Arm User's Manual D1001 AH.00, pp. 46-48. What the pages leave
open is decided here as the two public drivers of the arm do it, and so that a decoder
takes whatever either of them takes.
"""

from typing import NamedTuple

from masrel.errors import FrameError

# Identifiers: 11 bits, G FFFFF TTTTT, which are whether the receiver is a group, the
# sender, and the receiver (p. 46). The host is node 0.

HOST = 0
SAFETY_NODE = 10  # watches a whole arm; has nothing to say to a driver of one joint
MAX_NODE = 31

TORQUE_GROUP = 1  # packed torques for pucks 1-4
POSITION_GROUP = 3  # where pucks answer a request for P
PROPERTY_GROUP = 6  # where they answer any other

_GROUP_FLAG = 0x400
_MAX_IDENTIFIER = 0x7FF


class Address(NamedTuple):
    """What an identifier says."""

    sender: int  # node that sent the frame, 0 to 31
    receiver: int  # node or group it is for, 0 to 31
    is_group: bool  # whether the receiver is a group


def to_puck(puck: int) -> int:
    """Return the identifier of a frame from the host to one puck."""
    _check_node("puck", puck, lowest=1)
    return puck


def to_group(group: int) -> int:
    """Return the identifier of a frame from the host to a group."""
    _check_node("group", group, lowest=0)
    return _GROUP_FLAG | group


def from_puck(puck: int, group: int) -> int:
    """Return the identifier of a frame from a puck to a group."""
    _check_node("puck", puck, lowest=1)
    return to_group(group) | puck << 5


def reply_identifiers(puck: int) -> tuple[int, int]:
    """Return under which identifiers a puck sends positions, and other properties."""
    return from_puck(puck, POSITION_GROUP), from_puck(puck, PROPERTY_GROUP)


def split_identifier(identifier: int) -> Address:
    """Return sender and receiver of an identifier."""
    if not 0 <= identifier <= _MAX_IDENTIFIER:
        raise FrameError(f"identifier: needs 11 bits, got {identifier:#x}")
    return Address(
        sender=identifier >> 5 & MAX_NODE,
        receiver=identifier & MAX_NODE,
        is_group=bool(identifier & _GROUP_FLAG),
    )


def _check_node(what: str, number: int, *, lowest: int) -> None:
    if not lowest <= number <= MAX_NODE:
        raise FrameError(f"{what}: needs {lowest} to {MAX_NODE}, got {number}")


# Properties: a byte with the property's number, then the value, lowest byte first
# (p. 47). The top bit of the first byte says that a value follows.

_VALUE_FLAG = 0x80
_PROPERTY_MASK = 0x7F


class Request(NamedTuple):
    """What the host sends to a puck."""

    property_id: int  # number of the property
    value: int | None  # what it is set to; None when its value is requested


class Reply(NamedTuple):
    """What a puck answers when the host requests a property."""

    property_id: int  # number of the property
    value: int  # its value, signed


def encode_get(property_id: int) -> bytes:
    """Return the data that request a property."""
    return bytes((_checked_property(property_id),))


def encode_set(property_id: int, value: int) -> bytes:
    """Return the data that set a property."""
    return _encode_value(property_id, value, 4)


def decode_request(data: bytes) -> Request:
    """Read what the host sends to a puck."""
    if len(data) == 1 and not data[0] & _VALUE_FLAG:
        return Request(data[0], None)
    if len(data) in (4, 6) and data[0] & _VALUE_FLAG:
        return Request(*_decode_value(data))
    raise FrameError(
        "request: needs 1 byte below 80 or 4 or 6 bytes from 80 up, "
        f"got {data.hex(' ') or 'none'}"
    )


def encode_reply(property_id: int, value: int, *, size: int = 6) -> bytes:
    """Return the data with which a puck answers, 4 or 6 bytes."""
    if size not in (4, 6):
        raise FrameError(f"reply: needs 4 or 6 bytes, got {size}")
    return _encode_value(property_id, value, size - 2)


def decode_reply(data: bytes) -> Reply:
    """Read a puck's answer."""
    if len(data) not in (4, 6) or not data[0] & _VALUE_FLAG:
        raise FrameError(
            "reply: needs 4 or 6 bytes, the first from 80 up, "
            f"got {data.hex(' ') or 'none'}"
        )
    return Reply(*_decode_value(data))


def _encode_value(property_id: int, value: int, n_bytes: int) -> bytes:
    head = bytes((_VALUE_FLAG | _checked_property(property_id), 0))
    try:
        return head + value.to_bytes(n_bytes, "little", signed=True)
    except OverflowError as error:
        raise FrameError(
            f"value: needs {8 * n_bytes} bits with sign, got {value}"
        ) from error


def _decode_value(data: bytes) -> tuple[int, int]:
    # -> number of the property, value
    value = int.from_bytes(data[2:], "little", signed=True)
    return data[0] & _PROPERTY_MASK, value


def _checked_property(property_id: int) -> int:
    if not 0 <= property_id <= _PROPERTY_MASK:
        raise FrameError(f"property: needs 0 to {_PROPERTY_MASK}, got {property_id}")
    return property_id


# Positions: 22 bits, highest byte first, unlike all else (p. 48). One public driver
# ignores the two bits above them, the other needs the upper one to be set.

_POSITION_FLAG = 0x800000
_POSITION_MASK = 0x3FFFFF
_POSITION_SIGN = 0x200000


class Position(NamedTuple):
    """What a puck answers when the host requests its position."""

    counts: int  # lowest 22 bits of the encoder's count, signed: it wraps
    secondary: int | None  # the same of a second encoder; None without one


def encode_position(
    counts: int, secondary: int | None = None, *, flagged: bool = False
) -> bytes:
    """Return the data with which a puck answers a request for its position."""
    flag = _POSITION_FLAG if flagged else 0
    data = (flag | counts & _POSITION_MASK).to_bytes(3, "big")
    if secondary is None:
        return data
    return data + (secondary & _POSITION_MASK).to_bytes(3, "big")


def decode_position(data: bytes) -> Position:
    """Read a puck's position."""
    if len(data) not in (3, 6):
        raise FrameError(f"position: needs 3 or 6 bytes, got {data.hex(' ') or 'none'}")
    secondary = _signed_position(data[3:]) if len(data) == 6 else None
    return Position(_signed_position(data[:3]), secondary)


def _signed_position(data: bytes) -> int:
    field = int.from_bytes(data, "big") & _POSITION_MASK
    return (field ^ _POSITION_SIGN) - _POSITION_SIGN


# Packed torques: four times 14 bits, highest byte first (p. 47). The driver reads but
# never sends them: on a bus with other pucks the frame sets the torque of each of them,
# and which of the four a puck obeys depends on its PIDX and groups.

MAX_TORQUE = 8191  # current units; the most that 14 bits with sign can say

_TORQUE_MASK = 0x3FFF
_TORQUE_SIGN = 0x2000
_N_PACKED = 4


def decode_torques(data: bytes) -> tuple[int, ...]:
    """Read the torques of four pucks."""
    if len(data) != 8 or not data[0] & _VALUE_FLAG:
        raise FrameError(
            "torques: need 8 bytes, the first from 80 up, "
            f"got {data.hex(' ') or 'none'}"
        )
    packed = int.from_bytes(data[1:], "big")
    fields = (packed >> 14 * slot & _TORQUE_MASK for slot in reversed(range(_N_PACKED)))
    return tuple((field ^ _TORQUE_SIGN) - _TORQUE_SIGN for field in fields)
