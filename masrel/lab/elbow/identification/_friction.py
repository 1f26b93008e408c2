"""Friction of a device from backdriving it: I, B and β of (7).

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section III.B.2 and Fig. 8.
"""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from masrel.errors import RecordingError, RecordingWarning
from masrel.lab.elbow.identification._catches import filter_alike, window_length
from masrel.lab.elbow.identification._clusters import (
    FittedParameter,
    Rows,
    fitted,
    solve,
)
from masrel.lab.elbow.identification._reading import (
    Movement,
    even_samples,
    read_movement,
)

_Floats = NDArray[np.float64]

# Slower, the direction of motion is not certain and the device may stick, rad/s.
_MOVING = math.radians(5.0)

_WINDOW = 0.1  # of the filter of angle and torque, s
_MIN_STROKE = 0.1  # a stroke lasts at least this long, s
_NAMES = ("inertia", "viscous", "coulomb")


@dataclass(frozen=True, slots=True, kw_only=True)
class Stroke:
    """A movement in one direction: filtered columns (n_samples,), and the law."""

    recording: str
    time: _Floats = field(compare=False, repr=False)
    velocity: _Floats = field(compare=False, repr=False)
    acceleration: _Floats = field(compare=False, repr=False)
    torque: _Floats = field(compare=False, repr=False)
    fitted: _Floats = field(compare=False, repr=False)


def _strokes(movement: Movement) -> list[Stroke]:
    # movements in one direction that last long enough and hold no gap, not fitted yet
    samples = even_samples(movement)
    margin = window_length(_WINDOW, samples.period) // 2 + 1
    _, velocity, acceleration, torque = filter_alike(
        samples.angle, samples.torque, samples.period, _WINDOW
    )
    unusable = np.convolve(
        samples.in_gap | samples.saturated, np.ones(2 * margin + 1), mode="valid"
    )
    # sgn of (7) is one number within the window of the filter, or it is not used
    direction = np.where(np.abs(velocity) > _MOVING, np.sign(velocity), 0.0)
    direction[unusable > 0.5] = 0.0
    edges = np.flatnonzero(np.diff(direction, prepend=0.0, append=0.0))
    return [
        Stroke(
            recording=movement.name,
            time=samples.time[margin:-margin][inner],
            velocity=velocity[inner],
            acceleration=acceleration[inner],
            torque=torque[inner],
            fitted=torque[inner],
        )
        for start, stop in pairwise(edges)
        if direction[start] != 0.0
        and (stop - start - 2 * margin) * samples.period >= _MIN_STROKE
        for inner in [slice(start + margin, stop - margin)]
    ]


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
    strokes = [stroke for movement in movements for stroke in _strokes(movement)]
    forward = sum(stroke.velocity.mean() > 0.0 for stroke in strokes)
    if min(forward, len(strokes) - forward) < 2:
        raise RecordingError(
            "recordings: friction needs two strokes or more in each direction, got "
            f"{forward} in extension and {len(strokes) - forward} in flexion"
        )
    rows = _rows(strokes)
    fit = solve(rows, n_local=len(movements))
    estimates = fitted(_NAMES, fit, level)
    for estimate in estimates:
        if estimate.value < 0.0:
            warnings.warn(
                f"{estimate.name} is negative ({estimate.value:.4g}): is torque that "
                "of the hand, counted as the angle is?",
                RecordingWarning,
                stacklevel=2,
            )
    strokes = [
        replace(stroke, fitted=stroke.torque - (row.target - row.design @ fit.values))
        for stroke, row in zip(strokes, rows, strict=True)
    ]
    far = np.concatenate([stroke.torque - stroke.fitted for stroke in strokes])
    size = np.concatenate([stroke.torque for stroke in strokes])
    sd = np.sqrt(np.diag(fit.covariance))
    return FrictionFit(
        estimates=estimates,
        correlation=fit.covariance / np.outer(sd, sd),
        relative_error=float(np.abs(far).mean() / np.abs(size).mean()),
        torque_sd=fit.residual_sd,
        strokes=tuple(strokes),
        level=level,
        simulated=any(movement.simulated for movement in movements),
    )


def _rows(strokes: Sequence[Stroke]) -> list[Rows]:
    # the constant of a recording is taken out of all its strokes together
    tables = [
        np.stack([s.acceleration, s.velocity, np.sign(s.velocity), s.torque], axis=1)
        for s in strokes
    ]
    means = {
        name: np.concatenate(
            [t for s, t in zip(strokes, tables, strict=True) if s.recording == name]
        ).mean(axis=0)
        for name in {stroke.recording for stroke in strokes}
    }
    left = [t - means[s.recording] for s, t in zip(strokes, tables, strict=True)]
    return [Rows(t[:, :3], t[:, 3]) for t in left]
