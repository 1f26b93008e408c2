"""What a controller steps, whatever the law."""

from typing import Protocol


class Stepper(Protocol):
    """A joint as a state machine that sees one sample at a time.

    Attributes
    ----------
    phase : int
        Position in `masrel.recording.PHASES`: "pre-catch" while nothing has been
        triggered, "catch" from a trigger on, "post-catch" once it has given way. A
        joint without triggers stays in "pre-catch".
    """

    phase: int

    def step(self, time_s: float, angle: float, velocity: float) -> float:
        """Decide the torque of one sample.

        Parameters
        ----------
        time_s : float
            Time of the sample, s; later than that of the one before.
        angle : float
            Angle, rad.
        velocity : float
            Angular velocity, rad/s.

        Returns
        -------
        float
            Torque that resists extension, N·m.
        """
        ...

    def release(self) -> None:
        """Give up at once what has been triggered, as when the grip is lost."""
        ...
