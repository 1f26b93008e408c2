"""The arm that a simulated device moves: inertia, friction that sticks, end stops."""

import functools
import math
from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from masrel.errors import ParameterError
from masrel.lab.hess.friction import Friction
from masrel.lab.hess.hand import Hand

_LOWER, _FREE, _UPPER = -1, 0, 1  # which end stop the arm touches
_MAX_HALVINGS = 10  # of a step in which something changes: 0.5 ms / 1024
_TAYLOR_TERMS = 14
_MAX_NORM = 0.25  # 0.25^15 / 15! is below 1e-21: the series is exact in floats


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantParameters:
    """What the simulated arm, motor and amplifier are like, in SI units."""

    # inertia of the motor and friction, (7)
    friction: Friction = field(default_factory=Friction)
    # inertia of the mannequin's forearm and hand, kg·m². Not printed in the source: a
    # rod of 0.8 kg and 0.25 m and a hand of 0.3 kg at 0.33 m give 0.05.
    arm_inertia: float = 0.05
    # where the arm meets its end stop, rad; the other one is at 0
    range_end: float = math.radians(146.0)
    # stop_stiffness, stop_damping: of both end stops, N·m/rad and N·m·s/rad: 10 N·m
    # move one by 0.03 deg, and the arm does not bounce
    stop_stiffness: float = 20_000.0
    stop_damping: float = 50.0
    # quantum of the commanded torque, N·m; 0 for none. One unit of an amplifier with
    # 2700 units to the N·m behind a gear of 18.8:1.
    torque_step: float = 18.8 / 2700.0
    # time constant of the current loop, s; 0 for none. Not printed; chosen.
    lag_time: float = 0.0005
    # from the command until the current begins to follow, s. Not printed; chosen.
    delay: float = 0.0005
    step_ns: int = 500_000  # step of the integration, ns

    def __post_init__(self) -> None:
        # The one number here that is set from outside
        if not 0.0 < self.range_end <= math.pi:
            raise ParameterError(
                "range_end: needs more than 0 and at most 180 degrees, "
                f"got {self.range_end} rad"
            )


class Propagator(NamedTuple):
    """What one step does to angle and speed; a named tuple, unpacked at every step."""

    # angle_angle, angle_speed, angle_lag, angle_force, angle_slope: new angle for a
    # unit of angle, of speed, of what the actuator lags behind its command, of the
    # torque at the beginning of the step, and of its slope
    angle_angle: float
    angle_speed: float
    angle_lag: float
    angle_force: float
    angle_slope: float
    # speed_angle, speed_speed, speed_lag, speed_force, speed_slope: the same for the
    # new speed
    speed_angle: float
    speed_speed: float
    speed_lag: float
    speed_force: float
    speed_slope: float
    lag: float  # share of the actuator's lag that is left after the step


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
    angle_row, speed_row = exponential[0].tolist(), exponential[1].tolist()
    lag_left = float(exponential[2, 2]) if lag_time > 0.0 else 0.0
    return Propagator._make([*angle_row, *speed_row, lag_left])


