"""Trials and the fit of them, in turn: each round knows what the one before found.

In: stretches and the fit of the slow ones. Out: the last round.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from masrel.lab.elbow.identification._catches import (
    Arm,
    Catch,
    CatchLevels,
    PreCatchLaw,
    Trial,
    catch_levels,
    fast_trial,
)
from masrel.lab.elbow.identification._equations import Equations, Known, Spreads
from masrel.lab.elbow.identification._fit_options import STARTS, FitOptions
from masrel.lab.elbow.identification._joint_fit import Solution, fit_together
from masrel.lab.elbow.identification._quantities import ARM_QUANTITIES, QUANTITIES
from masrel.lab.elbow.identification._results import Step
from masrel.lab.elbow.identification._steps import (
    SlowFit,
    can_be_censored,
    fit_catch_line,
    fit_catch_torque,
    fit_catch_travel,
    fit_post_catch,
    on_the_line,
)
from masrel.lab.elbow.identification._stretches import Stretch
from masrel.lab.elbow.identification._travels import DetectionLimit, detection_limit
from masrel.lab.elbow.parameters import ElbowParameters

ALWAYS = ("damping", "stiffness", "inertia")
"""What slow trials tell."""

# Of catches and fit, where what an arm has moves the catches, or makes them last.
_ROUNDS, _TIMED_ROUNDS = 2, 8

# Of a lag and a rise, in periods of samples: none is found that is shorter.
_FLOORS = {"lag": 0.2, "catch_rise": 3.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """Trials, what was read off them, steps, and the fit of all together."""

    fast: Sequence[Trial]
    trials: list[Trial]  # slow and fast ones that are used
    arm: Arm
    limits: list[DetectionLimit | None]
    steps: list[Step]
    equations: list[Equations]
    solution: Solution


def fit_in_rounds(
    stretches: Mapping[str, Stretch], slow: SlowFit, arm: Arm, options: FitOptions
) -> Round:
    """Fit trials in rounds: what an arm has moves catches, and catches tell that."""
    law, arm = slow.law, replace(arm, gravity=slow.gravity)
    tries = [
        _round(stretches, slow, law, each, options) for each in _starts(options, arm)
    ]
    made = min(tries, key=lambda each: each.solution.typical)
    n_rounds = _ROUNDS if set(options.fitted) - {"offset"} else 1
    for _ in range((_TIMED_ROUNDS if made.arm.takes_time else n_rounds) - 1):
        law, arm = _next(law, made)
        instants = _instants(made)
        settled = instants and _is_settled(made)
        made = _round(stretches, slow, law, arm, options, instants)
        if settled:
            break
    return made


def _starts(options: FitOptions, arm: Arm) -> list[Arm]:
    # the sum of squares has a valley for each of several lags and rises
    timed = [name for name in STARTS if name in options.fitted]
    starts: list[dict[str, Any]] = [
        dict(zip(timed, each, strict=True))
        for each in product(*(STARTS[name] for name in timed))
    ]
    return [replace(arm, **each) for each in starts]


def _round(
    stretches: Mapping[str, Stretch],
    slow: SlowFit,
    law: PreCatchLaw,
    arm: Arm,
    options: FitOptions,
    instants: Mapping[str, float] | None = None,
) -> Round:
    fast = [
        fast_trial(
            stretch,
            name,
            options.constants,
            law,
            options.window,
            arm,
            (instants or {}).get(name),
        )
        for name, stretch in stretches.items()
        if stretch.pace == "fast"
    ]
    return _fit_trials(slow, fast, arm, options)


def _is_settled(made: Round) -> bool:
    # no catch moves by more than a sample
    period = _floor("catch_rise", made.equations) / _FLOORS["catch_rise"]
    return all(abs(local.get("shift", 0.0)) < period for local in locals_of(made))


def untimed(made: Round) -> dict[str, str]:
    """Return why a lag or a rise is not fitted: samples do not tell it from none."""
    names = made.equations[0].known.names
    values = dict(zip(names, made.solution.shared.tolist(), strict=True))
    floors = {n: _floor(n, made.equations) for n in STARTS if n in values}
    return {
        name: f"shorter than {1000.0 * floor:.2g} ms, which these samples do not tell "
        "from nothing: taken as 0"
        for name, floor in floors.items()
        if values[name] <= 1.001 * floor
    }


def _fit_trials(
    slow: SlowFit,
    fast: Sequence[Trial],
    arm: Arm,
    options: FitOptions,
) -> Round:
    constants, level = options.constants, options.level
    trials = [*slow.trials, *(trial for trial in fast if trial.catch is not None)]
    read = [catch_levels(trial, slow.law, constants, arm) for trial in trials]
    post = fit_post_catch([each for each in read if each is not None], level=level)
    stiffness = post["post_catch_stiffness"].value
    limits = _limits(trials, read, slow, stiffness, options)
    steps = [slow.step]
    if len(trials) > len(slow.trials):
        steps += [*_catch_steps(trials, read, limits, constants, level), post]
    start = _start(steps, options, arm)
    names = tuple(name for name, value in start.items() if not math.isnan(value))
    lines = _on_line(trials, constants)
    equations = [
        Equations(
            trial,
            Known(
                names=names,
                constants=constants,
                spreads=_spreads(steps),
                arm=arm,
                offset=options.offset,
                drifts="drift" in options.fitted,
                on_line=on_line,
                limit=limit,
            ),
        )
        for trial, on_line, limit in zip(trials, lines, limits, strict=True)
    ]
    floors = {name: _floor(name, equations) for name in STARTS if name in start}
    return Round(
        fast=fast,
        trials=trials,
        arm=arm,
        limits=limits,
        steps=steps,
        equations=equations,
        solution=fit_together(equations, start, floors),
    )


def _floor(name: str, equations: Sequence[Equations]) -> float:
    return _FLOORS[name] * float(np.median(np.diff(equations[0].time)))


def _start(steps: Sequence[Step], options: FitOptions, arm: Arm) -> dict[str, float]:
    start = dict.fromkeys(QUANTITIES, math.nan)
    start |= {e.name: e.value for step in steps for e in step.estimates}
    has_catch = not math.isnan(start["catch_torque_constant"])
    for name in ARM_QUANTITIES:
        needs_catch = name in ("lag", "catch_rise")
        if name in options.fitted and (has_catch or not needs_catch):
            start[name] = float(getattr(arm, name))
    return start


def locals_of(made: Round) -> list[dict[str, float]]:
    """Return each trial's own parameters by name."""
    return [
        dict(zip(e.local, values.tolist(), strict=True))
        for e, values in zip(made.equations, made.solution.local, strict=True)
    ]


