"""Friction of the device, fitted to how much torque a free arm needs to turn."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from masrel.errors import ParameterError

__all__ = ["FrictionEstimate", "SteadyRun", "fit_friction"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SteadyRun:
    """One turn of the arm at a steady speed."""

    speed: float  # mean speed of the steady part, rad/s; negative in flexion
    torque: float  # mean torque of the motor in it, N·m, positive in extension


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionEstimate:
    """Friction of (7), fitted to steady runs."""

    # viscous, viscous_error: B and its standard error, N·m·s/rad
    viscous: float
    viscous_error: float
    # coulomb, coulomb_error: β and its standard error, N·m
    coulomb: float
    coulomb_error: float
    # offset, offset_error: torque that acts one way whatever the motion, N·m: gravity
    # of an arm that is not level, or a current sensor that is off
    offset: float
    offset_error: float
    runs: tuple[SteadyRun, ...]  # what it was fitted to


def fit_friction(runs: Sequence[SteadyRun]) -> FrictionEstimate:
    """Fit B and β of (7) to steady runs by least squares."""
    # [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). IEEE TNSRE 20(3), 361-370,
    # equation (7). https://doi.org/10.1109/TNSRE.2012.2195330
    speeds = np.array([run.speed for run in runs])
    torques = np.array([run.torque for run in runs])
    # (7) at a steady speed: τ = B θ̇ + β sgn(θ̇), and what acts one way
    design = np.column_stack([speeds, np.sign(speeds), np.ones(len(runs))])
    if len(runs) < 4 or np.linalg.matrix_rank(design) < 3:
        raise ParameterError(
            "runs: need four or more, at two speeds and in both directions, "
            f"got {len(runs)}"
        )
    found, *_ = np.linalg.lstsq(design, torques, rcond=None)
    left = torques - design @ found
    variance = float(left @ left) / (len(runs) - 3)
    errors = np.sqrt(variance * np.diag(np.linalg.inv(design.T @ design)))
    viscous, coulomb, offset = (float(value) for value in found)
    viscous_error, coulomb_error, offset_error = (float(value) for value in errors)
    return FrictionEstimate(
        viscous=viscous,
        viscous_error=viscous_error,
        coulomb=coulomb,
        coulomb_error=coulomb_error,
        offset=offset,
        offset_error=offset_error,
        runs=tuple(runs),
    )
