"""The control loop: one presentation at a fixed rate, recorded tick by tick."""

import gc
import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from masrel.errors import DeviceError, OverrunWarning, ParameterError
from masrel.hess.clock import Clock
from masrel.hess.controller import Controller
from masrel.hess.device import Device
from masrel.hess.limits import DeviceLimits
from masrel.hess.samples import movement_facts
from masrel.hess.ticks import Ticks
from masrel.recording import Recording

__all__ = ["Presented", "run_presentation"]

Fact = str | int | float | bool | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Presented:
    """One presentation, as it went.

    Attributes
    ----------
    recording : Recording
        Every tick that was run; its facts repeat the two fields below.
    fault : str or None
        The limit or device error that stopped it, in words; None when none did.
    n_missed_ticks : int
        Ticks skipped because the loop came too late for them.
    """

    recording: Recording
    fault: str | None
    n_missed_ticks: int


def run_presentation(
    device: Device,
    controller: Controller,
    *,
    clock: Clock,
    limits: DeviceLimits,
    rate_hz: int = 1000,
    max_duration_s: float = 10.0,
    end_angle: float = math.radians(146.0),
) -> Presented:
    """Present one model on an open device and record it.

    The presentation ends when the arm has been slower than 5 deg/s for 0.1 s within 3
    deg of `end_angle` or beyond, or at `max_duration_s`, with zero torque. A limit or
    an error of the device ends it with a fault: zero torque, device closed. Any
    other exception does the same and goes on to the caller, with a note when the
    device did not take the zero torque.

    Parameters
    ----------
    device : Device
        An open device. It stays open unless the presentation ends with a fault.
    controller : Controller
        A controller that has not been stepped, for the same `rate_hz`.
    clock : Clock
        The clock of the device.
    limits : DeviceLimits
        What the loop lets pass.
    rate_hz : int, optional
        Ticks a second.
    max_duration_s : float, optional
        Longest duration, s.
    end_angle : float, optional
        Where the stretch is meant to end, rad.

    Returns
    -------
    Presented
        The recording, the fault and the missed ticks.

    Raises
    ------
    ParameterError
        If the rate or the duration is not above 0, the rate is not the controller's,
        the controller has been used, or `end_angle` is not finite.
    DeviceError
        If the device is not open to begin with.

    Warns
    -----
    OverrunWarning
        If ticks were missed.

    Examples
    --------
    >>> from masrel.elbow import STANDARD_MODELS
    >>> from masrel.hess import DeviceLimits, SimulatedClock, SimulatedHand, open_device
    >>> clock = SimulatedClock()
    >>> hand = SimulatedHand(start=0.5, end=2.5, mean_speed=1.5)
    >>> controller = Controller(STANDARD_MODELS["HM3"], start_angle=0.5)
    >>> limits = DeviceLimits(torque=20.0, speed=7.0, missed_ticks=20)
    >>> with open_device("simulated", clock=clock, hand=hand) as device:
    ...     presented = run_presentation(
    ...         device, controller, clock=clock, limits=limits, end_angle=2.5
    ...     )
    >>> presented.recording.facts["phases"]
    'pre-catch, catch, post-catch, pre-catch'
    """
    if rate_hz < 1 or not 0.0 < max_duration_s < math.inf:
        raise ParameterError(
            "rate_hz, max_duration_s: need more than 0, "
            f"got {rate_hz} Hz and {max_duration_s} s"
        )
    if not math.isfinite(end_angle):
        raise ParameterError(f"end_angle: needs a finite angle, got {end_angle} rad")
    if rate_hz != controller.rate_hz:
        raise ParameterError(
            f"rate_hz: needs the controller's {controller.rate_hz} Hz, got {rate_hz}"
        )
    if not controller.is_new:
        raise ParameterError("controller: needs a new one for every presentation")
    if not device.is_open:
        raise DeviceError(f"{device.name}: needs an open device to present on")
    n_ticks = math.ceil(max_duration_s * rate_hz)
    ticks = Ticks(device, controller, clock, limits, rate_hz, n_ticks, end_angle)
    ended, fault = _guarded(ticks, device)
    if ticks.n_missed:
        warnings.warn(
            f"the control loop missed {ticks.n_missed} ticks; they were skipped",
            OverrunWarning,
            stacklevel=2,
        )
    columns = ticks.samples.columns()
    facts: dict[str, Fact] = {
        "simulated": device.simulated,
        "device": device.name,
        "rate_hz": rate_hz,
        "n_missed_ticks": ticks.n_missed,
        "fault": fault,
        "ended": ended,
        "grip_lost": controller.grip_lost,
        **movement_facts(columns, controller.speed_threshold, fault),
    }
    recording = Recording(columns=columns, facts=facts)
    return Presented(recording=recording, fault=fault, n_missed_ticks=ticks.n_missed)


def _guarded(ticks: Ticks, device: Device) -> tuple[str, str | None]:
    # -> how it ended, fault; whatever happens, the torque is zero afterwards
    with _collector_off():
        try:
            ended = ticks.run()
            device.command(0.0)
        except BaseException as error:
            unsafe = _close(device)  # before anything else, whatever came
            if not isinstance(error, DeviceError):
                if unsafe is not None:
                    error.add_note(f"closing the device: {unsafe}")
                raise
            fault = str(error)
        else:
            return ended, None
    ticks.mark_fault()
    return "fault", fault if unsafe is None else f"{fault}; closing it: {unsafe}"


@contextmanager
def _collector_off() -> Iterator[None]:
    # A collection could take longer than a tick
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


def _close(device: Device) -> str | None:
    # Zero torque, then let go; -> what went wrong with that, or None
    try:
        device.close()
    except DeviceError as error:
        return str(error)
    return None
