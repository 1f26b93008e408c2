"""Events good enough to say which samples they lie between: 16 digits where they do.

What floats settle is settled; a decision or a sample that is nearer than they show is
asked again in 32 digits.
"""

import numpy as np

from masrel.elbow.scenes.course import Courses, Flags
from masrel.elbow.scenes.digits import DIGITS_16
from masrel.elbow.scenes.quintic import quintic_courses
from masrel.elbow.scenes.table import Joints, Motions
from masrel.elbow.scenes.twofold import Twofold

__all__ = ["quintic_courses_for_samples"]

_NEAR = 1e-11
# of the number of samples so far; places are right to 1e-13 or so


def quintic_courses_for_samples(
    joints: Joints, motions: Motions, rate_hz: float
) -> Courses:
    """Find the events of minimum-jerk stretches that will be sampled.

    Parameters
    ----------
    joints : Joints
        The joints.
    motions : Motions
        The stretches.
    rate_hz : float
        Samples a second.

    Returns
    -------
    Courses
        Their events: each is on the right side of every sample, or at it, and angles
        and speeds are right to 2e-14.
    """
    with np.errstate(all="ignore"):  # what is not reached may be anything
        quick = quintic_courses(joints, motions, DIGITS_16)
        unsettled = quick.is_doubtful | _is_at_sample(joints, motions, quick, rate_hz)
    rows = np.flatnonzero(unsettled)
    if not rows.size:
        return quick
    return quick.replaced(rows, quintic_courses(joints.rows(rows), motions.rows(rows)))


def _is_at_sample(
    joints: Joints, motions: Motions, courses: Courses, rate_hz: float
) -> Flags:
    c = courses
    near = np.zeros(c.moves.shape, dtype=np.bool_)
    events: tuple[tuple[Twofold, Flags], ...] = (
        (c.catch, c.catches),
        (c.catch + joints.peak_duration, c.catches),
        (c.catch_end, c.leaves),
        (c.post_end, c.slows),
        (c.end, joints.range_end < motions.end),  # others are right to the last bit
    )
    for event, known in events:
        samples = event.high * rate_hz
        near |= known & (np.abs(samples - np.rint(samples)) < _NEAR * (1.0 + samples))
    return near
