"""Positions as a Puck sends them: highest byte first, 22 bits, unlike all else.

Source: Barrett WAM Arm User's Manual D1001 AH.00, p. 48.
"""

from typing import NamedTuple

from masrel.errors import FrameError

__all__ = ["Position", "decode_position", "encode_position"]

_TOP_BIT = 0x800000
_MASK = 0x3FFFFF  # 22 bits
_SIGN = 0x200000


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
    flag = _TOP_BIT if flagged else 0
    data = (flag | counts & _MASK).to_bytes(3, "big")
    if secondary is None:
        return data
    return data + (secondary & _MASK).to_bytes(3, "big")


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


def _signed_position(data: bytes) -> int:
    field = int.from_bytes(data, "big") & _MASK
    return (field ^ _SIGN) - _SIGN
