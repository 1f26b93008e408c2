"""From recordings to a joint: what is asked, what is read, what is used of it.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section II.
"""

import math
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

from masrel.elbow.identification.joint import fit_joint
from masrel.elbow.identification.law import PreCatchLaw
from masrel.elbow.identification.movement import Movement
from masrel.elbow.identification.reading import read_movement
from masrel.elbow.identification.results import ElbowFit
from masrel.elbow.identification.samples import even_samples
from masrel.elbow.identification.slow import fit_slow
from masrel.elbow.identification.stretches import (
    Stretch,
    check_velocity,
    find_stretches,
)
from masrel.elbow.identification.trials import Trial, fast_trial, slow_trial
from masrel.elbow.parameters import STANDARD_MODELS, ElbowParameters
from masrel.errors import (
    ParameterError,
    RecordingError,
    RecordingWarning,
    SmallSampleWarning,
)

__all__ = ["WINDOW", "fit"]

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
        If no more trials determine a parameter than it takes.

    References
    ----------
    .. [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). IEEE TNSRE 20(3), 361-370,
       section II and Figs. 3-5. https://doi.org/10.1109/TNSRE.2012.2195330
    """
    held = STANDARD_MODELS["HM1"] if constants is None else constants
    limit = held.speed_threshold if slow_below is None else slow_below
    _check_options(held, inertia, limit, level)
    movements = [
        entry if isinstance(entry, Movement) else read_movement(Path(entry))
        for entry in recordings
    ]
    stretches = _stretches(movements, window, limit)
    slow = fit_slow(
        _slow_trials(stretches, limit), with_inertia=inertia == "fitted", level=level
    )
    _check_law(slow.law)
    fast = [
        fast_trial(stretch, name, held, slow.law, window)
        for name, stretch in stretches.items()
        if stretch.pace == "fast"
    ]
    _warn_of_parts([*slow.trials, *fast])
    found = fit_joint(movements, slow, fast, held, level)
    _warn_of_lone(found)
    return found


def _check_options(
    held: ElbowParameters, inertia: str, slow_below: float, level: float
) -> None:
    if not 0.5 < level < 1.0:
        raise ParameterError(f"level: needs more than 0.5 and less than 1, got {level}")
    if held.residual_reading != "residual" or held.catch_rise != 0.0:
        raise ParameterError(
            "constants: a fit reads Q as section II does and a catch as a step; needs "
            'residual_reading "residual" and catch_rise 0, got '
            f"{held.residual_reading!r} and {held.catch_rise:g}"
        )
    if not 0.0 < slow_below < math.inf:
        raise ParameterError(f"slow_below: needs more than 0, got {slow_below}")
    if inertia not in ("zero", "fitted"):
        raise ParameterError(f'inertia: needs "zero" or "fitted", got {inertia!r}')
    if inertia == "fitted" and held.post_catch == "additive":
        raise ParameterError(
            'inertia: with post_catch "additive", m is in every phase but the catch, '
            "and where one ends cannot be told from the jump of m·θ̈; needs "
            '"zero", got "fitted"'
        )


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


def _slow_trials(stretches: Mapping[str, Stretch], limit: float) -> list[Trial]:
    used = []
    for name, stretch in stretches.items():
        if stretch.pace == "slow":
            trial = slow_trial(stretch, name)
            if trial.pre_catch.time.size:
                used.append(trial)
            else:
                why = trial.remark or "too short for the filter of slow stretches"
                _warn(f"{name}: {why}; not used")
    if not used:
        raise RecordingError(_no_slow(stretches, limit))
    return used


def _no_slow(stretches: Mapping[str, Stretch], limit: float) -> str:
    n_slow = sum(stretch.pace == "slow" for stretch in stretches.values())
    if n_slow:
        return f"recordings: b and k need a slow stretch; none of {n_slow} can be used"
    slowest = min(stretch.peak_speed for stretch in stretches.values())
    return (
        "recordings: b and k need a slow stretch, one whose speed stays below "
        f"{math.degrees(limit):g} deg/s; the slowest of {len(stretches)} reaches "
        f"{math.degrees(slowest):.3g} deg/s. A larger limit can be given (slow_below)"
    )


def _check_law(law: PreCatchLaw) -> None:
    values = {"damping": law.damping, "stiffness": law.stiffness}
    if any(math.isnan(value) for value in (*values.values(), law.inertia)):
        raise RecordingError(
            "recordings: the slow stretches do not tell b, k and a constant torque "
            "apart; they need a speed that varies within a stretch"
        )
    for name, value in values.items():
        if value < 0.0:
            _warn(
                f"{name} is negative ({value:.4g}): torque must resist extension, and "
                "the angle grow with it; are both signs right?"
            )


def _warn_of_parts(trials: Sequence[Trial]) -> None:
    for trial in trials:
        if trial.remark:
            _warn(f"{trial.name}: {trial.remark}")


def _warn_of_lone(found: ElbowFit) -> None:
    lone = [
        estimate.name
        for estimate in found.estimates
        if estimate.reason is not None and not math.isnan(estimate.value)
    ]
    if lone:
        warnings.warn(
            f"{', '.join(lone)}: too few trials to say how trials differ; there is no "
            "interval",
            SmallSampleWarning,
            stacklevel=3,
        )


def _warn(message: str) -> None:
    # called by what `fit` calls: the warning points to who called that
    warnings.warn(message, RecordingWarning, stacklevel=4)
