"""From recordings to a joint: the paper's steps, then all parameters together.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section II.
"""

import math
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.catch_line import fit_catch_line, on_the_line
from masrel.elbow.identification.equations import Spreads
from masrel.elbow.identification.movement import Movement
from masrel.elbow.identification.reading import read_movement
from masrel.elbow.identification.results import (
    QUANTITIES,
    ElbowFit,
    FittedParameter,
    Step,
    fitted,
)
from masrel.elbow.identification.samples import even_samples
from masrel.elbow.identification.steps import (
    CatchLevels,
    PreCatchLaw,
    catch_levels,
    fit_catch_torque,
    fit_catch_travel,
    fit_post_catch,
    fit_slow,
)
from masrel.elbow.identification.stretches import (
    Stretch,
    check_velocity,
    find_stretches,
)
from masrel.elbow.identification.together import Together, refine
from masrel.elbow.identification.trials import Catch, Trial, fast_trial, slow_trial
from masrel.elbow.parameters import STANDARD_MODELS, ElbowParameters
from masrel.errors import (
    ParameterError,
    RecordingError,
    RecordingWarning,
    SmallSampleWarning,
)

__all__ = ["WINDOW", "fit"]

Floats = NDArray[np.float64]

WINDOW = 0.06
"""Length of the filter's window unless asked otherwise, s: 20.5 Hz at 1 kHz."""


def fit(
    recordings: Sequence[Movement | Path | str],
    *,
    constants: ElbowParameters | None = None,
    inertia: Literal["zero", "fitted"] = "zero",
    slow_below: float | None = None,
    window: float = WINDOW,
    level: float = 0.95,
) -> ElbowFit:
    """Identify the joint that made these recordings.

    Parameters
    ----------
    recordings : sequence of Movement or path
        Slow and fast stretches, one or more a recording.
    constants : ElbowParameters, optional
        What is not fitted: ν_th, ν_L, θ_L, ΔT_peak, the end of range and the reading
        of (5). Those of Table III unless given; its other values are not used.
    inertia : {"zero", "fitted"}, optional
        Whether m of (1) is fitted. The paper has 0.
    slow_below : float, optional
        A stretch whose speed stays below is slow, rad/s; ν_th unless given, below
        which nothing can catch.
    window : float, optional
        Length of the window of the filter that gives speed and acceleration, s.
    level : float, optional
        Level of the confidence intervals.

    Returns
    -------
    ElbowFit
        Every parameter with its interval, clustered by trial; the steps before; what
        these trials do not determine, and why.

    Raises
    ------
    ParameterError
        If `level`, `window` or `slow_below` is outside its range.
    RecordingError
        If a recording is not usable, or there is no slow stretch.

    Warns
    -----
    RecordingWarning
        If a recording or stretch is not used, or b or k comes out negative.
    SmallSampleWarning
        If one trial alone determines a parameter.

    References
    ----------
    .. [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). IEEE TNSRE 20(3), 361-370,
       section II and Figs. 3-5. https://doi.org/10.1109/TNSRE.2012.2195330
    """
    if not 0.5 < level < 1.0:
        raise ParameterError(f"level: needs more than 0.5 and less than 1, got {level}")
    held = STANDARD_MODELS["HM1"] if constants is None else constants
    if held.residual_reading != "residual" or held.catch_rise != 0.0:
        raise ParameterError(
            "constants: a fit reads Q as section II does and a catch as a step; needs "
            'residual_reading "residual" and catch_rise 0, got '
            f"{held.residual_reading!r} and {held.catch_rise:g}"
        )
    limit = held.speed_threshold if slow_below is None else slow_below
    if not 0.0 < limit < math.inf:
        raise ParameterError(f"slow_below: needs more than 0, got {slow_below}")
    if inertia not in ("zero", "fitted"):
        raise ParameterError(f'inertia: needs "zero" or "fitted", got {inertia!r}')
    if inertia == "fitted" and held.post_catch == "additive":
        raise ParameterError(
            'inertia: with post_catch "additive", m is in every phase but the catch, '
            "and where one ends cannot be told from the jump of m·θ̈; needs "
            '"zero", got "fitted"'
        )
    movements = [
        entry if isinstance(entry, Movement) else read_movement(Path(entry))
        for entry in recordings
    ]
    stretches = _stretches(movements, window, limit)
    slow = [
        trial
        for name, stretch in stretches.items()
        if stretch.pace == "slow" and _is_used(trial := slow_trial(stretch, name))
    ]
    if not slow:
        raise RecordingError(_no_slow(stretches, limit))
    first, error = fit_slow(slow, with_inertia=inertia == "fitted", level=level)
    law = _law(first)
    terms = (law.damping, law.stiffness, law.inertia)
    fast = [
        fast_trial(stretch, name, held, terms, window)
        for name, stretch in stretches.items()
        if stretch.pace == "fast"
    ]
    return _together(movements, slow, fast, first, law, error, held, level)


