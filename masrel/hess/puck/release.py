"""Let go of a puck: no torque, idle, and its word for it."""

from masrel.errors import BusError, DeviceError, DeviceTimeoutError, FrameError
from masrel.hess.puck.node import PuckNode
from masrel.hess.puck.properties import STATUS
from masrel.hess.puck.states import ASLEEP, IDLE

__all__ = ["release"]

_PATIENCE_S = 0.1  # also what a bus needs that restarts itself after bus off
_ANSWER_S = 0.005
_BLIND_AFTER_S = 0.05
_PAUSE_S = 0.001  # between two tries


def release(node: PuckNode, *, torque_number: int, mode_number: int) -> None:
    """Zero the torque and idle a puck, again and again until it confirms."""
    begun_ns = node.now_ns()
    reason = "it does not go to idle"
    while (since_s := (node.now_ns() - begun_ns) * 1e-9) < _PATIENCE_S:
        try:
            node.tell(torque_number, 0)
            if _is_asleep(node, blindly=since_s > _BLIND_AFTER_S):
                return
            node.tell(mode_number, IDLE)
            node.tell(mode_number, IDLE)  # twice: a regular loss may not hit both
            if node.ask(mode_number, patience_s=_ANSWER_S) == IDLE:
                return
        except (BusError, DeviceTimeoutError, FrameError) as error:
            reason = str(error)
        node.wait(_PAUSE_S)
    raise DeviceError(
        f"puck {node.puck}: not idle after {_PATIENCE_S * 1e3:g} ms ({reason}); it may "
        "hold its last torque: SWITCH ITS SUPPLY OFF"
    )


def _is_asleep(node: PuckNode, *, blindly: bool) -> bool:
    # One that was reset drives nothing, and has the lock of its memory where MODE was.
    # One that is not heard for long is taken to be awake: idling it matters more.
    try:
        return node.ask(STATUS, patience_s=_ANSWER_S) == ASLEEP
    except (BusError, DeviceTimeoutError, FrameError):
        if blindly:
            return False
        raise
