"""A free arm, turned to and fro at steady speeds under speed control."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from masrel.errors import DeviceError, DeviceTimeoutError
from masrel.hess._guard import Guard, check_overrun
from masrel.hess._stop import EmergencyStop
from masrel.hess._velocity import VelocityEstimate
from masrel.hess._watchdog import NoWatchdog, Watching
from masrel.hess.clock import Clock
from masrel.hess.device import Device
from masrel.hess.limits import DeviceLimits
from masrel.hess.puck.friction import SteadyRun

__all__ = ["LIMITS", "SPEEDS", "steady_runs"]

SPEEDS = tuple(math.radians(speed) for speed in (20.0, 40.0, 60.0, 80.0))

_LOWEST, _HIGHEST = math.radians(40.0), math.radians(115.0)  # where the arm turns
_MARGIN = math.radians(10.0)  # how far outside it may be to begin with
_LARGEST_TORQUE = 2.0  # N·m; ten times what friction is expected to be

LIMITS = DeviceLimits(
    torque=_LARGEST_TORQUE,
    speed=math.radians(150.0),
    lowest_angle=_LOWEST - 2.0 * _MARGIN,
    highest_angle=_HIGHEST + 2.0 * _MARGIN,
    # A free arm turns with less than half of this; a hand or an end stop is in the way
    # of one that does not, or its encoder has frozen.
    standing_torque=1.0,
    standing_time=0.2,
)
"""What passes while nobody holds the arm: less than in a presentation."""

_SETTLED = math.radians(35.0)  # what it travels before it counts as steady
_LONGEST_S = 10.0  # for one run
_FEWEST_TICKS = 100  # of a steady part
_GAIN = 1.0  # N·m·s/rad: with 0.06 kg·m² the speed settles within 0.05 s
_INTEGRAL_GAIN = 20.0  # N·m/rad: 18 rad/s with that inertia, damped by a half
_PROBE_TORQUE, _PROBE_S = 0.5, 0.3
_PROBE_TRAVEL = math.radians(1.0)
_PERIOD_NS = 1_000_000


def steady_runs(
    device: Device,
    clock: Clock,
    *,
    speeds: Sequence[float] = SPEEDS,
    watchdog: Watching | None = None,
    stop: EmergencyStop | None = None,
    progress: Callable[[], None] = lambda: None,
) -> tuple[SteadyRun, ...]:
    """Turn a free arm to and fro at steady speeds."""
    # THE ARM MOVES BY ITSELF, between 40 and 115 deg, with 2 N·m at most. First it is
    # pushed with 0.5 N·m for 0.3 s to see whether it goes the right way.
    watching = watchdog or NoWatchdog()
    turning = _Turning(device, clock, watching, stop or EmergencyStop())
    turning.check_direction()
    away = 1.0 if turning.is_low else -1.0
    turning.turn(-away * speeds[0])  # to the nearer end
    runs = []
    for speed in speeds:
        for direction in (away, -away):
            runs.append(_mean(turning.turn(direction * speed), direction * speed))
            progress()
    device.command(0.0)
    watching.rest()
    return tuple(runs)


class _Turning:
    """A free arm under speed control, tick by tick."""

    def __init__(
        self, device: Device, clock: Clock, watchdog: Watching, stop: EmergencyStop
    ) -> None:
        self._device = device
        self._clock = clock
        self._watchdog = watchdog
        self._stop = stop
        self._estimate = VelocityEstimate()
        self._guard = Guard(LIMITS, _PERIOD_NS * 1e-9)
        self._start_ns = self._due_ns = self._sent_ns = clock.now_ns()
        self.angle = math.nan  # until it has been read
        self._velocity = 0.0

    @property
    def is_low(self) -> bool:
        return self.angle < 0.5 * (_LOWEST + _HIGHEST)

    def check_direction(self) -> None:
        while math.isnan(self.angle):
            self._tick(0.0)
        start, begun_ns = self.angle, self._clock.now_ns()
        if not _LOWEST - _MARGIN <= start <= _HIGHEST + _MARGIN:
            raise DeviceError(
                "friction: needs an arm between 30 and 125 deg to begin with, it is at "
                f"{math.degrees(start):.1f}"
            )
        while abs(self.angle - start) < _PROBE_TRAVEL:
            if self._clock.now_ns() - begun_ns > _PROBE_S * 1e9:
                raise DeviceError(
                    f"friction: needs a free arm, {_PROBE_TORQUE:g} N·m do not move it"
                )
            self._tick(_PROBE_TORQUE)
        if self.angle < start:
            raise DeviceError(
                "friction: needs an arm that a torque towards extension extends, it "
                "flexes; torque and counts of the puck have different signs"
            )

    def turn(self, speed: float) -> list[tuple[float, float]]:
        # Turns to the end of the range on that side -> speed and torque of each tick,
        # once it is steady
        begun_ns, start, integral = self._clock.now_ns(), self.angle, 0.0
        steady = []
        while self.angle < _HIGHEST if speed > 0.0 else self.angle > _LOWEST:
            if self._clock.now_ns() - begun_ns > _LONGEST_S * 1e9:
                raise _held(speed)
            off = speed - self._velocity
            torque = _GAIN * off + integral
            if abs(torque) <= _LARGEST_TORQUE:  # no more of it than the motor gives
                integral += _INTEGRAL_GAIN * off * _PERIOD_NS * 1e-9
            torque = max(-_LARGEST_TORQUE, min(_LARGEST_TORQUE, torque))
            self._tick(torque)
            if abs(self.angle - start) > _SETTLED:
                steady.append((self._velocity, torque))
        return steady

    def _tick(self, torque_nm: float) -> None:
        # torque: of the motor, positive in extension
        self._clock.sleep_until_ns(self._due_ns)
        now_ns = self._clock.now_ns()
        self._due_ns = max(self._due_ns, now_ns - _PERIOD_NS) + _PERIOD_NS
        self._stop.check()
        guard = self._guard
        check_overrun(LIMITS, 0, (now_ns - self._sent_ns) * 1e-9)  # silence alone
        try:
            time_ns, angle = self._device.read()
        except DeviceTimeoutError as error:
            guard.dropouts.count(self._since_start_s(now_ns), str(error))
            return  # the device holds its torque
        time_s = self._since_start_s(time_ns)
        if not guard.is_new(time_s):
            guard.dropouts.count(
                self._since_start_s(now_ns), f"one of {time_s:.6f} s again"
            )
            return
        guard.reading(time_s, angle, (self._clock.now_ns() - time_ns) * 1e-9)
        self.angle = angle
        self._velocity = self._estimate.update(time_s, angle)
        guard.speed(self._velocity)
        guard.torque(time_s, torque_nm)
        self._device.command(-torque_nm)
        self._sent_ns = now_ns
        self._watchdog.beat()

    def _since_start_s(self, time_ns: int) -> float:
        return (time_ns - self._start_ns) * 1e-9


def _mean(steady: list[tuple[float, float]], speed: float) -> SteadyRun:
    if len(steady) < _FEWEST_TICKS:
        raise _held(speed)
    mean_speed, mean_torque = np.mean(np.array(steady), axis=0)
    return SteadyRun(speed=float(mean_speed), torque=float(mean_torque))


def _held(speed: float) -> DeviceError:
    return DeviceError(
        f"friction: needs a free arm, it does not turn at {math.degrees(speed):.0f} "
        "deg/s from end to end"
    )