def _is_used(trial: Trial) -> bool:
    if trial.pre_catch.time.size == 0:
        _warn(f"{trial.name}: too short for the filter of slow stretches; not used")
    return trial.pre_catch.time.size > 0


def _stretches(
    movements: Sequence[Movement], window: float, limit: float
) -> dict[str, Stretch]:
    found: dict[str, Stretch] = {}
    for movement in movements:
        samples = even_samples(movement)
        check_velocity(movement, samples, window)
        here = find_stretches(samples, window=window, slow_below=limit)
        if not here:
            _warn(f"{movement.name}: no extension of 15 degrees or more; not used")
        for number, stretch in enumerate(here, start=1):
            name = movement.name if len(here) == 1 else f"{movement.name} #{number}"
            if name in found:
                raise RecordingError(f"{name}: the recording is there twice")
            found[name] = stretch
    if not found:
        raise RecordingError("recordings: none has an extension of 15 degrees or more")
    return found


def _no_slow(stretches: dict[str, Stretch], limit: float) -> str:
    slowest = min(stretch.peak_speed for stretch in stretches.values())
    return (
        "recordings: b and k need a slow stretch, one whose speed stays below "
        f"{math.degrees(limit):g} deg/s; the slowest of {len(stretches)} reaches "
        f"{math.degrees(slowest):.3g} deg/s. A larger limit can be given (slow_below)"
    )


def _law(step: Step) -> PreCatchLaw:
    names = {estimate.name: estimate.value for estimate in step.estimates}
    if any(math.isnan(value) for value in names.values()):
        raise RecordingError(
            "recordings: the slow stretches do not tell b from k; they need a speed "
            "that varies, or trials at different speeds"
        )
    for name in ("damping", "stiffness"):
        if names[name] < 0.0:
            _warn(
                f"{name} is negative ({names[name]:.4g}): torque must resist "
                "extension, and the angle grow with it; are both signs right?"
            )
    return PreCatchLaw(
        damping=names["damping"],
        stiffness=names["stiffness"],
        inertia=names.get("inertia", 0.0),
    )


def _together(
    movements: Sequence[Movement],
    slow: Sequence[Trial],
    fast: Sequence[Trial],
    first: Step,
    law: PreCatchLaw,
    error: float,
    held: ElbowParameters,
    level: float,
) -> ElbowFit:
    trials = [*slow, *(trial for trial in fast if trial.catch is not None)]
    for trial in (*slow, *fast):
        if trial.remark:
            _warn(f"{trial.name}: {trial.remark}")
    catches = [trial.catch for trial in trials if trial.catch is not None]
    read = [catch_levels(trial, law, held) for trial in trials]
    pairs = [
        (trial.catch, levels)
        for trial, levels in zip(trials, read, strict=True)
        if trial.catch is not None and levels is not None
    ]
    steps = [first, *_catch_steps(catches, pairs, held, level)]
    start, reasons = _found_so_far(steps)
    if not catches:
        why = "there are only slow stretches, in which nothing catches"
        if fast:
            why = "no fast stretch has a catch that can be used"
        reasons = {name: why for name in QUANTITIES if name not in _FIRST}
    last = refine(trials, start, held, _spreads(steps), _on_line(trials, held))
    estimates = _estimates(last, reasons, level)
    return ElbowFit(
        estimates=estimates,
        correlation=_correlation(last, estimates),
        steps=tuple(steps),
        relative_error=error,
        torque_sd=last.torque_sd,
        trials=tuple(trials),
        fitted_torque=last.fitted_torque,
        constants=held,
        n_evaluations=last.n_evaluations,
        level=level,
        simulated=any(movement.simulated for movement in movements),
        sources={movement.name: movement.sha256 for movement in movements},
        remarks=_remarks(estimates, catches, fast),
    )


