"""From slow and fast trials to a joint: step after step, then everything together.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section II.
"""

import math
from collections.abc import Sequence

from masrel.elbow.identification.catch import Catch
from masrel.elbow.identification.catch_line import fit_catch_line, on_the_line
from masrel.elbow.identification.conclusions import (
    all_estimates,
    correlation,
    remarks,
    unfound,
)
from masrel.elbow.identification.horizon import Horizon, horizon
from masrel.elbow.identification.levels import CatchLevels, catch_levels
from masrel.elbow.identification.movement import Movement
from masrel.elbow.identification.quantities import QUANTITIES
from masrel.elbow.identification.results import ElbowFit, Step
from masrel.elbow.identification.scatter import Spreads
from masrel.elbow.identification.slow import SlowFit
from masrel.elbow.identification.steps import (
    can_be_censored,
    fit_catch_torque,
    fit_catch_travel,
    fit_post_catch,
)
from masrel.elbow.identification.together import refine
from masrel.elbow.identification.trials import Trial
from masrel.elbow.parameters import ElbowParameters

__all__ = ["fit_joint"]


def fit_joint(
    movements: Sequence[Movement],
    slow: SlowFit,
    fast: Sequence[Trial],
    constants: ElbowParameters,
    level: float,
) -> ElbowFit:
    """Fit what is left to fit when b and k are known, and then all at once.

    Parameters
    ----------
    movements : sequence of Movement
        Where the trials are from.
    slow : SlowFit
        Step 1.
    fast : sequence of Trial
        Fast trials, with their catches or without.
    constants : ElbowParameters
        What is held.
    level : float
        Level of the intervals.

    Returns
    -------
    ElbowFit
        The joint.
    """
    trials = [*slow.trials, *(trial for trial in fast if trial.catch is not None)]
    catches = [trial.catch for trial in trials if trial.catch is not None]
    read = [catch_levels(trial, slow.law, constants) for trial in trials]
    post = fit_post_catch([each for each in read if each is not None], level=level)
    stiffness = post["post_catch_stiffness"].value
    horizons = _horizons(trials, read, slow, stiffness, constants)
    steps = [slow.step]
    if catches:
        steps += _catch_steps(trials, read, horizons, constants, level)
        steps.append(post)
    start = dict.fromkeys(QUANTITIES, math.nan)
    start |= {e.name: e.value for step in steps for e in step.estimates}
    on_line = _on_line(trials, constants)
    last = refine(trials, start, constants, _spreads(steps), on_line, horizons)
    estimates = all_estimates(last, steps, horizons, unfound(steps, fast), level)
    return ElbowFit(
        estimates=estimates,
        correlation=correlation(last, estimates),
        steps=tuple(steps),
        relative_error=slow.relative_error,
        torque_sd=last.torque_sd,
        trials=tuple(trials),
        fitted_torque=last.fitted_torque,
        constants=constants,
        n_evaluations=last.n_evaluations,
        level=level,
        simulated=any(movement.simulated for movement in movements),
        sources={movement.name: movement.sha256 for movement in movements},
        remarks=remarks(estimates, catches, horizons, fast),
    )


def _horizons(
    trials: Sequence[Trial],
    read: Sequence[CatchLevels | None],
    slow: SlowFit,
    stiffness: float,
    constants: ElbowParameters,
) -> list[Horizon | None]:
    # Of catches that do not end, if those that do tell how much travels differ. With
    # m, or where the pre-catch law goes on after a catch, the torque may climb or not
    # whatever k_post is: what could have been seen is not one angle.
    used = [trial.catch for trial, levels in zip(trials, read, strict=True) if levels]
    seen = [c.travel for c in used if c is not None and c.end is not None]
    climbs_alone = constants.post_catch == "continuous" and slow.law.inertia == 0.0
    if not climbs_alone or not can_be_censored(seen):
        return [None] * len(trials)
    return [
        horizon(trial, stiffness, constants)
        if levels is not None and trial.catch is not None and trial.catch.end is None
        else None
        for trial, levels in zip(trials, read, strict=True)
    ]


def _catch_steps(
    trials: Sequence[Trial],
    read: Sequence[CatchLevels | None],
    horizons: Sequence[Horizon | None],
    constants: ElbowParameters,
    level: float,
) -> list[Step]:
    catches = [trial.catch for trial in trials if trial.catch is not None]
    pairs: list[tuple[Catch, CatchLevels]] = [
        (trial.catch, levels)
        for trial, levels in zip(trials, read, strict=True)
        if trial.catch is not None and levels is not None
    ]
    used, levels = [catch for catch, _ in pairs], [read for _, read in pairs]
    behind = [each for each in horizons if each is not None]
    return [
        fit_catch_line(catches, constants, level=level),
        *fit_catch_torque(used, levels, level=level),
        fit_catch_travel(used, behind, level=level),
    ]


def _spreads(steps: Sequence[Step]) -> Spreads:
    def spread(name: str) -> float:
        for step in steps:
            if any(estimate.name == name for estimate in step.estimates):
                # of one trial, or of none that differ, any size serves
                return step.residual_sd if step.residual_sd > 0.0 else 1.0
        return 1.0

    return Spreads(
        torque=spread("damping"),
        peak=spread("catch_torque_constant"),
        residual=spread("residual_ratio"),
        catch_angle=spread("catch_slope"),
        travel=spread("catch_travel"),
    )


def _on_line(trials: Sequence[Trial], held: ElbowParameters) -> list[bool]:
    catches = [trial.catch for trial in trials if trial.catch is not None]
    lies = iter(on_the_line(catches, held).tolist() if catches else [])
    return [trial.catch is not None and next(lies) for trial in trials]
