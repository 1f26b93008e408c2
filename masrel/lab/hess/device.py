"""What a device is to the control loop, what one is made from, and devices by name."""

import importlib
import math
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import entry_points
from types import TracebackType
from typing import Any, ClassVar, Literal, NamedTuple, Self, TypeVar

from masrel._input import listed, refuse
from masrel.errors import DeviceError
from masrel.lab.hess._clock import Clock
from masrel.lab.hess.hand import Hand
from masrel.lab.recording import Channel

_State = Literal["new", "open", "closed"]
_Result = TypeVar("_Result")


class Reading(NamedTuple):
    """One reading of the encoder; a named tuple because one is made per tick.

    Attributes
    ----------
    time_ns : int
        When it was read, on the device's clock.
    angle : float
        Elbow angle, rad: 0 is full flexion and grows with extension. The speed
        is not read but estimated by the loop, the same way for every device.
    channels : tuple of float, optional
        One value for each of `Device.channels`, of the same time and in their units;
        ``nan`` where none has come since the last reading, never an old one again.
    """

    time_ns: int
    angle: float
    channels: tuple[float, ...] = ()


class IdleCommand(NamedTuple):
    """How another process can idle the device when this one has died.

    Attributes
    ----------
    module : str
        A module with a function ``prepare(*arguments)``, which takes hold of the
        device and returns a function without arguments that idles it.
    arguments : tuple of str
        What it is called with.
    """

    module: str
    arguments: tuple[str, ...]


