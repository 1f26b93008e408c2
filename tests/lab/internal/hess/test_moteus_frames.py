"""Frames of a moteus: those of the maker's client bit for bit, and both ways for all.

The commands were made by version 1.1.1 of the maker's Python client, and the answers
packed by hand and read back by it.
"""

import math
import struct
from math import nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import FrameError
from masrel.lab.hess.moteus._frames import (
    ANSWER,
    CONSOLE,
    FLOAT,
    FROM_CONSOLE,
    INT8,
    INT16,
    INT32,
    POLL,
    READ,
    READ_ERROR,
    TO_CONSOLE,
    WRITE,
    WRITE_ERROR,
    Subframe,
    decode,
    encode,
    raw_of,
    value_of,
    write,
)


def read(kind: int, first: int, n: int = 1) -> Subframe:
    return Subframe(READ, kind, first, n)


def answered(kind: int, first: int, *values: float) -> Subframe:
    return Subframe(ANSWER, kind, first, len(values), values)


def text(act: int, said: bytes) -> Subframe:
    return Subframe(act, 0, CONSOLE, len(said), text=said)


QUERY = (read(INT8, 0), read(FLOAT, 1, 3), read(INT8, 0x00D, 3))


def torque(torque_nm: float, most_nm: float, watchdog_s: float) -> tuple:
    return (
        write(INT8, 0, 10),
        write(FLOAT, 0x020, nan, 0.0, torque_nm, 0.0, 0.0, most_nm),
        write(FLOAT, 0x027, watchdog_s),
        write(FLOAT, 0x02B, 0.0),
        *QUERY,
    )


def answer(mode: int, state: tuple, volts: float, celsius: int, code: int) -> tuple:
    return (
        answered(INT8, 0, mode),
        answered(FLOAT, 1, *state),
        answered(INT8, 0x00D, round(volts / 0.5), celsius, code),
    )


ORACLES = [
    (
        torque(0.8, 2.0, 0.02),
        "01000a0c06200000c07f00000000cdcc4c3f000000000000000000000040"
        "0d270ad7a33c0d2b0000000011001f01130d",
    ),
    (
        torque(-3.25, 12.0, 0.02),
        "01000a0c06200000c07f00000000000050c0000000000000000000004041"
        "0d270ad7a33c0d2b0000000011001f01130d",
    ),
    (
        torque(0.0, 12.0, 0.05),
        "01000a0c06200000c07f0000000000000000000000000000000000004041"
        "0d27cdcc4c3d0d2b0000000011001f01130d",
    ),
    ((write(INT8, 0, 0), *QUERY), "01000011001f01130d"),
    ((write(INT8, 0, 0),), "010000"),
    (QUERY, "11001f01130d"),
    (
        answer(10, (0.25, -0.5, 0.8), 24.0, 30, 0),
        "21000a2f010000803e000000bfcdcc4c3f230d301e00",
    ),
    (
        answer(11, (0.25, 0.0, 0.0), 24.0, 30, 0),
        "21000b2f010000803e0000000000000000230d301e00",
    ),
    (
        answer(1, (0.25, 0.0, 0.0), 24.0, 30, 34),
        "2100012f010000803e0000000000000000230d301e22",
    ),
    (
        answer(10, (-0.125, 0.0625, -3.25), 23.0, 41, 103),
        "21000a2f01000000be0000803d000050c0230d2e2967",
    ),
    # int16 and int8 of the maker's page on the protocol, and what it answers
    (
        (
            write(INT8, 0, 10),
            write(INT16, 0x020, 96, 288, -176),
            read(INT16, 0, 4),
            read(INT8, 0x00D, 3),
        ),
        "01000a07206000200150ff140400130d",
    ),
    (
        (
            answered(INT16, 0, 10, 80, 256, -144),
            answered(INT8, 0x00D, 24, 20, 0),
        ),
        "2404000a005000000170ff230d181400",
    ),
    # a register above 127 and what is refused, text of the console
    ((read(INT32, 0x101, 2),), "1a8102"),
    (
        (Subframe(READ_ERROR, 0, 0x300, 1), Subframe(WRITE_ERROR, 0, 5, 2)),
        "31800601300502",
    ),
    ((text(TO_CONSOLE, b"tel stop\n"),), "40010974656c2073746f700a"),
    ((Subframe(POLL, 0, CONSOLE, 48),), "420130"),
    ((text(FROM_CONSOLE, b"OK\r\n"),), "4101044f4b0d0a"),
]


@pytest.mark.parametrize(("subframes", "in_hex"), ORACLES)
def test_frames_are_those_of_the_maker_and_come_back(
    subframes: tuple, in_hex: str
) -> None:
    data = bytes.fromhex(in_hex)
    made = encode(subframes)
    assert made.rstrip(b"\x50") == data
    assert len(made) in (*range(9), 12, 16, 20, 24, 32, 48, 64)
    assert len(made) < len(data) + 17
    assert same(decode(made), single(subframes))


