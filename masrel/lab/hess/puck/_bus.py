"""The CAN bus, by python-can: the only module that imports it.

Each frame on the bus becomes a `Frame`, each error of python-can a `BusError`, and
every wait ends at a time on the loop's clock.
"""

from types import ModuleType, TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, Self

from masrel.errors import BusError, DeviceError
from masrel.lab.hess.clock import Clock

if TYPE_CHECKING:
    import can  # loaded when a bus is opened

BITRATE = 1_000_000
"""Bits a second on a Puck's bus."""

# Classes of error in the identifier of SocketCAN's error frames (linux/can/error.h)
BUS_OFF, BUS_RESTARTED = 0x040, 0x100

# What python-can's interfaces raise, beside its own `CanError`, when an adapter or its
# maker's library is missing, or a channel is not enough
_NOT_OPENED = (
    ImportError,
    NameError,
    NotImplementedError,
    OSError,
    TypeError,
    ValueError,
)

_FILTERS_IN_KERNEL = frozenset({"socketcan"})


class Frame(NamedTuple):
    """One frame of the bus.

    Attributes
    ----------
    identifier : int
        Identifier of 11 bits; for an error frame the class of error.
    data : bytes
        Up to eight bytes.
    is_error : bool
        Whether the controller reports an error with it.
    """

    identifier: int
    data: bytes
    is_error: bool = False


class InProcessPeer(Protocol):
    """Another node on a bus inside this process, served whenever the host waits."""

    def next_due_ns(self) -> int | None:
        """Return when it will act next, ns; None when it waits for a frame."""

    def serve(self) -> None:
        """Take in what was sent and do what is due by now."""

    def close(self) -> None:
        """Leave the bus, after the host."""


class Link:
    """One end of a bus, as `connected` opens it; a context manager that leaves it.

    Parameters
    ----------
    bus : can.BusABC
        An open bus.
    clock : Clock
        The clock of deadlines.
    peer : InProcessPeer or None, optional
        An emulator in the same thread, which is served whenever this end sends or
        waits, so that a bus works on a simulated clock too, and closed with it.
    """

    def __init__(
        self, bus: "can.BusABC", clock: Clock, *, peer: InProcessPeer | None = None
    ) -> None:
        self._can = _python_can()
        self._bus = bus
        self._clock = clock
        self._peer = peer

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
            if error is None:  # an error inside the block matters more
                raise

    def send(self, frame: Frame) -> int:
        """Send a frame to the bus.

        Parameters
        ----------
        frame : Frame
            What to send.

        Returns
        -------
        int
            When it was handed to the bus, ns.

        Raises
        ------
        BusError
            If the bus does not take it.
        """
        message = self._can.Message(
            arbitration_id=frame.identifier,
            data=frame.data,
            is_extended_id=False,
            is_error_frame=frame.is_error,
        )
        now_ns = self._clock.now_ns()
        try:
            self._bus.send(message)
        except (self._can.CanError, OSError) as error:
            raise BusError(f"puck: the bus takes no frame ({error})") from error
        if self._peer is not None:
            self._peer.serve()
        return now_ns

    def receive(self, deadline_ns: int) -> Frame | None:
        """Wait for a frame.

        Parameters
        ----------
        deadline_ns : int
            When to give up, ns; a time that has passed takes what is there already.

        Returns
        -------
        Frame or None
            The oldest that has not been received yet; None when none came.

        Raises
        ------
        BusError
            If the bus cannot be read.
        """
        if self._peer is None:
            left_ns = deadline_ns - self._clock.now_ns()
            return self._next_frame(max(0.0, left_ns * 1e-9))
        while True:
            self._peer.serve()
            frame = self._next_frame(0.0)
            if frame is not None:
                return frame
            due_ns = self._peer.next_due_ns()
            if due_ns is None or due_ns > deadline_ns:
                self._clock.sleep_until_ns(deadline_ns)
                self._peer.serve()
                return None
            self._clock.sleep_until_ns(due_ns)

    def close(self) -> None:
        """Leave the bus; doing it twice does nothing more.

        Raises
        ------
        BusError
            If the adapter does not let go.
        """
        try:
            self._bus.shutdown()
        except (self._can.CanError, OSError) as error:
            raise BusError(f"puck: the bus cannot be left ({error})") from error
        finally:
            if self._peer is not None:
                self._peer.close()

    def _next_frame(self, timeout_s: float) -> Frame | None:
        # A timeout of 0 does not wait.
        try:
            message = self._bus.recv(timeout_s)
        except (self._can.CanError, OSError) as error:
            raise BusError(f"puck: the bus cannot be read ({error})") from error
        if message is None:
            return None
        if message.is_error_frame:
            return Frame(message.arbitration_id, bytes(message.data), is_error=True)
        if message.is_extended_id or message.is_remote_frame:
            return Frame(0, b"")  # not of a puck's bus; from the host to the host
        return Frame(message.arbitration_id, bytes(message.data))


def _python_can() -> ModuleType:
    try:
        import can
    except ImportError as error:
        raise DeviceError(
            "puck: needs python-can; install it with: pip install 'masrel[can]'"
        ) from error
    return can


def open_link(
    interface: str,
    channel: str,
    *,
    clock: Clock,
    accepted: tuple[int, ...] | None = None,
    peer: InProcessPeer | None = None,
) -> Link:
    """Open one end of a bus; `accepted` identifiers are filtered in the kernel."""
    # Where no kernel filters, whoever receives looks at the identifiers: filters of
    # python-can would drop error frames too.
    can = _python_can()
    filters: list[dict[str, Any]] | None = None
    if accepted is not None and interface in _FILTERS_IN_KERNEL:
        filters = [
            {"can_id": identifier, "can_mask": 0x7FF, "extended": False}
            for identifier in accepted
        ]
    try:
        bus = can.Bus(
            interface=interface,
            can_filters=filters,
            ignore_config=True,  # no file of python-can's changes what is opened
            **_bus_arguments(interface, channel),
        )
    except (can.CanError, *_NOT_OPENED) as error:
        raise BusError(
            f"puck: cannot open channel {channel!r} of interface {interface!r} "
            f"({error})"
        ) from error
    return Link(bus, clock, peer=peer)


def _bus_arguments(interface: str, channel: str) -> dict[str, Any]:
    if interface != "udp_multicast":
        return {"channel": channel, "bitrate": BITRATE}
    # The bus is for processes of one machine: its packets do not leave it. The channel
    # is a group, or an IPv4 group, a colon and a port.
    arguments: dict[str, Any] = {"channel": channel, "hop_limit": 0}
    group, colon, port = channel.partition(":")
    if colon and port.isdecimal():
        arguments.update(channel=group, port=int(port))
    return arguments