def _next(law: PreCatchLaw, made: Round) -> tuple[PreCatchLaw, Arm]:
    # what the fit says of the law before a catch, and of the arm
    names = made.equations[0].known.names
    values = dict(zip(names, made.solution.shared.tolist(), strict=True))
    drifts = {
        trial.name: local["drift"]
        for trial, local in zip(made.trials, locals_of(made), strict=True)
        if "drift" in local
    }
    of_arm: dict[str, Any] = {n: values[n] for n in ARM_QUANTITIES if n in values}
    of_law = {n: values[n] for n in ALWAYS if n in values}
    return replace(law, **of_law), replace(made.arm, **of_arm, drifts=drifts)


def _instants(made: Round) -> dict[str, float]:
    # where the fit has each catch begin
    return {
        trial.name: trial.catch.time + local["shift"]
        for trial, local in zip(made.trials, locals_of(made), strict=True)
        if trial.catch is not None and "shift" in local
    }


def _limits(
    trials: Sequence[Trial],
    read: Sequence[CatchLevels | None],
    slow: SlowFit,
    stiffness: float,
    options: FitOptions,
) -> list[DetectionLimit | None]:
    # Of catches that do not end, if those that do tell how much travels differ. With
    # m, or where the pre-catch law goes on after a catch, the torque may climb or not
    # whatever k_post is: what could have been seen is not one angle.
    used = [trial.catch for trial, levels in zip(trials, read, strict=True) if levels]
    seen = [c.travel for c in used if c is not None and c.end is not None]
    climbs_alone = options.constants.post_catch == "continuous"
    climbs_alone &= slow.law.inertia == 0.0
    if not climbs_alone or not can_be_censored(seen):
        return [None] * len(trials)
    return [
        detection_limit(trial, stiffness, options.constants)
        if levels is not None and trial.catch is not None and trial.catch.end is None
        else None
        for trial, levels in zip(trials, read, strict=True)
    ]


def _catch_steps(
    trials: Sequence[Trial],
    read: Sequence[CatchLevels | None],
    limits: Sequence[DetectionLimit | None],
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
    behind = [each for each in limits if each is not None]
    return [
        fit_catch_line(catches, constants, level=level),
        *fit_catch_torque(used, levels, level=level),
        fit_catch_travel(used, behind, level=level),
    ]


def _spreads(steps: Sequence[Step]) -> Spreads:
    def size_of(name: str) -> float:
        for step in steps:
            if any(estimate.name == name for estimate in step.estimates):
                # of one trial, or of none that differ, any size serves
                return step.residual_sd if step.residual_sd > 0.0 else 1.0
        return 1.0

    return Spreads(
        torque=size_of("damping"),
        peak=size_of("catch_torque_constant"),
        residual=size_of("residual_ratio"),
        catch_angle=size_of("catch_slope"),
        travel=size_of("catch_travel"),
    )


def _on_line(trials: Sequence[Trial], held: ElbowParameters) -> list[bool]:
    catches = [trial.catch for trial in trials if trial.catch is not None]
    lies = iter(on_the_line(catches, held).tolist() if catches else [])
    return [trial.catch is not None and next(lies) for trial in trials]
