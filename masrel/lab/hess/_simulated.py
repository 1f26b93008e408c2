"""The simulated device: an arm behind an encoder, an amplifier and a torque sensor.

The arm has inertia, friction that sticks, and end stops, and a hand moves it.
"""

import functools
import math
import random
from collections import deque
from dataclasses import dataclass, field, replace

import numpy as np

from masrel.errors import DeviceError, ParameterError
from masrel.lab.hess._clock import Clock
from masrel.lab.hess.controller import Friction
from masrel.lab.hess.device import (
    _NOT_A_KEY,
    BackendOptions,
    Device,
    DeviceSetup,
    Reading,
)
from masrel.lab.hess.hand import Hand
from masrel.lab.hess.limits import _check_not_negative
from masrel.lab.recording import MEASURED_TORQUE, _Floats

_LOWER, _FREE, _UPPER = -1, 0, 1  # which end stop the arm touches
_RESOLUTION = math.radians(0.005)  # of the encoder: its step
_MAX_HALVINGS = 10  # of a step in which something changes: 0.5 ms / 1024
_TAYLOR_TERMS = 14
_MAX_NORM = 0.25  # 0.25^15 / 15! is below 1e-21: the series is exact in floats


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantParameters:
    """What a simulated arm, its encoder, motor and amplifier are like, in SI units.

    Attributes
    ----------
    friction : Friction, optional
        Inertia of the motor and friction, (7).
    arm_inertia : float, optional
        Of forearm and hand of the mannequin, kg·m². Not printed in the source: a rod of
        0.8 kg and 0.25 m and a hand of 0.3 kg at 0.33 m give 0.05.
    range_end : float, optional
        Where the arm meets its end stop, rad; the other one is at 0. `open_device` says
        where it is.
    stop_stiffness, stop_damping : float, optional
        Of both end stops, N·m/rad and N·m·s/rad: 10 N·m move one by 0.03 deg, and the
        arm does not bounce.
    torque_step : float, optional
        Quantum of the commanded torque, N·m; 0 for none. By default one unit of an
        amplifier with 2700 units to the N·m behind a gear of 18.8:1; an emulated
        amplifier has that of its bus.
    lag_time : float, optional
        Time constant of the current loop, s; 0 for none. Not printed; chosen.
    delay : float, optional
        From the command until the current begins to follow, s. Not printed; chosen.
    encoder_noise : float, optional
        Standard deviation of what the encoder sees, before its steps, rad.
    step_ns : int, optional
        Step of the integration, ns.

    Raises
    ------
    ParameterError
        If `range_end` is not an angle of an elbow, or another value is negative.
    """

    friction: Friction = field(default_factory=Friction)
    arm_inertia: float = 0.05
    range_end: float = math.radians(146.0)
    stop_stiffness: float = 20_000.0
    stop_damping: float = 50.0
    torque_step: float = 18.8 / 2700.0
    lag_time: float = 0.0005
    delay: float = 0.0005
    encoder_noise: float = 0.0
    step_ns: int = 500_000

    def __post_init__(self) -> None:
        if not 0.0 < self.range_end <= math.pi:
            raise ParameterError(
                "range_end: needs more than 0 and at most 180 degrees, "
                f"got {self.range_end} rad"
            )
        _check_not_negative(
            arm_inertia=self.arm_inertia,
            torque_step=self.torque_step,
            lag_time=self.lag_time,
            delay=self.delay,
            encoder_noise=self.encoder_noise,
        )


# What one step does. New angle for a unit of angle, of speed, of what the actuator lags
# behind its command, of the torque at the beginning of the step, and of its slope; the
# same five for the new speed; the share of the actuator's lag that is left.
Propagator = tuple[float, ...]


