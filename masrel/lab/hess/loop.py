"""The control loop: one presentation at a fixed rate, recorded tick by tick.

In every case the last torque is zero: without a fault along a raised cosine, while all
is checked as before; after a fault in a straight line, and with a closed device.
"""

import math
import sys
import warnings
from contextlib import closing, suppress
from pathlib import Path

from masrel._input import refuse
from masrel._interpreter import collector_off
from masrel.errors import (
    ControllerError,
    DeviceError,
    DeviceTimeoutError,
    LimitExceededError,
    OverrunWarning,
    ParameterError,
    RecordingWarning,
)
from masrel.lab._study_files import Fact
from masrel.lab.hess._clock import Clock, scheduled
from masrel.lab.hess._course import Course, PresentationStatus, StretchRules
from masrel.lab.hess._guard import ActiveGuard, ActuatorGuard, Guard
from masrel.lab.hess._recorder import Fault, Presented, Samples, as_presented
from masrel.lab.hess._signals import VelocityEstimate, raised_cosine, speed_margin
from masrel.lab.hess._stop import EmergencyStop, Watching
from masrel.lab.hess.controller import Controller
from masrel.lab.hess.device import Device
from masrel.lab.hess.limits import DeviceLimits
from masrel.lab.recording import MEASURED_TORQUE, RAMPS

_NONE, _POST_CATCH, _END, _FAULT = range(len(RAMPS))

