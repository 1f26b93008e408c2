"""From a puck that has just been switched on to one in torque mode.

Source of the order: Barrett WAM Arm User's Manual D1001 AH.00, pp. 46-48, and what
the two public drivers of the arm do. The permanent memory is never written.
"""

import math

from masrel.errors import DeviceError, ParameterError
from masrel.hess.puck.node import PuckNode
from masrel.hess.puck.options import PuckOptions
from masrel.hess.puck.properties import (
    STATUS,
    PropertyTable,
)
from masrel.hess.puck.states import IDLE, READY, TORQUE
from masrel.hess.puck.transmission import Transmission

__all__ = [
    "activate",
    "check_torque",
    "configure",
    "set_position",
    "wake",
]

_OFF_BUS_S = 1.2  # a waking puck leaves the bus; public drivers wait 1.0 and 1.2 s
_HIGHEST_UNITS = 8191  # what 14 bits of current units can say
_COUNT_TOLERANCE = 2  # an arm that is held moves the encoder by no more
_SETTING_TIME_S = 0.001  # a setting takes 0.11 ms on the bus


def wake(node: PuckNode) -> None:
    """Wake a puck and wait, in silence, until it is back on the bus."""
    # Talking to a puck that has left the bus may throw the host off it, too.
    node.tell(STATUS, READY)
    node.wait(_OFF_BUS_S)
    status = node.ask(STATUS)
    if status != READY:
        raise DeviceError(
            f"puck {node.puck}: needs STAT {READY} after waking, got {status}"
        )


def configure(
    node: PuckNode, table: PropertyTable, options: PuckOptions
) -> Transmission:
    """Idle a puck, set its groups and its torque limit, read what it counts in."""
    # It may still hold the torque of a driver that was killed.
    _set(node, table, "T", 0)
    _set(node, table, "MODE", IDLE)
    # Masks of a whole arm: 1 and 2 are packed torques for pucks 1-4 and 5-7.
    arm_half = 1 if node.puck <= 4 else 2
    for name, group in (("GRPA", 0), ("GRPB", arm_half), ("GRPC", 4)):
        _set(node, table, name, group)
    counts, units = node.ask(table.number("CTS")), node.ask(table.number("IPNM"))
    if counts < 1 or units < 1:
        raise DeviceError(
            f"puck {node.puck}: needs CTS and IPNM above 0, got {counts} and {units}"
        )
    transmission = Transmission(
        counts_per_turn=counts,
        units_per_nm=units,
        gear_ratio=options.gear_ratio,
        direction=options.direction,
    )
    highest = math.floor(options.largest_torque / transmission.torque_step)
    if not 0 < highest <= _HIGHEST_UNITS:
        raise DeviceError(
            f"puck {node.puck}: largest_torque needs 1 to {_HIGHEST_UNITS} current "
            f"units, {options.largest_torque:g} N·m are {highest}"
        )
    _set(node, table, "MT", highest)
    return transmission


def set_position(
    node: PuckNode, table: PropertyTable, transmission: Transmission, angle: float
) -> int:
    """Tell an idle puck where the arm is."""
    if not 0.0 <= angle <= math.pi:
        raise ParameterError(f"angle: needs 0 to 180 degrees, got {angle} rad")
    mode = node.ask(table.number("MODE"))
    if mode != IDLE:
        raise DeviceError(
            f"puck {node.puck}: needs MODE {IDLE} to be zeroed, is {mode}"
        )
    wanted = transmission.counts(angle)
    node.tell(table.settable("P"), wanted)
    node.wait(_SETTING_TIME_S)
    _, found = node.position(table.number("P"), patience_s=0.05)
    if abs(found - wanted) > _COUNT_TOLERANCE:
        raise DeviceError(
            f"puck {node.puck}: needs a position of {wanted} counts after zeroing, "
            f"got {found}"
        )
    return found


def activate(node: PuckNode, table: PropertyTable) -> None:
    """Put a puck into torque mode, with zero torque."""
    _set(node, table, "T", 0)
    node.tell(table.settable("MODE"), TORQUE)
    mode = node.ask(table.number("MODE"))
    if mode != TORQUE:
        raise DeviceError(
            f"puck {node.puck}: needs MODE {TORQUE}, stays in {mode}; is an emergency "
            "stop pressed, or does a safety module want to be activated?"
        )


def check_torque(node: PuckNode, table: PropertyTable) -> None:
    """See whether a puck says what torque it was told, with one current unit."""
    node.tell(table.settable("T"), 1)  # 0.007 N·m, less than friction holds
    found = node.ask(table.number("T"))
    _set(node, table, "T", 0)
    if found != 1:
        raise DeviceError(
            f"puck {node.puck}: needs a T that reads back what it was set to, set to 1 "
            f"it reads {found}; checks_torque = false goes without"
        )


def _set(node: PuckNode, table: PropertyTable, name: str, value: int) -> None:
    # A setting is not acknowledged: it is read back.
    node.tell(table.settable(name), value)
    found = node.ask(table.number(name))
    if found != value:
        raise DeviceError(f"puck {node.puck}: {name} needs {value}, reads {found}")