@functools.lru_cache(maxsize=512)
def propagator(
    inertia: float, damping: float, stiffness: float, lag_time: float, step: float
) -> Propagator:
    """Solve I·θ̈ + D·θ̇ + K·θ = f(t) - e(t) over one step."""
    # f is linear within the step, and e, what the actuator's torque lags behind its
    # command, decays as exp(-t / `lag_time`). For such f the result is exact.
    decay = 1.0 / lag_time if lag_time > 0.0 else 0.0
    system = np.zeros((5, 5))  # θ, θ̇, e, f, slope of f
    system[0, 1] = 1.0
    system[1, :4] = np.array([-stiffness, -damping, -1.0, 1.0]) / inertia
    system[2, 2] = -decay
    system[3, 4] = 1.0
    exponential = _exponential(system * step)
    angle_row, speed_row = exponential[:2].tolist()
    lag_left = float(exponential[2, 2]) if lag_time > 0.0 else 0.0
    return (*angle_row, *speed_row, lag_left)


def _exponential(matrix: _Floats) -> _Floats:
    # (n, n) -> (n, n), by a Taylor series of the scaled matrix, squared back
    norm = float(np.abs(matrix).sum(axis=1).max())
    squarings = max(0, math.ceil(math.log2(norm / _MAX_NORM)))
    scaled = matrix * 0.5**squarings
    identity = np.eye(matrix.shape[0])
    result = identity
    for term in range(_TAYLOR_TERMS, 0, -1):  # Horner
        result = identity + scaled @ result / term
    return np.linalg.matrix_power(result, 2**squarings)


