"""Who a puck is: asleep or awake, of which firmware, and whether a motor's."""

from dataclasses import dataclass

from masrel.errors import DeviceError
from masrel.hess.puck.node import PuckNode
from masrel.hess.puck.properties import (
    ROLE,
    STATUS,
    VERSION,
    PropertyTable,
    property_table,
)
from masrel.hess.puck.states import ASLEEP, READY

__all__ = ["ROLE_MASK", "Identity", "identify", "table_of"]

ROLE_MASK = 0x1F  # of ROLE; the other bits say what encoder it has

_MOTOR_ROLE = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """What a puck says of itself before anything is set."""

    puck: int  # its node
    is_awake: bool  # whether it has left its monitor
    firmware: int  # VERS
    role: int  # ROLE

    @property
    def is_motor(self) -> bool:
        """Whether it drives a motor: on others the same numbers mean other things."""
        return self.role & ROLE_MASK == _MOTOR_ROLE


def identify(node: PuckNode, *, patience_s: float = 0.05) -> Identity:
    """Ask a puck who it is; nothing is set."""
    status = node.ask(STATUS, patience_s=patience_s)
    if status not in (ASLEEP, READY):
        raise DeviceError(f"puck {node.puck}: needs STAT 0 or 2, it reports {status}")
    return Identity(
        puck=node.puck,
        is_awake=status == READY,
        firmware=node.ask(VERSION, patience_s=patience_s),
        role=node.ask(ROLE, patience_s=patience_s),
    )


def table_of(identity: Identity, given: PropertyTable | None) -> PropertyTable:
    """Return the numbers of a motor puck's properties."""
    if not identity.is_motor:
        raise DeviceError(
            f"puck {identity.puck}: needs a motor's puck, its ROLE is "
            f"{identity.role & ROLE_MASK}"
        )
    return given or property_table(identity.firmware)
