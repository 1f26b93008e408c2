"""What a puck is asked between two positions: whether it still obeys."""

from masrel.errors import BusError, DeviceTimeoutError, IdledError
from masrel.hess.puck.node import PuckNode
from masrel.hess.puck.states import TORQUE

__all__ = ["Polls"]

_UNANSWERED_POLLS = 2  # one may get lost
_LOST_TORQUES = 1  # the next comes after a tick


class Polls:
    """Ask for the mode and for the torque it holds, in turn, every few torques."""

    # No setting is acknowledged. Nobody waits for the answers in the loop: they come
    # before the next position.

    __slots__ = (
        "_asks_mode",
        "_checks_torque",
        "_every",
        "_left",
        "_mode",
        "_n_lost",
        "_n_unanswered",
        "_node",
        "_told",
        "_torque",
    )

    def __init__(
        self,
        node: PuckNode,
        *,
        torque_number: int,
        mode_number: int,
        every: int,
        checks_torque: bool,
    ) -> None:
        self._node = node
        self._torque, self._mode = torque_number, mode_number
        self._every = self._left = every
        self._checks_torque = checks_torque
        self._asks_mode = True  # the next time; its torque the time after
        self._n_unanswered = 0
        self._told = 0  # current units, when its torque was asked for
        self._n_lost = 0

    def sent(self, units: int) -> None:
        """Count a torque, and ask when it is time."""
        self._left -= 1
        if self._left:
            return
        self._left = self._every
        self._n_unanswered += 1  # until the answer comes
        if self._asks_mode or not self._checks_torque:
            self._node.inquire(self._mode)
        else:
            self._told = units
            self._node.inquire(self._torque)
        self._asks_mode = not self._asks_mode

    def hear(self) -> None:
        """Look at the answers that have come."""
        heard = self._node.heard
        if heard:
            if self._mode in heard:
                self._check_mode(heard[self._mode])
            if self._torque in heard:
                self._check_torque(heard[self._torque])
            heard.clear()
        if self._n_unanswered > _UNANSWERED_POLLS:
            raise self._unanswered()

    def ask_mode(self, *, patience_s: float) -> None:
        """Ask for its mode and wait for the answer."""
        try:
            found = self._node.ask(self._mode, patience_s=patience_s)
        except DeviceTimeoutError:
            self._n_unanswered += 1
            if self._n_unanswered > _UNANSWERED_POLLS:
                raise self._unanswered() from None
        else:
            self._check_mode(found)

    def _check_mode(self, mode: int) -> None:
        self._n_unanswered = 0
        if mode != TORQUE:
            raise IdledError(
                f"puck {self._node.puck}: needs MODE {TORQUE}, somebody else "
                f"has set it to {mode}; an emergency stop, or a pendant?"
            )

    def _check_torque(self, units: int) -> None:
        self._n_unanswered = 0
        if units == self._told:
            self._n_lost = 0
            return
        self._n_lost += 1
        if self._n_lost > _LOST_TORQUES:
            raise BusError(
                f"puck {self._node.puck}: needs the torque it was told, "
                f"{self._told} current units, holds {units}, "
                f"{self._n_lost} times in a row: torques get lost",
                "lost-torques",
            )

    def _unanswered(self) -> DeviceTimeoutError:
        return DeviceTimeoutError(
            f"puck {self._node.puck}: has not said its mode or torque "
            f"{self._n_unanswered} times in a row"
        )