_FADE_IN_S = 0.1  # of a torque that is asked for before anything moves
_CHECK_EVERY_S = 0.05  # how often the device is asked for its state
_BEAT_EVERY_S = 0.005  # how often the watchdog is told that the loop is alive
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
    for `arrival_time` within `arrival_angle` of `end_angle` or beyond. Each of several
    stretches ends so, or when the arm is brought back: flexed faster than ν_th, or near
    where the stretch began. A stretch begins when the arm was extended by
    `arrival_angle`; the next one only after the arm was flexed faster than ν_th, as the
    law has it, or was brought back without a catch. All the while the controller goes
    on. What it asks for before anything moves comes within 100 ms, along a raised
    cosine.

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
    facts: dict[str, Fact] = {
        "simulated": device.simulated,
        "device": device.name,
        "rate_hz": rate_hz,
        "speed_threshold_deg_s": math.degrees(controller.speed_threshold),
    }
    if device.holds_torque_when_silent is not None:
        facts["holds_torque_when_silent"] = device.holds_torque_when_silent
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
        ticks = _Ticks(
            device,
            controller,
            clock,
            limits,
            course,
            samples,
            stop or EmergencyStop(),
            watchdog or Watching(),
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
    refuse(
        (
            not math.isfinite(end_angle),
            f"end_angle: needs a finite angle, got {end_angle} rad",
        ),
        (
            limits.watchdog_time * rate_hz < 2.0,
            f"watchdog_time: needs two ticks or more, at {rate_hz} Hz "
            f"{2.0 / rate_hz:g} s, got {limits.watchdog_time:g} s",
        ),
        (
            rate_hz != controller.rate_hz,
            f"rate_hz: needs the controller's {controller.rate_hz} Hz, got {rate_hz}",
        ),
        (
            not controller.is_new,
            "controller: needs a new one for every presentation",
        ),
    )
    if not device.is_open:
        raise DeviceError(f"{device.name}: needs an open device to present on")


class _Ticks:
    """The loop proper, in plain numbers: a numpy scalar would cost more than a tick."""

    def __init__(
        self,
        device: Device,
        controller: Controller,
        clock: Clock,
        limits: DeviceLimits,
        course: Course,
        samples: Samples,
        stop: EmergencyStop,
        watchdog: Watching,
    ) -> None:
        self._device = device
        self._controller = controller
        self._clock = clock
        self._limits = limits
        self._course = course
        self._samples = samples
        self._stop = stop
        self._watchdog = watchdog
        self._period_ns = round(1e9 / controller.rate_hz)
        self.guard = Guard(limits, 1.0 / controller.rate_hz)
        self._active_guard = ActiveGuard(limits) if controller.is_guarded else None
        self._actuator_guard = None
        if MEASURED_TORQUE in device.channels and not device.is_replay:
            friction, rate_hz = controller.friction, controller.rate_hz
            self._actuator_guard = ActuatorGuard(
                limits, friction, rate_hz, device.torque_delay
            )
        self._estimate = VelocityEstimate()
        self._start_ns = self._sent_ns = 0
        self._n_ticks = 0
        self._sent = 0.0  # the torque that the device holds, N·m
        self._latest: tuple[float, float, float] | None = None
        self._last_torques: list[float] = []  # torques yet to be sent, last first, N·m
        self._is_ending = False
        # what is asked for before anything moves, N·m, and the share of it to come
        self._first = 0.0
        self._fade_in = iter((1.0, *raised_cosine(_FADE_IN_S, controller.rate_hz)))

    def run_to_the_end(self, n_ticks: int) -> tuple[str, Fault | None]:
        """Run ticks -> how they ended, and the fault; the torque is zero afterwards."""
        try:
            try:
                ended = self._run(n_ticks)
                self._finish()
            except DeviceError as error:
                return "fault", self._stopped_by(error)
            return ended, None
        except BaseException as error:
            unsafe = self._close()  # before anything else, whatever came
            if unsafe is not None:
                error.add_note(f"closing the device: {unsafe}")
            raise

    def _run(self, n_ticks: int) -> str:
        # Until the torque is zero -> how the presentation ended
        self._n_ticks = n_ticks
        self._start_ns = self._sent_ns = self._clock.now_ns()
        tick, ended = self._run_from(0)
        self._course.end()
        shares = raised_cosine(self._limits.end_ramp_time, 1e9 / self._period_ns)
        if shares and self._sent != 0.0:
            self._last_torques = [self._sent * share for share in reversed(shares)]
            self._is_ending = self._controller.is_over = True
            self._n_ticks = sys.maxsize
            self._run_from(self._wait_for(tick + 1) if ended else tick)
        return ended or "max-duration"

    def _run_from(self, tick: int) -> tuple[int, str]:
        # -> the tick it ended at, and what in it ended it, empty for nothing
        stop, device, beat = self._stop, self._device, self._watchdog.beat
        check_every = max(1, round(_CHECK_EVERY_S * 1e9 / self._period_ns))
        beat_every_s = min(_BEAT_EVERY_S, 0.25 * self._limits.watchdog_time)
        beat_every = max(1, round(beat_every_s * 1e9 / self._period_ns))
        next_check, next_beat = tick + check_every, tick
        while tick < self._n_ticks:
            if stop.reason is not None:
                stop.check()
            if tick >= next_beat:
                beat()
                next_beat = tick + beat_every
            if tick >= next_check:
                device.check()
                next_check = tick + check_every
            ended = self._tick()
            if ended:
                return tick, ended
            tick = self._wait_for(tick + 1)
        return tick, ""

    def _wait_for(self, tick: int) -> int:
        # Sleeps until the tick is due -> the tick that is due then. Those whose time
        # is over are skipped and counted: sent late, they would come in a burst.
        due_ns = self._start_ns + tick * self._period_ns  # absolute: no drift
        self._clock.sleep_until_ns(due_ns)
        now_ns = self._clock.now_ns()
        n_skipped = (now_ns - due_ns) // self._period_ns
        if n_skipped <= 0:
            return tick
        gap_s = (now_ns - self._sent_ns) * 1e-9
        # none after the last
        self.guard.missed(tick, min(tick + n_skipped, self._n_ticks), gap_s)
        return tick + n_skipped

    def _tick(self) -> str:
        # Read, check, estimate, decide, check, send, record -> why it is over, or empty
        guard = self.guard
        try:
            time_ns, angle, values = self._device.read()
        except DeviceTimeoutError as error:
            guard.no_reading(self._time_s(), str(error))
            return ""  # the device holds its torque
        time_s = (time_ns - self._start_ns) * 1e-9
        if not guard.is_new(time_s):
            guard.no_reading(self._time_s(), f"one of {time_s:.6f} s again")
            return ""
        now_ns = self._clock.now_ns()
        self._latest = (time_s, angle, 0.0)
        guard.reading(time_s, angle, (now_ns - time_ns) * 1e-9)
        velocity = self._estimate.update(time_s, angle)
        self._latest = (time_s, angle, velocity)
        guard.speed(velocity)
        controller = self._controller
        torque = self._decide(time_s, angle, velocity) + guard.soft_stop(angle)
        if not self._samples.n:
            guard.begins_with(torque)
            self._first = torque
        # never beyond zero, where less is asked for by now
        torque -= next(self._fade_in, 0.0) * sorted((0.0, self._first, torque))[1]
        if self._is_ending:  # whatever the model asks for
            # One share a tick, however late it comes: no fall is steeper than this
            torque = self._last_torques.pop()
        if self._active_guard is not None:
            is_on_the_way = self._is_ending or controller.is_easing
            acting = torque if is_on_the_way else controller.model_torque
            self._active_guard.check(angle, velocity, acting)
        guard.torque(time_s, torque)
        self._device.command(torque)
        held, self._sent = self._sent, torque
        self._sent_ns = now_ns
        if self._samples.channels:
            self._measure(values)
        if self._actuator_guard is not None:
            measured = values[self._device.channels.index(MEASURED_TORQUE)]
            self._actuator_guard.check(time_s, velocity, held, measured)
        eases = _POST_CATCH if controller.is_easing else _NONE
        ramp, stretch = _END if self._is_ending else eases, self._course.stretch
        model, phase = controller.model_torque, controller.phase
        self._samples.add(
            (time_s, angle, velocity, model, torque, phase, ramp, stretch)
        )
        if self._is_ending:
            return "" if self._last_torques else "at rest"
        ended = self._course.update(time_s, angle, velocity, controller.phase)
        if self._active_guard is not None and self._course.stretch > stretch:
            self._active_guard.begin_stretch(time_s, angle)
        return ended

    def _decide(self, time_s: float, angle: float, velocity: float) -> float:
        try:
            return self._controller.step(time_s, angle, velocity)
        except LimitExceededError:  # a lost grip
            raise
        except Exception as error:
            # Whatever a model does wrong, the torque has to be taken back slowly
            raise ControllerError(
                f"controller: {type(error).__name__}: {error}"
            ) from error

    def _measure(self, values: tuple[float, ...]) -> None:
        try:
            self._samples.measure(values)
        except (TypeError, ValueError) as error:
            names = ", ".join(channel.name for channel in self._samples.channels)
            raise DeviceError(
                f"{self._device.name}: needs a number for each of its channels "
                f"({names}), got {values}"
            ) from error

    def _time_s(self) -> float:
        # Since the presentation began
        return (self._clock.now_ns() - self._start_ns) * 1e-9

    def _finish(self) -> None:
        # Zero torque, and the watchdog may rest
        self._device.command(0.0)
        self._sent = 0.0
        self._watchdog.rest()

    # After a fault

    def _stopped_by(self, error: DeviceError) -> Fault:
        time_s, torque, messages = self._time_s(), self._sent, [str(error)]
        try:
            self._ramp_down()
            self._finish()
        except DeviceError as unsafe:
            messages.append(f"ramping down: {unsafe}")
        wrong = self._close()
        if wrong is not None:
            messages.append(f"closing it: {wrong}")
        self._mark(self._clock.now_ns(), 0.0)
        message = "; ".join(messages)
        return Fault(kind=error.kind, message=message, time_s=time_s, torque_nm=torque)

    def _ramp_down(self) -> None:
        # In a straight line to zero, and recorded. Nothing is read any more, because
        # reading may be what failed.
        clock, torque = self._clock, self._sent
        ramp_ns = round(self._limits.ramp_time * 1e9)
        begun_ns = now_ns = clock.now_ns()
        self._mark(begun_ns, torque)
        while torque != 0.0 and ramp_ns:
            n_elapsed = (now_ns - begun_ns) // self._period_ns  # late ones are skipped
            next_ns = min((n_elapsed + 1) * self._period_ns, ramp_ns)
            clock.sleep_until_ns(begun_ns + next_ns)
            now_ns = clock.now_ns()
            share = 1.0 - (now_ns - begun_ns) / ramp_ns
            if share <= 0.0:
                break
            self._device.command(torque * share)
            self._sent = torque * share
            with suppress(DeviceError):  # `_finish` says so; the ramp has to go on
                self._watchdog.beat()
            self._mark(now_ns, self._sent)

    def _mark(self, now_ns: int, torque: float) -> None:
        # A row without a reading, which holds the last one; none if none was
        if self._latest is None:
            return
        samples = self._samples
        read_s, angle, velocity = self._latest
        time_s = max((now_ns - self._start_ns) * 1e-9, read_s)
        if time_s <= samples.last_time_s:
            samples.change_last(torque, _FAULT)
        else:
            model, phase = self._controller.model_torque, self._controller.phase
            samples.add((time_s, angle, velocity, model, torque, phase, _FAULT, 0))

    def _close(self) -> str | None:
        # Zero torque, then let go; -> what went wrong with that, or None
        try:
            self._device.close()
        except DeviceError as error:
            return str(error)
        return None
