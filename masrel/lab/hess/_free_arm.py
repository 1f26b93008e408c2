"""A free arm: what must hold before it moves, its steady runs, and its friction.

In: an open device whose arm nobody holds; it turns to and fro at steady speeds. Out:
the friction of equation (7) of the source fitted to the mean torque at each speed.
"""

import math
import statistics
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np

from masrel.errors import DeviceError, DeviceTimeoutError, ParameterError
from masrel.lab.hess._can import Node
from masrel.lab.hess._clock import Clock
from masrel.lab.hess._guard import Guard
from masrel.lab.hess._signals import VelocityEstimate
from masrel.lab.hess._stop import EmergencyStop, Watching
from masrel.lab.hess.device import Device
from masrel.lab.hess.limits import DeviceLimits
from masrel.lab.recording import MEASURED_TORQUE, _Floats

# Before it turns

PROBE_PATIENCE_S = 0.01  # with a node that may not be there; drivers wait 1 to 100 ms
_N_REQUESTS = 1000
_MAX_REPLY_S = 0.0007  # of a tick of 1 ms; the rest is for the torque and the host
_MIN_FRACTION_IN_TIME = 0.99
_REST_COUNTS = 4  # between the largest and the smallest of an arm at rest

# A free arm that turns

SPEEDS = tuple(math.radians(speed) for speed in (20.0, 40.0, 60.0, 80.0))

_LOW_END, _HIGH_END = math.radians(40.0), math.radians(115.0)  # where the arm turns
_MARGIN = math.radians(10.0)  # how far outside it may be to begin with
_MAX_TORQUE = 2.0  # N·m; ten times what friction is expected to be

LIMITS = DeviceLimits(
    torque=_MAX_TORQUE,
    speed=math.radians(150.0),
    lowest_angle=_LOW_END - 2.0 * _MARGIN,
    highest_angle=_HIGH_END + 2.0 * _MARGIN,
    # A free arm turns with less than half of this. One that does not is held or against
    # an end stop, or its encoder has frozen.
    standing_torque=1.0,
    standing_time=0.2,
    drift_angle=math.pi,  # never: here a motor keeps the speed even
)
"""What passes while nobody holds the arm: less than in a presentation."""

