"""What all frames of a Puck share: the number of a property, and the order of bytes.

Source: Barrett WAM Arm User's Manual D1001 AH.00, pp. 46-48. What the pages leave
open is decided here as the two public drivers of the arm do it, and so that a decoder
takes whatever either of them takes.
"""

from masrel.errors import FrameError

__all__ = ["PROPERTY_MASK", "SET_FLAG", "checked_property", "little_endian"]

SET_FLAG = 0x80
"""Set in the first byte of every frame that carries a value."""

PROPERTY_MASK = 0x7F


def checked_property(property_id: int) -> int:
    """Return the number of a property if there can be one."""
    if not 0 <= property_id <= PROPERTY_MASK:
        raise FrameError(f"property: needs 0 to {PROPERTY_MASK}, got {property_id}")
    return property_id


def little_endian(value: int, n_bytes: int) -> bytes:
    """Return a value with its lowest byte first."""
    try:
        return value.to_bytes(n_bytes, "little", signed=True)
    except OverflowError as error:
        raise FrameError(
            f"value: needs {8 * n_bytes} bits with sign, got {value}"
        ) from error
