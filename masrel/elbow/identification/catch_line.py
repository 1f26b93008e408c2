"""Step 2: the line of catch angles against mean speed, L and α of (2).

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (2) and (6).
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.catch import Catch
from masrel.elbow.identification.clusters import ClusteredFit, Rows, solve
from masrel.elbow.identification.results import Step, fitted
from masrel.elbow.parameters import ElbowParameters

__all__ = ["fit_catch_line", "line_row", "on_the_line"]

NAMES = ("catch_angle_constant", "catch_slope")

LEAST_SPAN = math.radians(5.0)
"""Mean speeds must span this, rad/s: less is one speed, which has no slope."""

ITERATIONS = 20
"""Of Gauss and Newton's method; the row is so nearly linear that five would do."""


def line_row(
    catch: Catch, line: float, slope: float, slowest: float
) -> tuple[float, float, float]:
    """How far from the line of (2) a catch lies, and the derivatives of that.

    Parameters
    ----------
    catch : Catch
        A catch.
    line, slope : float
        L (rad) and α (s).
    slowest : float
        ν_L of (6), rad/s.

    Returns
    -------
    tuple of three float
        Angle where this motion meets the line, less the angle of its catch (rad),
        and its derivatives by L and α.

    Notes
    -----
    A catch that comes late in a motion that speeds up has a larger mean speed for
    that very reason, so that a plain regression on mean speed is biased. Here the
    motion is followed to the angle θ* at which it meets the line, θ* = L - α·v̄(θ*)
    with v̄(θ*) = v̄ + (θ* - θ)·dv̄/dθ, and θ* is compared with the catch.

    Examples
    --------
    >>> from types import SimpleNamespace as Made
    >>> catch = Made(angle=1.0, mean_speed=2.0, speed_gain=0.5)
    >>> round(line_row(catch, 2.2, 0.4, 1.0)[0], 12)  # 0.4/(1 + 0.4·0.5)
    0.333333333333
    """
    clamped = catch.mean_speed <= slowest  # first line of (6): θ_catch stands still
    speed = slowest if clamped else catch.mean_speed
    gain = 0.0 if clamped else catch.speed_gain
    scale = 1.0 + slope * gain
    left = (line - slope * speed - catch.angle) / scale
    return left, 1.0 / scale, -(speed + left * gain) / scale


def on_the_line(
    catches: Sequence[Catch], constants: ElbowParameters
) -> NDArray[np.bool_]:
    """Tell catches on the line of (2) from those where θ_L of (6) holds.

    Parameters
    ----------
    catches : sequence of Catch
        Catches.
    constants : ElbowParameters
        ν_L and θ_L of (6).

    Returns
    -------
    ndarray of bool, shape (n_catches,)
        False where the line through the others lies below θ_L.
    """
    speeds = np.array([catch.mean_speed for catch in catches])
    speeds = np.maximum(speeds, constants.slowest_mean_speed)
    angles = np.array([catch.angle for catch in catches])
    design = np.stack([np.ones_like(speeds), -speeds], axis=1)
    on = np.ones(speeds.size, dtype=np.bool_)
    for _ in range(speeds.size):
        line = np.linalg.lstsq(design[on], angles[on], rcond=None)[0]
        now = design @ line >= constants.smallest_catch_angle
        if (now == on).all() or not now.any():
            break
        on = now
    return on


def fit_catch_line(
    catches: Sequence[Catch], constants: ElbowParameters, *, level: float
) -> Step:
    """Fit L and α to catch angles: (2) within the clamps of (6).

    Parameters
    ----------
    catches : sequence of Catch
        One a trial, at least one.
    constants : ElbowParameters
        ν_L and θ_L of (6).
    level : float
        Level of the intervals.

    Returns
    -------
    Step
        L and α, by Gauss and Newton's method from the plain regression.
    """
    slowest = constants.slowest_mean_speed
    on = on_the_line(catches, constants)
    used = [catch for catch, lies in zip(catches, on.tolist(), strict=True) if lies]
    speeds = np.maximum([catch.mean_speed for catch in used], slowest)
    if np.ptp(speeds) < LEAST_SPAN:
        return _undetermined(len(used), slowest, level)
    design = np.stack([np.ones_like(speeds), -speeds], axis=1)
    angles = np.array([catch.angle for catch in used])
    values = np.linalg.lstsq(design, angles, rcond=None)[0]
    for _ in range(ITERATIONS):
        rows = _rows(used, values, slowest)
        jacobian = np.concatenate([row.design for row in rows])
        left = np.concatenate([row.target for row in rows])
        values = values + np.linalg.lstsq(jacobian, left, rcond=None)[0]
    found = solve(_rows(used, values, slowest))
    return Step(
        name="catch angles: L, α of (2)",
        estimates=fitted(
            NAMES,
            ClusteredFit(
                values=values,
                covariance=found.covariance,
                freedom=found.freedom,
                residual_sd=found.residual_sd,
                n_trials=found.n_trials,
            ),
            level,
        ),
        residual_sd=found.residual_sd,
    )


def _rows(
    catches: Sequence[Catch], values: NDArray[np.float64], slowest: float
) -> list[Rows]:
    rows = []
    for catch in catches:
        left, by_line, by_slope = line_row(catch, values[0], values[1], slowest)
        rows.append(
            Rows(design=np.array([[by_line, by_slope]]), target=np.array([-left]))
        )
    return rows


def _undetermined(n_trials: int, slowest: float, level: float) -> Step:
    nothing = ClusteredFit(
        values=np.full(2, np.nan),
        covariance=np.full((2, 2), np.nan),
        freedom=np.full(2, np.nan),
        residual_sd=math.nan,
        n_trials=np.full(2, n_trials),
    )
    reason = (
        f"needs catches at mean speeds that differ by {math.degrees(LEAST_SPAN):g} "
        f"deg/s or more above {math.degrees(slowest):g} deg/s"
    )
    return Step(
        name="catch angles: L, α of (2)",
        estimates=fitted(NAMES, nothing, level, dict.fromkeys(NAMES, reason)),
        residual_sd=math.nan,
    )
