"""Idle a puck from another process: what the watchdog does when the loop has died."""

import atexit
from collections.abc import Callable

from masrel.hess.clock import RealClock
from masrel.hess.puck.arrivals import accepted_identifiers
from masrel.hess.puck.bus import open_link
from masrel.hess.puck.node import PuckNode
from masrel.hess.puck.release import release

__all__ = ["prepare"]


def prepare(
    interface: str, channel: str, puck: str, torque_number: str, mode_number: str
) -> Callable[[], None]:
    """Join the bus and be ready to idle the puck."""
    clock = RealClock()
    node_number = int(puck)
    link = open_link(
        interface, channel, clock=clock, accepted=accepted_identifiers(node_number)
    )
    atexit.register(link.close)
    node = PuckNode(link, clock, node_number)

    def idle() -> None:
        release(node, torque_number=int(torque_number), mode_number=int(mode_number))

    return idle
