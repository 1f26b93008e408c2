"""From recordings to a joint: what is fitted, what is read, what is used of it.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section II.
"""

import math
import warnings
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from masrel.errors import (
    RecordingError,
    RecordingWarning,
    SmallSampleWarning,
)
from masrel.lab.elbow.identification._catches import (
    Trial,
    slow_trial,
)
from masrel.lab.elbow.identification._drifts import own_drifts
from masrel.lab.elbow.identification._fit_options import FitOptions, Term, check_options
from masrel.lab.elbow.identification._joint_fit import (
    JointFit,
    joint_fit,
)
from masrel.lab.elbow.identification._lack_of_fit import LEVEL, p_text
from masrel.lab.elbow.identification._quantities import (
    ALL_QUANTITIES,
    ARM_QUANTITIES,
    QUANTITIES,
)
from masrel.lab.elbow.identification._reading import (
    Movement,
    TorqueSource,
    even_samples,
    read_movement,
)
from masrel.lab.elbow.identification._results import (
    UNDETERMINED,
    ElbowFit,
    FittedParameter,
    Step,
    fitted,
)
from masrel.lab.elbow.identification._rounds import (
    ALWAYS,
    Round,
    fit_in_rounds,
    locals_of,
    untimed,
)
from masrel.lab.elbow.identification._steps import (
    SlowFit,
    fit_slow,
)
from masrel.lab.elbow.identification._stretches import (
    Stretch,
    check_velocity,
    find_stretches,
)
from masrel.lab.elbow.parameters import STANDARD_MODELS, ElbowParameters

_Floats = NDArray[np.float64]

_WINDOW = 0.06  # of the filter of speeds, s: 20.5 Hz at 1 kHz
# Two slow trials say little of how they differ, but not nothing of b.
_MIN_DF = 4.0
# So many times its error may each be below 0: a joint may have no inertia at all.
_MAX_BELOW_0 = {"damping": 1.0, "stiffness": 1.0, "inertia": 2.0, "arm_inertia": 2.0}


