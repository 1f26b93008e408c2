"""Scenes as columns: one array a parameter, one row a scene."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import chain
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.motion import Floats
from masrel.elbow.parameters import ElbowParameters

__all__ = ["Joints", "joints_of"]

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
