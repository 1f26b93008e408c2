"""The simulated device: arm, motor, friction that sticks, end stops, encoder."""

import math
from typing import ClassVar

from masrel.errors import DeviceError, ParameterError
from masrel.hess.clock import Clock
from masrel.hess.device import Device, Reading
from masrel.hess.friction import Friction
from masrel.hess.hand import Hand
from masrel.hess.setup import DeviceSetup

__all__ = ["SimulatedDevice", "build"]

_LONGEST_STEP_NS = 500_000
_STOP_STIFFNESS = 20_000.0  # N·m/rad: 10 N·m move the end stop by 0.03 deg
_STOP_DAMPING = 50.0  # N·m·s/rad: the arm does not bounce


class SimulatedDevice(Device):
    """A device without hardware that obeys the same interface.

    The arm turns in a horizontal plane (no gravity)::

        (I + I_arm) θ̈ = τ_hand - τ_command - B θ̇ - β sgn(θ̇) - τ_stop

    with I, B, β of (7). While the arm rests, Coulomb friction takes any value up to
    β, so the arm truly sticks. The equation is integrated by backward Euler in steps
    of at most 0.5 ms up to the clock's now, whenever the device is read or
    commanded; the last command is held meanwhile, as an amplifier holds it.

    Parameters
    ----------
    clock : Clock
        Where "now" comes from.
    hand : Hand
        What moves the arm. Its time begins with the first reading.
    range_end : float, optional
        Where the arm meets its end stop, rad; the other one is at 0.
    friction : Friction, optional
        Inertia of the motor and friction, (7).
    arm_inertia : float, optional
        Inertia of the mannequin's forearm and hand, kg·m². Not printed in the
        source: a rod of 0.8 kg and 0.25 m and a hand of 0.3 kg at 0.33 m give 0.05.
    resolution : float, optional
        Step of the encoder at the elbow, rad (Table II: 0.005 deg).

    Raises
    ------
    ParameterError
        If a value is outside its range.

    References
    ----------
    .. [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). IEEE TNSRE 20(3), 361-370,
       Table II and equation (7). https://doi.org/10.1109/TNSRE.2012.2195330
    """

    name: ClassVar[str] = "simulated"
    simulated: ClassVar[bool] = True

    def __init__(
        self,
        *,
        clock: Clock,
        hand: Hand,
        range_end: float = math.radians(146.0),
        friction: Friction | None = None,
        arm_inertia: float = 0.05,
        resolution: float = math.radians(0.005),
    ) -> None:
        if not 0.0 <= hand.start < range_end <= math.pi:
            raise ParameterError(
                "range_end: needs an angle beyond the start of the stretch, at most "
                f"180 degrees, got {range_end} rad with a start at {hand.start} rad"
            )
        if not 0.0 <= arm_inertia < math.inf:
            raise ParameterError(f"arm_inertia: needs 0 or more, got {arm_inertia}")
        if not 0.0 < resolution < math.inf:
            raise ParameterError(f"resolution: needs more than 0, got {resolution}")
        friction = friction or Friction()
        self._clock = clock
        self._hand = hand
        self._range_end = range_end
        self._resolution = resolution
        self._inertia = friction.inertia + arm_inertia
        self._viscous = friction.viscous
        self._coulomb = friction.coulomb
        self._start_ns: int | None = None
        self._now_ns = 0  # how far the plant has been integrated
        self._angle = hand.start
        self._velocity = 0.0
        self._torque = 0.0

    @property
    def hand_torque(self) -> float:
        """Torque of the hand on the arm now, as a sensor between them reads, N·m."""
        if self._start_ns is None:
            return 0.0
        time_s = (self._now_ns - self._start_ns) * 1e-9
        if time_s >= self._hand.slip_time:
            return 0.0
        angle, velocity = self._hand.intended(time_s)
        spring = self._hand.stiffness * (angle - self._angle)
        return spring + self._hand.damping * (velocity - self._velocity)

    def _start(self) -> None:
        """Nothing to take hold of."""

    def _read(self) -> Reading:
        self._advance()
        steps = math.floor(self._angle / self._resolution + 0.5)
        return Reading(self._now_ns, steps * self._resolution)

    def _send(self, torque_nm: float) -> None:
        self._advance()
        self._torque = torque_nm

    def _stop(self) -> None:
        """Nothing to let go of."""

    def _advance(self) -> None:
        # Brings the plant to the clock's now, in equal steps.
        now_ns = self._clock.now_ns()
        if self._start_ns is None:
            self._start_ns = self._now_ns = now_ns
        gap_ns = now_ns - self._now_ns
        if gap_ns <= 0:
            return
        n_steps = -(-gap_ns // _LONGEST_STEP_NS)
        step = gap_ns * 1e-9 / n_steps
        time_s = (self._now_ns - self._start_ns) * 1e-9
        for number in range(1, n_steps + 1):
            self._step(time_s + number * step, step)
        self._now_ns = now_ns

    def _step(self, time_s: float, step: float) -> None:
        # One step of backward Euler: every spring and damper acts at its end, so
        # that stiff ones stay stable. `drive` is momentum plus impulse without
        # Coulomb friction, `resistance` what multiplies the new speed.
        angle = self._angle
        spring = 0.0
        damper = self._viscous
        torque = -self._torque
        hand = self._hand
        if time_s < hand.slip_time:
            intended, speed = hand.intended(time_s)
            spring = hand.stiffness
            damper += hand.damping
            torque += spring * (intended - angle) + hand.damping * speed
        if angle > self._range_end or angle < 0.0:
            stop = self._range_end if angle > 0.0 else 0.0
            spring += _STOP_STIFFNESS
            damper += _STOP_DAMPING
            torque += _STOP_STIFFNESS * (stop - angle)
        drive = self._inertia * self._velocity + step * torque
        resistance = self._inertia + step * (damper + step * spring)
        friction = step * self._coulomb  # the largest impulse of β
        if drive > friction:
            velocity = (drive - friction) / resistance
        elif drive < -friction:
            velocity = (drive + friction) / resistance
        else:
            velocity = 0.0  # it sticks
        self._velocity = velocity
        self._angle = angle + step * velocity


def build(setup: DeviceSetup) -> SimulatedDevice:
    """Make a simulated device.

    Parameters
    ----------
    setup : DeviceSetup
        Clock, hand and end of range.

    Returns
    -------
    SimulatedDevice
        Not yet open.

    Raises
    ------
    DeviceError
        If there is no hand, or there are options: it has none.
    ParameterError
        If the end of range does not fit the hand.
    """
    if setup.hand is None:
        raise DeviceError("simulated: needs a hand, there is nobody to move the arm")
    if setup.options is not None:
        got = type(setup.options).__name__
        raise DeviceError(f"simulated: needs no options, got {got}")
    return SimulatedDevice(
        clock=setup.clock, hand=setup.hand, range_end=setup.range_end
    )
