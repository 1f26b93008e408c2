"""The limits around every device: passing one stops the presentation."""

import math
from dataclasses import dataclass

from masrel._input import refuse
from masrel.errors import ParameterError

# No elbow is outside, rad; 5 deg because an end stop gives way a little.
_LOWEST_ANGLE, _HIGHEST_ANGLE = math.radians(-5.0), math.radians(185.0)

# At the latest the torque of a fault is zero after this, and of any other end
_LONGEST_S = {"ramp_time": 0.1, "end_ramp_time": 1.0}

_POSITIVE = (
    "torque",
    "torque_rate",
    "active_torque",
    "active_energy",
    "active_speed",
    "speed",
    "soft_stop_width",
    "stale_time",
    "frozen_time",
    "jump_angle",
    "drift_angle",
    "drift_speed",
    "arrival_speed",
    "arrival_time",
    "standing_time",
    "standing_torque",
    "actuator_torque",
    "watchdog_time",
)
_NOT_NEGATIVE = (
    "missed_ticks",
    "missed_replies",
    "missed_replies_per_100",
    "soft_stop_torque",
    "arrival_angle",
    "encoder_noise",
)


def _check_positive(**values: float) -> None:
    """Refuse the first value that is not above 0, and finite."""
    for name, value in values.items():
        if not 0.0 < value < math.inf:
            raise ParameterError(f"{name}: needs more than 0 and finite, got {value}")


def _check_not_negative(**values: float) -> None:
    """Refuse the first value that is not 0 or more, and finite."""
    for name, value in values.items():
        if not 0.0 <= value < math.inf:
            raise ParameterError(f"{name}: needs 0 or more, got {value}")


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceLimits:
    """What the loop lets pass, in SI units.

    ``docs/reference/driver.md`` gives the reasons.

    Attributes
    ----------
    torque : float, optional
        Largest torque sent either way, N·m. A larger one is not sent, and the
        presentation is stopped: cut off there it would be another model that the
        rater feels and grades.
    torque_rate : float, optional
        Fastest build-up of torque from one tick to the next, N·m/s. Torque may be
        taken away as suddenly as it likes.
    active_torque : float, optional
        Largest torque of a model behind the guard (`Controller.is_guarded`), N·m.
    active_energy : float, optional
        Energy that such a model may have given to the arm on balance, J: what it gave
        less what it took. What it took in one stretch it may not give in the next.
    active_speed : float, optional
        Speed at which an arm may move the way such a model pushes it, rad/s: faster
        it is not led by a hand, but thrown.
    speed : float, optional
        Speed at which the presentation is stopped, either way, rad/s.
    lowest_angle, highest_angle : float, optional
        Angles outside which the presentation is stopped, rad: 5 deg beyond full
        flexion and a straight arm, because an end stop gives way a little.
    soft_stop_width : float, optional
        How far before these angles a spring begins to push back, rad.
    soft_stop_torque : float, optional
        What it reaches at them, N·m; 0 for no soft stop.
    missed_ticks : int, optional
        Missed ticks that any 2000 may have; one more stops the presentation.
    missed_replies : int, optional
        Ticks in a row without a new reading that are let pass, torque held.
    missed_replies_per_100 : int, optional
        How many of any 100 ticks may be without a new reading; at least 100 for no
        such limit.
    stale_time : float, optional
        Age of a reading at which it is too old, s.
    frozen_time : float, optional
        How long an arm that was moving may read one angle to the last step, s.
    standing_time, standing_torque : float, optional
        How long any arm may do so while more than this torque is sent, s and N·m; 20
        times as long if it was slower than 4.5 deg/s before, or had settled, which a
        hand that holds it makes it do. The first torque may not be more either.
    actuator_torque : float, optional
        How far the torque of a sensor may be from the one that is sent, friction and
        inertia allowed for, for 50 ms, N·m.
    jump_angle : float, optional
        How far a reading may lie from where the speed before would have it, a tick
        later, rad.
    drift_angle, drift_speed : float, optional
        How far an arm may creep from where it rested, rad, that was at once at an even
        speed below this, rad/s: no arm starts like that, an encoder that drifts does.
    encoder_noise : float, optional
        Standard deviation of a reading of an arm at rest, beyond the encoder's steps,
        rad; arrival and a lost grip allow for what it does to the estimated speed.
    arrival_angle, arrival_speed, arrival_time : float, optional
        An arm has arrived that was slower than this speed for this time, rad/s and s,
        at most this far before the end of the stretch, rad.
    watchdog_time : float, optional
        Longest time without a command, s; then the watchdog idles the device.
    ramp_time : float, optional
        How long a fault takes to bring the torque to zero, s; at most 0.1.
    end_ramp_time : float, optional
        How long every other end of a presentation takes, s; at most 1, and 0 for at
        once.

    Raises
    ------
    ParameterError
        If a limit is not finite or leaves nothing to pass.

    Examples
    --------
    >>> DeviceLimits(torque=12.0).torque
    12.0
    """

    torque: float = 20.0
    torque_rate: float = 12_000.0
    active_torque: float = 10.0
    active_energy: float = 1.0
    active_speed: float = math.radians(180.0)
    speed: float = math.radians(400.0)
    lowest_angle: float = _LOWEST_ANGLE
    highest_angle: float = _HIGHEST_ANGLE
    soft_stop_width: float = math.radians(5.0)
    soft_stop_torque: float = 10.0
    missed_ticks: int = 20
    missed_replies: int = 2
    missed_replies_per_100: int = 10
    stale_time: float = 0.005
    frozen_time: float = 0.010
    standing_time: float = 0.5
    standing_torque: float = 2.0
    actuator_torque: float = 1.5
    jump_angle: float = math.radians(0.3)
    drift_angle: float = math.radians(3.0)
    drift_speed: float = math.radians(25.0)
    encoder_noise: float = 0.0
    arrival_angle: float = math.radians(3.0)
    arrival_speed: float = math.radians(5.0)
    arrival_time: float = 0.1
    watchdog_time: float = 0.05
    ramp_time: float = 0.05
    end_ramp_time: float = 0.1

    def __post_init__(self) -> None:
        _check_positive(**{name: getattr(self, name) for name in _POSITIVE})
        _check_not_negative(**{name: getattr(self, name) for name in _NOT_NEGATIVE})
        for name, most in _LONGEST_S.items():
            value = getattr(self, name)
            if not 0.0 <= value <= most:
                raise ParameterError(f"{name}: needs 0 to {most:g} s, got {value}")
        low, high = self.lowest_angle, self.highest_angle
        refuse(
            (
                not -math.inf < low < high < math.inf,
                "lowest_angle, highest_angle: need finite angles in this order, "
                f"got {low} and {high}",
            ),
            (
                2.0 * self.soft_stop_width > high - low,
                "soft_stop_width: needs at most half of the range, "
                f"got {self.soft_stop_width} rad",
            ),
        )
