"""Many stretches at constant speed: events and efforts in closed form.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (2), (4) and (6).
"""

import numpy as np

from masrel.elbow.motion import Floats
from masrel.elbow.scenes.course import Courses, Flags
from masrel.elbow.scenes.effort import Path
from masrel.elbow.scenes.table import Joints, Motions
from masrel.elbow.scenes.twofold import Twofold

__all__ = ["constant_courses", "constant_ends", "constant_path"]

_NEAR = 1e-24
# rad: two angles as near as that are left to 50 digits


def constant_courses(joints: Joints, motions: Motions) -> Courses:
    """Find the events of stretches at constant speed.

    Parameters
    ----------
    joints : Joints
        The joints.
    motions : Motions
        The stretches.

    Returns
    -------
    Courses
        Their events.
    """
    speed, start = motions.speed, motions.start
    way = Twofold.difference(np.minimum(motions.end, joints.range_end), start)
    lowest = Twofold.difference(joints.smallest_catch_angle, start)
    # (2) with the first line of (6), as a way from the start
    held = np.maximum(speed, joints.slowest_mean_speed)
    line = Twofold.difference(joints.catch_angle_constant, start) - Twofold.product(
        joints.catch_slope, held
    )
    travel = lowest.where(lowest.high > line.high, line)  # (6), third line
    none = Twofold(np.zeros_like(speed))
    travel = none.where(travel.high < 0.0, travel)  # it starts beyond the catch angle
    released = travel + joints.catch_travel  # (4)
    moves = speed >= joints.speed_threshold
    catches = (speed > joints.speed_threshold) & ((way - travel).high > 0.0)
    leaves = catches & ((way - released).high > 0.0)
    doubtful = joints.has_jump
    for one, other in ((way, travel), (way, released), (lowest, line)):
        doubtful |= np.abs((one - other).high) < _NEAR
    constant = Twofold(speed)
    return Courses(
        is_doubtful=doubtful,
        moves=moves,
        catches=catches,
        leaves=leaves,
        slows=np.zeros_like(moves),
        onset=none,
        catch=travel / speed,
        catch_end=released / speed,
        post_end=none,
        end=way / speed,
        catch_angle=travel + start,
        catch_speed=constant,
        mean_speed=constant,
    )


def constant_ends(joints: Joints, motions: Motions) -> tuple[Floats, Flags]:
    """Find when stretches at constant speed end, and nothing else.

    Parameters
    ----------
    joints : Joints
        The joints, of which the end of range is used.
    motions : Motions
        The stretches.

    Returns
    -------
    end : ndarray, shape (n_scenes,)
        s.
    is_doubtful : ndarray of bool, shape (n_scenes,)
        None of them is.
    """
    way = Twofold.difference(np.minimum(motions.end, joints.range_end), motions.start)
    return (way / motions.speed).high, np.zeros(motions.speed.shape, dtype=np.bool_)


def constant_path(motions: Motions) -> Path:
    """Return the functions of stretches at constant speed.

    Parameters
    ----------
    motions : Motions
        The stretches.

    Returns
    -------
    Path
        Their functions.
    """
    speed = motions.speed
    return Path(
        travel=lambda t: speed * t,
        velocity=lambda t: speed + 0.0 * t,
        acceleration=lambda t: 0.0 * t,
        is_steady=True,
        travel_integral=lambda t: 0.5 * speed * t * t,
        square_integral=lambda t: speed * speed * t,
        turning=lambda k, _: np.full(k.shape, np.inf),
    )