_SETTLING_TRAVEL = math.radians(35.0)  # of a run, before it counts as steady
_MAX_RUN_S = 10.0
_MIN_TICKS = 100  # of the steady part of a run
# At each of its ends, which say how far it is from steady
_ENDS = (slice(None, 20), slice(-20, None))
_GAIN = 1.0  # N·m·s/rad: with 0.06 kg·m² the speed settles within 0.05 s
_INTEGRAL_GAIN = 20.0  # N·m/rad: 18 rad/s with that inertia, damped by a half
_PROBE_TORQUE, _PROBE_S = 0.5, 0.3
_PROBE_TRAVEL = math.radians(1.0)
_PERIOD_NS = 1_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One thing that must hold before a person touches the arm.

    Attributes
    ----------
    name : str
        What was checked.
    holds : bool
        Whether it is as it must be.
    result : str
        What was measured, in a sentence.
    """

    name: str
    holds: bool
    result: str


_Answer = TypeVar("_Answer")


def ask_often(node: Node, ask: Callable[[], _Answer]) -> tuple[Check, list[_Answer]]:
    """Ask a thousand times, once a tick -> whether answers come in time, and they."""
    answers, took_s = [], []
    for _ in range(_N_REQUESTS):
        request_ns = node.clock.now_ns()
        with suppress(DeviceTimeoutError):
            answers.append(ask())
            took_s.append((node.clock.now_ns() - request_ns) * 1e-9)
        node.wait(max(0.0, 0.001 - (node.clock.now_ns() - request_ns) * 1e-9))
    return _check_replies(took_s), answers


def _check_replies(took_s: list[float]) -> Check:
    n_lost = _N_REQUESTS - len(took_s)
    if not took_s:
        return Check(name="answers", holds=False, result=f"none of {n_lost} came")
    in_time = sum(took <= _MAX_REPLY_S for took in took_s) / _N_REQUESTS
    return Check(
        name="answers",
        holds=n_lost == 0 and in_time >= _MIN_FRACTION_IN_TIME,
        result=(
            f"median {1e3 * statistics.median(took_s):.2f} ms, longest "
            f"{1e3 * max(took_s):.2f} ms, {n_lost} of {_N_REQUESTS} lost; needs "
            f"{100 * _MIN_FRACTION_IN_TIME:g} % within {1e3 * _MAX_REPLY_S:g} ms"
        ),
    )


def check_rest(
    counts: list[int], angle: float, advice: str, unit: str = "counts"
) -> tuple[Check, Check]:
    """Return whether an arm is where an elbow can be, and at rest."""
    limits, n_moved = DeviceLimits(), max(counts) - min(counts)
    return (
        Check(
            name="position",
            holds=limits.lowest_angle <= angle <= limits.highest_angle,
            result=f"{math.degrees(angle):.2f} deg; {advice}",
        ),
        Check(
            name="rest",
            holds=n_moved <= _REST_COUNTS,
            result=f"{n_moved} {unit} in a second; at most {_REST_COUNTS} at rest",
        ),
    )


def check_torque_mode(
    activate: Callable[[], object], release: Callable[[], object], result: str
) -> Check:
    """Return whether an amplifier goes into torque mode; it is idle afterwards."""
    holds = True
    try:
        activate()
    except DeviceError as error:
        holds, result = False, str(error)
    finally:
        release()
    return Check(name="torque mode", holds=holds, result=result)


def check_bus(node: Node) -> Check:
    """Return whether there were no error frames so far."""
    return Check(
        name="error frames",
        holds=node.n_errors == 0,
        result=f"{node.n_errors}, and {node.n_foreign} frames of others",
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SteadyRun:
    """One turn of the arm at a steady speed.

    Attributes
    ----------
    speed : float
        Mean speed of the steady part, rad/s; negative in flexion.
    torque : float
        Mean torque of the motor in it, N·m, positive in extension.
    acceleration : float, optional
        Mean acceleration in it, rad/s².
    """

    speed: float
    torque: float
    acceleration: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionEstimate:
    """Friction of equation (7), fitted to steady runs.

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


