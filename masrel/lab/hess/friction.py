"""Friction of the device by equation (7), and the torque that makes up for it.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section III.B.2.
"""

import math
from dataclasses import dataclass

from masrel.errors import ParameterError


@dataclass(frozen=True, slots=True, kw_only=True)
class Friction:
    """Friction of motor and cable drive at the elbow, identified for (7).

    Attributes
    ----------
    inertia : float
        I of (7), kg·m²: motor and speed reduction, without the forearm.
    viscous : float
        B of (7), N·m·s/rad.
    coulomb : float
        β of (7), N·m.

    Raises
    ------
    ParameterError
        If one is negative or not finite, or the inertia is 0.
    """

    inertia: float = 0.0097
    viscous: float = 0.168
    coulomb: float = 0.189

    def __post_init__(self) -> None:
        if not 0.0 < self.inertia < math.inf:
            raise ParameterError(f"inertia: needs more than 0, got {self.inertia}")
        for name in ("viscous", "coulomb"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ParameterError(
                    f"{name}: needs 0 or more, got {getattr(self, name)}"
                )


class FrictionCompensation:
    """The share of the friction that the motor takes off the rater's hand.

    The Coulomb part needs the sign of a speed that an encoder resolves in steps,
    so it is 0 in a dead zone around rest, grows in proportion to the speed above
    it, and is whole from `full_speed` on: a torque that never jumps. At rest a step of
    the encoder, 0.8 deg/s in the estimate, switches 0.06 N·m of it on for some
    milliseconds: less than the friction that holds the arm, so that nothing moves.

    Parameters
    ----------
    friction : Friction
        What is there.
    share : float
        How much of it is compensated, from 0 to 1. Above 1 the device would feed
        energy into the hand and creep by itself, so it is refused; at 1 a slightly
        overestimated B or β does the same.
    dead_zone : float, optional
        Speed below which the Coulomb part is 0, rad/s.
    full_speed : float, optional
        Speed above which it is whole, rad/s.

    Raises
    ------
    ParameterError
        If the share is outside [0, 1] or the speeds are not in order.

    References
    ----------
    .. [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). IEEE TNSRE 20(3), 361-370,
       equation (7). https://doi.org/10.1109/TNSRE.2012.2195330

    Examples
    --------
    At 1 rad/s, nine tenths of 0.168 and 0.189 N·m:

    >>> round(FrictionCompensation(Friction(), share=0.9).torque(1.0), 4)
    0.3213
    """

    __slots__ = ("_coulomb", "_dead_zone", "_full_speed", "_slope", "_viscous")

    def __init__(
        self,
        friction: Friction,
        *,
        share: float,
        dead_zone: float = math.radians(0.1),
        full_speed: float = math.radians(2.0),
    ) -> None:
        if not 0.0 <= share <= 1.0:
            raise ParameterError(f"share: needs [0, 1], got {share}")
        if not 0.0 <= dead_zone < full_speed < math.inf:
            raise ParameterError(
                "dead_zone, full_speed: need 0 <= dead_zone < full_speed, "
                f"got {dead_zone} and {full_speed}"
            )
        self._viscous = share * friction.viscous
        self._coulomb = share * friction.coulomb
        self._dead_zone = dead_zone
        self._full_speed = full_speed
        self._slope = self._coulomb / (full_speed - dead_zone)

    def torque(self, velocity: float) -> float:
        """Return the torque that helps the motion.

        Parameters
        ----------
        velocity : float
            Estimated speed of the elbow, rad/s.

        Returns
        -------
        float
            Torque with the sign of `velocity`, N·m; subtracted from the model's.
        """
        speed = velocity if velocity >= 0.0 else -velocity
        if speed >= self._full_speed:
            coulomb = self._coulomb
        elif speed > self._dead_zone:
            coulomb = self._slope * (speed - self._dead_zone)
        else:
            coulomb = 0.0
        helping = self._viscous * speed + coulomb  # B and β of (7), scaled
        return helping if velocity >= 0.0 else -helping