def same(one: tuple, other: tuple) -> bool:
    """Whether subframes are the same; nan is."""
    return repr(one) == repr(other)


def single(subframes: tuple) -> tuple:
    """The same with floats as they are on the bus."""
    return tuple(
        one._replace(values=struct.unpack(f"{n}f", struct.pack(f"{n}f", *one.values)))
        if one.kind == FLOAT and (n := len(one.values))
        else one
        for one in subframes
    )


registers = st.integers(0, 2**32 - 1)
numbers = st.one_of(
    *(
        st.tuples(
            st.just(kind),
            st.lists(st.integers(-(2**bits), 2**bits - 1), min_size=1, max_size=5),
        )
        for kind, bits in ((INT8, 7), (INT16, 15), (INT32, 31))
    ),
    st.tuples(st.just(FLOAT), st.lists(st.floats(width=32), min_size=1, max_size=5)),
)
subframes = st.one_of(
    st.builds(
        lambda act, first, made: Subframe(
            act, made[0], first, len(made[1]), tuple(made[1])
        ),
        st.sampled_from([WRITE, ANSWER]),
        registers,
        numbers,
    ),
    st.builds(read, st.integers(0, 3), registers, st.integers(1, 2**32 - 1)),
    st.builds(
        lambda act, first, n: Subframe(act, 0, first, n),
        st.sampled_from([WRITE_ERROR, READ_ERROR, POLL]),
        registers,
        registers,
    ),
    st.builds(
        text, st.sampled_from([TO_CONSOLE, FROM_CONSOLE]), st.binary(max_size=20)
    ),
)


@given(st.lists(subframes, max_size=2))
def test_every_frame_comes_back(made: list) -> None:
    assert same(decode(encode(made)), tuple(made))


@given(st.binary(max_size=64))
def test_decoding_raises_its_own_error_or_none(data: bytes) -> None:
    try:
        made = decode(data)
    except FrameError:
        return  # any other exception fails the test
    assert len(b"".join(encode([one]).rstrip(b"\x50") for one in made)) <= 64


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda: decode(b"\x01\x00"), "in the middle of a subframe"),
        (lambda: decode(b"\x2c\xff\xff\xff\xff\x0f\x00"), "in the middle of"),
        (lambda: decode(b"\x11" + b"\xff" * 6), "one without an end"),
        (lambda: decode(b"\x60"), "a known subframe, got 0x60"),
        (lambda: encode([write(INT8, 0, 128)]), "does not fit its type"),
        (lambda: encode([write(FLOAT, 0, 1e39)]), "does not fit its type"),
        (lambda: encode([read(INT8, -1)]), "needs a number of 32 bits, got -1"),
        (lambda: encode([text(FROM_CONSOLE, bytes(62))]), "at most 64 bytes, got 65"),
    ],
)
def test_what_is_no_frame_or_fits_in_none_is_refused(act, words: str) -> None:
    with pytest.raises(FrameError, match=words):
        act()


# The maker's table: position, velocity, torque, voltage, temperature, time, share
@pytest.mark.parametrize(
    ("register", "scales"),
    [
        (0x001, (0.01, 0.0001, 0.00001)),
        (0x002, (0.1, 0.00025, 0.00001)),
        (0x003, (0.5, 0.01, 0.001)),
        (0x00D, (0.5, 0.1, 0.001)),
        (0x00E, (1.0, 0.1, 0.001)),
        (0x020, (0.01, 0.0001, 0.00001)),
        (0x023, (1 / 127, 1 / 32767, 1 / 2147483647)),
        (0x025, (0.5, 0.01, 0.001)),
        (0x027, (0.01, 0.001, 0.000001)),
    ],
)
def test_integers_are_scaled(register: int, scales: tuple[float, ...]) -> None:
    for kind, scale in zip((INT8, INT16, INT32), scales, strict=True):
        most = 2 ** (8 * 2**kind - 1)
        assert value_of(register, kind, 3) == pytest.approx(3 * scale, rel=1e-15)
        assert math.isnan(value_of(register, kind, -most))
        assert raw_of(register, kind, 3.4 * scale) == 3
        assert raw_of(register, kind, -1e12) == 1 - most  # the most negative is nan
        assert raw_of(register, kind, nan) == -most
    assert value_of(register, FLOAT, 0.3) == raw_of(register, FLOAT, 0.3) == 0.3


def test_the_counter_of_milliseconds_counts_through_its_most_negative() -> None:
    for kind, most in ((INT8, 2**7), (INT16, 2**15), (INT32, 2**31)):
        assert value_of(0x070, kind, -most) == raw_of(0x070, kind, -most) == -most
