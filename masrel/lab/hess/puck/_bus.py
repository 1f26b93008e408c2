"""The Puck's frames: bytes to values and back.

Source of the frames: Barrett WAM Arm User's Manual D1001 AH.00, pp. 46-48. What the
pages leave open is decided here as the two public drivers of the arm do it, and so that
a decoder takes whatever either of them takes.
"""

from masrel.errors import FrameError

MAX_TORQUE = 8191
"""Current units: the most that 14 bits with sign can say, as on a bus of four pucks."""


# Identifiers: 11 bits, G FFFFF TTTTT, which are whether the receiver is a group, the
# sender, and the receiver (p. 46). The host is node 0, so that its frames to one puck
# have the puck's number.

SAFETY_NODE = 10  # watches a whole arm; has nothing to say to a driver of one joint
MAX_NODE = 31

POSITION_GROUP = 3  # where pucks answer a request for P
PROPERTY_GROUP = 6  # where they answer any other

SAMPLING_NS = 75_000
"""From a request for P to the encoder's sample, as one of the public drivers has it."""

_GROUP_FLAG = 0x400


def from_node(sender: int, group: int) -> int:
    """Return the identifier of a frame to a group."""
    return _GROUP_FLAG | sender << 5 | group


def reply_identifiers(puck: int) -> tuple[int, int]:
    """Return under which identifiers a puck sends positions, and other properties."""
    return from_node(puck, POSITION_GROUP), from_node(puck, PROPERTY_GROUP)


# Properties: a byte with the property's number, then the value, lowest byte first
# (p. 47). The top bit of the first byte says that a value follows.

_VALUE_FLAG = 0x80
_PROPERTY_MASK = 0x7F


def encode_get(number: int) -> bytes:
    """Return the data that request a property."""
    return bytes((_checked(number),))


def _checked(number: int) -> int:
    if not 0 <= number <= _PROPERTY_MASK:
        raise FrameError(f"property: needs 0 to {_PROPERTY_MASK}, got {number}")
    return number


def encode_value(number: int, value: int) -> bytes:
    """Return the data that set a property, or with which a puck answers."""
    try:
        in_bytes = value.to_bytes(4, "little", signed=True)
    except OverflowError as error:
        raise FrameError(f"value: needs 32 bits with sign, got {value}") from error
    return bytes((_VALUE_FLAG | _checked(number), 0)) + in_bytes


def decode_request(data: bytes) -> tuple[int, int | None]:
    """Return the property that is requested and None, or that is set and its value."""
    if len(data) == 1 and not data[0] & _VALUE_FLAG:
        return data[0], None
    return decode_value(data, "request")


def decode_value(data: bytes, what: str = "reply") -> tuple[int, int]:
    """Return the number of a property, and its value."""
    if len(data) not in (4, 6) or not data[0] & _VALUE_FLAG:
        raise _malformed(f"{what}: needs 4 or 6 bytes, the first from 80 up", data)
    value = int.from_bytes(data[2:], "little", signed=True)
    return data[0] & _PROPERTY_MASK, value


def _malformed(needs: str, data: bytes) -> FrameError:
    return FrameError(f"{needs}, got {data.hex(' ') or 'none'}")


# Positions: 22 bits, highest byte first, unlike all else (p. 48). One public driver
# ignores the two bits above them, the other needs the upper one to be set. Three more
# bytes are the position of a second encoder, which this driver does not use.

_POSITION_MASK = 0x3FFFFF


def encode_position(counts: int) -> bytes:
    """Return the data with which a puck answers a request for its position."""
    return (counts & _POSITION_MASK).to_bytes(3, "big")


def decode_position(data: bytes) -> int:
    """Return the lowest 22 bits of the encoder's count, signed: it wraps."""
    if len(data) not in (3, 6):
        raise _malformed("position: needs 3 or 6 bytes", data)
    value, sign = int.from_bytes(data[:3], "big"), 1 << 21  # two's complement
    return (value & _POSITION_MASK ^ sign) - sign
