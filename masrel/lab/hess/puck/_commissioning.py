"""Bring a puck up by hand: who is there, can it be driven, where is it.

In: where the puck is, as `PuckOptions`; nothing moves. Out: reports to print.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from masrel.errors import DeviceError, DeviceTimeoutError
from masrel.lab.hess._can import Link
from masrel.lab.hess._clock import Clock
from masrel.lab.hess._free_arm import (
    PROBE_PATIENCE_S,
    Check,
    ask_often,
    check_bus,
    check_rest,
    check_torque_mode,
)
from masrel.lab.hess.puck._bus import MAX_NODE
from masrel.lab.hess.puck._puck_device import (
    ROLE_MASK,
    AwakePuck,
    PuckNode,
    motor_table,
)
from masrel.lab.hess.puck._puck_options import (
    ASLEEP,
    READY,
    ROLE,
    SERIAL_NUMBER,
    STATUS,
    VERSION,
    PropertyTable,
    PuckOptions,
)

_REPORTED = ("MODE", "CTS", "IPNM", "MT", "GRPA", "GRPB", "GRPC", "TEMP", "VBUS")
_KINDS = {
    0: "motor",
    1: "gimbals",
    2: "safety module",
    3: "wraptor",
    4: "trigger",
    5: "hand",
    6: "force sensor",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeReport:
    """What a node on the bus says of itself.

    Attributes
    ----------
    puck : int
        Its node.
    kind : str
        What it is, from its ROLE, or that it is in error.
    is_awake : bool
        Whether it has left its monitor.
    firmware : int or None
        VERS; None where it is in error.
    is_supported : bool
        Whether this driver can drive it.
    properties : dict of str to int
        Other values that it reports, while it is awake and supported.
    serial : int or None
        Serial number; None where it is in error.
    """

    puck: int
    kind: str
    is_awake: bool
    firmware: int | None
    is_supported: bool
    properties: dict[str, int]
    serial: int | None = None

    def __str__(self) -> str:
        if self.firmware is None:
            return f"puck {self.puck}: {self.kind}"
        state = "awake" if self.is_awake else "asleep"
        support = "" if self.is_supported else ", NOT SUPPORTED"
        values = "".join(f", {name} {value}" for name, value in self.properties.items())
        return (
            f"puck {self.puck}: {self.kind}, firmware {self.firmware}, "
            f"{state}{support}{values}"
        )


def probe(
    link: Link,
    clock: Clock,
    options: PuckOptions | None = None,
    *,
    progress: Callable[[], object] = lambda: None,
) -> tuple[NodeReport, ...]:
    """Ask every node who it is; nothing is set, and nobody is woken.

    Parameters
    ----------
    link : Link
        The bus, connected to all nodes.
    clock : Clock
        Its clock.
    options : PuckOptions or None, optional
        For the numbers of properties, where a firmware is unknown to this driver.
    progress : callable, optional
        Called after each of the 31 nodes.

    Returns
    -------
    tuple of NodeReport
        Those that answer, in the order of their nodes.

    Raises
    ------
    DeviceError
        If the bus fails.
    """
    properties = None if options is None else options.properties
    reports = []
    for number in range(1, MAX_NODE + 1):
        report = _node_report(PuckNode(link, clock, number), properties)
        if report is not None:
            reports.append(report)
        progress()
    return tuple(reports)


def _node_report(node: PuckNode, properties: PropertyTable | None) -> NodeReport | None:
    try:
        status = node.get(STATUS, patience_s=PROBE_PATIENCE_S)
        if status not in (ASLEEP, READY):
            return NodeReport(
                puck=node.puck,
                kind=f"in error, STAT {status}",
                is_awake=False,
                firmware=None,
                is_supported=False,
                properties={},
            )
        firmware = node.get(VERSION, patience_s=PROBE_PATIENCE_S)
        role = node.get(ROLE, patience_s=PROBE_PATIENCE_S)
    except DeviceTimeoutError:
        return None
    try:
        numbers = motor_table(node.puck, role, firmware, properties).numbers
    except DeviceError:
        numbers = {}  # the report says that it is not supported
    is_awake, kind = status == READY, role & ROLE_MASK
    reported = [name for name in _REPORTED if is_awake and name in numbers]
    return NodeReport(
        puck=node.puck,
        kind=_KINDS.get(kind, f"unknown, ROLE {role}"),
        is_awake=is_awake,
        firmware=firmware,
        is_supported=bool(numbers),
        properties={name: node.get(numbers[name]) for name in reported},
        serial=node.get(SERIAL_NUMBER),
    )


def zero(link: Link, clock: Clock, options: PuckOptions, *, angle: float) -> int:
    """Tell a puck where the arm is; it forgets when its supply is switched off.

    Parameters
    ----------
    link : Link
        The bus.
    clock : Clock
        Its clock.
    options : PuckOptions
        Which puck, and how its device is to behave.
    angle : float
        Where the arm is held, rad; 0 at full flexion, to pi.

    Returns
    -------
    int
        The count that it reports afterwards.

    Raises
    ------
    ParameterError
        If no arm can be at `angle`.
    DeviceError
        If the puck does not answer, is not supported, or does not take a setting.
    """
    return AwakePuck(link, clock, options).set_position(angle)


def check(link: Link, clock: Clock, options: PuckOptions) -> tuple[Check, ...]:
    """Wake and configure a puck, and see whether it can be driven.

    The arm must be at rest. The puck is put into torque mode with zero torque, and with
    one current unit (0.007 N·m) for a millisecond, and idled again.

    Parameters
    ----------
    link : Link
        The bus.
    clock : Clock
        Its clock.
    options : PuckOptions
        Which puck, and how its device is to behave.

    Returns
    -------
    tuple of Check
        What was checked.

    Raises
    ------
    DeviceError
        If the bus fails, or the puck does not answer, is not supported, does not take a
        setting, or cannot be idled again.
    """
    puck = AwakePuck(link, clock, options)
    node, transmission = puck.node, puck.transmission
    units = Check(
        name="units",
        holds=True,
        result=(
            f"CTS {transmission.counts_per_turn}, IPNM {transmission.units_per_nm}"
            f": {math.degrees(transmission.angle_step):.6f} deg and "
            f"{transmission.torque_step:.5f} N·m a step"
        ),
    )
    answers, counts = ask_often(
        node,
        lambda: node.position(puck.position_id, patience_s=options.patience_s)[1],
    )
    advice = "not zeroed yet" if puck.was_asleep else "look whether the arm is there"
    rest = check_rest(counts, transmission.angle(counts[-1]), advice) if counts else ()
    torque = "T reads back" if options.checks_torque else "T not asked for"
    torque_mode = check_torque_mode(
        lambda: puck.activate(checks_torque=options.checks_torque),
        puck.release,
        f"in and out of it; {torque}; idle now",
    )
    # the last counts the errors of all others
    return (units, answers, *rest, torque_mode, check_bus(node))