class Plant:
    """The arm, integrated in fixed steps from the time at which it begins."""

    # The arm turns in a horizontal plane (no gravity), and the hand's own mass with it:
    #     (I + I_arm + I_hand) θ̈ = τ_muscles - τ_motor - B θ̇ - β sgn(θ̇) - τ_stop
    # with I, B, β of (7). While the arm rests, Coulomb friction takes any value up to
    # β, so the arm truly sticks. The motor's torque follows the command, rounded to its
    # quantum, after a delay and through a first-order lag.
    # Between two changes (the arm sticks or breaks away, turns back, meets a stop, the
    # hand lets go) the equation is linear. A step solves it exactly for a torque of the
    # hand's intention that is linear within the step; a step in which something changes
    # is halved until the change lies within a 1024th of it.
    # [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). IEEE TNSRE 20(3), 361-370, Table
    # II and equation (7). https://doi.org/10.1109/TNSRE.2012.2195330

    def __init__(self, hand: Hand, parameters: PlantParameters) -> None:
        if not 0.0 <= hand.start < parameters.range_end:
            raise ParameterError(
                "range_end: needs an angle beyond the start of the stretch, got "
                f"{parameters.range_end} rad with a start at {hand.start} rad"
            )
        friction = parameters.friction
        self._hand, self._arm = hand, parameters
        self._yields = hand.yields
        self._inertia = friction.inertia + parameters.arm_inertia  # nobody's hand
        self._coulomb = friction.coulomb
        self._range_end = parameters.range_end
        self._delay_ns = round(parameters.delay * 1e9)
        self.step_ns = parameters.step_ns
        self._start_ns = self.now_ns = 0
        self._noise = random.Random(0)
        self._time = 0.0  # of the hand, s
        self.angle = hand.start
        self.velocity = 0.0
        self._commanded = 0.0  # what the motor is on its way to, N·m
        self._lag = 0.0  # motor's torque less that
        self._pending: deque[tuple[int, float]] = deque()  # (when, ns; N·m)
        self._slide = 0  # direction of sliding, 0 while it sticks
        self._contact = _FREE
        self._holds = hand.slip_time > 0.0
        self._propagators: dict[tuple[bool, int, int], Propagator] = {}
        self._force = self._force_at(0.0)
        # Before the loop: numpy's first product of matrices takes memory for 0.1 s
        self._propagator(self.step_ns * 1e-9, 0)

    def begin(self, now_ns: int) -> None:
        """Let the time of the hand begin now."""
        self._start_ns = self.now_ns = now_ns

    @property
    def motor_torque(self) -> float:
        """Torque of the motor at the elbow now, N·m; positive resists extension."""
        return self._commanded + self._lag

    @property
    def hand_torque(self) -> float:
        """Torque of the hand on the arm now, as a sensor between them reads, N·m."""
        return self._pull_of(0.0) if self._holds else 0.0

    @property
    def arm_torque(self) -> float:
        """Torque of the arm on the device now, as a sensor between them reads, N·m."""
        # Motor and friction are on its other side; the end stops are the elbow's own.
        stop = 0.0
        if self._contact:
            beyond = self.angle - (self._range_end if self._contact == _UPPER else 0.0)
            stop = self._arm.stop_stiffness * beyond
            stop += self._arm.stop_damping * self.velocity
        return self._pull_of(self._arm.arm_inertia) - stop

    def _pull_of(self, inertia: float) -> float:
        # Torque of muscles and weight less what moves the hand and so much of the arm
        muscles, of_hand = self._hand.load, 0.0
        if self._holds:
            muscles, of_hand = muscles + self._muscle_torque(), self._hand.inertia
        share = (of_hand + inertia) / (self._inertia + of_hand)
        return muscles - share * self._net_torque()

    def _muscle_torque(self) -> float:
        # Of the hand's spring and damper, N·m
        hand = self._hand
        angle, velocity = hand.intended(self._time)
        spring = hand.stiffness * (angle - self.angle)
        return spring + hand.damping * (velocity - self.velocity)

    def _net_torque(self) -> float:
        # What accelerates arm and hand, N·m; nothing while they stick
        if not self._slide:
            return 0.0
        driven = self._force - self._lag - self._slide * self._coulomb
        resisted = self._stiffness() * self.angle + self._damping() * self.velocity
        return driven - resisted

    def angle_at(self, now_ns: int) -> float:
        """Return what an encoder sees less than a step ahead, before its steps, rad."""
        # At the speed of now: within half a step at 100 rad/s² that is right to
        # 0.0007 deg, less than an encoder sees.
        angle = self.angle + self.velocity * (now_ns - self.now_ns) * 1e-9
        return angle + self._noise.gauss(0.0, self._arm.encoder_noise)

    def command(self, torque_nm: float, now_ns: int) -> None:
        """Command a torque, which the motor begins to follow after its delay."""
        torque_nm = _rounded(torque_nm, self._arm.torque_step)
        self._pending.append((now_ns + self._delay_ns, torque_nm))

    def advance(self, now_ns: int) -> None:
        """Integrate up to the last whole step that ends at or before a time."""
        step_ns = self.step_ns
        while self.now_ns + step_ns <= now_ns:
            pending = self._pending
            if pending and pending[0][0] <= self.now_ns:
                self._follow(pending.popleft()[1])
                continue
            self._step(0)
            self.now_ns += step_ns
            # From integers, so that rounding does not add up.
            self._time = (self.now_ns - self._start_ns) * 1e-9
            if self._yields and self._holds:
                self._hand.feel(self._time, self._muscle_torque())
                self._force = self._force_at(self._time)

    def _follow(self, torque_nm: float) -> None:
        # The motor's torque goes on from where it is.
        self._lag = (
            self._lag + self._commanded - torque_nm if self._arm.lag_time else 0.0
        )
        self._commanded = torque_nm
        self._force = self._force_at(self._time)

    def _step(self, level: int) -> None:
        # A part of a step, half as long per level; its halves where something changes
        if not self._try_step(level):
            self._step(level + 1)
            self._step(level + 1)

    def _force_at(self, time_s: float) -> float:
        # Torque on the arm that depends on neither its angle nor its speed, N·m
        force = self._hand.load - self._commanded
        if self._holds:
            hand = self._hand
            angle, speed = hand.intended(time_s)
            force += hand.stiffness * angle + hand.damping * speed
        if self._contact == _UPPER:
            force += self._arm.stop_stiffness * self._range_end
        return force

    def _stiffness(self) -> float:
        stiffness = self._hand.stiffness if self._holds else 0.0
        return stiffness + (self._arm.stop_stiffness if self._contact else 0.0)

    def _damping(self) -> float:
        damping = self._hand.damping if self._holds else 0.0
        damping += self._arm.stop_damping if self._contact else 0.0
        return self._arm.friction.viscous + damping

    def _try_step(self, level: int) -> bool:
        # -> whether a part of a step was taken. It is not when something changes
        # within it, unless the part is the shortest.
        step = self.step_ns * 1e-9 / (1 << level)
        end = self._time + step
        force, new_force = self._force, self._force_at(end)
        factors = self._propagators.get((self._holds, self._contact, level))
        if factors is None:
            factors = self._propagator(step, level)
        slide, angle, velocity, lag = self._slide, self.angle, self.velocity, self._lag
        aa, as_, al, af, ag, sa, ss, sl, sf, sg, lag_left = factors
        new_lag = lag_left * lag
        if slide:
            slope = (new_force - force) / step
            driven = force - slide * self._coulomb
            angle, velocity = (
                aa * angle + as_ * velocity + al * lag + af * driven + ag * slope,
                sa * angle + ss * velocity + sl * lag + sf * driven + sg * slope,
            )
            turned = velocity * slide < 0.0
        else:
            net = new_force - new_lag - self._stiffness() * angle
            turned = abs(net) > self._coulomb  # it breaks away
        beyond = _UPPER if angle > self._range_end else _FREE
        contact = _LOWER if angle < 0.0 else beyond
        holds = self._holds and end < self._hand.slip_time
        changes = turned or contact != self._contact or holds != self._holds
        if changes and level < _MAX_HALVINGS:
            return False
        self._time, self.angle, self.velocity, self._lag = end, angle, velocity, new_lag
        self._force = new_force
        if changes:
            self._change(contact, holds, turned)
        return True

    def _propagator(self, step: float, level: int) -> Propagator:
        inertia = self._inertia + (self._hand.inertia if self._holds else 0.0)
        factors = propagator(
            inertia, self._damping(), self._stiffness(), self._arm.lag_time, step
        )
        self._propagators[self._holds, self._contact, level] = factors
        return factors

    def _change(self, contact: int, holds: bool, turned: bool) -> None:
        self._contact, self._holds = contact, holds
        self._force = self._force_at(self._time)
        if not turned:
            return
        self.velocity = 0.0
        net = self._force - self._lag - self._stiffness() * self.angle
        if abs(net) <= self._coulomb:
            self._slide = 0  # it sticks
        else:
            self._slide = 1 if net > 0.0 else -1


