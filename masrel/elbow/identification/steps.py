"""The fits of the source one by one: slow trials, catch angles, catch torques.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (1)-(6), Figs. 3-5.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.clusters import Rows, solve, without_own
from masrel.elbow.identification.results import Step, fitted
from masrel.elbow.identification.trials import Catch, Part, Trial
from masrel.elbow.parameters import ElbowParameters

__all__ = [
    "CatchLevels",
    "PreCatchLaw",
    "catch_levels",
    "fit_catch_torque",
    "fit_catch_travel",
    "fit_post_catch",
    "fit_slow",
]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class PreCatchLaw:
    """b, k and m of (1).

    Attributes
    ----------
    damping, stiffness, inertia : float
        N·m·s/rad, N·m/rad, kg·m².
    """

    damping: float
    stiffness: float
    inertia: float

    def torque(self, part: Part) -> Floats:
        """Torque of (1) without the constant k·θ_rest.

        Parameters
        ----------
        part : Part
            Samples.

        Returns
        -------
        ndarray, shape (n_samples,)
            N·m.
        """
        law = self.damping * part.velocity + self.stiffness * part.angle
        return np.asarray(law + self.inertia * part.acceleration)

    def at(self, catch: Catch) -> float:
        """Torque of (1) at the start of a catch, without the constant.

        Parameters
        ----------
        catch : Catch
            The catch.

        Returns
        -------
        float
            N·m.
        """
        law = self.damping * catch.speed + self.stiffness * catch.angle
        return law + self.inertia * catch.acceleration


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


def fit_slow(
    trials: Sequence[Trial], *, with_inertia: bool, level: float
) -> tuple[Step, float]:
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
    tuple of Step and float
        The fit, and the paper's mean relative error (Fig. 3): mean distance from
        the law over mean torque, both absolute.
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
    far, squares, size = 0.0, 0.0, 0.0
    for trial, row in zip(trials, rows, strict=True):
        part = trial.pre_catch
        law = part.torque - (row.target - row.design @ fit.values)
        far += float(np.abs(part.measured - law).sum())
        squares += float(((part.measured - law) ** 2).sum())
        size += float(np.abs(part.measured).sum())
    error = far / size if size > 0.0 else math.nan
    n_samples = sum(trial.pre_catch.measured.size for trial in trials)
    step = Step(
        name="slow trials: b, k of (1)",
        estimates=fitted(names, fit, level),
        residual_sd=math.sqrt(squares / n_samples),
    )
    return step, error


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
    torque = above
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


def fit_catch_travel(catches: Sequence[Catch], *, level: float) -> Step:
    """Average the angle travelled during the catch, ΔT_c·v̄_c of (4): D.

    Parameters
    ----------
    catches : sequence of Catch
        Catches; those that did not end within their stretch say nothing of D.
    level : float
        Level of the intervals.

    Returns
    -------
    Step
        D.
    """
    rows = [
        Rows(design=np.ones((1, 1)), target=np.array([catch.travel]))
        for catch in catches
        if catch.end is not None
    ]
    longest = max((catch.travel for catch in catches), default=0.0)
    reason = "no catch ends within its stretch"
    if catches:
        reason += f"; D is more than {math.degrees(longest):.4g} deg"
    return _one(
        "catch travel: D of (4)", "catch_travel", rows, level, {"catch_travel": reason}
    )


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
