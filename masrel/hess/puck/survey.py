"""Who is on the bus, and whether a puck is fit to be driven; nothing moves."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from masrel.errors import DeviceError, DeviceTimeoutError
from masrel.hess.clock import Clock
from masrel.hess.hand import Hand
from masrel.hess.puck import bring_up
from masrel.hess.puck.bus import Link, open_link
from masrel.hess.puck.emulator import PuckEmulator
from masrel.hess.puck.faults import EmulatorOptions
from masrel.hess.puck.node import PuckNode, accepted_identifiers
from masrel.hess.puck.options import PuckOptions
from masrel.hess.puck.properties import PropertyTable
from masrel.hess.puck.transmission import Transmission

__all__ = ["Awake", "Found", "awake", "connected", "probe"]

_HIGHEST_NODE = 31
_PROBE_PATIENCE_S = 0.01  # public drivers wait 1 and 100 ms
_SHOWN = ("MODE", "CTS", "IPNM", "MT", "GRPA", "GRPB", "GRPC", "TEMP", "VBUS")
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
class Found:
    """A node that answers.

    Attributes
    ----------
    puck : int
        Its node.
    kind : str
        What it is, from its ROLE.
    is_awake : bool
        Whether it has left its monitor.
    firmware : int
        VERS.
    is_supported : bool
        Whether this driver can drive it.
    properties : dict of str to int
        What else it says, while it is awake and supported.
    """

    puck: int
    kind: str
    is_awake: bool
    firmware: int
    is_supported: bool
    properties: dict[str, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Awake:
    """A puck that is awake, idle and configured.

    Attributes
    ----------
    node : PuckNode
        The puck.
    table : PropertyTable
        Numbers of its properties.
    transmission : Transmission
        What it counts in.
    was_asleep : bool
        Whether it was woken just now, and so does not know where the arm is.
    """

    node: PuckNode
    table: PropertyTable
    transmission: Transmission
    was_asleep: bool


@contextmanager
def connected(
    options: PuckOptions,
    *,
    clock: Clock,
    hand: Hand | None = None,
    range_end: float,
    hears_all: bool = False,
) -> Iterator[Link]:
    """Join a bus for a while, with an emulated puck on it where there is a hand.

    Parameters
    ----------
    options : PuckOptions
        Which bus.
    clock : Clock
        The clock of deadlines.
    hand : Hand or None, optional
        What moves the arm of an emulated puck.
    range_end : float
        Where that arm meets its end stop, rad.
    hears_all : bool, optional
        Whether to listen to all pucks rather than to one.

    Yields
    ------
    Link
        This end of the bus.

    Raises
    ------
    DeviceError
        If the bus cannot be opened.
    """
    emulator = None
    if hand is not None:
        emulator = PuckEmulator(
            link=open_link(options.interface, options.channel, clock=clock),
            clock=clock,
            hand=hand,
            range_end=range_end,
            options=options.emulator or EmulatorOptions(),
            puck=options.puck,
        )
    link = open_link(
        options.interface,
        options.channel,
        clock=clock,
        accepted=None if hears_all else accepted_identifiers(options.puck),
        neighbour=emulator,
    )
    try:
        yield link
    finally:
        link.close()
        if emulator is not None:
            emulator.close()


def probe(
    link: Link,
    clock: Clock,
    *,
    properties: PropertyTable | None = None,
    progress: Callable[[], None] = lambda: None,
) -> tuple[Found, ...]:
    """Ask every node who it is; nothing is set, and nobody is woken.

    Parameters
    ----------
    link : Link
        The bus.
    clock : Clock
        Its clock.
    properties : PropertyTable or None, optional
        Numbers of the properties, where a firmware is unknown to this driver.
    progress : callable, optional
        Called after each of the 31 nodes.

    Returns
    -------
    tuple of Found
        Those that answer, in the order of their nodes.

    Raises
    ------
    DeviceError
        If the bus fails.
    """
    found = []
    for number in range(1, _HIGHEST_NODE + 1):
        one = _probed(PuckNode(link, clock, number), properties)
        if one is not None:
            found.append(one)
        progress()
    return tuple(found)


def _probed(node: PuckNode, properties: PropertyTable | None) -> Found | None:
    try:
        identity = bring_up.identify(node, patience_s=_PROBE_PATIENCE_S)
    except DeviceTimeoutError:
        return None
    table: PropertyTable | None = None
    try:
        table = bring_up.table_of(identity, properties)
    except DeviceError:
        pass  # that it is not supported is what is found
    said: dict[str, int] = {}
    if identity.is_awake and table is not None:
        for name in _SHOWN:
            if name in table.numbers:
                said[name] = node.ask(table.number(name))
    return Found(
        puck=node.puck,
        kind=_KINDS.get(identity.role & 0x1F, f"unknown, ROLE {identity.role}"),
        is_awake=identity.is_awake,
        firmware=identity.firmware,
        is_supported=table is not None,
        properties=said,
    )


def awake(link: Link, clock: Clock, options: PuckOptions) -> Awake:
    """Wake a puck if it sleeps, idle it, and set what the driver needs set.

    Parameters
    ----------
    link : Link
        The bus.
    clock : Clock
        Its clock.
    options : PuckOptions
        Which puck.

    Returns
    -------
    Awake
        The puck, idle.

    Raises
    ------
    DeviceError
        If it does not answer, is not supported, or does not take a setting.
    """
    node = PuckNode(link, clock, options.puck)
    identity = bring_up.identify(node)
    table = bring_up.table_of(identity, options.properties)
    if not identity.is_awake:
        bring_up.wake(node)
    return Awake(
        node=node,
        table=table,
        transmission=bring_up.configure(node, table, options),
        was_asleep=not identity.is_awake,
    )
