"""What a simulated arm feels of whoever moves it."""

from typing import Protocol

__all__ = ["Hand"]


class Hand(Protocol):
    """A hand as the simulated arm feels it: a spring and a damper to an intention."""

    @property
    def stiffness(self) -> float:
        """Spring towards the intended angle, N·m/rad."""
        ...

    @property
    def damping(self) -> float:
        """Damper towards the intended speed, N·m·s/rad."""
        ...

    @property
    def slip_time(self) -> float:
        """When the hand lets go for good, s; infinite when it never does."""
        ...

    @property
    def start(self) -> float:
        """Where the arm is before the hand moves, rad."""
        ...

    @property
    def yields(self) -> bool:
        """Whether its intention depends on the torque it feels; then `feel` is told."""
        ...

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
        ...

    def feel(self, time_s: float, torque: float) -> None:
        """Take in what the hand feels now.

        Parameters
        ----------
        time_s : float
            Time after the first reading, s; never earlier than the one before.
        torque : float
            Torque of the hand on the arm, N·m.
        """
        ...
