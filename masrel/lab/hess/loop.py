"""The control loop: one presentation at a fixed rate, recorded tick by tick."""

import math
import warnings
from contextlib import closing
from pathlib import Path

from masrel._collector import collector_off
from masrel.errors import (
    DeviceError,
    OverrunWarning,
    ParameterError,
    RecordingWarning,
)
from masrel.lab.hess._clock import Clock, scheduled
from masrel.lab.hess._course import Course, PresentationStatus, StretchRules
from masrel.lab.hess._recorder import Presented, Samples, as_presented
from masrel.lab.hess._signals import speed_margin
from masrel.lab.hess._stop import EmergencyStop
from masrel.lab.hess._ticks import Ticks
from masrel.lab.hess._watchdog import NoWatchdog, Watching
from masrel.lab.hess.controller import Controller
from masrel.lab.hess.device import Device
from masrel.lab.hess.limits import DeviceLimits
from masrel.lab.recording import _Fact

_MAX_DURATION_S = 10.0  # of one stretch


def run_presentation(
    device: Device,
    controller: Controller,
    *,
    clock: Clock,
    limits: DeviceLimits,
    rate_hz: int = 1000,
    max_duration_s: float | None = None,
    end_angle: float = math.radians(146.0),
    stretches: StretchRules | None = None,
    status: PresentationStatus | None = None,
    stop: EmergencyStop | None = None,
    watchdog: Watching | None = None,
    spool: Path | None = None,
) -> Presented:
    """Present one model on an open device and record it.

    One stretch ends it: when the arm has been slower than `DeviceLimits.arrival_speed`
    for `arrival_time` within `arrival_angle` of `end_angle` or beyond. Of many
    stretches each ends so, or when the arm is brought back: flexed faster than ν_th, or
    near where the stretch began. A stretch begins when the arm was extended by
    `arrival_angle`; the next one only after the arm was flexed faster than ν_th, as the
    law has it, or was brought back without a catch. All the while the controller goes
    on.

    The presentation is over when one stretch has arrived (``"arrived"``), when the arm
    is brought back after the last of many (``"stretches"``), after the time limit
    (``"time-limit"``), when `status` says that the rater is done (``"done"``), or at
    `max_duration_s` (``"max-duration"``). Then the torque goes from where it stands to
    zero within `DeviceLimits.end_ramp_time`, along a raised cosine, while readings are
    taken and checked as before. A limit, an error of the device or
    of the controller, or an emergency stop ends it with a fault: the torque goes to
    zero within `DeviceLimits.ramp_time`, and the device is closed. Any other exception
    closes it at once and goes on to the caller, with a note when the device did not
    take the zero torque.

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
    max_duration_s : float or None, optional
        Longest duration, without the ramp at its end, s. None for 10 s with one
        stretch; with many for what the limits of `stretches` take, if the first begins
        within `StretchRules.time_limit`.
    end_angle : float, optional
        Where a stretch is meant to end, rad.
    stretches : StretchRules or None, optional
        How often the arm may be stretched, and for how long; None for once.
    status : PresentationStatus or None, optional
        Says how the presentation stands, and takes in that the rater is done.
    stop : EmergencyStop or None, optional
        A button that the loop looks at in every tick.
    watchdog : Watching or None, optional
        Told every 5 ms, or four times as often as it demands, that the loop is alive.
    spool : Path or None, optional
        A file that keeps every sample from the moment it is taken, for a process that
        is killed; `cut_off` reads it. Remove it when the recording is on disk.

    Returns
    -------
    Presented
        The recording, the fault and the missed ticks. The facts ``phases``,
        ``catch_angle_deg`` and ``mean_speed_deg_s`` are of the first of many stretches
        that reached ν_th; `masrel.lab.recording.stretches` has those of each.

    Raises
    ------
    ParameterError
        If the rate or the duration is not above 0, the rate is not the controller's,
        the controller has been used, `end_angle` is not finite, or the watchdog waits
        less than two ticks.
    DeviceError
        If the device is not open to begin with.
    OSError
        If the spool cannot be written.

    Warns
    -----
    OverrunWarning
        If ticks were missed.
    RecordingWarning
        If a channel of the device gave no number in some samples, or its torque sensor
        does not follow the torque.

    Examples
    --------
    >>> from masrel.lab.elbow import STANDARD_MODELS
    >>> from masrel.lab.hess import DeviceLimits, SimulatedClock, SimulatedHand
    >>> from masrel.lab.hess import open_device
    >>> clock = SimulatedClock()
    >>> hand = SimulatedHand(start=0.5, end=2.5, mean_speed=1.5)
    >>> controller = Controller(STANDARD_MODELS["HM3"], start_angle=0.5)
    >>> with open_device("simulated", clock=clock, hand=hand) as device:
    ...     presented = run_presentation(
    ...         device, controller, clock=clock, limits=DeviceLimits(), end_angle=2.5
    ...     )
    >>> presented.recording.facts["phases"]
    'pre-catch, catch, post-catch, pre-catch'
    """
    rules = stretches or StretchRules()
    if max_duration_s is None:
        many_s = 2.0 * rules.time_limit + rules.stretch_limit
        max_duration_s = _MAX_DURATION_S if rules.n == 1 else many_s
    _check(device, controller, limits, rate_hz, max_duration_s, end_angle)
    controller.speed_margin = speed_margin(limits.encoder_noise, rate_hz)
    facts: dict[str, _Fact] = {
        "simulated": device.simulated,
        "device": device.name,
        "rate_hz": rate_hz,
        "speed_threshold_deg_s": math.degrees(controller.speed_threshold),
    }
    course = Course(
        rules,
        limits,
        status or PresentationStatus(),
        rate_hz=rate_hz,
        end_angle=end_angle,
        speed_threshold=controller.speed_threshold,
    )
    n_ticks = math.ceil(max_duration_s * rate_hz)
    n_of_ramps = math.ceil((limits.end_ramp_time + limits.ramp_time) * rate_hz) + 4
    samples = Samples(n_ticks + n_of_ramps, device.channels, file=spool, facts=facts)
    with closing(samples):
        ticks = Ticks(
            device,
            controller,
            clock,
            limits,
            course,
            samples,
            stop or EmergencyStop(),
            watchdog or NoWatchdog(),
        )
        # a collection could take longer than a tick
        with scheduled(clock) as facts["scheduling"], collector_off():
            ended, fault = ticks.run_to_the_end(n_ticks)
        columns = samples.columns()
    presented = as_presented(
        columns,
        facts,
        channels=device.channels,
        ended=ended,
        fault=fault,
        grip_lost=controller.grip_lost,
        n_missed_ticks=ticks.guard.n_missed_ticks,
        n_missed_replies=ticks.guard.n_without_reading,
    )
    _warn(device.name, presented)
    return presented


