"""The frames of a moteus controller: registers to the bytes of a CAN-FD frame and back.

Source of the frames: the maker's documentation (mjbots/moteus, docs/protocol/can.md and
registers.md); those of streams, with which its settings are read, as its own Python
client sends them.
"""

import math
import struct
from collections.abc import Iterable, Iterator
from typing import Literal, NamedTuple

from masrel.errors import FrameError

INT8, INT16, INT32, FLOAT = range(4)  # of what type the values of a subframe are
_FORMATS = ("b", "h", "i", "f")  # of `struct`
_MOST_NEGATIVE = (-(2**7), -(2**15), -(2**31))  # which integers mean nan

_WRITE, _READ, _ANSWER, _ERRORS, _STREAMS, _PADDING = (
    *(0x00, 0x10, 0x20, 0x30, 0x40),
    0x50,
)
_ACTS: dict[int, Literal["write", "answer"]] = {_WRITE: "write", _ANSWER: "answer"}
_REFUSED: tuple[Literal["write", "read"], ...] = ("write", "read")
_SAID: tuple[Literal["says", "is told"], ...] = ("is told", "says")

_LENGTHS = (*range(9), 12, 16, 20, 24, 32, 48, 64)  # bytes that a CAN-FD frame may have
_MOST_BYTES_OF_A_NUMBER = 5

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


class Values(NamedTuple):
    """Registers that are written, or that an answer reports."""

    act: Literal["write", "answer"]
    kind: int  # INT8 to FLOAT
    first: int  # register; the others follow it
    values: tuple[float, ...]  # as on the bus: `value_of` scales them


class Read(NamedTuple):
    """Registers that are asked for."""

    kind: int  # as which the answer is to have them
    first: int
    n: int


class Refusal(NamedTuple):
    """A register that could not be written or read."""

    act: Literal["write", "read"]
    register: int
    number: int  # of the error


class Stream(NamedTuple):
    """Text of the console, to the controller or from it."""

    act: Literal["is told", "says"]
    data: bytes


class Poll(NamedTuple):
    """A request for text of the console."""

    most: int  # bytes of the answer


Subframe = Values | Read | Refusal | Stream | Poll

_CONSOLE = 1  # the stream's channel


def value_of(register: int, kind: int, raw: float) -> float:
    """Return what a register's number on the bus stands for, in SI but for turns."""
    if kind == FLOAT:
        return raw
    if raw == _MOST_NEGATIVE[kind]:
        return math.nan
    return raw * _SCALES[register][kind] if register in _SCALES else raw


def raw_of(register: int, kind: int, value: float) -> float:
    """Return a register's number on the bus, clipped to what the type can hold."""
    if kind == FLOAT:
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
    match subframe:
        case Values(act, kind, first, values):
            begin = _WRITE if act == "write" else _ANSWER
            numbers = struct.pack(f"<{len(values)}{_FORMATS[kind]}", *values)
            return _head(begin, kind, len(values), first) + numbers
        case Read(kind, first, n):
            return _head(_READ, kind, n, first)
        case Refusal(act, register, number):
            begin = _ERRORS + _REFUSED.index(act)
            return bytes((begin,)) + _varuint(register) + _varuint(number)
        case Stream(act, data):
            begin = _STREAMS + _SAID.index(act)
            return bytes((begin, _CONSOLE)) + _varuint(len(data)) + data
        case Poll(most):
            return bytes((_STREAMS + 2, _CONSOLE)) + _varuint(most)


def _head(begin: int, kind: int, n: int, first: int) -> bytes:
    # A number of registers up to three is in the first byte
    begin += 4 * kind
    if 0 < n <= 3:
        return bytes((begin + n,)) + _varuint(first)
    return bytes((begin,)) + _varuint(n) + _varuint(first)


def _varuint(value: int) -> bytes:
    # Seven bits a byte, lowest first; the eighth says that another follows
    if not 0 <= value < 2**32:
        raise FrameError(f"moteus: needs a number of 32 bits, got {value}")
    made = bytearray()
    while value > 0x7F:
        made.append(0x80 | value & 0x7F)
        value >>= 7
    made.append(value)
    return bytes(made)


def decode(data: bytes) -> tuple[Subframe, ...]:
    """Return the subframes of a frame, without padding."""
    return tuple(_Reader(data).subframes())


class _Reader:
    """The bytes of a frame, taken from its beginning."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._place = 0

    def subframes(self) -> Iterator[Subframe]:
        while self._place < len(self._data):
            (begin,) = self._bytes(1)
            if begin != _PADDING:
                yield self._subframe(begin)

    def _subframe(self, begin: int) -> Subframe:
        if begin < _ERRORS:
            return self._registers(begin & 0x30, begin >> 2 & 3, begin & 3)
        if begin in (_ERRORS, _ERRORS + 1):
            act = _REFUSED[begin - _ERRORS]
            return Refusal(act, self._varuint(), self._varuint())
        if not _STREAMS <= begin <= _STREAMS + 2 or self._varuint() != _CONSOLE:
            raise self._error(f"a subframe {begin:#04x}")
        size = self._varuint()
        if begin == _STREAMS + 2:
            return Poll(size)
        return Stream(_SAID[begin - _STREAMS], self._bytes(size))

    def _registers(self, act: int, kind: int, n: int) -> Subframe:
        n = n or self._varuint()
        first = self._varuint()
        if act == _READ:
            return Read(kind, first, n)
        layout = f"<{n}{_FORMATS[kind]}"
        if n > len(self._data):  # before `struct` is asked for its size
            raise self._error(f"{n} registers")
        values = struct.unpack(layout, self._bytes(struct.calcsize(layout)))
        return Values(_ACTS[act], kind, first, values)

    def _varuint(self) -> int:
        value = 0
        for place in range(_MOST_BYTES_OF_A_NUMBER):
            (byte,) = self._bytes(1)
            value |= (byte & 0x7F) << 7 * place
            if byte <= 0x7F:
                return value
        raise self._error("a number without an end")

    def _bytes(self, n: int) -> bytes:
        begin, self._place = self._place, self._place + n
        if self._place > len(self._data):
            raise self._error("one that ends in the middle of a subframe")
        return self._data[begin : self._place]

    def _error(self, got: str) -> FrameError:
        return FrameError(
            f"moteus: needs a frame of known subframes, got {got} "
            f"({self._data.hex() or 'empty'})"
        )
