"""The limits around every device: passing one stops the presentation."""

import math
from dataclasses import dataclass

from masrel.errors import LimitExceededError, ParameterError

__all__ = ["DeviceLimits"]


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceLimits:
    """What the loop lets pass, in SI units.

    Attributes
    ----------
    torque : float
        Largest torque sent either way, N·m. A larger one is not sent, and the
        presentation is stopped: cut off there it would be another model that the
        rater feels and grades.
    speed : float
        Speed at which the presentation is stopped, either way, rad/s.
    missed_ticks : int
        Missed ticks that a presentation may have; one more stops it.
    lowest_angle, highest_angle : float, optional
        Angles outside which the encoder cannot be right, rad: 5 deg beyond full
        flexion and a straight arm, because an end stop gives way a little.

    Raises
    ------
    ParameterError
        If a limit is not finite or leaves nothing to pass.
    """

    torque: float
    speed: float
    missed_ticks: int
    lowest_angle: float = math.radians(-5.0)
    highest_angle: float = math.radians(185.0)

    def __post_init__(self) -> None:
        for name in ("torque", "speed"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise ParameterError(f"{name}: needs a finite limit > 0, got {value}")
        if self.missed_ticks < 0:
            raise ParameterError(
                f"missed_ticks: needs 0 or more, got {self.missed_ticks}"
            )
        if not -math.inf < self.lowest_angle < self.highest_angle < math.inf:
            raise ParameterError(
                "lowest_angle, highest_angle: need finite angles in this order, "
                f"got {self.lowest_angle} and {self.highest_angle}"
            )

    def check_torque(self, torque: float) -> None:
        """Check a torque before it is sent; ``nan`` never passes.

        Parameters
        ----------
        torque : float
            What the controller asks for, N·m.

        Raises
        ------
        LimitExceededError
            If it is above the limit, either way, or not a number.

        Examples
        --------
        >>> limits = DeviceLimits(torque=20.0, speed=7.0, missed_ticks=20)
        >>> limits.check_torque(-31.5)
        Traceback (most recent call last):
            ...
        masrel.errors.LimitExceededError: torque: needs at most 20 N·m, got -31.500 N·m
        """
        if not -self.torque <= torque <= self.torque:
            raise LimitExceededError(
                f"torque: needs at most {self.torque:g} N·m, got {torque:.3f} N·m"
            )

    def check_motion(self, angle: float, velocity: float) -> None:
        """Check one sample of the motion; ``nan`` never passes.

        Parameters
        ----------
        angle : float
            Elbow angle, rad.
        velocity : float
            Estimated speed, rad/s.

        Raises
        ------
        LimitExceededError
            If the angle is out of range or the arm too fast.
        """
        if not self.lowest_angle <= angle <= self.highest_angle:
            raise LimitExceededError(
                f"range: needs {math.degrees(self.lowest_angle):.1f} to "
                f"{math.degrees(self.highest_angle):.1f} deg, the arm is at "
                f"{math.degrees(angle):.1f} deg"
            )
        if not -self.speed <= velocity <= self.speed:
            raise LimitExceededError(
                f"speed: needs at most {math.degrees(self.speed):.0f} deg/s, the arm "
                f"moves at {math.degrees(velocity):.0f} deg/s"
            )

    def check_missed(self, n_missed_ticks: int) -> None:
        """Check how many ticks a presentation has missed so far.

        Parameters
        ----------
        n_missed_ticks : int
            Ticks missed since the presentation began.

        Raises
        ------
        LimitExceededError
            If there are more than the limit.
        """
        if n_missed_ticks > self.missed_ticks:
            raise LimitExceededError(
                f"missed ticks: needs at most {self.missed_ticks} in a presentation, "
                f"the loop missed {n_missed_ticks}"
            )
