"""The Puck's CAN bus: bytes to values and back, and frames by python-can.

Source of the frames: Barrett WAM Arm User's Manual D1001 AH.00, pp. 46-48. What the
pages leave open is decided here as the two public drivers of the arm do it, and so that
a decoder takes whatever either of them takes. This is the only module that imports
python-can: each of its errors becomes a `BusError`, and every wait ends at a time on
the loop's clock.
"""

from types import ModuleType, TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from masrel.errors import BusError, DeviceError, FrameError
from masrel.lab.hess._clock import Clock

if TYPE_CHECKING:
    import can  # loaded when a bus is opened

    from masrel.lab.hess.puck._emulator import PuckEmulator  # which is on such a bus

BITRATE = 1_000_000
"""Bits a second on a Puck's bus."""

MAX_TORQUE = 8191
"""Current units: the most that 14 bits with sign can say, as on a bus of four pucks."""

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


# Identifiers: 11 bits, G FFFFF TTTTT, which are whether the receiver is a group, the
# sender, and the receiver (p. 46). The host is node 0, so that its frames to one puck
# have the puck's number.

SAFETY_NODE = 10  # watches a whole arm; has nothing to say to a driver of one joint
MAX_NODE = 31

POSITION_GROUP = 3  # where pucks answer a request for P
PROPERTY_GROUP = 6  # where they answer any other

_GROUP_FLAG = 0x400


def from_node(sender: int, group: int) -> int:
    """Return the identifier of a frame to a group."""
    return _GROUP_FLAG | sender << 5 | group


def reply_identifiers(puck: int) -> tuple[int, int]:
    """Return under which identifiers a puck sends positions, and other properties."""
    return from_node(puck, POSITION_GROUP), from_node(puck, PROPERTY_GROUP)


# Properties: a byte with the property's number, then the value, lowest byte first
# (p. 47). The top bit of the first byte says that a value follows.

_VALUE_FLAG = 0x80
_PROPERTY_MASK = 0x7F


def encode_get(number: int) -> bytes:
    """Return the data that request a property."""
    return bytes((_checked(number),))


def _checked(number: int) -> int:
    if not 0 <= number <= _PROPERTY_MASK:
        raise FrameError(f"property: needs 0 to {_PROPERTY_MASK}, got {number}")
    return number


def encode_value(number: int, value: int) -> bytes:
    """Return the data that set a property, or with which a puck answers."""
    try:
        in_bytes = value.to_bytes(4, "little", signed=True)
    except OverflowError as error:
        raise FrameError(f"value: needs 32 bits with sign, got {value}") from error
    return bytes((_VALUE_FLAG | _checked(number), 0)) + in_bytes


def decode_request(data: bytes) -> tuple[int, int | None]:
    """Return the property that is requested and None, or that is set and its value."""
    if len(data) == 1 and not data[0] & _VALUE_FLAG:
        return data[0], None
    return decode_value(data, "request")


def decode_value(data: bytes, what: str = "reply") -> tuple[int, int]:
    """Return the number of a property, and its value."""
    if len(data) not in (4, 6) or not data[0] & _VALUE_FLAG:
        raise _malformed(f"{what}: needs 4 or 6 bytes, the first from 80 up", data)
    value = int.from_bytes(data[2:], "little", signed=True)
    return data[0] & _PROPERTY_MASK, value


def _malformed(needs: str, data: bytes) -> FrameError:
    return FrameError(f"{needs}, got {data.hex(' ') or 'none'}")


# Positions: 22 bits, highest byte first, unlike all else (p. 48). One public driver
# ignores the two bits above them, the other needs the upper one to be set. Three more
# bytes are the position of a second encoder, which this driver does not use.

_POSITION_MASK = 0x3FFFFF


def encode_position(counts: int) -> bytes:
    """Return the data with which a puck answers a request for its position."""
    return (counts & _POSITION_MASK).to_bytes(3, "big")


def decode_position(data: bytes) -> int:
    """Return the lowest 22 bits of the encoder's count, signed: it wraps."""
    if len(data) not in (3, 6):
        raise _malformed("position: needs 3 or 6 bytes", data)
    value, sign = int.from_bytes(data[:3], "big"), 1 << 21  # two's complement
    return (value & _POSITION_MASK ^ sign) - sign


# Frames, by python-can


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


class Link:
    """One end of a bus, as `connected` opens it; a context manager that leaves it.

    Parameters
    ----------
    bus : can.BusABC
        An open bus.
    clock : Clock
        The clock of deadlines.
    peer : PuckEmulator or None, optional
        An emulator in the same thread, which is served whenever this end sends or
        waits, so that a bus works on a simulated clock too, and closed with it.

    Attributes
    ----------
    peer : PuckEmulator or None
        That emulator.
    """

    def __init__(
        self, bus: "can.BusABC", clock: Clock, *, peer: "PuckEmulator | None" = None
    ) -> None:
        self._can = _python_can()
        self._bus = bus
        self._clock = clock
        self.peer = peer

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
        if self.peer is not None:
            self.peer.serve()
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
        if self.peer is None:
            left_ns = deadline_ns - self._clock.now_ns()
            return self._next_frame(max(0.0, left_ns * 1e-9))
        while True:
            self.peer.serve()
            frame = self._next_frame(0.0)
            if frame is not None:
                return frame
            due_ns = self.peer.next_due_ns()
            if due_ns is None or due_ns > deadline_ns:
                self._clock.sleep_until_ns(deadline_ns)
                self.peer.serve()
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
            if self.peer is not None:
                self.peer.close()

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
    peer: "PuckEmulator | None" = None,
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
