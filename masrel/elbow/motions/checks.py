"""What the angles and speeds of a movement must be."""

import math

from masrel.errors import ParameterError

__all__ = ["check_stretch"]

_UNITS = {"speed": "deg/s", "mean_speed": "deg/s", "acceleration_rate": "deg/s²"}


def check_stretch(start: float, end: float, **rates: float) -> None:
    """Check that a stretch leads from one angle to a larger one, and moves the arm.

    Parameters
    ----------
    start, end : float
        Angles, rad.
    **rates : float
        Speeds and accelerations by their names, rad to some unit of time.

    Raises
    ------
    ParameterError
        If the angles are not in order within 0 to 180 degrees, or a rate is not more
        than 0 and finite.
    """
    if not 0.0 <= start < end <= math.pi:
        raise ParameterError(
            "start, end: need 0 <= start < end <= 180 degrees, got "
            f"{math.degrees(start):g} and {math.degrees(end):g} degrees"
        )
    for name, rate in rates.items():
        if not 0.0 < rate < math.inf:
            raise ParameterError(
                f"{name}: needs more than 0 and finite, got {math.degrees(rate):g} "
                f"{_UNITS[name]}"
            )
