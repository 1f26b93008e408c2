"""Who is on the bus; nothing is set and nobody is woken."""

from collections.abc import Callable
from dataclasses import dataclass

from masrel.errors import DeviceError, DeviceTimeoutError
from masrel.hess.clock import Clock
from masrel.hess.puck.bus import Link
from masrel.hess.puck.identity import ROLE_MASK, identify, table_of
from masrel.hess.puck.node import PuckNode
from masrel.hess.puck.properties import STATUS, PropertyTable
from masrel.hess.puck.states import ASLEEP, READY

__all__ = ["Found", "probe"]

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
    """A node that answers."""

    puck: int  # its node
    kind: str  # what it is, from its ROLE, or that it is in error
    is_awake: bool  # whether it has left its monitor
    firmware: int | None  # VERS; None where it is in error
    is_supported: bool  # whether this driver can drive it
    properties: dict[str, int]  # what else it says, while it is awake and supported


def probe(
    link: Link,
    clock: Clock,
    *,
    properties: PropertyTable | None = None,
    progress: Callable[[], None] = lambda: None,
) -> tuple[Found, ...]:
    """Ask every node who it is; nothing is set, and nobody is woken."""
    found = []
    for number in range(1, _HIGHEST_NODE + 1):
        one = _probed(PuckNode(link, clock, number), properties)
        if one is not None:
            found.append(one)
        progress()
    return tuple(found)


def _probed(node: PuckNode, properties: PropertyTable | None) -> Found | None:
    try:
        status = node.ask(STATUS, patience_s=_PROBE_PATIENCE_S)
        if status not in (ASLEEP, READY):
            return _unusable(node.puck, status)
        identity = identify(node, patience_s=_PROBE_PATIENCE_S)
    except DeviceTimeoutError:
        return None
    table: PropertyTable | None = None
    try:
        table = table_of(identity, properties)
    except DeviceError:
        pass  # that it is not supported is what is found
    said: dict[str, int] = {}
    if identity.is_awake and table is not None:
        for name in _SHOWN:
            if name in table.numbers:
                said[name] = node.ask(table.number(name))
    return Found(
        puck=node.puck,
        kind=_KINDS.get(identity.role & ROLE_MASK, f"unknown, ROLE {identity.role}"),
        is_awake=identity.is_awake,
        firmware=identity.firmware,
        is_supported=table is not None,
        properties=said,
    )


def _unusable(puck: int, status: int) -> Found:
    return Found(
        puck=puck,
        kind=f"in error, STAT {status}",
        is_awake=False,
        firmware=None,
        is_supported=False,
        properties={},
    )