@dataclass(frozen=True, slots=True, kw_only=True)
class TorqueSensor:
    """The torque sensor of the simulated device, between motor and arm.

    It reads what the arm pulls at: the motor's torque, friction and what moves the
    motor itself. The numbers are of no product; ``docs/reference/driver.md`` gives
    reasons.

    Attributes
    ----------
    noise : float, optional
        Standard deviation of a reading, N·m.
    lag_time : float, optional
        Time constant of its low-pass, s; 0 for none.
    step : float, optional
        Its quantum, N·m; 0 for none.
    seed : int, optional
        Seed of the noise.

    Raises
    ------
    ParameterError
        If a value is below 0 or not finite.

    Examples
    --------
    >>> TorqueSensor(noise=0.1).lag_time
    0.0008
    """

    noise: float = 0.02
    lag_time: float = 0.0008
    step: float = 0.01
    seed: int = 0

    def __post_init__(self) -> None:
        _check_not_negative(
            noise=self.noise, lag_time=self.lag_time, step=self.step, seed=self.seed
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedOptions(BackendOptions):
    """What `open_device` can be told of the simulated device.

    Attributes
    ----------
    torque_sensor : TorqueSensor or None, optional
        Its torque sensor; None for none.
    arm : PlantParameters, optional
        What its arm is like.
    """

    torque_sensor: TorqueSensor | None = None
    arm: PlantParameters = field(default_factory=PlantParameters, metadata=_NOT_A_KEY)

    @property
    def moves_hardware(self) -> bool:
        """No motor moves."""
        return False

    @property
    def has_simulated_hand(self) -> bool:
        """A simulated hand moves the arm."""
        return True


OPTIONS = SimulatedOptions


def _rounded(value: float, step: float) -> float:
    # To the nearest step, where there are steps
    return math.floor(value / step + 0.5) * step if step > 0.0 else value


class _Sensing:
    """A torque sensor between the arm and the device."""

    def __init__(self, sensor: TorqueSensor) -> None:
        self._sensor = sensor
        self._noise = random.Random(sensor.seed)
        self._raw = self._late = 0.0  # before and behind its low-pass, N·m

    def advance(self, plant: Plant, now_ns: int) -> None:
        """Let the arm move, and sense the torque at the end of every step."""
        # The low-pass is exact for a torque in straight lines between these
        step_ns, lag = plant.step_ns, self._sensor.lag_time
        periods = lag / (step_ns * 1e-9)
        left = math.exp(-step_ns * 1e-9 / lag) if lag > 0.0 else 0.0  # of a lag
        while plant.now_ns + step_ns <= now_ns:
            plant.advance(plant.now_ns + step_ns)
            before, self._raw = self._raw, plant.arm_torque
            behind = periods * (self._raw - before)  # of such a slope, in the long run
            late = self._late - before + behind
            self._late = self._raw - behind + left * late

    def read(self) -> float:
        """Return what it says now, N·m."""
        noisy = self._noise.gauss(self._late, self._sensor.noise)
        return _rounded(noisy, self._sensor.step)


class SimulatedDevice(Device):
    """A device without hardware that obeys the same interface."""

    # The arm is a `Plant`, brought up to the clock's now whenever the device is read or
    # commanded; the last command is held meanwhile, as an amplifier holds it.
    # [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). IEEE TNSRE 20(3), 361-370, Table
    # II. https://doi.org/10.1109/TNSRE.2012.2195330

    name = "simulated"
    simulated = True

    def __init__(
        self,
        *,
        clock: Clock,
        hand: Hand,
        parameters: PlantParameters | None = None,
        sensor: TorqueSensor | None = None,
    ) -> None:
        self._clock = clock
        self._plant = Plant(hand, parameters or PlantParameters())
        self._started = False
        self._sensing = None if sensor is None else _Sensing(sensor)
        self.channels = () if sensor is None else (MEASURED_TORQUE,)

    def _start(self) -> None:
        """Nothing to take hold of."""

    def _read(self) -> Reading:
        now_ns = self._advance()
        angle = _rounded(self._plant.angle_at(now_ns), _RESOLUTION)
        if self._sensing is None:
            return Reading(now_ns, angle)
        return Reading(now_ns, angle, (self._sensing.read(),))

    def _send(self, torque_nm: float) -> None:
        now_ns = self._advance()
        self._plant.command(torque_nm, now_ns)

    def _stop(self) -> None:
        """Nothing to let go of."""

    def _advance(self) -> int:
        # Brings the plant to the clock's now -> now, ns
        now_ns = self._clock.now_ns()
        if not self._started:
            self._started = True
            self._plant.begin(now_ns)
        if self._sensing is None:
            self._plant.advance(now_ns)
        else:
            self._sensing.advance(self._plant, now_ns)
        return now_ns


def build(setup: DeviceSetup) -> SimulatedDevice:
    """Make a simulated device."""
    if setup.hand is None:
        raise DeviceError("simulated: needs a hand, there is nobody to move the arm")
    options = setup.options or SimulatedOptions()
    if not isinstance(options, SimulatedOptions):
        got = type(options).__name__
        raise DeviceError(
            f"simulated: needs options of type SimulatedOptions or none, got {got}"
        )
    return SimulatedDevice(
        clock=setup.clock,
        hand=setup.hand,
        parameters=replace(options.arm, range_end=setup.range_end),
        sensor=options.torque_sensor,
    )
