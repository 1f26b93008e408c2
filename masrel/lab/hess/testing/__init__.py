"""The contract that the loop relies on: what any device must hold, whoever wrote it.

In: how devices are made. A rule that a device breaks is a `DeviceError`. If it is
hardware, its arm must be free and nobody near it: 0.1 N·m are sent.
"""

import importlib
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from types import MappingProxyType

from masrel.errors import DeviceError, DeviceTimeoutError
from masrel.lab.hess._clock import Clock
from masrel.lab.hess._recorder import Presented
from masrel.lab.hess.controller import Controller
from masrel.lab.hess.device import Device, DeviceSetup, Reading
from masrel.lab.hess.limits import DeviceLimits
from masrel.lab.hess.loop import run_presentation

__all__ = ["CONTRACT", "DeviceUnderTest", "assert_device_contract"]

_TORQUE = 0.1  # N·m, less than the friction of any arm
_DURATION_S = 0.1
_LOST = 20  # two readings are lost from this one on, and all from twice as many on


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceUnderTest:
    """How devices of one kind are made, a new one for each rule.

    Attributes
    ----------
    build : callable
        Makes a device of a `DeviceSetup`, not yet open: `build` of its module, or
        `build_device` with its name.
    setup : callable
        Makes a new setup, in which the arm rests where the controller starts.
    controller : callable
        Makes a new `Controller`, which asks for little torque while the arm rests.
    """

    build: Callable[[DeviceSetup], Device]
    setup: Callable[[], DeviceSetup]
    controller: Callable[[], Controller]

    @contextmanager
    def _opened(self) -> Iterator[tuple[Device, Clock, list[object]]]:
        # A device, its clock, and its commands: torques, and "stop"
        setup, commands = self.setup(), list[object]()
        device = self.build(setup)
        send, stop = device._send, device._stop

        def heard_send(torque_nm: float) -> None:
            commands.append(torque_nm)
            send(torque_nm)

        def heard_stop() -> None:
            commands.append("stop")
            stop()

        vars(device).update(_send=heard_send, _stop=heard_stop)
        device.open()
        try:
            yield device, setup.clock, commands
        finally:
            with suppress(DeviceError):
                device.close()

    def _present(self, device: Device, clock: Clock) -> Presented:
        return run_presentation(
            device,
            self.controller(),
            clock=clock,
            limits=DeviceLimits(),
            max_duration_s=_DURATION_S,
        )


def _needs(holds: bool, device: Device, what: str) -> None:
    if not holds:
        raise DeviceError(f"{device.name}: needs {what}")


def _refuses(
    device: Device, what: str, act: Callable[..., object], *arguments: float
) -> None:
    try:
        act(*arguments)
    except DeviceError:
        return
    except Exception as error:  # whatever another's device does
        raise DeviceError(
            f"{device.name}: needs to refuse {what} by a DeviceError"
        ) from error
    raise DeviceError(f"{device.name}: needs to refuse {what}")


def _order_of_states(of: DeviceUnderTest) -> None:
    new = of.build(of.setup())
    _needs(not new.is_open, new, "to be built without being opened")
    _refuses(new, "a reading before it is opened", new.read)
    with of._opened() as (device, _, _):
        device.open()  # does nothing
        _needs(device.is_open, device, "to be open once it is opened")
        device.check()
        device.close()
        device.close()  # does nothing
        _needs(not device.is_open, device, "not to be open once it is closed")
        _refuses(device, "to be opened again", device.open)
        _refuses(device, "a reading once it is closed", device.read)
        _refuses(device, "to say how it is once it is closed", device.check)


def _readings(of: DeviceUnderTest) -> None:
    with of._opened() as (device, clock, _):
        columns = {channel.column for channel in device.channels}
        _needs(len(columns) == len(device.channels), device, "channels by other names")
        before_ns = -1
        for _ in range(5):
            clock.sleep_until_ns(clock.now_ns() + 1_000_000)
            reading = device.read()
            is_now = before_ns < reading.time_ns <= clock.now_ns()
            _needs(is_now, device, "the time of each reading on the loop's clock")
            # a number of numpy's would slow the loop down
            types = {type(value) for value in (reading.angle, *reading.channels)}
            is_plain = types == {float} and math.isfinite(reading.angle)
            _needs(is_plain, device, "an angle and channels that are Python's floats")
            is_full = len(reading.channels) == len(device.channels)
            _needs(is_full, device, "a number for each channel, or nan")
            before_ns = reading.time_ns


