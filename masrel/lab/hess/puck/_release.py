"""Let go of a puck: zero torque, idle, confirmed; also from the watchdog's process."""

import atexit
from collections.abc import Callable

from masrel.errors import BusError, DeviceError, DeviceTimeoutError, FrameError
from masrel.lab.hess.clock import RealClock
from masrel.lab.hess.device import IdleCommand
from masrel.lab.hess.puck._bus import open_link
from masrel.lab.hess.puck._codec import reply_identifiers
from masrel.lab.hess.puck._node import PuckNode
from masrel.lab.hess.puck._properties import ASLEEP, IDLE, STATUS
from masrel.lab.hess.puck._puck_options import PuckOptions

_PATIENCE_S = 0.1  # also what a bus needs that restarts itself after bus off
_REPLY_PATIENCE_S = 0.005
_BLIND_AFTER_S = 0.05
_PAUSE_S = 0.001  # between two attempts

_SHARED_INTERFACES = frozenset({"socketcan", "udp_multicast"})


def release(node: PuckNode, *, torque_id: int, mode_id: int) -> None:
    """Zero the torque and idle a puck, again and again until it confirms."""
    start_ns = node.now_ns()
    reason = "it does not go to idle"
    while (since_s := (node.now_ns() - start_ns) * 1e-9) < _PATIENCE_S:
        try:
            node.set(torque_id, 0)
            if _is_asleep(node, blindly=since_s > _BLIND_AFTER_S):
                return
            node.set(mode_id, IDLE)
            node.set(mode_id, IDLE)  # twice: a regular loss may not hit both
            if node.get(mode_id, patience_s=_REPLY_PATIENCE_S) == IDLE:
                return
        except (BusError, DeviceTimeoutError, FrameError) as error:
            reason = str(error)
        node.wait(_PAUSE_S)
    raise DeviceError(
        f"puck {node.puck}: not idle after {_PATIENCE_S * 1e3:g} ms ({reason}); it may "
        "hold its last torque: SWITCH ITS SUPPLY OFF"
    )


def _is_asleep(node: PuckNode, *, blindly: bool) -> bool:
    # A puck that was reset drives nothing, and the number of MODE is that of LOCK, of
    # its memory. One that is silent for long is taken to be awake: idling it matters
    # more.
    try:
        return node.get(STATUS, patience_s=_REPLY_PATIENCE_S) == ASLEEP
    except (BusError, DeviceTimeoutError, FrameError):
        if blindly:
            return False
        raise


def release_command(
    options: PuckOptions, *, torque_id: int, mode_id: int
) -> IdleCommand | None:
    """Return how another process can release a puck; None where it cannot."""
    # python-can's "virtual" is inside this process, and most makers' adapters belong
    # to whoever opened them.
    if options.interface not in _SHARED_INTERFACES:
        return None
    bus = (options.interface, options.channel)
    return IdleCommand(
        __name__, (*bus, str(options.puck), str(torque_id), str(mode_id))
    )


def prepare(
    interface: str, channel: str, puck: str, torque_id: str, mode_id: str
) -> Callable[[], None]:
    """Join the bus, as the watchdog's process, and return what releases the puck."""
    clock = RealClock()
    node_number = int(puck)
    link = open_link(
        interface, channel, clock=clock, accepted=reply_identifiers(node_number)
    )
    atexit.register(link.close)
    node = PuckNode(link, clock, node_number)

    def idle() -> None:
        release(node, torque_id=int(torque_id), mode_id=int(mode_id))

    return idle
