"""From a puck that has just been switched on to one in torque mode, and back.

Source of the order: Barrett WAM Arm User's Manual D1001 AH.00, pp. 46-48, and what
the two public drivers of the arm do. The permanent memory is never written.
"""

import math
from dataclasses import dataclass

from masrel.errors import BusError, DeviceError, DeviceTimeoutError, FrameError
from masrel.hess.puck.node import PuckNode
from masrel.hess.puck.options import PuckOptions
from masrel.hess.puck.properties import (
    ROLE,
    STATUS,
    VERSION,
    PropertyTable,
    property_table,
)
from masrel.hess.puck.transmission import Transmission

__all__ = [
    "Identity",
    "activate",
    "check_torque",
    "configure",
    "identify",
    "release",
    "set_position",
    "table_of",
    "wake",
]

ASLEEP, READY = 0, 2  # STAT
IDLE, TORQUE = 0, 2  # MODE

_MOTOR_ROLE = 0  # of the lowest five bits of ROLE
_ROLE_MASK = 0x1F
_OFF_BUS_S = 1.2  # a waking puck leaves the bus; public drivers wait 1.0 and 1.2 s
_RELEASE_S = 0.1
_HIGHEST_UNITS = 8191  # what 14 bits of current units can say
_COUNT_TOLERANCE = 2  # an arm that is held moves the encoder by no more
_SETTING_TIME_S = 0.001  # a setting takes 0.11 ms on the bus


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """What a puck says of itself before anything is set.

    Attributes
    ----------
    puck : int
        Its node.
    is_awake : bool
        Whether it has left its monitor.
    firmware : int
        VERS.
    role : int
        ROLE.
    """

    puck: int
    is_awake: bool
    firmware: int
    role: int

    @property
    def is_motor(self) -> bool:
        """Whether it drives a motor: on others the same numbers mean other things."""
        return self.role & _ROLE_MASK == _MOTOR_ROLE


def identify(node: PuckNode, *, patience_s: float = 0.05) -> Identity:
    """Ask a puck who it is; nothing is set.

    Parameters
    ----------
    node : PuckNode
        The puck.
    patience_s : float, optional
        How long to wait for each answer, s.

    Returns
    -------
    Identity
        What it answers, asleep or awake.

    Raises
    ------
    DeviceTimeoutError
        If nobody answers at this node.
    DeviceError
        If it reports an error, or the bus fails.
    """
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
    """Return the numbers of a motor puck's properties.

    Parameters
    ----------
    identity : Identity
        What it says of itself.
    given : PropertyTable or None
        A table of the user's own, which goes before.

    Returns
    -------
    PropertyTable
        Names and numbers.

    Raises
    ------
    DeviceError
        If it is no motor's, or its firmware is not known and no table was given.
    """
    if not identity.is_motor:
        raise DeviceError(
            f"puck {identity.puck}: needs a motor's puck, its ROLE is "
            f"{identity.role & _ROLE_MASK}"
        )
    return given or property_table(identity.firmware)


def wake(node: PuckNode) -> None:
    """Wake a puck and wait, in silence, until it is back on the bus.

    Talking to a puck that has left the bus may throw the host off it, too.

    Parameters
    ----------
    node : PuckNode
        A puck that is asleep.

    Raises
    ------
    DeviceError
        If it is not ready afterwards.
    """
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
    """Idle a puck, set its groups and its torque limit, read what it counts in.

    Parameters
    ----------
    node : PuckNode
        A puck that is awake.
    table : PropertyTable
        Numbers of its properties.
    options : PuckOptions
        Groups follow from the node, the limit is `largest_torque`.

    Returns
    -------
    Transmission
        From CTS and IPNM as it reports them.

    Raises
    ------
    DeviceError
        If a setting does not read back, or what it reports makes no sense.
    """
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
    """Tell an idle puck where the arm is.

    Parameters
    ----------
    node : PuckNode
        The puck; idle, because its position jumps.
    table : PropertyTable
        Numbers of its properties.
    transmission : Transmission
        What it counts in.
    angle : float
        Where the arm is held, rad.

    Returns
    -------
    int
        The count it reports afterwards.

    Raises
    ------
    DeviceError
        If it is not idle, or its position does not read back.
    """
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
    """Put a puck into torque mode, with zero torque.

    Parameters
    ----------
    node : PuckNode
        The puck.
    table : PropertyTable
        Numbers of its properties.

    Raises
    ------
    DeviceError
        If it does not go: on a whole arm its safety module decides.
    """
    _set(node, table, "T", 0)
    node.tell(table.settable("MODE"), TORQUE)
    mode = node.ask(table.number("MODE"))
    if mode != TORQUE:
        raise DeviceError(
            f"puck {node.puck}: needs MODE {TORQUE}, stays in {mode}; is an emergency "
            "stop pressed, or does a safety module want to be activated?"
        )


def check_torque(node: PuckNode, table: PropertyTable) -> None:
    """See whether a puck says what torque it was told, with one current unit.

    Parameters
    ----------
    node : PuckNode
        A puck in torque mode.
    table : PropertyTable
        Numbers of its properties.

    Raises
    ------
    DeviceError
        If it does not: then lost torques could not be noticed.
    """
    node.tell(table.settable("T"), 1)  # 0.007 N·m, less than friction holds
    found = node.ask(table.number("T"))
    _set(node, table, "T", 0)
    if found != 1:
        raise DeviceError(
            f"puck {node.puck}: needs a T that reads back what it was set to, set to 1 "
            f"it reads {found}; checks_torque = false goes without"
        )


def release(node: PuckNode, *, torque_number: int, mode_number: int) -> None:
    """Zero the torque and idle a puck, again and again until it confirms.

    Parameters
    ----------
    node : PuckNode
        The puck.
    torque_number, mode_number : int
        Numbers of T and MODE.

    Raises
    ------
    DeviceError
        If it has not confirmed within 0.1 s.
    """
    begun_ns = node.now_ns()
    reason = "it does not go to idle"
    while node.now_ns() - begun_ns < _RELEASE_S * 1e9:
        try:
            node.tell(torque_number, 0)
            if _is_asleep(node):
                return
            node.tell(mode_number, IDLE)
            node.tell(mode_number, IDLE)  # twice: a regular loss may not hit both
            if node.ask(mode_number, patience_s=0.005) == IDLE:
                return
        except (BusError, DeviceTimeoutError, FrameError) as error:
            reason = str(error)
        node.wait(_SETTING_TIME_S)
    raise DeviceError(
        f"puck {node.puck}: not idle after {_RELEASE_S * 1e3:g} ms ({reason}); it may "
        "hold its last torque: SWITCH ITS SUPPLY OFF"
    )


def _is_asleep(node: PuckNode) -> bool:
    # One that was reset drives nothing, and has another property where MODE was. One
    # that says nothing is taken to be awake: idling it matters more.
    try:
        return node.ask(STATUS, patience_s=0.005) == ASLEEP
    except DeviceTimeoutError:
        return False


def _set(node: PuckNode, table: PropertyTable, name: str, value: int) -> None:
    # A setting is not acknowledged: it is read back.
    node.tell(table.settable(name), value)
    found = node.ask(table.number(name))
    if found != value:
        raise DeviceError(f"puck {node.puck}: {name} needs {value}, reads {found}")
