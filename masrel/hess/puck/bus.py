"""The CAN bus, by python-can: the only module that imports it.

A frame that a bus reports is a `Frame`, an error that python-can raises a
`DeviceError`, a wait ends at a time on the loop's clock.
"""

from types import TracebackType
from typing import Any, NamedTuple, Protocol, Self

from masrel.errors import BusError, DeviceError
from masrel.hess.clock import Clock

try:
    import can
except ImportError as error:
    raise DeviceError(
        "puck: needs python-can; install it with: pip install 'masrel[can]'"
    ) from error

__all__ = [
    "BUS_OFF",
    "BUS_RESTARTED",
    "CONTROLLER_ERROR",
    "Frame",
    "Link",
    "Neighbour",
    "open_link",
]

BITRATE = 1_000_000
"""Bits a second on a Puck's bus."""

# Classes of error in the identifier of SocketCAN's error frames (linux/can/error.h)
CONTROLLER_ERROR, BUS_OFF, BUS_RESTARTED = 0x004, 0x040, 0x100

# What python-can raises where it knows no such interface, and its interfaces where an
# adapter or its maker's library is missing or they have to be told more than a channel
_NOT_OPENED = (
    can.CanError,
    ImportError,
    NameError,
    NotImplementedError,
    OSError,
    TypeError,
    ValueError,
)

_FILTERS_IN_KERNEL = frozenset({"socketcan"})


class Frame(NamedTuple):
    """One frame of the bus."""

    identifier: int  # identifier of 11 bits; for an error frame the class of error
    data: bytes  # up to eight bytes
    is_error: bool = False  # whether the controller reports an error with it


class Neighbour(Protocol):
    """Somebody else on an in-process bus, who acts when the host sends or waits."""

    def next_due_ns(self) -> int | None:
        """Return when it will act next, ns; None when it waits for a frame."""
        ...

    def serve(self) -> None:
        """Take in what was sent and do what is due by now."""
        ...


class Link:
    """One end of a bus; a context manager that leaves it."""

    __slots__ = ("_bus", "_clock", "_neighbour")

    def __init__(
        self, bus: can.BusABC, clock: Clock, *, neighbour: Neighbour | None = None
    ) -> None:
        self._bus = bus
        self._clock = clock
        self._neighbour = neighbour

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            self.close()
        except BusError:
            if error is None:  # else that one matters more
                raise

    def send(self, frame: Frame) -> int:
        """Send a frame."""
        message = can.Message(
            arbitration_id=frame.identifier,
            data=frame.data,
            is_extended_id=False,
            is_error_frame=frame.is_error,
        )
        now_ns = self._clock.now_ns()
        try:
            self._bus.send(message)
        except (can.CanError, OSError) as error:
            raise BusError(f"puck: the bus takes no frame ({error})") from error
        if self._neighbour is not None:
            self._neighbour.serve()
        return now_ns

    def receive(self, deadline_ns: int) -> Frame | None:
        """Wait for a frame."""
        if self._neighbour is None:
            left_ns = deadline_ns - self._clock.now_ns()
            return self._received(max(0.0, left_ns * 1e-9))
        while True:
            self._neighbour.serve()
            frame = self._received(0.0)
            if frame is not None:
                return frame
            due_ns = self._neighbour.next_due_ns()
            if due_ns is None or due_ns > deadline_ns:
                self._clock.sleep_until_ns(deadline_ns)
                self._neighbour.serve()
                return None
            self._clock.sleep_until_ns(due_ns)

    def close(self) -> None:
        """Leave the bus; doing it twice does nothing more."""
        try:
            self._bus.shutdown()
        except (can.CanError, OSError) as error:
            raise BusError(f"puck: the bus cannot be left ({error})") from error

    def _received(self, timeout_s: float) -> Frame | None:
        # A timeout of 0 does not wait.
        try:
            message = self._bus.recv(timeout_s)
        except (can.CanError, OSError) as error:
            raise BusError(f"puck: the bus cannot be read ({error})") from error
        if message is None:
            return None
        if message.is_error_frame:
            return Frame(message.arbitration_id, bytes(message.data), is_error=True)
        if message.is_extended_id or message.is_remote_frame:
            return Frame(0, b"")  # not of a puck's bus; from the host to the host
        return Frame(message.arbitration_id, bytes(message.data))


def open_link(
    interface: str,
    channel: str,
    *,
    clock: Clock,
    accepted: tuple[int, ...] | None = None,
    neighbour: Neighbour | None = None,
) -> Link:
    """Open one end of a bus."""
    filters: list[can.typechecking.CanFilter] | None = None
    if accepted is not None and interface in _FILTERS_IN_KERNEL:
        filters = [
            {"can_id": identifier, "can_mask": 0x7FF, "extended": False}
            for identifier in accepted
        ]
    try:
        bus = can.Bus(
            interface=interface,
            can_filters=filters,
            ignore_config=True,  # what is opened is what was asked for
            **_settings(interface, channel),
        )
    except _NOT_OPENED as error:
        raise BusError(
            f"puck: cannot open channel {channel!r} of interface {interface!r} "
            f"({error})"
        ) from error
    return Link(bus, clock, neighbour=neighbour)


def _settings(interface: str, channel: str) -> dict[str, Any]:
    if interface != "udp_multicast":
        return {"channel": channel, "bitrate": BITRATE}
    # A bus between the processes of one machine does not leave it.
    settings: dict[str, Any] = {"channel": channel, "hop_limit": 0}
    group, colon, port = channel.partition(":")
    if colon and port.isdecimal():
        settings.update(channel=group, port=int(port))
    return settings
