"""Kinds of movements: prescribed, recorded, and made of others."""

from masrel.lab.elbow.motions._composed import Joined, Part, Reversed, interrupted
from masrel.lab.elbow.motions._prescribed import (
    ConstantSpeed,
    Hold,
    MinimumJerk,
    Trapezoid,
)
from masrel.lab.elbow.motions._recorded import Interpolation, Recorded

__all__ = [
    "ConstantSpeed",
    "Hold",
    "Interpolation",
    "Joined",
    "MinimumJerk",
    "Part",
    "Recorded",
    "Reversed",
    "Trapezoid",
    "interrupted",
]
