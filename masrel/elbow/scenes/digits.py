"""How many digits events are found in, and what such digits leave open."""

from dataclasses import dataclass

from masrel.elbow.scenes.onefold import Onefold
from masrel.elbow.scenes.twofold import Twofold

__all__ = ["DIGITS_16", "DIGITS_32", "Digits"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Digits:
    """Numbers to compute with, and when their answer is in doubt.

    Attributes
    ----------
    number : type
        Their class.
    near : float
        Places, as shares of the duration, or angles in rad that are nearer than this to
        each other may be one.
    n_corrections : int
        Steps of Newton's rule with these numbers after those with floats.
    settled : float
        The last of them is smaller, or there is no convergence.
    least_rest : float
        x (1 - x) of a place x nearer to whose end the way hardly tells the place.
    least_steepness : float
        Slope over the sum of absolute terms, below which a zero is badly defined.
    """

    number: type[Twofold]
    near: float
    n_corrections: int
    settled: float
    least_rest: float
    least_steepness: float


DIGITS_32 = Digits(
    number=Twofold,
    near=1e-12,
    n_corrections=2,
    settled=1e-22,  # the next correction would be its square or so
    least_rest=0.0,
    least_steepness=0.0,
)
"""For events that are the nearest floats."""

DIGITS_16 = Digits(
    number=Onefold,
    near=1e-11,
    n_corrections=1,
    settled=1e-12,
    least_rest=0.05,  # place right to 2u / (30 · 0.05²) = 3e-15
    least_steepness=0.05,  # to 2u / 0.05 = 4e-15
)
"""For samples of the torque, which may be off by rounding."""
