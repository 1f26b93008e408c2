"""Kinds of motion whose scenes are evaluated together."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from masrel.elbow.motion import Motion
from masrel.elbow.motions import ConstantSpeed, MinimumJerk
from masrel.elbow.scenes.constant import constant_courses, constant_path
from masrel.elbow.scenes.course import Courses
from masrel.elbow.scenes.effort import Path
from masrel.elbow.scenes.quintic import quintic_courses, quintic_path
from masrel.elbow.scenes.sieve import quintic_courses_for_samples
from masrel.elbow.scenes.table import Joints, Motions

__all__ = ["KINDS"]


@dataclass(frozen=True, slots=True)
class _Kind:
    """How the events and the torques of one kind are found."""

    courses: Callable[[Joints, Motions], Courses]
    # events, only to tell which samples they lie between, at a rate
    courses_for_samples: Callable[[Joints, Motions, float], Courses]
    path: Callable[[Motions], Path]
    speed: str  # attribute of the motion that is its mean speed


KINDS: Mapping[type[Motion], _Kind] = {
    ConstantSpeed: _Kind(
        courses=constant_courses,
        courses_for_samples=lambda joints, motions, _: constant_courses(
            joints, motions
        ),
        path=constant_path,
        speed="speed",
    ),
    MinimumJerk: _Kind(
        courses=quintic_courses,
        courses_for_samples=quintic_courses_for_samples,
        path=quintic_path,
        speed="mean_speed",
    ),
}
"""By the class of the motion."""
