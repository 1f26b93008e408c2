"""What a motion asks of whoever moves the arm: peak torque, residual, work, impulse.

All come from the exact events, and from integrals of polynomials: there is no trace.
"""

from collections.abc import Callable
from decimal import Decimal

from masrel.elbow.course import course
from masrel.elbow.legs import Section, catch_levels, legs, sections
from masrel.elbow.moments import Course
from masrel.elbow.motion import Motion
from masrel.elbow.parameters import ElbowParameters
from masrel.elbow.polynomial import (
    ONE,
    ZERO,
    derivative,
    exactly,
    integral,
    product,
    scaled,
    value,
)
from masrel.elbow.roots import cuts

__all__ = ["effort", "impulse", "peak_torque", "residual_torque", "work"]


def peak_torque(parameters: ElbowParameters, motion: Motion) -> float:
    """Return the largest torque of a motion, without a trace.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units.

    Returns
    -------
    float
        The largest torque, N·m: at an event, at an end, or where a phase's torque
        turns.

    Raises
    ------
    ParameterError
        If the motion starts at or beyond the end of range.

    Examples
    --------
    >>> from math import radians
    >>> from masrel.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> round(peak_torque(STANDARD_MODELS["HM3"], stretch), 3)
    10.984
    """
    return effort("peak_torque", parameters, motion, course(parameters, motion))


def residual_torque(parameters: ElbowParameters, motion: Motion) -> float:
    """Return the torque after the peak of the first catch, (3), second line.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units.

    Returns
    -------
    float
        The torque, N·m, also where the catch ends before its peak does; ``nan``
        without a catch.

    Raises
    ------
    ParameterError
        If the motion starts at or beyond the end of range.

    Examples
    --------
    >>> from math import radians
    >>> from masrel.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> round(residual_torque(STANDARD_MODELS["HM3"], stretch), 3)
    7.624
    """
    return effort("residual_torque", parameters, motion, course(parameters, motion))


def work(parameters: ElbowParameters, motion: Motion) -> float:
    """Return the work done against the joint, ∫ τ dθ.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units.

    Returns
    -------
    float
        The work, J; less than 0 where the joint gave back more than it took.

    Raises
    ------
    ParameterError
        If the motion starts at or beyond the end of range.

    Examples
    --------
    A slow stretch of 1 rad works against the damper and the spring alone,
    1.26 x 0.2 x 1 + 3.15 / 2 x 1² J:

    >>> from masrel.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=0.5, end=1.5, speed=0.2)
    >>> round(work(STANDARD_MODELS["HM3"], stretch), 12)
    1.827
    """
    return effort("work", parameters, motion, course(parameters, motion))


def impulse(parameters: ElbowParameters, motion: Motion) -> float:
    """Return the angular impulse of the joint's torque, ∫ τ dt.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units.

    Returns
    -------
    float
        The impulse, N·m·s.

    Raises
    ------
    ParameterError
        If the motion starts at or beyond the end of range.

    Examples
    --------
    A slow stretch of 1 rad in 5 s, 1.26 x 1 + 3.15 / 2 x 5 N·m·s:

    >>> from masrel.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=0.5, end=1.5, speed=0.2)
    >>> round(impulse(STANDARD_MODELS["HM3"], stretch), 12)
    9.135
    """
    return effort("impulse", parameters, motion, course(parameters, motion))


def effort(
    name: str, parameters: ElbowParameters, motion: Motion, found: Course
) -> float:
    """Return one of the above for a motion whose course is known.

    Parameters
    ----------
    name : {"peak_torque", "residual_torque", "work", "impulse"}
        Which.
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units.
    found : Course
        Its course.

    Returns
    -------
    float
        The float nearest to it.
    """
    with exactly():
        if name == "residual_torque":
            return _residual(parameters, motion, found)
        parts = [
            _OF_SECTION[name](section)
            for section in sections(legs(parameters, motion, found), motion)
        ]
        return float(max(parts) if name == "peak_torque" else sum(parts, ZERO))


def _residual(parameters: ElbowParameters, motion: Motion, found: Course) -> float:
    for stretch in found.stretches:
        if stretch.catch is not None:
            pre_end, rise = catch_levels(parameters, motion, stretch.catch)
            return float(pre_end + Decimal(parameters.residual_share) * rise)
    return float("nan")


def _peak(section: Section) -> Decimal:
    places = cuts((derivative(section.torque),), ZERO, ONE)
    return max(value(section.torque, share) for share in places)


def _work(section: Section) -> Decimal:
    # ∫ τ ω dt
    power = product(section.torque, section.piece.velocity)
    return section.piece.length * value(integral(power), ONE)


def _impulse(section: Section) -> Decimal:
    return value(scaled(integral(section.torque), section.piece.length), ONE)


_OF_SECTION: dict[str, Callable[[Section], Decimal]] = {
    "peak_torque": _peak,
    "work": _work,
    "impulse": _impulse,
}
