"""Torques of four Pucks in one frame, which this driver reads but never sends.

Source: Barrett WAM Arm User's Manual D1001 AH.00, p. 47.
"""

from masrel.errors import FrameError
from masrel.hess.puck.frames import checked_property

__all__ = ["HIGHEST_TORQUE", "LOWEST_TORQUE", "decode_torques", "encode_torques"]

LOWEST_TORQUE, HIGHEST_TORQUE = -8192, 8191  # 14 bits

_FLAG = 0x80
_MASK = 0x3FFF
_SIGN = 0x2000
_N_PACKED = 4


def encode_torques(
    first: int, second: int, third: int, fourth: int, *, property_id: int = 42
) -> bytes:
    """Return the data that set the torques of four pucks at once."""
    # The driver does not use it: on a bus with other pucks the frame sets the torque of
    # each of them, and which of the four a puck obeys hangs on its PIDX and groups.
    packed = 0
    for torque in (first, second, third, fourth):
        if not LOWEST_TORQUE <= torque <= HIGHEST_TORQUE:
            raise FrameError(
                f"torque: needs {LOWEST_TORQUE} to {HIGHEST_TORQUE}, got {torque}"
            )
        packed = packed << 14 | torque & _MASK
    head = bytes((_FLAG | checked_property(property_id),))
    return head + packed.to_bytes(7, "big")


def decode_torques(data: bytes) -> tuple[int, ...]:
    """Read the torques of four pucks."""
    if len(data) != 8 or not data[0] & _FLAG:
        raise FrameError(
            "torques: need 8 bytes, the first from 80 up, "
            f"got {data.hex(' ') or 'none'}"
        )
    packed = int.from_bytes(data[1:], "big")
    fields = (packed >> 14 * place & _MASK for place in reversed(range(_N_PACKED)))
    return tuple((field ^ _SIGN) - _SIGN for field in fields)
