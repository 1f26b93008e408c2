"""Join a bus, see who is there, and see whether a puck can be driven; nothing moves.

In: where the puck is, as `PuckOptions`. Out: reports to print.
"""

import math
import statistics
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

from masrel.errors import DeviceError, DeviceTimeoutError
from masrel.lab.hess.clock import Clock
from masrel.lab.hess.hand import Hand
from masrel.lab.hess.limits import DeviceLimits
from masrel.lab.hess.puck._bus import Link
from masrel.lab.hess.puck._codec import MAX_NODE
from masrel.lab.hess.puck._emulator import join
from masrel.lab.hess.puck._node import AwakePuck, PuckNode, identify
from masrel.lab.hess.puck._properties import ASLEEP, READY, STATUS, PropertyTable
from masrel.lab.hess.puck._puck_options import PuckOptions

_PROBE_PATIENCE_S = 0.01  # public drivers wait 1 and 100 ms
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

_N_REQUESTS = 1000
_REST_COUNTS = 4  # between the largest and the smallest of an arm at rest
_MAX_REPLY_S = 0.0007  # of a tick of 1 ms; the rest is for the torque and the host
_MIN_FRACTION_IN_TIME = 0.99


@contextmanager
def connected(
    options: PuckOptions,
    *,
    clock: Clock,
    hand: Hand | None = None,
    range_end: float = math.radians(146.0),
    all_nodes: bool = False,
) -> Iterator[Link]:
    """Join a bus for a while, with an emulated puck on it where there is a hand.

    Parameters
    ----------
    options : PuckOptions
        Which bus, and which puck on it.
    clock : Clock
        The clock of deadlines.
    hand : Hand or None, optional
        What moves the arm of an emulated puck.
    range_end : float, optional
        Where that arm meets its end stop, rad.
    all_nodes : bool, optional
        Whether to receive the frames of all nodes rather than of one puck.

    Yields
    ------
    Link
        This end of the bus.

    Raises
    ------
    DeviceError
        If the bus cannot be opened, or left without an error before that.
    """
    link, _ = join(
        options, clock=clock, hand=hand, range_end=range_end, all_nodes=all_nodes
    )
    with link:
        yield link


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
    """

    puck: int
    kind: str
    is_awake: bool
    firmware: int | None
    is_supported: bool
    properties: dict[str, int]


def probe(
    link: Link,
    clock: Clock,
    *,
    properties: PropertyTable | None = None,
    progress: Callable[[], None] = lambda: None,
) -> tuple[NodeReport, ...]:
    """Ask every node who it is; nothing is set, and nobody is woken.

    Parameters
    ----------
    link : Link
        The bus, connected to all nodes.
    clock : Clock
        Its clock.
    properties : PropertyTable or None, optional
        Numbers of the properties, where a firmware is unknown to this driver.
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
    reports = []
    for number in range(1, MAX_NODE + 1):
        report = _node_report(PuckNode(link, clock, number), properties)
        if report is not None:
            reports.append(report)
        progress()
    return tuple(reports)


