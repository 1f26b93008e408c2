"""A hand that goes more slowly the more it feels."""

import math
from typing import ClassVar

from masrel.errors import ParameterError
from masrel.hess.simulated_hand import SimulatedHand

__all__ = ["YieldingHand"]


class YieldingHand(SimulatedHand):
    """A hand that slows down where the arm resists, and speeds up where it gives.

    The intention of a `SimulatedHand` is gone through at a rate r between 0 and 1
    that follows 1 / (1 + `yielding`·|τ|) of the torque τ it feels, with a first-order
    lag of `reaction_time`. So the hand brakes after a catch, as a person's does who
    meets a resistance. It is still no model of a person.

    Parameters
    ----------
    start : float
        Where the stretch starts, rad.
    end : float
        Where it is meant to end, rad.
    mean_speed : float
        Speed between the ramps where nothing resists, rad/s.
    slip_time : float or None, optional
        Time after the first reading at which the hand lets go, s; None for never.
    yielding : float, optional
        1/(N·m); the default halves the speed at 10 N·m.
    reaction_time : float, optional
        s; the default is a long-latency reflex rather than a decision.

    Raises
    ------
    ParameterError
        If a value is outside its range or the ramps take more than the stretch.

    Examples
    --------
    >>> hand = YieldingHand(start=0.5, end=2.5, mean_speed=1.5)
    >>> for tick in range(1000):
    ...     hand.feel(tick * 1e-3, 10.0)
    >>> round(hand.intended(1.0)[1], 2)
    0.75
    """

    __slots__ = ("_felt_at", "_intended_at", "_rate", "_reaction_time", "_yielding")

    yields: ClassVar[bool] = True

    def __init__(
        self,
        *,
        start: float,
        end: float,
        mean_speed: float,
        slip_time: float | None = None,
        yielding: float = 0.1,
        reaction_time: float = 0.08,
    ) -> None:
        super().__init__(
            start=start, end=end, mean_speed=mean_speed, slip_time=slip_time
        )
        if not 0.0 <= yielding < math.inf:
            raise ParameterError(f"yielding: needs 0 or more, got {yielding}")
        if not 0.0 < reaction_time < math.inf:
            raise ParameterError(
                f"reaction_time: needs more than 0, got {reaction_time}"
            )
        self._yielding = yielding
        self._reaction_time = reaction_time
        self._rate = 1.0
        self._felt_at = 0.0  # s
        self._intended_at = 0.0  # how far it has gone through its intention, s

    def intended(self, time_s: float) -> tuple[float, float]:
        """Return where the hand means to be, as far as it has felt.

        Parameters
        ----------
        time_s : float
            Time after the first reading, s.

        Returns
        -------
        tuple of float
            Intended angle, rad, and speed, rad/s.
        """
        since = time_s - self._felt_at
        angle, speed = super().intended(self._intended_at + self._rate * since)
        return angle, self._rate * speed

    def feel(self, time_s: float, torque: float) -> None:
        """Adapt the rate to a torque.

        Parameters
        ----------
        time_s : float
            Time after the first reading, s; never earlier than the one before.
        torque : float
            Torque of the hand on the arm, N·m.
        """
        since = time_s - self._felt_at
        self._intended_at += self._rate * since
        self._felt_at = time_s
        target = 1.0 / (1.0 + self._yielding * abs(torque))
        share = -math.expm1(-since / self._reaction_time)
        self._rate += share * (target - self._rate)
