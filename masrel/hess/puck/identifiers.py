"""Identifiers of the Puck's CAN bus: who sends, and to whom.

An identifier has 11 bits, ``G FFFFF TTTTT``: whether the receiver is a group, the
sender, the receiver. The host is node 0. Source: Barrett WAM Arm User's Manual
D1001 AH.00, p. 46.
"""

from typing import NamedTuple

from masrel.errors import FrameError

__all__ = [
    "HOST",
    "POSITION_GROUP",
    "PROPERTY_GROUP",
    "SAFETY_NODE",
    "TORQUE_GROUP",
    "Address",
    "from_puck",
    "split_identifier",
    "to_group",
    "to_puck",
]

HOST = 0
SAFETY_NODE = 10
"""The module that watches a whole arm; a driver of one joint has nothing to say to."""

TORQUE_GROUP = 1  # packed torque for pucks 1-4
POSITION_GROUP = 3  # where pucks answer a request for P
PROPERTY_GROUP = 6  # where they answer any other

_GROUP_FLAG = 0x400
_HIGHEST_NODE = 31
_HIGHEST_IDENTIFIER = 0x7FF


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


def split_identifier(identifier: int) -> Address:
    """Take an identifier apart."""
    if not 0 <= identifier <= _HIGHEST_IDENTIFIER:
        raise FrameError(f"identifier: needs 11 bits, got {identifier:#x}")
    return Address(
        sender=identifier >> 5 & _HIGHEST_NODE,
        receiver=identifier & _HIGHEST_NODE,
        is_group=bool(identifier & _GROUP_FLAG),
    )


def _check_node(what: str, number: int, *, lowest: int) -> None:
    if not lowest <= number <= _HIGHEST_NODE:
        raise FrameError(f"{what}: needs {lowest} to {_HIGHEST_NODE}, got {number}")
