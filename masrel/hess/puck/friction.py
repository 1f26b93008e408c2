"""Friction of the device, from how much torque a free arm needs to turn steadily."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from masrel.errors import DeviceError, DeviceTimeoutError, ParameterError
from masrel.hess.clock import Clock
from masrel.hess.device import Device
from masrel.hess.velocity import VelocityEstimate
from masrel.hess.watchdog import NoWatchdog, Watching

__all__ = ["SPEEDS", "FrictionEstimate", "SteadyRun", "fit_friction", "steady_runs"]

SPEEDS = tuple(math.radians(speed) for speed in (20.0, 40.0, 60.0, 80.0))

_LOWEST, _HIGHEST = math.radians(40.0), math.radians(115.0)  # where the arm turns
_SETTLED = math.radians(35.0)  # what it travels before it counts as steady
_LARGEST_TORQUE = 2.0  # N·m; ten times what friction is expected to be
_LARGEST_SPEED = math.radians(150.0)
_LONGEST_S = 10.0  # for one run
_FEWEST_TICKS = 100  # of a steady part
_GAIN = 1.0  # N·m·s/rad: with 0.06 kg·m² the speed settles within 0.05 s
_INTEGRAL_GAIN = 20.0  # N·m/rad: 18 rad/s with that inertia, damped by a half
_PROBE_TORQUE, _PROBE_S = 0.5, 0.3
_PROBE_TRAVEL = math.radians(1.0)
_PERIOD_NS = 1_000_000
_MOST_MISSED = 2  # readings in a row, as in a presentation


@dataclass(frozen=True, slots=True, kw_only=True)
class SteadyRun:
    """One turn of the arm at a steady speed.

    Attributes
    ----------
    speed : float
        Mean speed of the steady part, rad/s; negative in flexion.
    torque : float
        Mean torque of the motor in it, N·m, positive in extension.
    """

    speed: float
    torque: float


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionEstimate:
    """Friction of (7), fitted to steady runs.

    Attributes
    ----------
    viscous, viscous_error : float
        B and its standard error, N·m·s/rad.
    coulomb, coulomb_error : float
        β and its standard error, N·m.
    offset, offset_error : float
        Torque that acts one way whatever the motion, N·m: gravity of an arm that is
        not level, or a current sensor that is off.
    runs : tuple of SteadyRun
        What it was fitted to.
    """

    viscous: float
    viscous_error: float
    coulomb: float
    coulomb_error: float
    offset: float
    offset_error: float
    runs: tuple[SteadyRun, ...]


def fit_friction(runs: Sequence[SteadyRun]) -> FrictionEstimate:
    """Fit B and β of (7) to steady runs by least squares.

    Parameters
    ----------
    runs : sequence of SteadyRun
        At two speeds or more, in both directions.

    Returns
    -------
    FrictionEstimate
        B, β and an offset, with standard errors from what the fit leaves.

    Raises
    ------
    ParameterError
        If there are fewer than four runs, or they cannot tell the three apart.

    References
    ----------
    .. [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). IEEE TNSRE 20(3), 361-370,
       equation (7). https://doi.org/10.1109/TNSRE.2012.2195330

    Examples
    --------
    >>> runs = [SteadyRun(speed=v, torque=0.2 * v + math.copysign(0.1, v))
    ...         for v in (-2.0, -1.0, 1.0, 2.0)]
    >>> found = fit_friction(runs)
    >>> round(found.viscous, 6), round(found.coulomb, 6)
    (0.2, 0.1)
    """
    speeds = np.array([run.speed for run in runs])
    torques = np.array([run.torque for run in runs])
    # (7) at a steady speed: τ = B θ̇ + β sgn(θ̇), and what acts one way
    design = np.column_stack([speeds, np.sign(speeds), np.ones(len(runs))])
    if len(runs) < 4 or np.linalg.matrix_rank(design) < 3:
        raise ParameterError(
            "runs: need four or more, at two speeds and in both directions, "
            f"got {len(runs)}"
        )
    found, *_ = np.linalg.lstsq(design, torques, rcond=None)
    left = torques - design @ found
    variance = float(left @ left) / (len(runs) - 3)
    errors = np.sqrt(variance * np.diag(np.linalg.inv(design.T @ design)))
    viscous, coulomb, offset = (float(value) for value in found)
    viscous_error, coulomb_error, offset_error = (float(value) for value in errors)
    return FrictionEstimate(
        viscous=viscous,
        viscous_error=viscous_error,
        coulomb=coulomb,
        coulomb_error=coulomb_error,
        offset=offset,
        offset_error=offset_error,
        runs=tuple(runs),
    )


def steady_runs(
    device: Device,
    clock: Clock,
    *,
    speeds: Sequence[float] = SPEEDS,
    watchdog: Watching | None = None,
    progress: Callable[[], None] = lambda: None,
) -> tuple[SteadyRun, ...]:
    """Turn a free arm to and fro at steady speeds.

    THE ARM MOVES BY ITSELF, between 40 and 115 deg, with 2 N·m at most. First it is
    pushed with 0.5 N·m for 0.3 s to see whether it goes the right way.

    Parameters
    ----------
    device : Device
        An open device; nobody holds the arm.
    clock : Clock
        The clock of the device.
    speeds : sequence of float, optional
        Speeds above 0, rad/s.
    watchdog : Watching or None, optional
        Told at every tick that all is well.
    progress : callable, optional
        Called after each run; there are two to a speed.

    Returns
    -------
    tuple of SteadyRun
        Two to a speed, one each way.

    Raises
    ------
    DeviceError
        If the device fails, or the arm goes the wrong way, is held or blocked, is too
        fast, or is not between 30 and 125 deg to begin with.
    """
    watching = watchdog or NoWatchdog()
    turning = _Turning(device, clock, watching)
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

    def __init__(self, device: Device, clock: Clock, watchdog: Watching) -> None:
        self._device = device
        self._clock = clock
        self._watchdog = watchdog
        self._estimate = VelocityEstimate()
        self._due_ns = clock.now_ns()
        self.angle = 0.0
        self._velocity = 0.0
        self._n_missed = 0  # readings in a row

    @property
    def is_low(self) -> bool:
        return self.angle < 0.5 * (_LOWEST + _HIGHEST)

    def check_direction(self) -> None:
        self._tick(0.0)
        start, begun_ns = self.angle, self._clock.now_ns()
        margin = math.radians(10.0)
        if not _LOWEST - margin <= start <= _HIGHEST + margin:
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
        self._due_ns = max(self._due_ns, self._clock.now_ns() - _PERIOD_NS) + _PERIOD_NS
        try:
            time_ns, self.angle = self._device.read()
        except DeviceTimeoutError:
            self._n_missed += 1
            if self._n_missed > _MOST_MISSED:
                raise
            return  # the device holds its torque
        self._n_missed = 0
        self._velocity = self._estimate.update(time_ns * 1e-9, self.angle)
        if abs(self._velocity) > _LARGEST_SPEED:
            raise DeviceError(
                f"friction: needs at most {math.degrees(_LARGEST_SPEED):.0f} deg/s, "
                f"the arm turns at {math.degrees(self._velocity):.0f}"
            )
        self._device.command(-torque_nm)
        self._watchdog.beat()


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
