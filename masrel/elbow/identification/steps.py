"""Step 4: H, Q, D and k_post of (3) to (5), each on its own.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (3)-(5), Figs. 4 and 5.
"""

import math
from collections.abc import Sequence

import numpy as np

from masrel.elbow.identification.catch import Catch
from masrel.elbow.identification.censored import fit_censored
from masrel.elbow.identification.clusters import Rows, solve
from masrel.elbow.identification.horizon import Horizon
from masrel.elbow.identification.levels import CatchLevels
from masrel.elbow.identification.results import FittedParameter, Step, fitted
from masrel.elbow.identification.travels import CensoredTravels

__all__ = [
    "can_be_censored",
    "fit_catch_torque",
    "fit_catch_travel",
    "fit_post_catch",
]


def fit_catch_torque(
    catches: Sequence[Catch], levels: Sequence[CatchLevels], *, level: float
) -> tuple[Step, Step]:
    """Fit H to peaks against speed, and Q to residuals against peaks: (3).

    Parameters
    ----------
    catches : sequence of Catch
        Catches.
    levels : sequence of CatchLevels
        What was read off each.
    level : float
        Level of the intervals.

    Returns
    -------
    tuple of two Step
        H, and Q.
    """
    peaks = [
        Rows(design=np.array([[catch.speed]]), target=np.array([read.peak]))
        for catch, read in zip(catches, levels, strict=True)
        if not math.isnan(read.peak)
    ]
    ratios = [
        Rows(design=np.array([[read.peak]]), target=np.array([read.residual]))
        for read in levels
        if not math.isnan(read.residual + read.peak)
    ]
    reason = {"residual_ratio": "no torque was recorded after a peak"}
    return (
        _one("catch torque: H of (3)", "catch_torque_constant", peaks, level),
        _one("residual torque: Q of (3)", "residual_ratio", ratios, level, reason),
    )


def fit_catch_travel(
    catches: Sequence[Catch], horizons: Sequence[Horizon], *, level: float
) -> Step:
    """Average the angle travelled during the catch, ΔT_c·v̄_c of (4): D.

    Parameters
    ----------
    catches : sequence of Catch
        Catches.
    horizons : sequence of Horizon
        Of those that do not end within their stretch, as far as they have one.
    level : float
        Level of the intervals.

    Returns
    -------
    Step
        D: the mean if all catches end, otherwise where the likelihood of all travels
        is largest, those behind a horizon censored there.
    """
    title, name = "catch travel: D of (4)", "catch_travel"
    seen = [catch.travel for catch in catches if catch.end is not None]
    if horizons and can_be_censored(seen):
        found = fit_censored(CensoredTravels.of(seen, horizons), level=level)
        estimate = FittedParameter(
            name=name,
            value=found.mean,
            standard_error=found.standard_error,
            freedom=found.freedom,
            low=found.low,
            high=found.high,
            level=level,
            n_trials=len(seen) + len(horizons),
        )
        return Step(name=title, estimates=(estimate,), residual_sd=found.sd)
    rows = [Rows(design=np.ones((1, 1)), target=np.array([each])) for each in seen]
    longest = max((catch.travel for catch in catches), default=0.0)
    reason = "no catch ends within its stretch"
    if catches:
        reason += f"; D is more than {math.degrees(longest):.4g} deg"
    return _one(title, name, rows, level, {name: reason})


def can_be_censored(seen: Sequence[float]) -> bool:
    """Say whether travels that were seen tell how much travels differ.

    Parameters
    ----------
    seen : sequence of float
        Travels of catches that end, rad.

    Returns
    -------
    bool
        Whether there are two that differ.
    """
    return len(set(seen)) > 1


def fit_post_catch(levels: Sequence[CatchLevels], *, level: float) -> Step:
    """Fit k_post to the torque after the catch: (5).

    Parameters
    ----------
    levels : sequence of CatchLevels
        What was read off each catch.
    level : float
        Level of the intervals.

    Returns
    -------
    Step
        k_post.
    """
    rows = [read.climb for read in levels if read.climb.design.any()]
    reason = {"post_catch_stiffness": "no stretch goes on after its catch"}
    return _one(
        "post-catch: k_post of (5)", "post_catch_stiffness", rows, level, reason
    )


def _one(
    title: str,
    name: str,
    rows: list[Rows],
    level: float,
    reasons: dict[str, str] | None = None,
) -> Step:
    if not rows:  # nothing to fit: a value that no row determines
        rows = [Rows(design=np.zeros((1, 1)), target=np.zeros(1))]
    found = solve(rows)
    return Step(
        name=title,
        estimates=fitted((name,), found, level, reasons),
        residual_sd=found.residual_sd,
    )
