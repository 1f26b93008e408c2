"""Friction of a device from backdriving it: I, B and β of (7).

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section III.B.2 and Fig. 8.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from masrel._input import warn_caller
from masrel.errors import RecordingError, RecordingWarning
from masrel.lab.elbow.identification._catches import Part, filtered_part, window_length
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
from masrel.lab.elbow.motions import Floats

# Slower, the direction of motion is not certain and the device may stick, rad/s.
_MOVING = math.radians(5.0)

_WINDOW = 0.1  # of the filter of angle and torque, s
_MIN_STROKE = 0.1  # a stroke lasts at least this long, s
_NAMES = ("inertia", "viscous", "coulomb")


@dataclass(frozen=True, slots=True, kw_only=True)
class Stroke:
    """A movement in one direction: filtered, and the law (n_samples,)."""

    recording: str
    part: Part = field(compare=False, repr=False)
    fitted: Floats = field(compare=False, repr=False)


def _strokes(movement: Movement) -> list[Part]:
    # movements in one direction that last long enough and hold no gap
    samples = even_samples(movement)
    margin = window_length(_WINDOW, samples.period) // 2 + 1
    whole = filtered_part(samples, _WINDOW)
    # sgn of (7) is one number within the window of the filter, or it is not used
    part = whole.keep(np.abs(whole.velocity) > _MOVING)
    breaks = np.diff(part.time) > 1.5 * samples.period
    breaks |= np.diff(np.sign(part.velocity)) != 0.0
    runs = np.split(np.arange(part.time.size), np.flatnonzero(breaks) + 1)
    return [
        part.keep(run[margin:-margin])
        for run in runs
        if (run.size - 2 * margin) * samples.period >= _MIN_STROKE
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
    correlation: Floats = field(compare=False, repr=False)
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
        measured torque, from which the commanded torque is subtracted.
    level : float, optional
        Level of the intervals.

    Returns
    -------
    FrictionFit
        The three parameters. Each recording has its own constant, the sensor's zero.
        Strokes do not repeat exactly, so they are the clusters.

    Raises
    ------
    RecordingError
        If there are not two strokes in each direction, without which β cannot be
        distinguished from the sensor's zero.

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
    parts = [(m.name, part) for m in movements for part in _strokes(m)]
    forward = sum(part.velocity.mean() > 0.0 for _, part in parts)
    if min(forward, len(parts) - forward) < 2:
        raise RecordingError(
            "recordings: friction needs two strokes or more in each direction, got "
            f"{forward} in extension and {len(parts) - forward} in flexion"
        )
    rows = _rows(parts)
    fit = solve(rows, n_local=len(movements))
    estimates = fitted(_NAMES, fit, level)
    for estimate in estimates:
        if estimate.value < 0.0:
            warn_caller(
                f"{estimate.name} is negative ({estimate.value:.4g}): is the torque "
                "that of the hand, positive in the same direction as the angle?",
                RecordingWarning,
            )
    left = [row.target - row.design @ fit.values for row in rows]
    far = np.concatenate(left)
    size = np.concatenate([part.torque for _, part in parts])
    sd = np.sqrt(np.diag(fit.covariance))
    return FrictionFit(
        estimates=estimates,
        correlation=fit.covariance / np.outer(sd, sd),
        relative_error=float(np.abs(far).mean() / np.abs(size).mean()),
        torque_sd=fit.residual_sd,
        strokes=tuple(
            Stroke(recording=name, part=part, fitted=part.torque - far)
            for (name, part), far in zip(parts, left, strict=True)
        ),
        level=level,
        simulated=any(movement.simulated for movement in movements),
    )


def _rows(parts: Sequence[tuple[str, Part]]) -> list[Rows]:
    # the constant of a recording is taken out of all its strokes together
    tables = [
        np.stack([p.acceleration, p.velocity, np.sign(p.velocity), p.torque], axis=1)
        for _, p in parts
    ]
    names = [name for name, _ in parts]
    means = {
        name: np.concatenate(
            [table for of, table in zip(names, tables, strict=True) if of == name]
        ).mean(axis=0)
        for name in set(names)
    }
    left = [table - means[of] for of, table in zip(names, tables, strict=True)]
    return [Rows(table[:, :3], table[:, 3]) for table in left]
