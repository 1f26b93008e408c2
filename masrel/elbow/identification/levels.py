"""What is read off the torque of one catch: peak, residual and climb.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (3) and (5).
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.clusters import Rows, without_own
from masrel.elbow.identification.law import PreCatchLaw
from masrel.elbow.identification.trials import Trial
from masrel.elbow.parameters import ElbowParameters

__all__ = ["CatchLevels", "catch_levels"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class CatchLevels:
    """What is read off the torque of one catch.

    Attributes
    ----------
    peak : float
        Peak above the end of pre-catch, H·v_c of (3), N·m.
    residual : float
        Residual above it, Q·H·v_c, N·m; ``nan`` if nothing was recorded after the peak.
    climb : Rows
        Torque above the residual after the catch against angle travelled since.
    """

    peak: float
    residual: float
    climb: Rows = field(repr=False)


def catch_levels(
    trial: Trial, law: PreCatchLaw, constants: ElbowParameters
) -> CatchLevels | None:
    """Read peak, residual and climb off the torque of a trial.

    Parameters
    ----------
    trial : Trial
        A trial.
    law : PreCatchLaw
        b, k and m.
    constants : ElbowParameters
        ΔT_peak and the reading of (5).

    Returns
    -------
    CatchLevels or None
        None without a catch whose torque can be used.
    """
    catch, after, pre = trial.catch, trial.after, trial.pre_catch
    if catch is None or after is None or pre.torque.size == 0 or after.torque.size == 0:
        return None
    own = float((pre.torque - law.torque(pre)).mean())  # -k·θ_rest
    above = after.torque - (own + law.at(catch))  # over τ_pre_end of (3)
    end = math.inf if catch.end is None else catch.end
    in_peak = after.time < min(catch.time + constants.peak_duration, end)
    later = after.time >= end
    past = np.where(later, after.angle - (catch.angle + catch.travel), 0.0)
    torque = above - np.where(later, law.inertia * after.acceleration, 0.0)
    if constants.post_catch == "additive":
        torque = np.where(later, after.torque - law.torque(after) - own, above)
    climb, residual = _climb(past[~in_peak], torque[~in_peak])
    return CatchLevels(
        peak=float(above[in_peak].mean()) if in_peak.any() else math.nan,
        residual=residual,
        climb=climb,
    )


def _climb(past: Floats, torque: Floats) -> tuple[Rows, float]:
    # a level and a slope; the level alone is the residual torque
    nothing = Rows(design=np.zeros((1, 1)), target=np.zeros(1))
    if torque.size == 0:
        return nothing, math.nan
    if not past.any():
        return nothing, float(torque.mean())
    own = np.ones((past.size, 1))
    rows = without_own(own, past[:, None], torque)
    moved = float((rows.design[:, 0] ** 2).sum())
    slope = float(rows.design[:, 0] @ rows.target) / moved
    return rows, float(torque.mean()) - slope * float(past.mean())
