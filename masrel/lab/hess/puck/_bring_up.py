"""From a puck that has just been switched on to one in torque mode.

Source of the order: Barrett WAM Arm User's Manual D1001 AH.00, pp. 46-48, and what
the two public drivers of the arm do. The permanent memory is never written.
"""

import math
from dataclasses import dataclass

from masrel.errors import DeviceError, ParameterError
from masrel.lab.hess.puck._codec import MAX_TORQUE
from masrel.lab.hess.puck._node import PuckNode
from masrel.lab.hess.puck._properties import (
    ASLEEP,
    IDLE,
    READY,
    ROLE,
    STATUS,
    TORQUE,
    VERSION,
    PropertyTable,
    property_table,
)
from masrel.lab.hess.puck._puck_options import PuckOptions
from masrel.lab.hess.puck._transmission import Transmission

_ROLE_MASK = 0x1F  # the other bits of ROLE say what encoder it has
_MOTOR_KIND = 0
_OFF_BUS_S = 1.2  # a waking puck leaves the bus; public drivers wait 1.0 and 1.2 s
_COUNT_TOLERANCE = 2  # an arm that is held moves the encoder by no more
_SETTING_TIME_S = 0.001  # a setting takes 0.11 ms on the bus


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """What a puck says of itself before anything is set."""

    puck: int  # its node
    is_awake: bool  # whether it has left its monitor
    firmware: int  # VERS
    role: int  # ROLE

    @property
    def kind(self) -> int:
        """Its kind: on other kinds the same numbers mean other things."""
        return self.role & _ROLE_MASK


@dataclass(frozen=True, slots=True, kw_only=True)
class AwakePuck:
    """A puck that is awake, idle and configured."""

    node: PuckNode  # the puck
    table: PropertyTable  # numbers of its properties
    transmission: Transmission  # what it counts in
    max_units: int  # its torque limit, current units
    # whether it was woken just now, and so does not know where the arm is
    was_asleep: bool


def identify(node: PuckNode, *, patience_s: float = 0.05) -> Identity:
    """Request who a puck is; nothing is set."""
    status = node.get(STATUS, patience_s=patience_s)
    if status not in (ASLEEP, READY):
        raise DeviceError(f"puck {node.puck}: needs STAT 0 or 2, it reports {status}")
    return Identity(
        puck=node.puck,
        is_awake=status == READY,
        firmware=node.get(VERSION, patience_s=patience_s),
        role=node.get(ROLE, patience_s=patience_s),
    )


def motor_table(identity: Identity, properties: PropertyTable | None) -> PropertyTable:
    """Return the user's property numbers of a motor's puck, or its firmware's."""
    if identity.kind != _MOTOR_KIND:
        raise DeviceError(
            f"puck {identity.puck}: needs a motor's puck, its ROLE is {identity.kind}"
        )
    return properties or property_table(identity.firmware)


def wake_and_configure(
    node: PuckNode, identity: Identity, table: PropertyTable, options: PuckOptions
) -> AwakePuck:
    """Wake a puck if it sleeps, idle it, and set what the driver needs set."""
    if not identity.is_awake:
        _wake(node)
    # It may still hold the torque of a driver that was killed.
    _set(node, table, "T", 0)
    _set(node, table, "MODE", IDLE)
    # Masks of a whole arm: 1 and 2 are packed torques for pucks 1-4 and 5-7.
    arm_half = 1 if node.puck <= 4 else 2
    for name, group in (("GRPA", 0), ("GRPB", arm_half), ("GRPC", 4)):
        _set(node, table, name, group)
    transmission = _read_transmission(node, table, options)
    max_units = math.floor(options.largest_torque / transmission.torque_step)
    if not 0 < max_units <= MAX_TORQUE:
        raise DeviceError(
            f"puck {node.puck}: largest_torque needs 1 to {MAX_TORQUE} current "
            f"units, {options.largest_torque:g} N·m are {max_units}"
        )
    _set(node, table, "MT", max_units)
    return AwakePuck(
        node=node,
        table=table,
        transmission=transmission,
        max_units=max_units,
        was_asleep=not identity.is_awake,
    )


def _wake(node: PuckNode) -> None:
    # Talking to a puck that has left the bus may throw the host off it, too.
    node.set(STATUS, READY)
    node.wait(_OFF_BUS_S)
    status = node.get(STATUS)
    if status != READY:
        raise DeviceError(
            f"puck {node.puck}: needs STAT {READY} after waking, got {status}"
        )


def _read_transmission(
    node: PuckNode, table: PropertyTable, options: PuckOptions
) -> Transmission:
    counts, units = node.get(table.number("CTS")), node.get(table.number("IPNM"))
    if counts < 1 or units < 1:
        raise DeviceError(
            f"puck {node.puck}: needs CTS and IPNM above 0, got {counts} and {units}"
        )
    return Transmission(
        counts_per_turn=counts,
        units_per_nm=units,
        gear_ratio=options.gear_ratio,
        direction=options.direction,
    )


def set_position(puck: AwakePuck, angle: float) -> int:
    """Set the position of an idle puck, and return the count that it then reports."""
    node, table = puck.node, puck.table
    if not 0.0 <= angle <= math.pi:
        raise ParameterError(f"angle: needs 0 to 180 degrees, got {angle} rad")
    mode = node.get(table.number("MODE"))
    if mode != IDLE:  # its position is about to jump
        raise DeviceError(
            f"puck {node.puck}: needs MODE {IDLE} to be zeroed, is {mode}"
        )
    target = puck.transmission.counts(angle)
    node.set(table.settable("P"), target)
    node.wait(_SETTING_TIME_S)
    _, counts = node.position(table.number("P"), patience_s=0.05)
    if abs(counts - target) > _COUNT_TOLERANCE:
        raise DeviceError(
            f"puck {node.puck}: needs a position of {target} counts after zeroing, "
            f"got {counts}"
        )
    return counts


def activate(puck: AwakePuck, *, checks_torque: bool) -> None:
    """Put a puck into torque mode with zero torque, and see whether T reads back."""
    node, table = puck.node, puck.table
    _set(node, table, "T", 0)
    node.set(table.settable("MODE"), TORQUE)
    mode = node.get(table.number("MODE"))
    if mode != TORQUE:  # on a whole arm its safety module decides
        raise DeviceError(
            f"puck {node.puck}: needs MODE {TORQUE}, stays in {mode}; is an emergency "
            "stop pressed, or does a safety module want to be activated?"
        )
    if checks_torque:
        _check_torque(node, table)


def _check_torque(node: PuckNode, table: PropertyTable) -> None:
    # One current unit is 0.007 N·m, less than friction holds.
    node.set(table.settable("T"), 1)
    torque = node.get(table.number("T"))
    _set(node, table, "T", 0)
    if torque != 1:  # then lost torques could not be noticed
        raise DeviceError(
            f"puck {node.puck}: needs a T that reads back what it was set to, set to 1 "
            f"it reads {torque}; checks_torque = false goes without"
        )


def _set(node: PuckNode, table: PropertyTable, name: str, value: int) -> None:
    # A setting is not acknowledged: it is read back.
    node.set(table.settable(name), value)
    actual = node.get(table.number(name))
    if actual != value:
        raise DeviceError(f"puck {node.puck}: {name} needs {value}, reads {actual}")
