"""An amplifier's CAN bus by python-can: frames, one end of a bus, and a node on it.

This is the only module that imports python-can: each of its errors becomes a
`BusError`, and every wait ends at a time on the loop's clock.
"""

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from types import ModuleType, TracebackType
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    Generic,
    Literal,
    NamedTuple,
    Self,
    TypeVar,
)

from masrel._input import refuse
from masrel.errors import (
    BusError,
    DeviceError,
    DeviceTimeoutError,
    FrameError,
    ParameterError,
)
from masrel.lab.hess._clock import Clock, SimulatedClock
from masrel.lab.hess.device import (
    BackendOptions,
    Device,
    DeviceSetup,
    IdleCommand,
)
from masrel.lab.hess.limits import DeviceLimits, _check_positive

if TYPE_CHECKING:
    import can  # loaded when a bus is opened

    from masrel.lab.hess._emulated import EmulatedAmplifier  # which is on such a bus

_BITRATE, _DATA_BITRATE = 1_000_000, 5_000_000  # bits a second; the latter of CAN-FD

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
_WITHOUT_HARDWARE = frozenset({"virtual", "udp_multicast"})

# python-can's "virtual" is inside this process, and most makers' adapters belong to
# whoever opened them: on others no other process can idle an amplifier.
_SHARED = frozenset({"socketcan", "udp_multicast"})

_MAX_WAITING = 1000  # frames; more than fit on the bus in 50 ms
_MAX_OVERDUE = 30  # more than fit on the bus in 1 ms
_MAX_ERROR_FRAMES = 10  # on a bus of one joint there should be none

_PATIENCE_S = 0.1  # to let go; also what a bus needs that restarts itself after bus off
_PAUSE_S = 0.001  # between two attempts
_LEAST_ATTEMPTS = 3


class Frame(NamedTuple):
    """One frame of the bus.

    Attributes
    ----------
    identifier : int
        Identifier of 11 bits, with CAN-FD of 29; for an error frame the class of error.
    data : bytes
        Up to eight bytes, with CAN-FD 64.
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
    options : BusOptions
        Whose bus it is.
    peer : EmulatedAmplifier or None, optional
        An emulator in the same thread, which is served whenever this end sends or
        waits, so that a bus works on a simulated clock too, and closed with it.

    Attributes
    ----------
    peer : EmulatedAmplifier or None
        That emulator.
    """

    def __init__(
        self,
        bus: "can.BusABC",
        clock: Clock,
        options: "BusOptions",
        *,
        peer: "EmulatedAmplifier | None" = None,
    ) -> None:
        self._can = _python_can(options.name)
        self._name, self._is_fd = options.name, options.is_fd
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
            is_extended_id=self._is_fd,
            is_fd=self._is_fd and not frame.is_error,
            bitrate_switch=self._is_fd and not frame.is_error,
            is_error_frame=frame.is_error,
        )
        now_ns = self._clock.now_ns()
        try:
            self._bus.send(message)
        except (self._can.CanError, OSError) as error:
            raise BusError(f"{self._name}: the bus takes no frame ({error})") from error
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
            raise BusError(f"{self._name}: the bus cannot be left ({error})") from error
        finally:
            if self.peer is not None:
                self.peer.close()

    def _next_frame(self, timeout_s: float) -> Frame | None:
        # A timeout of 0 does not wait.
        try:
            message = self._bus.recv(timeout_s)
        except (self._can.CanError, OSError) as error:
            raise BusError(f"{self._name}: the bus cannot be read ({error})") from error
        if message is None:
            return None
        if message.is_error_frame:
            return Frame(message.arbitration_id, bytes(message.data), is_error=True)
        if message.is_extended_id > self._is_fd or message.is_remote_frame:
            return Frame(0, b"")  # not of this bus; from the host to the host
        return Frame(message.arbitration_id, bytes(message.data))


def _python_can(name: str) -> ModuleType:
    try:
        import can
    except ImportError as error:
        raise DeviceError(
            f"{name}: needs python-can; install it with: pip install 'masrel[can]'"
        ) from error
    return can