def _warn(device: str, presented: Presented) -> None:
    # of ticks and of channels, at the line that asked for the presentation
    if n_missed := presented.n_missed_ticks:
        missed = (
            "1 tick, which was" if n_missed == 1 else f"{n_missed} ticks, which were"
        )
        message = f"the control loop missed {missed} skipped"
        warnings.warn(message, OverrunWarning, stacklevel=3)
    silent = presented.recording.facts.get("channel_faults")
    if silent is not None:
        warnings.warn(f"{device}: {silent}", RecordingWarning, stacklevel=3)


def _check(
    device: Device,
    controller: Controller,
    limits: DeviceLimits,
    rate_hz: int,
    max_duration_s: float,
    end_angle: float,
) -> None:
    if rate_hz < 1 or not 0.0 < max_duration_s < math.inf:
        raise ParameterError(
            "rate_hz, max_duration_s: need more than 0, "
            f"got {rate_hz} Hz and {max_duration_s} s"
        )
    if not math.isfinite(end_angle):
        raise ParameterError(f"end_angle: needs a finite angle, got {end_angle} rad")
    if limits.watchdog_time * rate_hz < 2.0:
        raise ParameterError(
            f"watchdog_time: needs two ticks or more, at {rate_hz} Hz "
            f"{2.0 / rate_hz:g} s, got {limits.watchdog_time:g} s"
        )
    if rate_hz != controller.rate_hz:
        raise ParameterError(
            f"rate_hz: needs the controller's {controller.rate_hz} Hz, got {rate_hz}"
        )
    if not controller.is_new:
        raise ParameterError("controller: needs a new one for every presentation")
    if not device.is_open:
        raise DeviceError(f"{device.name}: needs an open device to present on")
