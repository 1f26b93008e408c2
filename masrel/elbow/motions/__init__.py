"""Kinds of movements: prescribed, recorded, and made of others."""

from masrel.elbow.motions.constant_speed import ConstantSpeed
from masrel.elbow.motions.hold import Hold
from masrel.elbow.motions.joined import Joined, interrupted
from masrel.elbow.motions.minimum_jerk import MinimumJerk
from masrel.elbow.motions.part import Part, Reversed
from masrel.elbow.motions.recorded import Interpolation, Recorded
from masrel.elbow.motions.trapezoid import Trapezoid

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
