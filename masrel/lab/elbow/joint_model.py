"""What a joint offers to whoever presents it, whatever its law.

A controller steps it at samples, a figure draws it, and the limits of a device are
compared with the largest torque and slope that it can ask for.
"""

from typing import ClassVar, Protocol

__all__ = ["JointModel", "Stepper"]


class Stepper(Protocol):
    """A joint as a state machine that sees one sample at a time.

    Attributes
    ----------
    phase : int
        Position in `masrel.lab.recording.PHASES`: "pre-catch" while nothing has been
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


class JointModel(Protocol):
    """A law of the joint with its parameters, in SI units.

    Parameters are checked where they are made: a `JointModel` that exists is valid.

    Attributes
    ----------
    kind : str
        Name of the law in `MODELS`, as a protocol file spells it.
    """

    __slots__ = ()

    kind: ClassVar[str]

    @property
    def is_passive(self) -> bool:
        """Whether it never gives back more than it took, whatever the motion.

        A joint with a delay, a trigger or a change in time is not passive in this
        sense, and is presented behind a guard only.
        """
        ...

    @property
    def range_end(self) -> float:
        """End of the range of motion, rad."""
        ...

    @property
    def speed_threshold(self) -> float:
        """Speed from which the arm counts as moving, rad/s."""
        ...

    def stepper(self, start_angle: float) -> Stepper:
        """Return a joint that has not seen a sample yet.

        Parameters
        ----------
        start_angle : float
            Where the stretch starts, rad.

        Returns
        -------
        Stepper
            The state machine of one presentation.
        """
        ...

    def largest_torque(self, *, start_angle: float, speed: float) -> float:
        """Return the largest torque of a stretch and the way back.

        Parameters
        ----------
        start_angle : float
            Where the stretch starts, rad; it goes to `range_end` at most.
        speed : float
            The largest speed, either way, rad/s.

        Returns
        -------
        float
            A bound of the torque's size, N·m, that no such motion passes.
        """
        ...

    def largest_slope(self, *, speed: float) -> tuple[float, float]:
        """Return the largest slopes of the torque where it does not jump.

        Parameters
        ----------
        speed : float
            The largest speed, either way, rad/s.

        Returns
        -------
        tuple of two floats
            Over angle, N·m/rad, and over angular velocity, N·m·s/rad.
        """
        ...