_FIRST = ("damping", "stiffness", "inertia")


def _found_so_far(steps: Sequence[Step]) -> tuple[dict[str, float], dict[str, str]]:
    # what the steps found, nan for what they did not, and why they did not
    values, reasons = dict.fromkeys(QUANTITIES, math.nan), {}
    for step in steps:
        for estimate in step.estimates:
            values[estimate.name] = estimate.value
            if estimate.reason is not None:
                reasons[estimate.name] = estimate.reason
    return values, reasons


def _catch_steps(
    catches: Sequence[Catch],
    pairs: Sequence[tuple[Catch, CatchLevels]],
    held: ElbowParameters,
    level: float,
) -> list[Step]:
    if not catches:
        return []
    levels = [read for _, read in pairs]
    return [
        fit_catch_line(catches, held, level=level),
        *fit_catch_torque([catch for catch, _ in pairs], levels, level=level),
        fit_catch_travel([catch for catch, _ in pairs], level=level),
        fit_post_catch(levels, level=level),
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


def _estimates(
    last: Together, reasons: dict[str, str], level: float
) -> tuple[FittedParameter, ...]:
    found = {e.name: e for e in fitted(last.names, last.fit, level, reasons)}
    made = []
    for name in QUANTITIES:
        if name in found:
            made.append(found[name])
        elif name != "inertia":
            made.append(_undetermined(name, reasons.get(name), level))
    lone = [e.name for e in made if e.reason is not None and not math.isnan(e.value)]
    if lone:
        warnings.warn(
            f"{', '.join(lone)}: one trial alone says nothing of how trials differ; "
            "there is no interval",
            SmallSampleWarning,
            stacklevel=4,
        )
    return tuple(made)


def _undetermined(name: str, reason: str | None, level: float) -> FittedParameter:
    nan = math.nan
    return FittedParameter(
        name=name,
        value=nan,
        standard_error=nan,
        freedom=nan,
        low=nan,
        high=nan,
        level=level,
        n_trials=0,
        reason=reason or "these trials do not determine it",
    )


def _correlation(last: Together, estimates: Sequence[FittedParameter]) -> Floats:
    places = [
        last.names.index(e.name) if e.name in last.names else -1 for e in estimates
    ]
    sd = np.sqrt(np.diag(last.fit.covariance))
    whole = np.full((len(sd) + 1, len(sd) + 1), np.nan)
    with np.errstate(invalid="ignore"):
        whole[:-1, :-1] = last.fit.covariance / np.outer(sd, sd)
    return whole[np.ix_(places, places)]


def _remarks(
    estimates: Sequence[FittedParameter],
    catches: Sequence[Catch],
    fast: Sequence[Trial],
) -> tuple[str, ...]:
    said = []
    for e in estimates:
        if e.reason is not None:
            said.append(f"{QUANTITIES[e.name].symbol}: {e.reason}")
    unended = sum(catch.end is None for catch in catches)
    if 0 < unended < len(catches):
        said.append(
            f"{unended} of {len(catches)} catches do not end within their stretch and "
            "say nothing of D: if D differs between trials, those with a short one "
            "are left, and D is underestimated"
        )
    unused = sum(trial.catch is None for trial in fast)
    if unused:
        said.append(f"{unused} of {len(fast)} fast stretches are not used")
    return tuple(said)


def _warn(message: str) -> None:
    warnings.warn(message, RecordingWarning, stacklevel=4)
