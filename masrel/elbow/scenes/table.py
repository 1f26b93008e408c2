"""Scenes as columns: every scene its joint and its motion, and one row."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import chain
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.motion import Floats, Motion
from masrel.elbow.parameters import ElbowParameters
from masrel.errors import ParameterError

__all__ = ["Joints", "Motions", "joints_of", "motions_of", "paired"]

_NEAR = 1e-12
# rad

_NUMBERS = (
    "catch_angle_constant",
    "catch_torque_constant",
    "residual_share",
    "catch_travel",
    "inertia",
    "damping",
    "stiffness",
    "catch_slope",
    "peak_duration",
    "post_catch_stiffness",
    "speed_threshold",
    "slowest_mean_speed",
    "smallest_catch_angle",
    "range_end",
    "catch_rise",
)
_read = attrgetter(*_NUMBERS)


def paired(
    parameters: ElbowParameters | Sequence[ElbowParameters],
    motions: Motion | Sequence[Motion],
) -> tuple[Sequence[ElbowParameters], Sequence[Motion]]:
    """Give every scene its joint and its motion, which starts within its range.

    Parameters
    ----------
    parameters : ElbowParameters or sequence of ElbowParameters
        The joints, one a scene; or one for all.
    motions : Motion or sequence of Motion
        The motions, one a scene; or one for all.

    Returns
    -------
    tuple of two sequences, each of length n_scenes
        Joints and motions.

    Raises
    ------
    ParameterError
        If their numbers do not fit, or a motion starts at or beyond the end of range;
        the message says which.
    """
    joints = [parameters] if isinstance(parameters, ElbowParameters) else parameters
    moves = motions if isinstance(motions, Sequence) else [motions]
    n = max(len(joints), len(moves)) if joints and moves else 0
    if len(joints) not in (1, n) or len(moves) not in (1, n) or n == 0:
        raise ParameterError(
            "parameters, motions: need as many joints as motions, or one of either, "
            f"got {len(joints)} and {len(moves)}"
        )
    joints = joints if len(joints) == n else [joints[0]] * n
    moves = moves if len(moves) == n else [moves[0]] * n
    for i, (joint, motion) in enumerate(zip(joints, moves, strict=True)):
        if motion.start >= joint.range_end:
            raise ParameterError(
                f"motions[{i}].start: needs less than the end of range, "
                f"{np.degrees(joint.range_end):g} degrees, got "
                f"{np.degrees(motion.start):g} degrees"
            )
    return joints, moves


@dataclass(frozen=True, slots=True, kw_only=True)
class Joints:
    """Parameters of many joints, as of `ElbowParameters`, each of shape (n_scenes,).

    Attributes
    ----------
    rest_angle : ndarray
        rad; ``nan`` is the angle where the motion starts.
    is_additive : ndarray of bool
        Whether `post_catch` is "additive".
    """

    catch_angle_constant: Floats
    catch_torque_constant: Floats
    residual_share: Floats
    catch_travel: Floats
    inertia: Floats
    damping: Floats
    stiffness: Floats
    catch_slope: Floats
    peak_duration: Floats
    post_catch_stiffness: Floats
    speed_threshold: Floats
    slowest_mean_speed: Floats
    smallest_catch_angle: Floats
    range_end: Floats
    catch_rise: Floats
    rest_angle: Floats
    is_additive: NDArray[np.bool_]

    @property
    def has_jump(self) -> NDArray[np.bool_]:
        """Whether θ_catch jumps at ν_H, or nearly: it does where ν_L is above it."""
        largest = self.catch_angle_constant - self.catch_slope * self.slowest_mean_speed
        return np.asarray(self.smallest_catch_angle > largest - _NEAR)

    def rows(self, which: "slice | NDArray[np.intp]") -> "Joints":
        """Return some of the joints.

        Parameters
        ----------
        which : slice or ndarray of int
            Their rows.

        Returns
        -------
        Joints
            Those.
        """
        names = (field.name for field in fields(self))
        return Joints(**{name: getattr(self, name)[which] for name in names})


def joints_of(parameters: Sequence[ElbowParameters]) -> Joints:
    """Put the parameters of many joints into columns.

    Parameters
    ----------
    parameters : sequence of ElbowParameters
        The joints, one a scene; the same object may come again and again.

    Returns
    -------
    Joints
        Their columns.
    """
    own = {id(one): one for one in parameters}
    distinct = list(own.values())
    places = dict(zip(own, range(len(own)), strict=True))
    index = np.fromiter(map(places.__getitem__, map(id, parameters)), dtype=np.intp)
    read = np.fromiter(
        chain.from_iterable(map(_read, distinct)),
        dtype=np.float64,
        count=len(distinct) * len(_NUMBERS),
    )
    numbers = read.reshape(len(distinct), len(_NUMBERS))[index].T
    rests = [np.nan if p.rest_angle is None else p.rest_angle for p in distinct]
    columns = dict(zip(_NUMBERS, np.ascontiguousarray(numbers), strict=True))
    return Joints(
        **columns,
        rest_angle=np.array(rests)[index],
        is_additive=np.array([p.post_catch == "additive" for p in distinct])[index],
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Motions:
    """Stretches of one kind, each column of shape (n_scenes,).

    Attributes
    ----------
    start, end : ndarray
        rad.
    speed : ndarray
        The mean speed, rad/s.
    """

    start: Floats
    end: Floats
    speed: Floats

    def rows(self, which: NDArray[np.intp]) -> "Motions":
        """Return some of the stretches.

        Parameters
        ----------
        which : ndarray of int
            Their rows.

        Returns
        -------
        Motions
            Those.
        """
        return Motions(
            start=self.start[which], end=self.end[which], speed=self.speed[which]
        )


def motions_of(stretches: Sequence[Motion], speed: str) -> Motions:
    """Put motions of one kind into columns.

    Parameters
    ----------
    stretches : sequence of Motion
        The motions.
    speed : str
        Their attribute that is the mean speed.

    Returns
    -------
    Motions
        Their columns.
    """
    read = attrgetter("start", "end", speed)
    start, end, mean = np.array([read(one) for one in stretches], dtype=np.float64).T
    return Motions(start=start, end=end, speed=mean)