def _node_report(node: PuckNode, properties: PropertyTable | None) -> NodeReport | None:
    try:
        status = node.get(STATUS, patience_s=_PROBE_PATIENCE_S)
        if status not in (ASLEEP, READY):
            return NodeReport(
                puck=node.puck,
                kind=f"in error, STAT {status}",
                is_awake=False,
                firmware=None,
                is_supported=False,
                properties={},
            )
        identity = identify(node, patience_s=_PROBE_PATIENCE_S)
    except DeviceTimeoutError:
        return None
    try:
        numbers = identity.table(properties).numbers
    except DeviceError:
        numbers = {}  # the report says that it is not supported
    reported = [name for name in _REPORTED if identity.is_awake and name in numbers]
    return NodeReport(
        puck=node.puck,
        kind=_KINDS.get(identity.kind, f"unknown, ROLE {identity.role}"),
        is_awake=identity.is_awake,
        firmware=identity.firmware,
        is_supported=bool(numbers),
        properties={name: node.get(numbers[name]) for name in reported},
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
    return _awake(link, clock, options).set_position(angle)


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One thing that must hold before a person touches the arm.

    Attributes
    ----------
    name : str
        What was checked.
    holds : bool
        Whether it is as it must be.
    result : str
        What was measured, in a sentence.
    """

    name: str
    holds: bool
    result: str


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
    puck = _awake(link, clock, options)
    node, transmission = puck.node, puck.transmission
    counts, took_s, n_lost = _request_positions(puck, options.patience_s)
    checks = [
        Check(
            name="units",
            holds=True,
            result=(
                f"CTS {transmission.counts_per_turn}, IPNM {transmission.units_per_nm}"
                f": {math.degrees(transmission.angle_step):.6f} deg and "
                f"{transmission.torque_step:.5f} N·m a step"
            ),
        ),
        _check_replies(took_s, n_lost),
    ]
    if counts:
        checks += _check_position(counts, puck)
    checks.append(_check_torque_mode(puck, options))
    errors = Check(
        name="error frames",
        holds=node.n_errors == 0,
        result=f"{node.n_errors}, and {node.n_foreign} frames of others",
    )
    return (*checks, errors)


def _awake(link: Link, clock: Clock, options: PuckOptions) -> AwakePuck:
    node = PuckNode(link, clock, options.puck)
    identity = identify(node)
    return AwakePuck(node, identity, identity.table(options.properties), options)


def _request_positions(
    puck: AwakePuck, patience_s: float
) -> tuple[list[int], list[float], int]:
    # -> counts, how long each took s, how many stayed without an answer
    node, number = puck.node, puck.table.number("P")
    counts, took_s = [], []
    for _ in range(_N_REQUESTS):
        request_ns = node.now_ns()
        with suppress(DeviceTimeoutError):
            counts.append(node.position(number, patience_s=patience_s)[1])
            took_s.append((node.now_ns() - request_ns) * 1e-9)
        node.wait(max(0.0, 0.001 - (node.now_ns() - request_ns) * 1e-9))
    return counts, took_s, _N_REQUESTS - len(counts)


def _check_replies(took_s: list[float], n_lost: int) -> Check:
    if not took_s:
        return Check(name="answers", holds=False, result=f"none of {n_lost} came")
    in_time = sum(took <= _MAX_REPLY_S for took in took_s) / _N_REQUESTS
    return Check(
        name="answers",
        holds=n_lost == 0 and in_time >= _MIN_FRACTION_IN_TIME,
        result=(
            f"median {1e3 * statistics.median(took_s):.2f} ms, longest "
            f"{1e3 * max(took_s):.2f} ms, {n_lost} of {_N_REQUESTS} lost; needs "
            f"{100 * _MIN_FRACTION_IN_TIME:g} % within {1e3 * _MAX_REPLY_S:g} ms"
        ),
    )


def _check_position(counts: list[int], puck: AwakePuck) -> list[Check]:
    angle, limits = puck.transmission.angle(counts[-1]), DeviceLimits()
    advice = "not zeroed yet" if puck.was_asleep else "look whether the arm is there"
    n_moved = max(counts) - min(counts)
    return [
        Check(
            name="position",
            holds=limits.lowest_angle <= angle <= limits.highest_angle,
            result=f"{math.degrees(angle):.2f} deg; {advice}",
        ),
        Check(
            name="rest",
            holds=n_moved <= _REST_COUNTS,
            result=f"{n_moved} counts in a second; at most {_REST_COUNTS} at rest",
        ),
    ]


def _check_torque_mode(puck: AwakePuck, options: PuckOptions) -> Check:
    torque = "T reads back" if options.checks_torque else "T not asked for"
    holds, result = True, f"in and out of it; {torque}; idle now"
    try:
        puck.activate(checks_torque=options.checks_torque)
    except DeviceError as error:
        holds, result = False, str(error)
    finally:
        puck.release()
    return Check(name="torque mode", holds=holds, result=result)
