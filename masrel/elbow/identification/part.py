"""Samples of one stretch that are used together."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.kinematics import (
    differentiate,
    filter_alike,
    window_length,
)
from masrel.elbow.identification.stretches import Stretch

__all__ = ["Part", "filtered_part", "part_of"]

Floats = NDArray[np.float64]

AFTER_WINDOW = 0.06
"""Window of the filter of the angle after a catch, s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """Samples of a trial that are used, within one phase or several.

    Attributes
    ----------
    time, angle, velocity, acceleration, torque : ndarray, shape (n_samples,)
        s, rad, rad/s, rad/s², N·m; smoothed within the part, before a catch the
        torque as well.
    measured : ndarray, shape (n_samples,)
        Torque as recorded, N·m.
    """

    time: Floats = field(compare=False, repr=False)
    angle: Floats = field(compare=False, repr=False)
    velocity: Floats = field(compare=False, repr=False)
    acceleration: Floats = field(compare=False, repr=False)
    torque: Floats = field(compare=False, repr=False)
    measured: Floats = field(compare=False, repr=False)

    def keep(self, which: NDArray[np.bool_]) -> "Part":
        """Leave out the samples that are not marked.

        Parameters
        ----------
        which : ndarray of bool, shape (n_samples,)
            Samples to keep.

        Returns
        -------
        Part
            The others are gone.
        """
        return Part(
            time=self.time[which],
            angle=self.angle[which],
            velocity=self.velocity[which],
            acceleration=self.acceleration[which],
            torque=self.torque[which],
            measured=self.measured[which],
        )

    def then(self, later: "Part") -> "Part":
        """Join two parts.

        Parameters
        ----------
        later : Part
            What follows.

        Returns
        -------
        Part
            Both.
        """
        return Part(
            time=np.concatenate([self.time, later.time]),
            angle=np.concatenate([self.angle, later.angle]),
            velocity=np.concatenate([self.velocity, later.velocity]),
            acceleration=np.concatenate([self.acceleration, later.acceleration]),
            torque=np.concatenate([self.torque, later.torque]),
            measured=np.concatenate([self.measured, later.measured]),
        )


def filtered_part(
    stretch: Stretch,
    unusable: NDArray[np.bool_],
    ends: tuple[int, int],
    window: float,
) -> Part:
    """Filter angle and torque alike, as a linear law allows.

    Parameters
    ----------
    stretch : Stretch
        The stretch.
    unusable : ndarray of bool, shape (n_samples,)
        Its samples that must not be used.
    ends : tuple of two int
        First sample of the part, and first after it.
    window : float
        Length of the filter's window, s.

    Returns
    -------
    Part
        Samples between the ends whose window holds nothing unusable.
    """
    period = stretch.samples.period
    margin = window_length(window, period) // 2 + 1
    start, stop = ends
    if stop - start <= 2 * margin:
        return part_of(stretch, slice(0, 0))
    angle, torque = stretch.raw_angle[start:stop], stretch.torque[start:stop]
    made = filter_alike(angle, torque, period, window)
    inner = slice(start + margin, stop - margin)
    reach = np.ones(2 * margin + 1)
    touched = np.convolve(unusable[start:stop], reach, mode="valid") > 0.5
    whole = Part(
        time=stretch.time[inner],
        angle=made[0],
        velocity=made[1],
        acceleration=made[2],
        torque=made[3],
        measured=stretch.torque[inner],
    )
    return whole.keep(~touched)


def part_of(stretch: Stretch, which: slice, *, smoothed_anew: bool = False) -> Part:
    """Take samples of a stretch as they are.

    Parameters
    ----------
    stretch : Stretch
        The stretch.
    which : slice
        Its samples.
    smoothed_anew : bool, optional
        Whether the angle is smoothed within the part alone, so that it knows nothing
        of the motion beyond.

    Returns
    -------
    Part
        Torque as measured.
    """
    motion = stretch.angle, stretch.velocity, stretch.acceleration
    if smoothed_anew:
        angle, velocity, acceleration = differentiate(
            stretch.raw_angle[which], stretch.samples.period, AFTER_WINDOW
        )
    else:
        angle, velocity, acceleration = (values[which] for values in motion)
    return Part(
        time=stretch.time[which],
        angle=angle,
        velocity=velocity,
        acceleration=acceleration,
        torque=stretch.torque[which],
        measured=stretch.torque[which],
    )
