"""Friction of a device from backdriving it: I, B and β of (7).

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section III.B.2 and Fig. 8.
"""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.clusters import Rows, solve, without_own
from masrel.elbow.identification.movement import Movement
from masrel.elbow.identification.reading import read_movement
from masrel.elbow.identification.results import FittedParameter, fitted
from masrel.elbow.identification.samples import even_samples
from masrel.elbow.identification.strokes import Moved, Stroke, find_strokes
from masrel.errors import RecordingError, RecordingWarning

__all__ = ["FrictionFit", "fit_friction"]

Floats = NDArray[np.float64]

NAMES = ("inertia", "viscous", "coulomb")


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
        hand exerts in the direction of extension.
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
        entry if isinstance(entry, Movement) else read_movement(Path(entry))
        for entry in recordings
    ]
    parts = _parts(movements)
    rows = _rows(parts)
    fit = solve(rows, n_own=len(movements))
    estimates = fitted(NAMES, fit, level)
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


def _parts(movements: Sequence[Movement]) -> list[tuple[str, Moved]]:
    # strokes with the name of their recording
    parts = [
        (movement.name, stroke)
        for movement in movements
        for stroke in find_strokes(even_samples(movement))
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


def _rows(parts: Sequence[tuple[str, Moved]]) -> list[Rows]:
    # the constant of a recording is taken out of all its strokes together
    made: list[Rows] = []
    for name in dict.fromkeys(name for name, _ in parts):
        own = [part for other, part in parts if other == name]
        designs = [
            np.stack([part[2], part[1], np.sign(part[1])], axis=1) for part in own
        ]
        whole = without_own(
            np.ones((sum(part[0].size for part in own), 1)),
            np.concatenate(designs),
            np.concatenate([part[3] for part in own]),
        )
        ends = np.cumsum([part[0].size for part in own])[:-1]
        made += [
            Rows(design=design, target=target)
            for design, target in zip(
                np.split(whole.design, ends), np.split(whole.target, ends), strict=True
            )
        ]
    return made


def _fitted_strokes(
    parts: Sequence[tuple[str, Moved]], rows: Sequence[Rows], values: Floats
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
