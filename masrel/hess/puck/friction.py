"""Friction of the device, fitted to how much torque a free arm needs to turn."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from masrel.errors import ParameterError

__all__ = ["FrictionEstimate", "SteadyRun", "fit_friction"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SteadyRun:
    """One turn of the arm at a steady speed.

    Attributes
    ----------
    speed : float
        Mean speed of the steady part, rad/s; negative in flexion.
    torque : float
        Mean torque of the motor in it, N·m, positive in extension.
    """

    speed: float
    torque: float


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionEstimate:
    """Friction of (7), fitted to steady runs.

    Attributes
    ----------
    viscous, viscous_error : float
        B and its standard error, N·m·s/rad.
    coulomb, coulomb_error : float
        β and its standard error, N·m.
    offset, offset_error : float
        Torque that acts one way whatever the motion, N·m: gravity of an arm that is
        not level, or a current sensor that is off.
    runs : tuple of SteadyRun
        What it was fitted to.
    """

    viscous: float
    viscous_error: float
    coulomb: float
    coulomb_error: float
    offset: float
    offset_error: float
    runs: tuple[SteadyRun, ...]


def fit_friction(runs: Sequence[SteadyRun]) -> FrictionEstimate:
    """Fit B and β of (7) to steady runs by least squares.

    Parameters
    ----------
    runs : sequence of SteadyRun
        At two speeds or more, in both directions.

    Returns
    -------
    FrictionEstimate
        B, β and an offset, with standard errors from what the fit leaves.

    Raises
    ------
    ParameterError
        If there are fewer than four runs, or they cannot tell the three apart.

    References
    ----------
    .. [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). IEEE TNSRE 20(3), 361-370,
       equation (7). https://doi.org/10.1109/TNSRE.2012.2195330

    Examples
    --------
    >>> import math
    >>> runs = [SteadyRun(speed=v, torque=0.2 * v + math.copysign(0.1, v))
    ...         for v in (-2.0, -1.0, 1.0, 2.0)]
    >>> found = fit_friction(runs)
    >>> round(found.viscous, 6), round(found.coulomb, 6)
    (0.2, 0.1)
    """
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
