"""A model rendered along a prescribed motion on the simulated device, and how well.

In: a joint model and a motion. Out: its recording, how far arm and torque were from
what was prescribed, and what the rendering means for passivity.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from masrel.lab.elbow._torque import _stepped
from masrel.lab.elbow.motions import Floats, Motion
from masrel.lab.elbow.tone import JointModel
from masrel.lab.hess._clock import SimulatedClock
from masrel.lab.hess._recorder import Presented
from masrel.lab.hess._signals import passive_damping
from masrel.lab.hess.controller import Controller
from masrel.lab.hess.device import open_device
from masrel.lab.hess.hand import Hand
from masrel.lab.hess.limits import DeviceLimits, _check_not_negative
from masrel.lab.hess.loop import run_presentation

# Between two samples of a motion the hand intends a straight line: at 100 rad/s² it is
# off by 3e-6 rad, a thirtieth of a step of the encoder.
_HAND_STEP_S = 0.0005

_NEVER_ARRIVES = 2.0 * math.pi  # an angle beyond every range, rad


class MotionHand(Hand):
    """A hand that moves a simulated arm along a prescribed motion, then holds it.

    It trembles, as the hand of a person who resists a torque does: without that, an arm
    held for 0.5 s could not be distinguished from an encoder that froze.

    Parameters
    ----------
    motion : Motion
        The intention, SI units; it may hold and return.
    slip_time : float or None, optional
        Time after the first reading at which the hand lets go, s; None for never.
    stiffness : float, optional
        N·m/rad.
    damping : float, optional
        N·m·s/rad.
    tremor : float, optional
        Amplitude of a tremor of 9 Hz, rad.

    Raises
    ------
    ParameterError
        If a value is outside its range.

    Examples
    --------
    >>> from masrel.lab.elbow import MinimumJerk
    >>> hand = MotionHand(MinimumJerk(start=0.5, end=2.5, mean_speed=1.0), tremor=0.0)
    >>> [round(value, 6) for value in hand.intended(1.0)]
    [1.5, 1.875]
    """

    _TREMOR_RAD_S: ClassVar[float] = 2.0 * math.pi * 9.0  # physiological: 8 to 12 Hz

    def __init__(
        self,
        motion: Motion,
        *,
        slip_time: float | None = None,
        stiffness: float = 600.0,
        damping: float = 40.0,
        tremor: float = math.radians(0.02),
    ) -> None:
        super().__init__(
            start=motion.start,
            stiffness=stiffness,
            damping=damping,
            slip_time=slip_time,
        )
        _check_not_negative(tremor=tremor)
        n_steps = math.ceil(motion.duration / _HAND_STEP_S)
        times = np.minimum(np.arange(n_steps + 1) * _HAND_STEP_S, motion.duration)
        self._angles: list[float] = motion.angle(times).tolist()
        self._velocities: list[float] = motion.velocity(times).tolist()
        self._velocities[-1] = 0.0  # from there on it holds
        self._tremor = tremor

    def intended(self, time_s: float) -> tuple[float, float]:
        """Return where the hand means to be.

        Parameters
        ----------
        time_s : float
            Time after the first reading, s.

        Returns
        -------
        tuple of float
            Intended angle, rad, and speed, rad/s.
        """
        phase = self._TREMOR_RAD_S * time_s
        angle = self._tremor * math.sin(phase)
        speed = self._tremor * self._TREMOR_RAD_S * math.cos(phase)
        step = time_s / _HAND_STEP_S
        i = int(step)
        if i + 1 >= len(self._angles):
            return angle + self._angles[-1], speed
        share = step - i
        left, right = self._angles[i], self._angles[i + 1]
        slow, fast = self._velocities[i], self._velocities[i + 1]
        return (
            angle + left + share * (right - left),
            speed + slow + share * (fast - slow),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Rendering:
    """What a model was on the simulated device, beside what was prescribed.

    Errors are over every tick without a fault.

    Attributes
    ----------
    presented : Presented
        The recording, and the fault if there was one.
    max_angle_error, rms_angle_error : float
        Angle of the arm less that of the motion, rad.
    max_torque_error, rms_torque_error : float
        Torque that the model asked for less that of the same model along the motion
        itself, N·m: what encoder, filtered speed and hand make of it.
    peak_torque : float
        Largest torque along the motion itself, N·m.
    energy_taken : float
        What the model took from the arm from the first tick to the last, J; negative
        when it gave some on balance.
    energy_given : float
        The most that it had given the arm on balance at any tick, J; 0 for a passive
        model that began without stored energy.
    damping_needed : float
        Damping of the device with which these slopes are passive with any hand,
        N·m·s/rad, by Colgate and Schenkel (1997): K·T/2 + B·g/(2 - g), where g is the
        gain of the low-pass of the speed; without the motor's own delay.
    """

    presented: Presented
    max_angle_error: float
    rms_angle_error: float
    max_torque_error: float
    rms_torque_error: float
    peak_torque: float
    energy_taken: float
    energy_given: float
    damping_needed: float


def render(
    model: JointModel,
    motion: Motion,
    *,
    limits: DeviceLimits | None = None,
    rate_hz: int = 1000,
    hand: MotionHand | None = None,
) -> Rendering:
    """Render a model by the control loop along a motion on the simulated device.

    Parameters
    ----------
    model : JointModel
        The joint.
    motion : Motion
        What the hand means to do, with holds and ways back; SI units.
    limits : DeviceLimits or None, optional
        What the loop lets pass; None for the defaults.
    rate_hz : int, optional
        Ticks a second.
    hand : MotionHand or None, optional
        The hand; None for one of the default stiffness along `motion`.

    Returns
    -------
    Rendering
        The recording, and how near it came to what was prescribed.

    Raises
    ------
    ParameterError
        If the motion starts at or beyond the end of range, or the rate does not fit.

    Examples
    --------
    >>> from math import radians
    >>> from masrel.lab.elbow import STANDARD_MODELS, MinimumJerk
    >>> stretch = MinimumJerk(start=radians(30), end=radians(130), mean_speed=1.0)
    >>> rendering = render(STANDARD_MODELS["HM1"], stretch)
    >>> rendering.presented.fault is None, rendering.energy_given < 1e-3
    (True, True)
    """
    clock = SimulatedClock()
    controller = Controller(model, start_angle=motion.start, rate_hz=rate_hz)
    with open_device(
        "simulated",
        clock=clock,
        hand=hand or MotionHand(motion),
        range_end=model.range_end,
    ) as device:
        presented = run_presentation(
            device,
            controller,
            clock=clock,
            limits=limits or DeviceLimits(),
            rate_hz=rate_hz,
            max_duration_s=motion.duration,
            end_angle=_NEVER_ARRIVES,
        )
    return _compared(model, motion, presented, rate_hz)


def _compared(
    model: JointModel, motion: Motion, presented: Presented, rate_hz: int
) -> Rendering:
    columns = presented.recording.columns
    n_rows = presented.recording.n_presented  # a ramp is no rendering
    times = np.minimum(columns["time_s"][:n_rows], motion.duration)
    angles = np.radians(columns["angle_deg"][:n_rows])
    torques = columns["model_torque_nm"][:n_rows]
    goal_angles, goal_velocities = motion.angle(times), motion.velocity(times)
    goal_torques, _ = _stepped(model, motion.start, times, goal_angles, goal_velocities)
    taken = np.concatenate(([0.0], np.cumsum(torques[:-1] * np.diff(angles))))
    speed = float(np.abs(goal_velocities).max(initial=0.0))
    stiffness, damping = model.largest_slope(speed=speed)
    max_angle_error, rms_angle_error = _largest_and_rms(angles - goal_angles)
    max_torque_error, rms_torque_error = _largest_and_rms(torques - goal_torques)
    return Rendering(
        presented=presented,
        max_angle_error=max_angle_error,
        rms_angle_error=rms_angle_error,
        max_torque_error=max_torque_error,
        rms_torque_error=rms_torque_error,
        peak_torque=float(np.abs(goal_torques).max(initial=0.0)),
        energy_taken=float(taken[-1]),
        energy_given=float(-taken.min()) + 0.0,  # no minus zero
        damping_needed=passive_damping(stiffness, damping, rate_hz),
    )


def _largest_and_rms(errors: Floats) -> tuple[float, float]:
    # (n,) -> 0 and 0 where there are none
    mean_square = np.sum(errors**2) / max(errors.size, 1)
    return float(np.abs(errors).max(initial=0.0)), float(np.sqrt(mean_square))
