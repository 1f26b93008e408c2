"""Friction of a device from backdriving it: I, B and β of (7).

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section III.B.2 and Fig. 8.
"""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from masrel.errors import RecordingError, RecordingWarning
from masrel.lab.elbow.identification._clusters import Rows, solve
from masrel.lab.elbow.identification._reading import (
    Movement,
    Samples,
    even_samples,
    read_movement,
)
from masrel.lab.elbow.identification._results import FittedParameter, fitted
from masrel.lab.elbow.identification._stretches import filter_alike, window_length

_Floats = NDArray[np.float64]

# Slower, the direction of motion is not certain and the device may stick, rad/s.
_MOVING = math.radians(5.0)

_WINDOW = 0.1  # of the filter of angle and torque, s
_MIN_STROKE = 0.1  # a stroke lasts at least this long, s
_NAMES = ("inertia", "viscous", "coulomb")

# Time, velocity, acceleration and torque of a stroke, SI units.
_Moved = tuple[_Floats, _Floats, _Floats, _Floats]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stroke:
    """A movement in one direction: filtered columns (n_samples,), and the law."""

    recording: str
    time: _Floats = field(compare=False, repr=False)
    velocity: _Floats = field(compare=False, repr=False)
    acceleration: _Floats = field(compare=False, repr=False)
    torque: _Floats = field(compare=False, repr=False)
    fitted: _Floats = field(compare=False, repr=False)


def _find_strokes(samples: Samples) -> list[_Moved]:
    # movements in one direction that last long enough and hold no gap
    margin = window_length(_WINDOW, samples.period) // 2 + 1
    _, velocity, acceleration, torque = filter_alike(
        samples.angle, samples.torque, samples.period, _WINDOW
    )
    time = samples.time[margin:-margin]
    unusable = np.convolve(
        samples.in_gap | samples.saturated, np.ones(2 * margin + 1), mode="valid"
    )
    # sgn of (7) is one number within the window of the filter, or it is not used
    direction = np.where(np.abs(velocity) > _MOVING, np.sign(velocity), 0.0)
    direction[unusable > 0.5] = 0.0
    edges = np.flatnonzero(np.diff(direction, prepend=0.0, append=0.0))
    strokes = []
    for start, stop in pairwise(edges):
        inner = slice(start + margin, stop - margin)
        long = (stop - start - 2 * margin) * samples.period >= _MIN_STROKE
        if direction[start] != 0.0 and long:
            strokes.append(
                (time[inner], velocity[inner], acceleration[inner], torque[inner])
            )
    return strokes


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionFit:
    """Friction of a device.

    Attributes
    ----------
    estimates : tuple of FittedParameter
        I (kg·m²), B (N·m·s/rad) and β (N·m), with intervals clustered by stroke.
    correlation : ndarray, shape (3, 3)
        Of their errors.
    relative_error : float
        Mean distance of torque from (7) over mean torque, both absolute.
    torque_sd : float
        Standard deviation of the filtered torque about (7), N·m.
    strokes : tuple of Stroke
        What was used.
    level : float
        Level of the intervals.
    simulated : bool
        Whether any recording is.
    """

    estimates: tuple[FittedParameter, ...]
    correlation: _Floats = field(compare=False, repr=False)
    relative_error: float
    torque_sd: float
    strokes: tuple[Stroke, ...] = field(repr=False)
    level: float
    simulated: bool

    def __getitem__(self, name: str) -> FittedParameter:
        return next(e for e in self.estimates if e.name == name)


def fit_friction(
    recordings: Sequence[Movement | Path | str], *, level: float = 0.95
) -> FrictionFit:
    """Fit (7), τ_ext = I·θ̈ + B·θ̇ + β·sgn(θ̇), to recordings of backdriving.

    Parameters
    ----------
    recordings : sequence of Movement or path
        The device moved to and fro by hand with its motor off; torque is what the
        hand exerts in the direction of extension. Or masrel's own recordings with a
        measured torque, of which the torque that was sent is taken off.
    level : float, optional
        Level of the intervals.

    Returns
    -------
    FrictionFit
        The three parameters. A recording has a constant of its own, the sensor's
        zero; what a stroke in one direction does, the next does not repeat exactly,
        so that strokes are the clusters.

    Raises
    ------
    RecordingError
        If there are not two strokes in each direction, without which β cannot be
        told from the sensor's zero.

    Warns
    -----
    RecordingWarning
        If a value is negative, which the law of a passive device cannot have.
    """
    movements = [
        entry
        if isinstance(entry, Movement)
        else read_movement(Path(entry), of_device=True)
        for entry in recordings
    ]
    parts = _parts(movements)
    rows = _rows(parts)
    fit = solve(rows, n_local=len(movements))
    estimates = fitted(_NAMES, fit, level)
    _warn_of_negative(estimates)
    strokes = _fitted_strokes(parts, rows, fit.values)
    far = np.concatenate([stroke.torque - stroke.fitted for stroke in strokes])
    size = np.concatenate([stroke.torque for stroke in strokes])
    sd = np.sqrt(np.diag(fit.covariance))
    return FrictionFit(
        estimates=estimates,
        correlation=fit.covariance / np.outer(sd, sd),
        relative_error=float(np.abs(far).mean() / np.abs(size).mean()),
        torque_sd=fit.residual_sd,
        strokes=strokes,
        level=level,
        simulated=any(movement.simulated for movement in movements),
    )


def _parts(movements: Sequence[Movement]) -> list[tuple[str, _Moved]]:
    # strokes with the name of their recording
    parts = [
        (movement.name, stroke)
        for movement in movements
        for stroke in _find_strokes(even_samples(movement))
    ]
    forward = sum(stroke[1].mean() > 0.0 for _, stroke in parts)
    if min(forward, len(parts) - forward) < 2:
        raise RecordingError(
            "recordings: friction needs two strokes or more in each direction, got "
            f"{forward} in extension and {len(parts) - forward} in flexion"
        )
    return parts


def _warn_of_negative(estimates: Sequence[FittedParameter]) -> None:
    for estimate in estimates:
        if estimate.value < 0.0:
            warnings.warn(
                f"{estimate.name} is negative ({estimate.value:.4g}): is torque that "
                "of the hand, counted as the angle is?",
                RecordingWarning,
                stacklevel=3,
            )


def _rows(parts: Sequence[tuple[str, _Moved]]) -> list[Rows]:
    # the constant of a recording is taken out of all its strokes together
    rows: list[Rows] = []
    for name in dict.fromkeys(name for name, _ in parts):
        strokes = [part for other, part in parts if other == name]
        tables = [
            np.stack([part[2], part[1], np.sign(part[1]), part[3]], axis=1)
            for part in strokes
        ]
        mean = np.concatenate(tables).mean(axis=0)
        rows += [
            Rows(design=(t - mean)[:, :3], target=(t - mean)[:, 3]) for t in tables
        ]
    return rows


def _fitted_strokes(
    parts: Sequence[tuple[str, _Moved]], rows: Sequence[Rows], values: _Floats
) -> tuple[Stroke, ...]:
    return tuple(
        Stroke(
            recording=name,
            time=part[0],
            velocity=part[1],
            acceleration=part[2],
            torque=part[3],
            fitted=part[3] - (row.target - row.design @ values),
        )
        for (name, part), row in zip(parts, rows, strict=True)
    )