@dataclass(frozen=True, slots=True, kw_only=True)
class BusOptions(BackendOptions, ABC):
    """On which bus an amplifier is; its backend's own options are a subclass."""

    name: ClassVar[str]  # of the backend
    is_fd: ClassVar[bool] = False  # whether its frames are those of CAN-FD

    interface: str = "socketcan"
    channel: str = "can0"
    direction: Literal[1, -1] = 1  # whether its numbers grow with extension
    gear_ratio: float = 1.0  # turns of it for one of the elbow
    patience_s: float = 0.001  # how long to wait for an answer: one period of the loop
    emulator: object | None = None  # what an emulated one is like

    def __post_init__(self) -> None:
        _check_positive(gear_ratio=self.gear_ratio, patience_s=self.patience_s)
        check_direction(self.direction)
        if self.emulator is not None and self.interface != "virtual":
            raise ParameterError(
                f"interface: needs 'virtual' for an emulated {self.name}, "
                f"got {self.interface!r}"
            )

    @abstractmethod
    def emulated(self, start: float) -> Self:
        """Return the same for an emulated one, whose arm is held somewhere, rad."""

    @property
    def moves_hardware(self) -> bool:
        """Whether a motor may be on this bus.

        No motor is on python-can's "virtual" and "udp_multicast", or on a network
        device whose name begins with "vcan".
        """
        return self.interface not in _WITHOUT_HARDWARE and not self.channel.startswith(
            "vcan"
        )

    @property
    def has_simulated_hand(self) -> bool:
        """Whether a simulated hand moves an emulated arm, within this process."""
        return self.interface == "virtual"

    @property
    def is_shared(self) -> bool:
        """Whether another process can join the bus."""
        return self.interface in _SHARED

    def open_link(
        self,
        clock: Clock,
        *,
        accepted: tuple[int, ...] | None = None,
        peer: "EmulatedAmplifier | None" = None,
    ) -> Link:
        """Open one end of a bus; `accepted` identifiers are filtered in the kernel."""
        # Where no kernel filters, whoever receives looks at the identifiers: filters of
        # python-can would drop error frames too.
        can = _python_can(self.name)
        filters: list[dict[str, Any]] | None = None
        if accepted is not None and self.interface in _FILTERS_IN_KERNEL:
            # an answer by CAN-FD may have either kind of identifier
            kind = {"can_mask": 0x1FFFFFFF}
            if not self.is_fd:
                kind = {"can_mask": 0x7FF, "extended": False}
            filters = [{"can_id": identifier, **kind} for identifier in accepted]
        try:
            bus = can.Bus(
                interface=self.interface,
                can_filters=filters,
                ignore_config=True,  # no file of python-can's changes what is opened
                **self._bus_arguments(),
            )
        except (can.CanError, *_NOT_OPENED) as error:
            raise BusError(
                f"{self.name}: cannot open channel {self.channel!r} of interface "
                f"{self.interface!r} ({error})"
            ) from error
        return Link(bus, clock, self, peer=peer)

    def _bus_arguments(self) -> dict[str, Any]:
        if self.interface != "udp_multicast":
            fd = {"fd": True, "data_bitrate": _DATA_BITRATE} if self.is_fd else {}
            return {"channel": self.channel, "bitrate": _BITRATE, **fd}
        # The bus is for processes of one machine: its packets do not leave it. The
        # channel is a group, or an IPv4 group, a colon and a port.
        arguments: dict[str, Any] = {"channel": self.channel, "hop_limit": 0}
        group, colon, port = self.channel.partition(":")
        if colon and port.isdecimal():
            arguments.update(channel=group, port=int(port))
        return arguments


class Node(ABC):
    """One amplifier, as this end of the bus speaks to it."""

    def __init__(self, link: Link, clock: Clock, name: str) -> None:
        self.link = link
        self.clock = clock
        self.name = name  # in messages
        self.n_foreign = self.n_errors = 0  # frames

    @abstractmethod
    def _sort(self, frame: Frame) -> None:
        """Take in a frame that is not an error."""

    def _receive_until(self, is_there: Callable[[], bool], deadline_ns: int) -> bool:
        # Whether what is waited for came in time. What waits is taken after the
        # deadline too, because this end may be late; but only so many frames, because
        # others may never fall silent.
        n_overdue = 0
        while not is_there():
            n_overdue += self.clock.now_ns() > deadline_ns
            frame = self.link.receive(deadline_ns)
            if frame is None or n_overdue > _MAX_OVERDUE:
                return False
            self._take_in(frame)
        return True

    def receive_waiting(self) -> None:
        """Receive all frames that wait: late replies, errors, frames of others."""
        for _ in range(_MAX_WAITING):
            frame = self.link.receive(0)
            if frame is None:
                return
            self._take_in(frame)
        raise BusError(f"{self.name}: the bus is flooded with frames", "flooded")

    def _take_in(self, frame: Frame) -> None:
        error_class = frame.identifier
        if not frame.is_error:
            self._sort(frame)
            return
        if error_class & BUS_RESTARTED:
            return
        if error_class & BUS_OFF:
            raise BusError(
                f"{self.name}: bus off, the host's controller has given up", "bus-off"
            )
        self.n_errors += 1
        if self.n_errors % (_MAX_ERROR_FRAMES + 1) == 0:  # it can be let go between two
            raise BusError(
                f"{self.name}: needs at most {_MAX_ERROR_FRAMES} error frames, "
                f"the bus has reported {self.n_errors}, the last of class "
                f"{error_class:#05x}",
                "error-frames",
            )

    def needs(self, holds: bool, what: str) -> None:
        """Refuse an amplifier that is not as it must be; what it must be, and is."""
        if not holds:
            raise DeviceError(f"{self.name}: needs {what}")

    def _await(
        self, is_there: Callable[[], bool], since_ns: int, patience_s: float, what: str
    ) -> None:
        # Receives until an answer is there, or refuses to wait any longer
        if not self._receive_until(is_there, since_ns + round(patience_s * 1e9)):
            raise DeviceTimeoutError(
                f"{self.name}: {what} within {patience_s * 1e3:g} ms"
            )

    def wait(self, duration_s: float) -> None:
        """Let time pass without sending a frame."""
        self.clock.sleep_until_ns(self.clock.now_ns() + round(duration_s * 1e9))

    def insist(self, attempt: Callable[[float], bool], advice: str) -> None:
        """Try to let go, again and again, until it is confirmed."""
        # The attempt is told for how long it has failed, s. A host that was away for
        # longer than its patience still has some left.
        start_ns = self.clock.now_ns()
        reason = "it does not go to idle"
        for n in itertools.count():
            since_s = (self.clock.now_ns() - start_ns) * 1e-9
            if n >= _LEAST_ATTEMPTS and since_s >= _PATIENCE_S:
                break
            try:
                if attempt(since_s):
                    return
            except (BusError, DeviceTimeoutError, FrameError) as error:
                reason = str(error)
            self.wait(_PAUSE_S)
        raise DeviceError(
            f"{self.name}: not idle after {_PATIENCE_S * 1e3:g} ms ({reason}); {advice}"
        )


