"""The ticks of one presentation: pace, and what happens at each of them."""

import sys

from masrel.errors import (
    ControllerError,
    DeviceError,
    DeviceTimeoutError,
    LimitExceededError,
)
from masrel.lab.hess._course import Course
from masrel.lab.hess._guard import ActiveGuard, Guard, Overruns, SoftStops
from masrel.lab.hess._signals import VelocityEstimate, raised_cosine
from masrel.lab.hess._spool import Samples
from masrel.lab.hess._stop import EmergencyStop
from masrel.lab.hess._watchdog import Watching
from masrel.lab.hess.clock import Clock
from masrel.lab.hess.controller import Controller
from masrel.lab.hess.device import Device
from masrel.lab.hess.limits import DeviceLimits
from masrel.lab.recording import RAMPS

_POST_CATCH, _END, _FAULT = (RAMPS.index(of) for of in RAMPS[1:])

_CHECK_EVERY_S = 0.05  # how often the device is asked for its state
_BEAT_EVERY_S = 0.005  # how often the watchdog is told that the loop is alive


class Ticks:
    """The loop proper, in plain numbers: a numpy scalar would cost more than a tick."""

    __slots__ = (
        "_active_guard",
        "_controller",
        "_course",
        "_estimate",
        "_has_channels",
        "_is_ending",
        "_last_torques",
        "_latest",
        "_limits",
        "_n_ticks",
        "_sent_ns",
        "_start_ns",
        "_stop",
        "_stops",
        "clock",
        "device",
        "guard",
        "overruns",
        "period_ns",
        "ramp_ns",
        "samples",
        "sent",
        "watchdog",
    )

    def __init__(
        self,
        device: Device,
        controller: Controller,
        clock: Clock,
        limits: DeviceLimits,
        rate_hz: int,
        n_ticks: int,
        course: Course,
        samples: Samples,
        stop: EmergencyStop,
        watchdog: Watching,
    ) -> None:
        self.device = device
        self._controller = controller
        self._active_guard = ActiveGuard(limits) if controller.is_guarded else None
        self.clock = clock
        self._n_ticks = n_ticks
        self.period_ns = round(1e9 / rate_hz)
        self.ramp_ns = round(limits.ramp_time * 1e9)
        self._course = course
        self._estimate = VelocityEstimate()
        self._start_ns = self._sent_ns = 0
        self._latest: tuple[float, float, float] | None = None
        self._last_torques: list[float] = []  # torques yet to be sent, last first, N·m
        self._is_ending = False
        self._stop = stop
        self.watchdog = watchdog
        self._limits = limits
        self._stops = SoftStops(limits)
        self.guard = Guard(limits, 1.0 / rate_hz)
        self.overruns = Overruns(limits)
        self.sent = 0.0
        self.samples = samples
        self._has_channels = bool(samples.channels)

    def run(self) -> str:
        """Run ticks until the torque is zero -> how the presentation ended."""
        self._start_ns = self._sent_ns = self.clock.now_ns()
        tick, ended = self._run_from(0)
        self._course.end()
        shares = raised_cosine(self._limits.end_ramp_time, 1e9 / self.period_ns)
        if shares and self.sent != 0.0:
            self._last_torques = [self.sent * share for share in reversed(shares)]
            self._is_ending = True
            self._n_ticks = sys.maxsize
            self._run_from(self._wait_for(tick + 1) if ended else tick)
        return ended or "max-duration"

    def _run_from(self, tick: int) -> tuple[int, str]:
        # -> the tick it ended at, and what in it ended it, empty for nothing
        stop, device, beat = self._stop, self.device, self.watchdog.beat
        check_every = max(1, round(_CHECK_EVERY_S * 1e9 / self.period_ns))
        beat_every_s = min(_BEAT_EVERY_S, 0.25 * self._limits.watchdog_time)
        beat_every = max(1, round(beat_every_s * 1e9 / self.period_ns))
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
        due_ns = self._start_ns + tick * self.period_ns  # absolute: no drift
        self.clock.sleep_until_ns(due_ns)
        now_ns = self.clock.now_ns()
        n_skipped = (now_ns - due_ns) // self.period_ns
        if n_skipped <= 0:
            return tick
        gap_s = (now_ns - self._sent_ns) * 1e-9
        # none after the last
        self.overruns.count(tick, min(tick + n_skipped, self._n_ticks), gap_s)
        return tick + n_skipped

    def _tick(self) -> str:
        # Read, check, estimate, decide, check, send, record -> why it is over, or empty
        guard = self.guard
        try:
            time_ns, angle, values = self.device.read()
        except DeviceTimeoutError as error:
            guard.dropouts.count(self.time_s(), str(error))
            return ""  # the device holds its torque
        time_s = (time_ns - self._start_ns) * 1e-9
        if not guard.is_new(time_s):
            guard.dropouts.count(self.time_s(), f"one of {time_s:.6f} s again")
            return ""
        now_ns = self.clock.now_ns()
        self._latest = (time_s, angle, 0.0)
        guard.reading(time_s, angle, (now_ns - time_ns) * 1e-9)
        velocity = self._estimate.update(time_s, angle)
        self._latest = (time_s, angle, velocity)
        guard.speed(velocity)
        controller = self._controller
        torque = self._decide(time_s, angle, velocity) + self._stops.torque(angle)
        if self._is_ending:  # whatever the model asks for
            # One share a tick, however late it comes: no fall is steeper than this
            torque = self._last_torques.pop()
        if self._active_guard is not None:
            acting = torque if self._is_ending else controller.model_torque
            self._active_guard.check(angle, velocity, acting)
        guard.torque(time_s, torque)
        self.device.command(torque)
        self.sent = torque
        self._sent_ns = now_ns
        if self._has_channels:
            self._measure(values)
        course = self._course
        self.samples.add(
            time_s,
            angle,
            velocity,
            controller.model_torque,
            torque,
            controller.phase,
            course.stretch,
        )
        if self._is_ending:
            self.samples.flag(_END)
            return "" if self._last_torques else "at rest"
        if controller.is_easing:
            self.samples.flag(_POST_CATCH)
        stretch, guard_of_model = course.stretch, self._active_guard
        ended = course.update(time_s, angle, velocity, controller.phase)
        if guard_of_model is not None and course.stretch > stretch:
            guard_of_model.begin_stretch(time_s, angle)
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
            self.samples.measure(values)
        except (TypeError, ValueError) as error:
            names = ", ".join(channel.name for channel in self.samples.channels)
            raise DeviceError(
                f"{self.device.name}: needs a number for each of its channels "
                f"({names}), got {values}"
            ) from error

    def time_s(self) -> float:
        """Return the time since the presentation began, s."""
        return (self.clock.now_ns() - self._start_ns) * 1e-9

    def finish(self) -> None:
        """Send zero torque, and let the watchdog rest."""
        self.device.command(0.0)
        self.sent = 0.0
        self.watchdog.rest()

    def mark(self, now_ns: int, torque: float) -> None:
        """Add a row without a reading, which holds the last one; none if none was."""
        if self._latest is None:
            return
        read_s, angle, velocity = self._latest
        time_s = max((now_ns - self._start_ns) * 1e-9, read_s)
        if time_s <= self.samples.last_time_s:
            self.samples.replace_command(torque)
        else:
            model, phase = self._controller.model_torque, self._controller.phase
            self.samples.add(time_s, angle, velocity, model, torque, phase, 0)
        self.samples.flag(_FAULT)
