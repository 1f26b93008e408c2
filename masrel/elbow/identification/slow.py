"""Step 1: b, k and m of (1) from slow trials.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equation (1) and Fig. 3.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.clusters import Rows, solve, without_own
from masrel.elbow.identification.law import PreCatchLaw
from masrel.elbow.identification.results import Step, fitted
from masrel.elbow.identification.trials import Trial

__all__ = ["SlowFit", "fit_slow"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class SlowFit:
    """What slow trials tell.

    Attributes
    ----------
    trials : tuple of Trial
        The trials.
    step : Step
        b, k and m, with their intervals.
    law : PreCatchLaw
        The same as a law.
    relative_error : float
        The paper's mean relative error (Fig. 3): mean distance from the law over
        mean torque, both absolute.
    """

    trials: tuple[Trial, ...]
    step: Step
    law: PreCatchLaw
    relative_error: float


def fit_slow(trials: Sequence[Trial], *, with_inertia: bool, level: float) -> SlowFit:
    """Fit b, k and m to slow trials: step 1.

    Parameters
    ----------
    trials : sequence of Trial
        Slow trials, at least one. Each has a constant of its own, -k·θ_rest of (1)
        and the sensor's zero.
    with_inertia : bool
        Whether m is fitted.
    level : float
        Level of the intervals.

    Returns
    -------
    SlowFit
        The fit; what these trials do not determine is ``nan``.
    """
    rows = []
    for trial in trials:
        part = trial.pre_catch
        columns = [part.velocity, part.angle]
        columns += [part.acceleration] if with_inertia else []
        own = np.ones((part.torque.size, 1))
        rows.append(without_own(own, np.stack(columns, axis=1), part.torque))
    names = ("damping", "stiffness", *(("inertia",) if with_inertia else ()))
    fit = solve(rows, n_own=len(trials))
    far, squares, size, n_samples = _distance(trials, rows, fit.values)
    step = Step(
        name="slow trials: b, k of (1)",
        estimates=fitted(names, fit, level),
        residual_sd=math.sqrt(squares / n_samples),
    )
    return SlowFit(
        trials=tuple(trials),
        step=step,
        law=PreCatchLaw(
            damping=step["damping"].value,
            stiffness=step["stiffness"].value,
            inertia=step["inertia"].value if with_inertia else 0.0,
        ),
        relative_error=far / size if size > 0.0 else math.nan,
    )


def _distance(
    trials: Sequence[Trial], rows: Sequence[Rows], values: Floats
) -> tuple[float, float, float, int]:
    # measured torque from the law: sums of |distance|, of its square and of |torque|,
    # and the number of samples
    far, squares, size, count = 0.0, 0.0, 0.0, 0
    for trial, row in zip(trials, rows, strict=True):
        part = trial.pre_catch
        law = part.torque - (row.target - row.design @ values)
        far += float(np.abs(part.measured - law).sum())
        squares += float(((part.measured - law) ** 2).sum())
        size += float(np.abs(part.measured).sum())
        count += part.measured.size
    return far, squares, size, count