def _exponential(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    # (n, n) -> (n, n), by a Taylor series of the scaled matrix, squared back
    norm = float(np.abs(matrix).sum(axis=1).max())
    squarings = 0
    while norm > _MAX_NORM:
        norm *= 0.5
        squarings += 1
    scaled = matrix * 0.5**squarings
    identity = np.eye(matrix.shape[0])
    result = identity
    for term in range(_TAYLOR_TERMS, 0, -1):  # Horner
        result = identity + scaled @ result / term
    for _ in range(squarings):
        result = result @ result
    return result


class Plant:
    """The arm, integrated in fixed steps from the time of its first use."""

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

    __slots__ = (
        "_arm_inertia",
        "_commanded",
        "_contact",
        "_coulomb",
        "_delay_ns",
        "_force",
        "_hand",
        "_holds",
        "_inertia",
        "_lag",
        "_lag_time",
        "_pending",
        "_propagators",
        "_range_end",
        "_slide",
        "_start_ns",
        "_step_ns",
        "_stop_damping",
        "_stop_stiffness",
        "_time",
        "_torque_step",
        "_viscous",
        "_yields",
        "angle",
        "now_ns",
        "velocity",
    )

    def __init__(
        self, hand: Hand, parameters: PlantParameters, *, start_ns: int
    ) -> None:
        if not 0.0 <= hand.start < parameters.range_end:
            raise ParameterError(
                "range_end: needs an angle beyond the start of the stretch, got "
                f"{parameters.range_end} rad with a start at {hand.start} rad"
            )
        friction = parameters.friction
        self._hand = hand
        self._yields = hand.yields
        self._arm_inertia = parameters.arm_inertia
        self._inertia = friction.inertia + parameters.arm_inertia  # nobody's hand
        self._viscous = friction.viscous
        self._coulomb = friction.coulomb
        self._range_end = parameters.range_end
        self._stop_stiffness = parameters.stop_stiffness
        self._stop_damping = parameters.stop_damping
        self._torque_step = parameters.torque_step
        self._lag_time = parameters.lag_time
        self._delay_ns = round(parameters.delay * 1e9)
        self._step_ns = parameters.step_ns
        self._start_ns = self.now_ns = start_ns
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
            stop = self._stop_stiffness * beyond + self._stop_damping * self.velocity
        return self._pull_of(self._arm_inertia) - stop

    def _pull_of(self, inertia: float) -> float:
        # The muscles' torque less what moves the hand and so much of the arm, N·m
        muscles, of_hand = 0.0, 0.0
        if self._holds:
            muscles, of_hand = self._muscle_torque(), self._hand.inertia
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
        """Return the angle at a time less than a step ahead, rad."""
        # At the speed of now: within half a step at 100 rad/s² that is right to
        # 0.0007 deg, less than an encoder sees.
        return self.angle + self.velocity * (now_ns - self.now_ns) * 1e-9

    def command(self, torque_nm: float, now_ns: int) -> None:
        """Command a torque, which the motor begins to follow after its delay."""
        step = self._torque_step
        if step > 0.0:
            torque_nm = math.floor(torque_nm / step + 0.5) * step
        self._pending.append((now_ns + self._delay_ns, torque_nm))

    def advance(self, now_ns: int) -> None:
        """Integrate up to the last whole step that ends at or before a time."""
        step_ns = self._step_ns
        while self.now_ns + step_ns <= now_ns:
            pending = self._pending
            if pending and pending[0][0] <= self.now_ns:
                self._follow(pending.popleft()[1])
                continue
            if not self._try_step(0):
                self._step_in_parts()
            self.now_ns += step_ns
            # From integers, so that rounding does not add up.
            self._time = (self.now_ns - self._start_ns) * 1e-9
            if self._yields and self._holds:
                self._hand.feel(self._time, self._muscle_torque())
                self._force = self._force_at(self._time)

    def _follow(self, torque_nm: float) -> None:
        # The motor's torque goes on from where it is.
        self._lag = self._lag + self._commanded - torque_nm if self._lag_time else 0.0
        self._commanded = torque_nm
        self._force = self._force_at(self._time)

    def _step_in_parts(self) -> None:
        # Something changes within this step: parts of a half, a quarter, ... of it,
        # each as long as the place reached allows.
        done, total = 0, 1 << _MAX_HALVINGS
        while done < total:
            size = done & -done or total >> 1
            level = _MAX_HALVINGS + 1 - size.bit_length()
            while not self._try_step(level):
                level += 1
            done += total >> level

    def _force_at(self, time_s: float) -> float:
        # Torque on the arm that depends on neither its angle nor its speed, N·m
        force = -self._commanded
        if self._holds:
            hand = self._hand
            angle, speed = hand.intended(time_s)
            force += hand.stiffness * angle + hand.damping * speed
        if self._contact == _UPPER:
            force += self._stop_stiffness * self._range_end
        return force

    def _stiffness(self) -> float:
        stiffness = self._hand.stiffness if self._holds else 0.0
        return stiffness + (self._stop_stiffness if self._contact else 0.0)

    def _damping(self) -> float:
        damping = self._viscous + (self._hand.damping if self._holds else 0.0)
        return damping + (self._stop_damping if self._contact else 0.0)

    def _try_step(self, level: int) -> bool:
        # One part of a step, half as long per level -> whether it was taken. It is
        # not when something changes within it, unless the part is the shortest.
        step = self._step_ns * 1e-9 / (1 << level)
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
            inertia, self._damping(), self._stiffness(), self._lag_time, step
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