def steady_runs(
    device: Device,
    clock: Clock,
    *,
    speeds: Sequence[float] = SPEEDS,
    watchdog: Watching | None = None,
    stop: EmergencyStop | None = None,
    progress: Callable[[], object] = lambda: None,
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
    stop : EmergencyStop or None, optional
        A button that is looked at in every tick.
    progress : callable, optional
        Called after each run; there are two to a speed.

    Returns
    -------
    tuple of SteadyRun
        Two to a speed, one each way.

    Raises
    ------
    DeviceError
        If the device fails, the stop is pressed, a limit is passed, or the arm goes the
        wrong way, is held or blocked, or is not between 30 and 125 deg to begin with.
        Whoever opened the device closes it: then it is idle.
    """
    arm = TurningArm(device, clock, watchdog, stop)
    arm.check_direction()
    runs = arm.steady_runs(speeds, progress)
    arm.let_go()
    return runs


def linear_fit(design: _Floats, target: _Floats) -> tuple[list[float], list[float]]:
    """Return coefficients and their standard errors from the residuals."""
    # of n rows of k terms, and n numbers
    solution, *_ = np.linalg.lstsq(design, target, rcond=None)
    residuals = target - design @ solution
    variance = float(residuals @ residuals) / (target.size - solution.size)
    errors = np.sqrt(variance * np.diag(np.linalg.inv(design.T @ design)))
    return solution.tolist(), errors.tolist()


def fit_friction(
    runs: Sequence[SteadyRun], *, inertia: float = 0.0
) -> FrictionEstimate:
    """Fit B and β of equation (7) to steady runs by least squares.

    Parameters
    ----------
    runs : sequence of SteadyRun
        At two speeds or more, in both directions.
    inertia : float, optional
        Inertia of the free arm, kg·m²: what accelerates it is not friction.

    Returns
    -------
    FrictionEstimate
        B, β and an offset, with standard errors from the residuals.

    Raises
    ------
    ParameterError
        If there are fewer than four runs, or they do not determine all three.

    References
    ----------
    .. [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). IEEE TNSRE 20(3), 361-370,
       equation (7). https://doi.org/10.1109/TNSRE.2012.2195330

    Examples
    --------
    >>> import math
    >>> runs = [SteadyRun(speed=v, torque=0.2 * v + math.copysign(0.1, v))
    ...         for v in (-2.0, -1.0, 1.0, 2.0)]
    >>> estimate = fit_friction(runs)
    >>> round(estimate.viscous, 6), round(estimate.coulomb, 6)
    (0.2, 0.1)
    """
    speeds = np.array([run.speed for run in runs])
    torques = np.array([run.torque - inertia * run.acceleration for run in runs])
    # (7) at a steady speed: τ = B θ̇ + β sgn(θ̇), and what acts one way
    design = np.column_stack([speeds, np.sign(speeds), np.ones(len(runs))])
    if len(runs) < 4 or np.linalg.matrix_rank(design) < 3:
        raise ParameterError(
            "runs: need four or more, at two speeds and in both directions, "
            f"got {len(runs)}"
        )
    (viscous, coulomb, offset), errors = linear_fit(design, torques)
    viscous_error, coulomb_error, offset_error = errors
    return FrictionEstimate(
        viscous=viscous,
        viscous_error=viscous_error,
        coulomb=coulomb,
        coulomb_error=coulomb_error,
        offset=offset,
        offset_error=offset_error,
        runs=tuple(runs),
    )


class Tick(NamedTuple):
    """What was read and then sent in a tick; times since the arm was taken, s."""

    time_s: float  # when it was read
    angle: float  # rad
    velocity: float  # estimated, rad/s
    measured: float  # by a torque sensor, N·m; nan without one
    sent_s: float
    torque: float  # of the motor, N·m, positive in extension


class TurningArm:
    """A free arm under speed control, tick by tick."""

    def __init__(
        self,
        device: Device,
        clock: Clock,
        watchdog: Watching | None = None,
        stop: EmergencyStop | None = None,
        limits: DeviceLimits = LIMITS,
    ) -> None:
        self._device = device
        self._clock = clock
        self._watchdog = watchdog or Watching()
        self._stop = stop or EmergencyStop()
        self._most = limits.torque
        self._estimate = VelocityEstimate()
        self._guard = Guard(limits, _PERIOD_NS * 1e-9, has_hand=False)
        self._start_ns = self._due_ns = self._sent_ns = clock.now_ns()
        self.angle = math.nan  # until it has been read
        self._velocity = 0.0

    def check_direction(self) -> None:
        while math.isnan(self.angle):
            self._tick(0.0)
        start, start_ns = self.angle, self._clock.now_ns()
        if not _LOW_END - _MARGIN <= start <= _HIGH_END + _MARGIN:
            raise DeviceError(
                "friction: needs an arm between 30 and 125 deg to begin with, it is at "
                f"{math.degrees(start):.1f}"
            )
        while abs(self.angle - start) < _PROBE_TRAVEL:
            if self._clock.now_ns() - start_ns > _PROBE_S * 1e9:
                raise DeviceError(
                    f"friction: needs a free arm, {_PROBE_TORQUE:g} N·m do not move it"
                )
            self._tick(_PROBE_TORQUE)
        if self.angle < start:
            raise DeviceError(
                "friction: needs an arm that a torque towards extension extends, it "
                "flexes; torque and counts have different signs"
            )

    def steady_runs(
        self, speeds: Sequence[float], progress: Callable[[], object]
    ) -> tuple[SteadyRun, ...]:
        away = 1.0 if self.angle < 0.5 * (_LOW_END + _HIGH_END) else -1.0
        self.turn(-away * speeds[0])  # to the nearer end
        runs = []
        for speed in speeds:
            for direction in (away, -away):
                runs.append(mean_run(self.turn(direction * speed), direction * speed))
                progress()
        return tuple(runs)

    def turn(
        self,
        speed: float,
        *,
        ends: tuple[float, float] = (_LOW_END, _HIGH_END),
        settling: float = _SETTLING_TRAVEL,
        holds: float = 0.0,
        pushes: Callable[[float], float] = lambda _time_s: 0.0,
    ) -> list[Tick]:
        # To the end of the range on that side -> each tick after so much travel. It
        # begins with a torque that holds a weight, and adds one of the time to its own.
        start_ns, start, integral = self._clock.now_ns(), self.angle, holds
        steady = []
        while self.angle < ends[1] if speed > 0.0 else self.angle > ends[0]:
            if self._clock.now_ns() - start_ns > _MAX_RUN_S * 1e9:
                raise _does_not_turn(speed)
            error = speed - self._velocity
            torque = _GAIN * error + integral
            if abs(torque) <= self._most:  # it does not wind up beyond the motor
                integral += _INTEGRAL_GAIN * error * _PERIOD_NS * 1e-9
            torque += pushes((self._clock.now_ns() - start_ns) * 1e-9)
            tick = self._tick(max(-self._most, min(self._most, torque)))
            if tick is not None and abs(self.angle - start) > settling:
                steady.append(tick)
        return steady

    def hold(self, torque_nm: float, duration_s: float) -> list[Tick]:
        # One torque for a while
        end_ns = self._clock.now_ns() + round(duration_s * 1e9)
        ticks = []
        while self._clock.now_ns() < end_ns:
            ticks.append(self._tick(torque_nm))
        return [tick for tick in ticks if tick is not None]

    def let_go(self) -> None:
        self._device.command(0.0)
        self._watchdog.rest()

    def _tick(self, torque_nm: float) -> Tick | None:
        # None without a new reading; torque: of the motor, positive in extension
        self._clock.sleep_until_ns(self._due_ns)
        now_ns = self._clock.now_ns()
        self._due_ns = max(self._due_ns, now_ns - _PERIOD_NS) + _PERIOD_NS
        self._stop.check()
        guard = self._guard
        guard.silence((now_ns - self._sent_ns) * 1e-9)
        try:
            time_ns, angle, channels = self._device.read()
        except DeviceTimeoutError as error:
            guard.no_reading(self._since_start_s(now_ns), str(error))
            return None  # the device holds its torque
        time_s = self._since_start_s(time_ns)
        if not guard.is_new(time_s):
            guard.no_reading(
                self._since_start_s(now_ns), f"one of {time_s:.6f} s again"
            )
            return None
        guard.reading(time_s, angle, (self._clock.now_ns() - time_ns) * 1e-9)
        self.angle = angle
        self._velocity = self._estimate.update(time_s, angle)
        guard.speed(self._velocity)
        guard.torque(time_s, torque_nm)
        sent_s = self._since_start_s(self._clock.now_ns())
        self._device.command(-torque_nm)
        self._sent_ns = now_ns
        self._watchdog.beat()
        names = self._device.channels
        sensed = dict(zip(names, channels, strict=True)).get(MEASURED_TORQUE, math.nan)
        return Tick(time_s, angle, self._velocity, sensed, sent_s, torque_nm)

    def _since_start_s(self, time_ns: int) -> float:
        return (time_ns - self._start_ns) * 1e-9


def mean_run(steady: list[Tick], speed: float) -> SteadyRun:
    """Return the means of a run, or refuse one that was not steady for long."""
    if len(steady) < _MIN_TICKS:
        raise _does_not_turn(speed)
    ticks = np.array(steady)
    began, ended = (np.mean(ticks[part], axis=0) for part in _ENDS)
    return SteadyRun(
        speed=float(np.mean(ticks[:, 2])),
        torque=float(np.mean(ticks[:, 5])),
        acceleration=float((ended[2] - began[2]) / (ended[0] - began[0])),
    )


def _does_not_turn(speed: float) -> DeviceError:
    return DeviceError(
        f"friction: needs a free arm, it does not turn at {math.degrees(speed):.0f} "
        "deg/s from end to end"
    )
