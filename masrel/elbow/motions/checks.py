"""What the angles and speeds of a movement must be."""

import math

from masrel.errors import ParameterError

__all__ = ["check_angles", "check_positive"]


def check_angles(start: float, end: float) -> None:
    """Check that a stretch leads from one angle to a larger one.

    Parameters
    ----------
    start, end : float
        Angles, rad.

    Raises
    ------
    ParameterError
        If they are not in order within 0 to 180 degrees.
    """
    if not 0.0 <= start < end <= math.pi:
        raise ParameterError(
            "start, end: need 0 <= start < end <= 180 degrees, got "
            f"{math.degrees(start):g} and {math.degrees(end):g} degrees"
        )


def check_positive(value: float, name: str, unit: str) -> None:
    """Check that a speed or an acceleration moves the arm.

    Parameters
    ----------
    value : float
        The value; rad to some unit of time.
    name : str
        What it is called.
    unit : str
        Its unit, in degrees, for the message.

    Raises
    ------
    ParameterError
        If it is not more than 0 and finite.
    """
    if not 0.0 < value < math.inf:
        raise ParameterError(
            f"{name}: needs more than 0 and finite, got {math.degrees(value):g} {unit}"
        )