class Device(ABC):
    """A one-joint device in torque mode.

    A device is opened once and closed once: what was closed, by a fault or on
    purpose, stays closed, and going on needs a new one. Opening an open device and
    closing a closed one do nothing. `close` sends zero torque first. A subclass
    provides the four hooks `_start`, `_read`, `_send`, `_stop`; hardware `_check` and
    `idle_command` too.

    Attributes
    ----------
    name : str
        Name of the backend, as in `open_device`.
    simulated : bool
        Whether no hardware moves; goes into every recording.
    channels : tuple of Channel
        What it measures beside the angle, with every reading; none by default. The
        torque of its sensor is `masrel.lab.recording.MEASURED_TORQUE`.
    is_replay : bool
        Whether what it measures does not come of the torque that it is sent; False by
        default.
    torque_gain : float
        How many times the torque that it is sent it gives, as was measured; 1 by
        default. Commands are divided by it.
    torque_delay : float
        How long after a command the torque follows, s, as was measured; 0 by default.
    holds_torque_when_silent : bool or None
        Whether it keeps its last torque when nothing more is sent, as after a cable
        comes off. Hardware must say; None, the default, where none moves.
    """

    name: ClassVar[str]
    simulated: bool
    channels: tuple[Channel, ...] = ()
    is_replay: bool = False
    torque_gain: float = 1.0
    torque_delay: float = 0.0
    holds_torque_when_silent: bool | None = None

    _state: _State = "new"  # on the class, so that `__del__` always finds one

    @property
    def is_open(self) -> bool:
        """Whether it can be read and commanded."""
        return self._state == "open"

    def open(self) -> None:
        """Take hold of the device; do nothing when it is open already.

        Raises
        ------
        DeviceError
            If it was closed before, cannot be opened, or is hardware that does not say
            whether it holds its torque when nothing is sent.
        """
        refuse(
            (
                self._state == "closed",
                f"{self.name}: needs a new device, this one has been closed",
            ),
            (
                not self.simulated and self.holds_torque_when_silent is None,
                f"{self.name}: needs holds_torque_when_silent, True or False: what it "
                "does with its last torque when nothing is sent any more",
            ),
            error=DeviceError,
        )
        if self._state == "new":
            self._try("opening", self._start)
            self._state = "open"  # only after it has worked

    def read(self) -> Reading:
        """Read the encoder and the channels.

        Returns
        -------
        Reading
            Time, angle, and what each channel measures.

        Raises
        ------
        DeviceError
            If the device is not open, does not answer, or gives no angle.
        """
        self._needs_to_be_open("read")
        reading = self._try("reading", self._read)
        # anything else would end the loop from within, without a ramp
        if not (
            isinstance(reading, Reading)
            and isinstance(reading.time_ns, int)
            and isinstance(reading.angle, int | float)
        ):
            raise DeviceError(
                f"{self.name}: needs a Reading of a time in ns and an angle, got "
                f"{reading!r}"
            )
        return reading

    def command(self, torque_nm: float) -> None:
        """Send a torque, held until the next one.

        Parameters
        ----------
        torque_nm : float
            Torque at the elbow, N·m; positive resists extension.

        Raises
        ------
        DeviceError
            If the device is not open or does not take it, or the torque is not
            finite; the one before it is then held.
        """
        self._needs_to_be_open("command")
        if not math.isfinite(torque_nm):
            raise DeviceError(f"{self.name}: needs a finite torque, got {torque_nm}")
        self._try("sending a torque", self._send, torque_nm / self.torque_gain)

    def check(self) -> None:
        """Ask the device whether it still does what it is told.

        Raises
        ------
        EmergencyStopError
            If its emergency stop has been pressed.
        DeviceError
            If the device is not open, has been idled from outside, or says that
            something is wrong with it.
        """
        self._needs_to_be_open("check")
        self._try("asking for its state", self._check)

    def idle_command(self) -> IdleCommand | None:
        """Return how another process can idle the device, once it is open.

        Returns
        -------
        IdleCommand or None
            None when no other process can reach it; then no watchdog is started.
        """
        return None

    def close(self) -> None:
        """Send zero torque and let go; do nothing when there is nothing to close.

        Raises
        ------
        DeviceError
            If the device does not take the zero torque; it is let go all the same.
        """
        state, self._state = self._state, "closed"
        if state == "open":
            self._try("letting go", self._let_go)

    def _let_go(self) -> None:
        try:
            self._send(0.0)
        finally:
            self._stop()

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def __del__(self) -> None:
        if self._state == "open":
            try:
                warnings.warn(
                    f"{self.name}: a device was never closed",
                    ResourceWarning,
                    stacklevel=2,
                    source=self,
                )
            finally:  # also when warnings are errors
                self.close()

    def _try(
        self, act: str, hook: Callable[..., _Result], *arguments: float
    ) -> _Result:
        # Whatever goes wrong within a backend is a fault of the device.
        try:
            return hook(*arguments)
        except DeviceError:
            raise
        except Exception as error:
            raise DeviceError(
                f"{self.name}: {act}: {type(error).__name__}: {error}"
            ) from error

    def _needs_to_be_open(self, wish: str) -> None:
        if self._state != "open":
            raise DeviceError(
                f"{self.name}: needs an open device to {wish}, "
                f"this one is {self._state}"
            )

    @abstractmethod
    def _start(self) -> None:
        """Take hold of the hardware; raise `DeviceError` when that fails."""

    @abstractmethod
    def _read(self) -> Reading:
        """Read the encoder of an open device."""

    @abstractmethod
    def _send(self, torque_nm: float) -> None:
        """Send a torque to an open device."""

    @abstractmethod
    def _stop(self) -> None:
        """Idle the hardware and let go of it; the torque is zero already."""

    def _check(self) -> None:  # noqa: B027 - a device without a state has nothing to say
        """Ask an open device for its state; raise `DeviceError` when it is wrong."""


# Metadata of an option that is true of one moment, or of a test
_NOT_A_KEY = {"in_protocol": False}


@dataclass(frozen=True, slots=True, kw_only=True)
class BackendOptions:
    """What one backend can be told beyond `DeviceSetup`; each has a subclass.

    The fields are keys of a protocol's table ``[device.NAME]``, but those whose
    metadata say ``{"in_protocol": False}``.

    Attributes
    ----------
    moves_hardware : bool
        Whether a motor may move.
    has_simulated_hand : bool
        Whether a simulated hand moves the arm.
    """

    @property
    def moves_hardware(self) -> bool:
        """Whether a motor may move; a backend without any says so."""
        return True

    @property
    def has_simulated_hand(self) -> bool:
        """Whether a simulated hand moves the arm."""
        return False

    def emulated(self, start: float) -> Self:
        """Return the same for an arm that a simulated hand holds.

        Parameters
        ----------
        start : float
            Where it holds the arm, rad.

        Returns
        -------
        BackendOptions
            These, where nothing has to be emulated.
        """
        del start
        return self


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceSetup:
    """What a backend's `build` makes a device from.

    Attributes
    ----------
    clock : Clock
        The clock of the loop that will use it.
    hand : Hand or None
        The hand that moves a simulated arm.
    range_end : float
        Where the arm meets its end stop, rad.
    options : BackendOptions or None
        The backend's own options; None for its defaults.
    """

    clock: Clock
    hand: Hand | None = None
    range_end: float = math.radians(146.0)
    options: BackendOptions | None = None


