"""What comes in over the bus, and where each frame of it belongs."""

from masrel.errors import BusError
from masrel.hess.puck.bus import BUS_OFF, BUS_RESTARTED, Frame
from masrel.hess.puck.identifiers import POSITION_GROUP, PROPERTY_GROUP, from_puck
from masrel.hess.puck.positions import Position, decode_position
from masrel.hess.puck.replies import decode_reply

__all__ = ["Arrivals", "accepted_identifiers"]

_ERROR_FRAMES = 10  # on a bus of one joint there should be none


def accepted_identifiers(puck: int) -> tuple[int, int]:
    """Return the only identifiers that a driver of one puck listens to."""
    return from_puck(puck, POSITION_GROUP), from_puck(puck, PROPERTY_GROUP)


class Arrivals:
    """Positions, answers, errors and frames of others, for the driver of one puck."""

    __slots__ = (
        "_positions",
        "_properties",
        "_puck",
        "heard",
        "n_errors",
        "n_foreign",
        "n_late",
    )

    def __init__(self, puck: int) -> None:
        self._puck = puck
        self._positions, self._properties = accepted_identifiers(puck)
        self.heard: dict[int, int] = {}
        self.n_foreign = 0
        self.n_late = 0
        self.n_errors = 0

    def sort(self, frame: Frame) -> Position | None:
        """Put a frame where it belongs."""
        if frame.is_error:
            self._note_error(frame.identifier)
        elif frame.identifier == self._positions:
            return decode_position(frame.data)
        elif frame.identifier == self._properties:
            answer = decode_reply(frame.data)
            self.heard[answer.property_id] = answer.value
        else:
            self.n_foreign += 1
        return None

    def _note_error(self, error_class: int) -> None:
        if error_class & BUS_RESTARTED:
            return
        if error_class & BUS_OFF:
            raise BusError(
                f"puck {self._puck}: bus off, the host's controller has given up",
                "bus-off",
            )
        self.n_errors += 1
        if self.n_errors > _ERROR_FRAMES:
            raise BusError(
                f"puck {self._puck}: needs at most {_ERROR_FRAMES} error frames, the "
                f"bus has reported {self.n_errors}, the last of class "
                f"{error_class:#05x}",
                "error-frames",
            )