def fit(
    recordings: Sequence[Movement | Path | str],
    *,
    constants: ElbowParameters | None = None,
    inertia: Literal["zero", "fitted"] = "zero",
    gravity: Term = "off",
    gravity_angle: float = 0.0,
    arm_inertia: Term = "off",
    offset: Term = "fitted",
    drift: Term = "off",
    lag: Term = "off",
    rise: Term = "off",
    slow_below: float | None = None,
    window: float = _WINDOW,
    level: float = 0.95,
) -> ElbowFit:
    """Identify the joint that made these recordings.

    Parameters
    ----------
    recordings : sequence of Movement or path
        Slow and fast stretches, one or more a recording.
    constants : ElbowParameters, optional
        What is not fitted: ν_th, ν_L, θ_L, ΔT_peak, the end of range and the reading
        of (5). Those of Table III by default; its other values are not used.
    inertia : {"zero", "fitted"}, optional
        Whether m of (1) is fitted, which the law has not in the catch. The paper has 0.
    gravity : float or {"off", "fitted"}, optional
        Weight of the arm, m·g·l, N·m: it adds m·g·l·sin(θ - `gravity_angle`).
    gravity_angle : float, optional
        Angle at which the weight has no torque, rad: the forearm hangs or stands there.
    arm_inertia : float or {"off", "fitted"}, optional
        Inertia of the arm, kg·m², which acts in every phase.
    offset : float or {"off", "fitted"}, optional
        Constant torque of a trial above k·(θ - θ_rest), N·m: the sensor's zero. Fitted
        for each trial by default. Fixed or off, the torque is that of a joint at rest
        where its stretch starts, so that b can be told from speeds that differ between
        trials.
    drift : float or {"off", "fitted"}, optional
        What the offset gains in a second, N·m/s; fitted for each trial.
    lag : float or {"off", "fitted"}, optional
        Time constant of a torque sensor of first order, s.
    rise : float or {"off", "fitted"}, optional
        How long the torque of a catch takes to its peak, s: `catch_rise`.
    slow_below : float, optional
        A stretch whose speed stays below is slow, rad/s; ν_th by default, below which
        nothing can catch.
    window : float, optional
        Length of the window of the filter that gives speed and acceleration, s; of 7
        samples at least.
    level : float, optional
        Level of the confidence intervals.

    Returns
    -------
    ElbowFit
        Every parameter with its interval, clustered by trial; the steps before; whether
        the law fits; what these trials do not determine, and why.

    Raises
    ------
    ParameterError
        If an option is outside its range.
    RecordingError
        If a recording is not usable, they are presentations of several models, there
        is no slow stretch, the slow stretches do
        not tell b from k, or what comes out cannot be the law: b or k below 0, or
        Q of 1 or more, by more than their error; m or J by more than twice theirs.

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
    options = FitOptions(
        constants=held,
        terms={
            "gravity": gravity,
            "arm_inertia": arm_inertia,
            "offset": offset,
            "drift": drift,
            "lag": lag,
            "catch_rise": rise,
        },
        gravity_angle=gravity_angle,
        with_inertia=inertia == "fitted",
        slow_below=held.speed_threshold if slow_below is None else slow_below,
        window=window,
        level=level,
    )
    check_options(options, inertia)
    movements = [
        entry if isinstance(entry, Movement) else read_movement(Path(entry))
        for entry in recordings
    ]
    _check_models(movements)
    stretches, rest_sd = _stretches(movements, options)
    slow = _slow_trials(stretches, options.slow_below)
    result = _identified(_Material(movements, stretches, slow, rest_sd), options)
    _warn_of_lone(result)
    return result


@dataclass(frozen=True, slots=True)
class _Material:
    movements: Sequence[Movement]
    stretches: Mapping[str, Stretch]
    slow: Sequence[Trial]
    rest_sd: float


def _stretches(
    movements: Sequence[Movement], options: FitOptions
) -> tuple[dict[str, Stretch], float]:
    named: dict[str, Stretch] = {}
    noise = []
    for movement in movements:
        samples = even_samples(movement)
        check_velocity(movement, samples, options.window)
        here, rest_sd = find_stretches(
            samples, window=options.window, slow_below=options.slow_below
        )
        noise += [] if math.isnan(rest_sd) else [rest_sd]
        if not here:
            _warn(f"{movement.name}: no extension of 15 degrees or more; not used")
        for number, stretch in enumerate(here, start=1):
            name = movement.name if len(here) == 1 else f"{movement.name} #{number}"
            if name in named:
                raise RecordingError(f"{name}: the recording is there twice")
            named[name] = stretch
    if not named:
        raise RecordingError(
            "recordings: none has an extension of 15 degrees or more; the angle must "
            "grow with extension"
        )
    return named, float(np.median(noise)) if noise else math.nan


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
        f"{math.degrees(slowest):.3g} deg/s. --slow-below raises the limit"
    )


def _identified(
    material: _Material,
    options: FitOptions,
    reasons: Mapping[str, str] | None = None,
) -> ElbowFit:
    arm = options.arm()
    to_fit = (*options.fitted, *(["inertia"] if options.with_inertia else []))
    slow = fit_slow(
        material.slow,
        to_fit,
        arm,
        offset=options.offset,
        rest_angle=options.constants.rest_angle,
        level=options.level,
    )
    _check_slow(slow, material.stretches, options)
    made = fit_in_rounds(material.stretches, slow, arm, options)
    none = untimed(made)
    if none and not reasons:
        terms: dict[str, Term] = dict(options.terms)
        terms.update(dict.fromkeys(none, 0.0))
        return _identified(material, replace(options, terms=terms), none)
    _warn_of_parts([*slow.trials, *made.fast])
    return _result(material, slow, made, options, reasons or {})


def _check_slow(
    slow: SlowFit, stretches: Mapping[str, Stretch], options: FitOptions
) -> None:
    # b and k are told by their error: what it does to the torque of these stretches
    torque = [float(np.ptp(t.pre_catch.torque)) for t in slow.trials]
    speed = max(stretch.peak_speed for stretch in stretches.values())
    travel = max(float(np.ptp(stretch.angle)) for stretch in stretches.values())
    for name, size in (("damping", speed), ("stiffness", travel)):
        estimate = slow.step[name]
        df = estimate.df if estimate.df > _MIN_DF else _MIN_DF
        half = float(stdtrit(df, 0.5 + 0.5 * options.level)) * slow.errors[name]
        # an error that matters: of the value, and of the torque at the largest speed
        unsure = 2.0 * half > abs(estimate.value) and 2.0 * half * size > max(torque)
        if math.isnan(estimate.value) or unsure:
            raise RecordingError(_untold(name, estimate.value, slow, options))
        symbol = QUANTITIES[name].symbol
        if estimate.high < 0.0:
            raise RecordingError(
                f"recordings: this is not the law: {symbol} is {estimate.value:.4g}, "
                f"below 0 by more than its error (to {estimate.high:.4g}); torque must "
                "resist extension, and the angle grow with it: are both signs right?"
            )
        if estimate.value < 0.0:
            _warn(
                f"{symbol} is negative ({estimate.value:.4g}): torque must resist "
                "extension, and the angle grow with it; are both signs right?"
            )


def _untold(name: str, value: float, slow: SlowFit, options: FitOptions) -> str:
    symbol, error = QUANTITIES[name].symbol, slow.errors[name]
    if not math.isnan(error):
        symbol += f" ({value:.3g}, standard error {error:.2g})"
    parts = [trial.pre_catch for trial in slow.trials]
    drifts = own_drifts(parts, options.gravity_angle)
    if "drift" not in options.fitted and drifts and drifts.p_value < LEVEL:
        return (
            f"recordings: the slow stretches do not tell {symbol}: each drifts in "
            f"its own way (p {p_text(drifts.p_value)}); try --drift fitted"
        )
    remedy = "they need a speed that varies within a stretch"
    if options.offset is None:
        remedy += (
            ", or, at constant speeds that differ between stretches, a sensor whose "
            "zero is known (--offset)"
        )
    return (
        f"recordings: the slow stretches do not tell {symbol} from a constant "
        f"torque; {remedy}"
    )


def _result(
    material: _Material,
    slow: SlowFit,
    made: Round,
    options: FitOptions,
    no_time: Mapping[str, str],
) -> ElbowFit:
    joint, steps = (
        joint_fit(made.equations, made.solution, material.rest_sd),
        made.steps,
    )
    reasons = {**_reasons(steps, made.fast, options), **no_time}
    estimates = _all_estimates(joint, made, reasons, options)
    _check_ratio(estimates)
    local = locals_of(made)
    return ElbowFit(
        estimates=estimates,
        correlation=_correlation(joint, estimates),
        steps=tuple(steps),
        relative_error=slow.relative_error,
        torque_sd=joint.torque_sd,
        lack_of_fit=joint.lack_of_fit,
        cross_validation=joint.cross_validation,
        trials=tuple(made.trials),
        fitted_torque=joint.fitted_torque,
        constants=options.constants,
        arm=dict(options.terms) | {"gravity_angle": options.gravity_angle},
        offsets=tuple(each.get("offset", options.offset or 0.0) for each in local),
        drifts=tuple(each.get("drift", options.arm().drift) for each in local),
        n_evaluations=joint.n_evaluations,
        level=options.level,
        simulated=any(movement.simulated for movement in material.movements),
        sources={m.name: m.sha256 for m in material.movements},
        remarks=_torque_remarks(material.movements) + _remarks(estimates, made),
    )


def _check_ratio(estimates: Sequence[FittedParameter]) -> None:
    for estimate in estimates:
        if estimate.name == "residual_ratio" and estimate.low >= 1.0:
            raise RecordingError(
                f"recordings: this is not the law: Q is {estimate.value:.3g}, 1 or "
                f"more beyond its error (from {estimate.low:.3g}): the torque does not "
                "fall from a peak to a residual"
            )
        most = _MAX_BELOW_0.get(estimate.name, math.inf)
        if estimate.value + most * (estimate.high - estimate.value) < 0.0:
            symbol = ALL_QUANTITIES[estimate.name].symbol
            raise RecordingError(
                f"recordings: this is not the law: {symbol} of all trials is "
                f"{estimate.value:.4g}, below 0 by more than its error (to "
                f"{estimate.high:.4g}); are the signs of torque and angle right?"
            )


def _reasons(
    steps: Sequence[Step], fast: Sequence[Trial], options: FitOptions
) -> dict[str, str]:
    # why the steps do not determine what they do not
    if all(trial.catch is None for trial in fast):
        why = "there are only slow stretches, in which nothing catches"
        if fast:
            why = "no fast stretch has a catch that can be used"
        names = [name for name in QUANTITIES if name not in ALWAYS]
        names += [name for name in options.fitted if name in ("lag", "catch_rise")]
        return dict.fromkeys(names, why)
    return {
        estimate.name: estimate.reason
        for step in steps
        for estimate in step.estimates
        if estimate.reason is not None
    }


def _all_estimates(
    joint: JointFit, made: Round, reasons: Mapping[str, str], options: FitOptions
) -> tuple[FittedParameter, ...]:
    # Where travels are censored, D is that of its step. Least squares hold the spread
    # of travels and know less than they say; and they draw each end towards D, by
    # which that spread would come out too small.
    level = options.level
    by_name = {e.name: e for e in fitted(joint.names, joint.fit, level, reasons)}
    if any(each is not None for each in made.limits):
        whole = {e.name: e for step in made.steps for e in step.estimates}
        by_name["catch_travel"] = whole["catch_travel"]
    optional = {"inertia", *ARM_QUANTITIES} - set(options.fitted) - set(reasons)
    return tuple(
        by_name[name]
        if name in by_name
        else FittedParameter(
            name=name, level=level, reason=reasons.get(name, UNDETERMINED)
        )
        for name in ALL_QUANTITIES
        if name in by_name or name not in optional
    )


def _correlation(joint: JointFit, estimates: Sequence[FittedParameter]) -> _Floats:
    places = [
        joint.names.index(e.name) if e.name in joint.names else -1 for e in estimates
    ]
    sd = np.sqrt(np.diag(joint.fit.covariance))
    whole = np.full((len(sd) + 1, len(sd) + 1), np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        whole[:-1, :-1] = joint.fit.covariance / np.outer(sd, sd)
    return whole[np.ix_(places, places)]


def _check_models(movements: Sequence[Movement]) -> None:
    models = sorted({m.model for m in movements if m.model is not None})
    if len(models) > 1:
        raise RecordingError(
            "recordings: a fit needs presentations of one model, which the .json "
            f"beside each recording names; got some of {', '.join(models)}"
        )


def _torque_remarks(movements: Sequence[Movement]) -> tuple[str, ...]:
    # which torque it is, of recordings of masrel's driver
    texts: dict[TorqueSource, str] = {
        "sensor": "measured by the device's sensor: what friction compensation leaves "
        "of the device is in it",
        "model": "what the joint model asked for, not measured",
    }
    n_from = Counter(movement.torque_source for movement in movements)
    return tuple(
        f"Torque of {n_from[source]} of {len(movements)} recordings: {text}"
        for source, text in texts.items()
        if n_from[source]
    )


def _remarks(estimates: Sequence[FittedParameter], made: Round) -> tuple[str, ...]:
    remarks = [
        f"{ALL_QUANTITIES[e.name].symbol}: {e.reason}"
        for e in estimates
        if e.reason is not None
    ]
    catches = [trial.catch for trial in made.trials if trial.catch is not None]
    unended = sum(catch.end is None for catch in catches)
    if 0 < unended < len(catches):
        behind = sum(each is not None for each in made.limits)
        remarks += _unended(unended, behind, len(catches))
    unused = sum(trial.catch is None for trial in made.fast)
    if unused:
        remarks.append(f"{unused} of {len(made.fast)} fast stretches are not used")
    return tuple(remarks)


def _unended(unended: int, behind: int, n_catches: int) -> list[str]:
    remarks = []
    if behind:
        remarks.append(
            f"{behind} of {n_catches} catches do not end within their stretch: D "
            "counts each as longer than what could be seen of it (censored), and "
            "takes travels to be normal"
        )
    if behind < unended:
        remarks.append(
            f"{unended - behind} of {n_catches} catches do not end within their "
            "stretch and say nothing of D: if D differs between trials, those with a "
            "short one are left, and D is underestimated"
        )
    return remarks


def _warn_of_parts(trials: Sequence[Trial]) -> None:
    for trial in trials:
        if trial.remark:
            _warn(f"{trial.name}: {trial.remark}")


def _warn_of_lone(result: ElbowFit) -> None:
    lone = [
        ALL_QUANTITIES[estimate.name].symbol
        for estimate in result.estimates
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