# Name to the module whose `build` makes a device of a `DeviceSetup`, not yet open, or
# raises `DeviceError` when it does not fit, and whose `OPTIONS` are the type of its
# options; imported when it is chosen. Those of other
# distributions are entry points of the group; none takes a name of these.
_BACKENDS = {
    "moteus": "masrel.lab.hess.moteus._moteus_device",
    "puck": "masrel.lab.hess.puck._puck_device",
    "replay": "masrel.lab.hess._replay",
    "simulated": "masrel.lab.hess._simulated",
}
_GROUP = "masrel.devices"


def device_names() -> tuple[str, ...]:
    """Return the names that `open_device` knows.

    Returns
    -------
    tuple of str
        Names in alphabetical order: masrel's own, and those that other distributions
        declare as entry points of the group ``masrel.devices``.

    Examples
    --------
    >>> "simulated" in device_names()
    True
    """
    return tuple(sorted({*_BACKENDS, *entry_points(group=_GROUP).names}))


def _backend(name: str) -> Any:
    """Return the module of a device, or refuse a name that is nobody's or several's."""
    if name in _BACKENDS:
        return importlib.import_module(_BACKENDS[name])
    declared = list(entry_points(group=_GROUP, name=name))
    of = sorted(
        f"{of.dist.name} ({of.value})" if of.dist else of.value for of in declared
    )
    refuse(
        (not of, f"device: needs one of {', '.join(device_names())}, got {name!r}"),
        (len(of) > 1, f"device {name!r}: needs one distribution, got {listed(of)}"),
        error=DeviceError,
    )
    try:
        return declared[0].load()
    except Exception as error:  # whatever another's module does
        raise DeviceError(
            f"device {name!r} of {of[0]}: {type(error).__name__}: {error}"
        ) from error


def _options_type(name: str) -> type[BackendOptions]:
    """Return what a device can be told: OPTIONS of its module, if it has any."""
    options: type[BackendOptions] = getattr(_backend(name), "OPTIONS", BackendOptions)
    return options


def build_device(name: str, setup: DeviceSetup) -> Device:
    """Make a device by name, not yet open.

    Parameters
    ----------
    name : str
        One of `device_names`.
    setup : DeviceSetup
        What it is made from.

    Returns
    -------
    Device
        A new device; nothing is taken hold of before it is opened.

    Raises
    ------
    DeviceError
        If there is no device of that name or there are several, its module cannot be
        imported, or the setup does not fit it.
    """
    device: Device = _backend(name).build(setup)
    return device


def open_device(
    name: str,
    *,
    clock: Clock,
    hand: Hand | None = None,
    range_end: float = math.radians(146.0),
    options: BackendOptions | None = None,
) -> Device:
    """Open a device by name.

    Parameters
    ----------
    name : str
        One of `device_names`.
    clock : Clock
        The clock of the loop that will use it.
    hand : Hand or None, optional
        The hand that moves a simulated arm; one stretch per device.
    range_end : float, optional
        Where a simulated arm meets its end stop, rad.
    options : BackendOptions or None, optional
        What this backend alone can be told; None for its defaults.

    Returns
    -------
    Device
        Open; close it, or use it in a ``with`` block.

    Raises
    ------
    DeviceError
        If there is no device of that name or there are several, its module cannot be
        imported, a simulated one has no hand, the options are another backend's, or it
        cannot be opened.
    ParameterError
        If `range_end` does not fit the hand.

    Examples
    --------
    >>> from masrel.lab.hess import SimulatedClock, SimulatedHand
    >>> hand = SimulatedHand(start=0.5, end=2.5, mean_speed=1.5)
    >>> with open_device("simulated", clock=SimulatedClock(), hand=hand) as device:
    ...     round(device.read().angle, 3)
    0.5
    """
    setup = DeviceSetup(clock=clock, hand=hand, range_end=range_end, options=options)
    device = build_device(name, setup)
    device.open()
    return device
