"""Kinds of motion whose scenes are evaluated together."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np

from masrel.elbow.motion import Motion
from masrel.elbow.motions import ConstantSpeed, MinimumJerk
from masrel.elbow.scenes.constant import constant_courses
from masrel.elbow.scenes.course import Courses, Motions
from masrel.elbow.scenes.effort import Efforts
from masrel.elbow.scenes.path import Path, constant_path, quintic_path
from masrel.elbow.scenes.quintic import quintic_courses
from masrel.elbow.scenes.sieve import quintic_courses_for_samples
from masrel.elbow.scenes.table import Joints

__all__ = [
    "KINDS",
    "courses_for_samples",
    "courses_of",
    "efforts_of",
    "motions_of",
]


@dataclass(frozen=True, slots=True)
class _Kind:
    """How the events and the torques of one kind are found."""

    courses: Callable[[Joints, Motions], Courses]
    courses_for_samples: Callable[[Joints, Motions, float], Courses]
    path: Callable[[Motions], Path]
    speed: str


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


def motions_of(kind: type[Motion], stretches: Sequence[Motion]) -> Motions:
    """Put motions of one kind into columns.

    Parameters
    ----------
    kind : type
        `ConstantSpeed` or `MinimumJerk`.
    stretches : sequence of Motion
        The motions.

    Returns
    -------
    Motions
        Their columns.
    """
    read = attrgetter("start", "end", KINDS[kind].speed)
    start, end, speed = np.array([read(one) for one in stretches], dtype=np.float64).T
    return Motions(start=start, end=end, speed=speed)


def courses_of(kind: type[Motion], joints: Joints, motions: Motions) -> Courses:
    """Find the events of motions of one kind.

    Parameters
    ----------
    kind : type
        `ConstantSpeed` or `MinimumJerk`.
    joints : Joints
        The joints.
    motions : Motions
        The motions.

    Returns
    -------
    Courses
        Their events.
    """
    return KINDS[kind].courses(joints, motions)


def courses_for_samples(
    kind: type[Motion], joints: Joints, motions: Motions, rate_hz: float
) -> Courses:
    """Find the events of motions of one kind, to tell which samples they lie between.

    Parameters
    ----------
    kind : type
        `ConstantSpeed` or `MinimumJerk`.
    joints : Joints
        The joints.
    motions : Motions
        The motions.
    rate_hz : float
        Samples a second.

    Returns
    -------
    Courses
        Their events.
    """
    return KINDS[kind].courses_for_samples(joints, motions, rate_hz)


def efforts_of(
    kind: type[Motion], joints: Joints, motions: Motions, courses: Courses
) -> Efforts:
    """Prepare torques, work and impulse of motions of one kind.

    Parameters
    ----------
    kind : type
        `ConstantSpeed` or `MinimumJerk`.
    joints : Joints
        The joints.
    motions : Motions
        The motions.
    courses : Courses
        Their events.

    Returns
    -------
    Efforts
        Each is computed when it is asked for.
    """
    return Efforts(joints, motions, courses, KINDS[kind].path(motions))
