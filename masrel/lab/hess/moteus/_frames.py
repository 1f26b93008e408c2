"""The frames of a moteus controller: registers to the bytes of a CAN-FD frame and back.

Source of the frames: the maker's documentation (mjbots/moteus, docs/protocol/can.md and
registers.md); those of its console, with which settings are read, as its own Python
client sends them.
"""

import io
import math
import struct
from collections.abc import Iterable
from typing import NamedTuple

from masrel.errors import FrameError

# What a subframe does, its first byte: registers that are written, asked for, or that
# an answer has; one that cannot be written or read; text to the console, text from it,
# and so much text asked for
WRITE, READ, ANSWER = 0x00, 0x10, 0x20
WRITE_ERROR, READ_ERROR = 0x30, 0x31
TO_CONSOLE, FROM_CONSOLE, POLL = 0x40, 0x41, 0x42
_PADDING = 0x50
_NOT_REGISTERS = (WRITE_ERROR, READ_ERROR, TO_CONSOLE, FROM_CONSOLE, POLL)

COUNTER = 0x070  # of milliseconds; the one whose most negative number is a number

INT8, INT16, INT32, FLOAT = range(4)  # of what type the values of registers are
_FORMATS = ("b", "h", "i", "f")  # of `struct`
_MOST_NEGATIVE = (-(2**7), -(2**15), -(2**31))  # which integers mean nan

CONSOLE = 1  # its channel
_LENGTHS = (*range(9), 12, 16, 20, 24, 32, 48, 64)  # bytes that a CAN-FD frame may have

# What one of an integer stands for, as int8, int16 and int32
_POSITION = (1e-2, 1e-4, 1e-5)  # revolutions
_VELOCITY = (0.1, 0.00025, 1e-5)  # revolutions a second
_TORQUE = (0.5, 0.01, 0.001)  # N·m
_SHARE = (1 / 127, 1 / 32767, 1 / 2147483647)
_SCALES = {
    **dict.fromkeys((0x001, 0x020, 0x130, 0x131), _POSITION),
    **dict.fromkeys((0x002, 0x021), _VELOCITY),
    **dict.fromkeys((0x003, 0x022, 0x025), _TORQUE),
    **dict.fromkeys((0x023, 0x024, 0x02B), _SHARE),
    0x00D: (0.5, 0.1, 0.001),  # V
    0x00E: (1.0, 0.1, 0.001),  # deg C
    0x027: (0.01, 0.001, 1e-6),  # s
}


class Subframe(NamedTuple):
    """A part of a frame."""

    act: int  # WRITE to POLL
    kind: int  # INT8 to FLOAT, of registers
    first: int  # register, which others may follow; or the console's channel
    n: int = 1  # registers, number of an error, or bytes of text
    values: tuple[float, ...] = ()  # as on the bus: `value_of` scales them
    text: bytes = b""


def write(kind: int, first: int, *values: float) -> Subframe:
    """Return what writes registers."""
    return Subframe(WRITE, kind, first, len(values), values)


def value_of(register: int, kind: int, raw: float) -> float:
    """Return the value of a register's number on the bus, in SI units except turns."""
    if kind == FLOAT or register == COUNTER:
        return raw
    if raw == _MOST_NEGATIVE[kind]:
        return math.nan
    return raw * _SCALES[register][kind] if register in _SCALES else raw


def raw_of(register: int, kind: int, value: float) -> float:
    """Return a register's number on the bus, clipped to what the type can hold."""
    if kind == FLOAT or register == COUNTER:
        return value
    if math.isnan(value):
        return _MOST_NEGATIVE[kind]
    scale = _SCALES[register][kind] if register in _SCALES else 1.0
    most = -_MOST_NEGATIVE[kind] - 1
    return max(-most, min(most, round(value / scale)))


def encode(subframes: Iterable[Subframe]) -> bytes:
    """Return the bytes of a frame, padded to a length that CAN-FD has."""
    try:
        data = b"".join(map(_encoded, subframes))
    except (struct.error, OverflowError) as error:
        raise FrameError(f"moteus: a number does not fit its type ({error})") from error
    lengths = [length for length in _LENGTHS if length >= len(data)]
    if not lengths:
        raise FrameError(f"moteus: a frame needs at most 64 bytes, got {len(data)}")
    return data.ljust(lengths[0], bytes((_PADDING,)))


def _encoded(subframe: Subframe) -> bytes:
    act, kind, first, n, values, text = subframe
    if act in _NOT_REGISTERS:
        return bytes((act,)) + _varuint(first) + _varuint(n) + text
    act += 4 * kind
    # A number of registers up to three is in the first byte
    head = bytes((act + n,)) if 0 < n <= 3 else bytes((act,)) + _varuint(n)
    numbers = struct.pack(f"<{len(values)}{_FORMATS[kind]}", *values)
    return head + _varuint(first) + numbers


def _varuint(value: int) -> bytes:
    # Seven bits a byte, lowest first; the eighth says that another follows
    if not 0 <= value < 2**32:
        raise FrameError(f"moteus: needs a number of 32 bits, got {value}")
    if value <= 0x7F:
        return bytes((value,))
    return bytes((0x80 | value & 0x7F,)) + _varuint(value >> 7)


def decode(data: bytes) -> tuple[Subframe, ...]:
    """Return the subframes of a frame, without padding."""
    stream, subframes = io.BytesIO(data), []
    while head := stream.read(1):
        if head[0] != _PADDING:
            subframes.append(_decoded(head[0], stream))
    return tuple(subframes)


def _decoded(head: int, stream: io.BytesIO) -> Subframe:
    if head < WRITE_ERROR:
        act, kind, n = head & 0x30, head >> 2 & 3, head & 3 or _read_varuint(stream)
        first, layout = _read_varuint(stream), f"<{n}{_FORMATS[kind]}"
        if act == READ:
            return Subframe(READ, kind, first, n)
        # before `struct` is asked for the size of a number that makes no sense
        data = _read(stream, struct.calcsize(layout) if n <= _LENGTHS[-1] else n)
        return Subframe(act, kind, first, n, struct.unpack(layout, data))
    if head not in _NOT_REGISTERS:
        raise FrameError(f"moteus: needs a known subframe, got {head:#04x}")
    first, n = _read_varuint(stream), _read_varuint(stream)
    text = _read(stream, n) if head in (TO_CONSOLE, FROM_CONSOLE) else b""
    return Subframe(head, 0, first, n, text=text)


def _read_varuint(stream: io.BytesIO) -> int:
    value = 0
    for shift in range(0, 35, 7):
        byte = _read(stream, 1)[0]
        value |= (byte & 0x7F) << shift
        if byte <= 0x7F:
            return value
    raise FrameError("moteus: needs a number of 32 bits, got one without an end")


def _read(stream: io.BytesIO, n: int) -> bytes:
    data = stream.read(n)
    if len(data) < n:
        raise FrameError(
            f"moteus: needs a whole frame, got {stream.getvalue().hex(' ')}, which "
            "ends in the middle of a subframe"
        )
    return data