def _finite_torque_only(of: DeviceUnderTest) -> None:
    with of._opened() as (device, _, commands):
        for torque in (math.nan, math.inf, -math.inf):
            _refuses(device, f"{torque} N·m", device.command, torque)
        _needs(commands == [] and device.is_open, device, "to send none and stay open")


def _zero_before_idle(of: DeviceUnderTest) -> None:
    with of._opened() as (device, _, commands):
        device.command(_TORQUE)
        device.close()
        _refuses(device, "a torque once it is closed", device.command, _TORQUE)
        is_zero_first = commands == [_TORQUE, 0.0, "stop"]
        _needs(is_zero_first, device, f"zero torque and then to let go, got {commands}")


def _errors_are_the_devices(of: DeviceUnderTest) -> None:
    def fail(*_arguments: object) -> None:
        raise OSError("broken")

    with of._opened() as (device, _, _):
        acts: dict[str, tuple[Callable[..., object], tuple[float, ...]]] = {
            "_read": (device.read, ()),
            "_check": (device.check, ()),
            "_send": (device.command, (_TORQUE,)),
        }
        for hook, (act, arguments) in acts.items():
            right = getattr(device, hook)
            vars(device)[hook] = fail
            _refuses(device, f"an error in {hook} as its own", act, *arguments)
            vars(device)[hook] = right


def _ticks_without_a_reading(of: DeviceUnderTest) -> None:
    with of._opened() as (device, clock, commands):
        read, reads = device._read, list[int]()

        def lost() -> Reading:
            reads.append(len(reads))
            if reads[-1] in (_LOST, _LOST + 1) or reads[-1] >= 2 * _LOST:
                raise DeviceTimeoutError(f"{device.name}: no answer")
            return read()

        vars(device)["_read"] = lost
        fault = of._present(device, clock).fault
        is_lost = fault is not None and fault.kind == "missed-replies"
        goes_on = is_lost and len(reads) > 2 * _LOST
        _needs(
            goes_on, device, "to go on after two lost readings, and stop after three"
        )
        is_closed = not device.is_open and commands[-2:] == [0.0, "stop"]
        _needs(is_closed, device, "zero torque and to be closed after a fault")


def _is_presented_on(of: DeviceUnderTest) -> None:
    with of._opened() as (device, clock, _):
        presented = of._present(device, clock)
        fault = presented.fault.message if presented.fault else None
        _needs(fault is None, device, f"a presentation without a fault, got {fault}")
        channels = presented.recording.channels
        _needs(channels == device.channels, device, "its channels in the recording")


def _idle_from_elsewhere(of: DeviceUnderTest) -> None:
    with of._opened() as (device, _, _):
        idle = device.idle_command()
        if idle is None:
            is_safe = device.simulated or not device.holds_torque_when_silent
            _needs(is_safe, device, "idle_command: it holds its torque in silence")
            return
        importlib.import_module(idle.module).prepare(*idle.arguments)()
        _refuses(device, "to go on when it was idled from elsewhere", device.check)


CONTRACT: Mapping[str, Callable[[DeviceUnderTest], None]] = MappingProxyType(
    {
        "order of states": _order_of_states,
        "readings": _readings,
        "finite torque only": _finite_torque_only,
        "zero before idle": _zero_before_idle,
        "errors are the device's": _errors_are_the_devices,
        "a presentation": _is_presented_on,
        "ticks without a reading": _ticks_without_a_reading,
        "idle from elsewhere": _idle_from_elsewhere,
    }
)
"""Each rule by its name, as a check of a `DeviceUnderTest`."""


def assert_device_contract(of: DeviceUnderTest) -> None:
    """Do nothing if devices hold every rule of `CONTRACT`.

    Parameters
    ----------
    of : DeviceUnderTest
        How they are made.

    Raises
    ------
    DeviceError
        If a rule is broken: which, and what was needed.

    Examples
    --------
    >>> from functools import partial
    >>> from masrel.lab.elbow import STANDARD_MODELS
    >>> from masrel.lab.hess import SimulatedClock, SimulatedHand, build_device
    >>> def setup() -> DeviceSetup:
    ...     hand = SimulatedHand(start=0.5, end=2.5, mean_speed=1.5)
    ...     return DeviceSetup(clock=SimulatedClock(), hand=hand)
    >>> def controller() -> Controller:
    ...     return Controller(STANDARD_MODELS["HM1"], start_angle=0.5)
    >>> build = partial(build_device, "simulated")
    >>> assert_device_contract(
    ...     DeviceUnderTest(build=build, setup=setup, controller=controller)
    ... )
    """
    for rule, check in CONTRACT.items():
        try:
            check(of)
        except DeviceError as error:
            raise DeviceError(f"{rule}: {error}") from error