_Options = TypeVar("_Options", bound=BusOptions)
_channels = itertools.count(1)


def options_of(setup: DeviceSetup, kind: type[_Options]) -> _Options:
    """Return the options of a setup: an emulator's when there is a hand, or refuse."""
    options, hand, name = setup.options, setup.hand, kind.name
    if options is None:
        if hand is None:
            raise DeviceError(f"{name}: needs options that say on which bus it is")
        # A bus that nobody else is on
        channel = f"masrel-{next(_channels)}"
        options = kind(interface="virtual", channel=channel).emulated(hand.start)
    if not isinstance(options, kind):
        got = type(options).__name__
        raise DeviceError(f"{name}: needs options of type {kind.__name__}, got {got}")
    refuse(
        (
            (hand is None) != (options.emulator is None),
            f"{name}: needs a simulated hand with an emulated {name} and none without, "
            "got " + ("an emulator alone" if hand is None else "a hand alone"),
        ),
        (
            hand is None and isinstance(setup.clock, SimulatedClock),
            f"{name}: needs a real clock, its bus is outside this process",
        ),
        error=DeviceError,
    )
    return options


class CanDevice(Device, Generic[_Options]):
    """A device on a CAN bus; what it is, and does there, is a subclass's."""

    def __init__(
        self, setup: DeviceSetup, options: _Options, connected: Callable[..., Link]
    ) -> None:
        self.simulated = not options.moves_hardware
        self._setup = setup
        self._options = options
        self._connected = connected

    @abstractmethod
    def _bring_up(self) -> None:
        """Make it ready on the bus that is joined."""

    @abstractmethod
    def _release(self) -> None:
        """Idle it."""

    @abstractmethod
    def _idle_arguments(self) -> tuple[int, ...]:
        """Return what `prepare` of its module needs beside interface and channel."""

    def _start(self) -> None:
        setup = self._setup
        link = self._connected(
            self._options, clock=setup.clock, hand=setup.hand, range_end=setup.range_end
        )
        self.emulator = link.peer
        with ExitStack() as failing:  # then the bus is left
            self._link = failing.enter_context(link)
            self._bring_up()
            failing.pop_all()

    def _stop(self) -> None:
        with self._link:  # which is left whatever comes
            self._release()

    def idle_command(self) -> IdleCommand | None:
        """Return how another process can idle it, once it is open."""
        options = self._options
        if not options.is_shared:
            return None
        arguments = map(str, self._idle_arguments())
        where = (options.interface, options.channel, *arguments)
        return IdleCommand(type(self).__module__, where)


def check_angle(name: str, angle: float) -> None:
    """Refuse an arm that is where no elbow can be."""
    limits = DeviceLimits()
    if not limits.lowest_angle <= angle <= limits.highest_angle:
        raise DeviceError(
            f"{name}: needs an arm between -5 and 185 deg, it reports "
            f"{math.degrees(angle):.1f}; run masrel device zero"
        )


def check_elbow_angle(angle: float) -> None:
    """Refuse an angle, rad, that no arm can be held at while it is zeroed."""
    if not 0.0 <= angle <= math.pi:
        raise ParameterError(f"angle: needs 0 to 180 degrees, got {angle} rad")


def check_direction(direction: int) -> None:
    """Refuse a direction that is neither with nor against extension."""
    if direction not in (1, -1):
        raise ParameterError(f"direction: needs 1 or -1, got {direction}")
