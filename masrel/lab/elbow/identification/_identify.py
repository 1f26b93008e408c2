"""From recordings to a joint: what is read, what is refused, what is remarked.

And which terms of an arm make a fit better: cross-validation over trials.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section II.
"""

import math
import warnings
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.special import stdtrit

from masrel._input import refuse, warn_caller
from masrel.errors import (
    MasrelError,
    MasrelWarning,
    ParameterError,
    RecordingError,
    RecordingWarning,
    SmallSampleWarning,
)
from masrel.lab.elbow._model_file import (
    ALL_QUANTITIES,
    ARM_QUANTITIES,
    QUANTITIES,
)
from masrel.lab.elbow.identification._catches import (
    SLOW_WINDOW,
    CatchLevels,
    Stretch,
    Trial,
    catch_levels,
    find_stretches,
    slow_trial,
)
from masrel.lab.elbow.identification._clusters import (
    UNDETERMINED,
    ClusteredFit,
    FittedParameter,
    Step,
    fitted,
)
from masrel.lab.elbow.identification._equations import (
    JointFit,
    left_out_errors,
    with_late_angle,
)
from masrel.lab.elbow.identification._lack_of_fit import (
    LEVEL,
    LackOfFit,
    lack_of_fit,
    own_drifts,
    p_text,
)
from masrel.lab.elbow.identification._reading import (
    Movement,
    TorqueSource,
    read_movement,
)
from masrel.lab.elbow.identification._rounds import (
    ALWAYS,
    LATEST_S,
    FitOptions,
    Term,
    fit_in_rounds,
    fit_slow,
    fitted_law,
    untimed_terms,
)
from masrel.lab.elbow.motions import Floats
from masrel.lab.elbow.parameters import STANDARD_MODELS, ElbowParameters

# Options of `fit` that are tried in a comparison, each alone.
TERMS = ("gravity", "arm_inertia", "drift", "lag", "rise")

# Of the search for an angle that is late: fits, and the step that ends it, s.
_LATE_ROUNDS, _SETTLED_S = 8, 2e-5

# Two slow trials say little of how they differ, but not nothing of b.
_MIN_DF = 4.0
# So many times its error may each be below 0: a joint may have no inertia at all.
_MAX_BELOW_0 = {"damping": 1.0, "stiffness": 1.0, "inertia": 2.0, "arm_inertia": 2.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class ElbowFit:
    """A joint identified from recordings.

    Attributes
    ----------
    estimates : tuple of FittedParameter
        Every parameter, from all trials together: those of the law, in the order of
        the source's equations, then the fitted terms of the arm.
    correlation : ndarray, shape (n_estimates, n_estimates)
        Correlation of the estimates' errors; ``nan`` if an error is undefined.
    steps : tuple of Step
        The fits before the last, in their order.
    relative_error : float
        In slow trials, the mean absolute residual of the law of step 1 divided by the
        mean absolute torque.
    torque_sd : float
        Standard deviation of the residual torque in all trials, N·m.
    lack_of_fit : LackOfFit
        Whether the law fits these recordings.
    cross_validation : ndarray, shape (n_trials,)
        Per trial, the mean square error of its torque predicted from the other trials'
        parameters, (N·m)²; ``nan`` if they do not determine one.
    trials : tuple of Trial
        The trials used.
    levels : tuple of CatchLevels
        Peak and residual of (3) as read off the torque, of each catch that has them.
    fitted_torque : tuple of ndarray
        Per trial the law's torque at the samples of `pre_catch` and then `after`.
    constants : ElbowParameters
        What was held: ν_th, ν_L, θ_L, ΔT_peak, end of range, reading of (5).
    arm : mapping of str to float or str
        What the arm and the sensor have beside the law: "off", "fitted" or the fixed
        value, SI units.
    offsets, drifts : tuple of float
        Per trial its constant torque (N·m) and what that gains a second (N·m/s).
    level : float
        Level of the intervals.
    simulated : bool
        Whether any recording is.
    sources : mapping of str to str or None
        Recording to its checksum.
    remarks : tuple of str
        What a reader must know before relying on it.
    """

    estimates: tuple[FittedParameter, ...]
    correlation: Floats = field(compare=False, repr=False)
    steps: tuple[Step, ...]
    relative_error: float
    torque_sd: float
    lack_of_fit: LackOfFit
    cross_validation: Floats = field(compare=False, repr=False)
    trials: tuple[Trial, ...] = field(repr=False)
    levels: tuple[CatchLevels, ...] = field(compare=False, repr=False)
    fitted_torque: tuple[Floats, ...] = field(compare=False, repr=False)
    constants: ElbowParameters
    arm: Mapping[str, float | str]
    offsets: tuple[float, ...] = field(repr=False)
    drifts: tuple[float, ...] = field(repr=False)
    level: float
    simulated: bool
    sources: Mapping[str, str | None]
    remarks: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> FittedParameter:
        for estimate in self.estimates:
            if estimate.name == name:
                return estimate
        known = ", ".join(e.name for e in self.estimates)
        raise ParameterError(f"name: needs one of {known}, got {name!r}")

    def joint(self) -> ElbowParameters:
        """Make the joint of the fitted values.

        Returns
        -------
        ElbowParameters
            The fitted values, with `constants` for all that was held. The weight and
            the inertia of the arm and the lag of the sensor are not part of a joint.

        Raises
        ------
        ParameterError
            If a parameter is undetermined, or a joint cannot have a value.
        """
        rise = self.arm["catch_rise"]
        values: dict[str, Any] = {} if isinstance(rise, str) else {"catch_rise": rise}
        for estimate in self.estimates:
            name, is_known = estimate.name, not math.isnan(estimate.value)
            if is_known and (name in QUANTITIES or name == "catch_rise"):
                values[name] = estimate.value
            elif name in QUANTITIES and name != "inertia":
                raise ParameterError(f"{name}: {estimate.reason}")
        return replace(self.constants, **values)


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
        Whether m of (1) is fitted; the law has no m in the catch. The paper has 0.
    gravity : float or {"off", "fitted"}, optional
        Weight of the arm, m·g·l, N·m: it adds m·g·l·sin(θ - `gravity_angle`).
    gravity_angle : float, optional
        Angle at which the weight exerts no torque, rad: the forearm is vertical there.
    arm_inertia : float or {"off", "fitted"}, optional
        Inertia of the arm, kg·m², which acts in every phase.
    offset : float or {"off", "fitted"}, optional
        Constant torque of a trial above k·(θ - θ_rest), N·m: the sensor's zero. Fitted
        for each trial by default. If it is fixed or off, the joint is taken to be at
        rest where its stretch starts, so speeds that differ between trials identify b.
    drift : float or {"off", "fitted"}, optional
        Change of the offset per second, N·m/s; fitted for each trial.
    lag : float or {"off", "fitted"}, optional
        Time constant of a first-order torque sensor, s. A value below 0, down to
        -0.05, means that the angle is late by that time instead, as after a filter.
    rise : float or {"off", "fitted"}, optional
        Time that the torque of a catch takes to reach its peak, s: `catch_rise`.
    slow_below : float, optional
        A stretch whose speed stays below this is slow, rad/s; by default ν_th, below
        which nothing can catch.
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
        If a recording is not usable, the recordings are of several models, no stretch
        is slow, the slow stretches do not determine b and k, or the result
        contradicts the law: b or k is below 0, or Q is 1 or more, by more than its
        error; or m or J is below 0 by more than twice its error.

    Warns
    -----
    RecordingWarning
        If a recording or stretch is not used, or b or k comes out negative.
    SmallSampleWarning
        If there are too few trials for the interval of a parameter.

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
        inertia=inertia,
        slow_below=held.speed_threshold if slow_below is None else slow_below,
        level=level,
    )
    movements = [
        entry if isinstance(entry, Movement) else read_movement(Path(entry))
        for entry in recordings
    ]
    if not isinstance(lag, str):
        movements = aligned(movements, min(lag, 0.0))
    models = sorted({m.model for m in movements if m.model is not None})
    if len(models) > 1:
        raise RecordingError(
            "recordings: a fit needs presentations of one model; the .json files "
            f"beside the recordings name {', '.join(models)}"
        )
    stretches, rest_sd = _stretches(movements, options)
    slow = _slow_fit(stretches, options)
    first = slow
    slow, last = _search(movements, stretches, first, options)
    reasons: dict[str, str] = {}
    while untimed := untimed_terms(last):
        reasons |= untimed
        options = options.without(untimed)
        slow, last = _search(movements, stretches, first, options)
    for trial in (*slow.trials, *last.fast):
        if trial.remark:
            warn_caller(f"{trial.stretch.name}: {trial.remark}", RecordingWarning)
    result = _result(movements, slow, last, options, rest_sd, reasons)
    lone = [
        ALL_QUANTITIES[estimate.name].symbol
        for estimate in result.estimates
        if estimate.reason is not None and not math.isnan(estimate.value)
    ]
    if lone:
        warn_caller(
            f"{', '.join(lone)}: too few trials to estimate how trials differ, so no "
            "interval is given",
            SmallSampleWarning,
        )
    return result


def aligned(movements: Sequence[Movement], lag: float) -> list[Movement]:
    """Put the torque as late as the angle beside it is, by a negative lag."""
    return [
        replace(m, torque=np.interp(m.time + lag, m.time, m.torque)) if lag else m
        for m in movements
    ]


def _search(
    movements: Sequence[Movement],
    stretches: Sequence[Stretch],
    slow: JointFit,
    options: FitOptions,
) -> tuple[JointFit, JointFit]:
    # the fits of slow trials and of all; a lag that is fitted may be below 0
    late = None
    if "lag" in options.fitted:
        late = _late_fit(movements, stretches, slow, options.without(("lag",)))
    return late or (slow, fit_in_rounds(stretches, slow, options))


def _late_fit(
    movements: Sequence[Movement],
    stretches: Sequence[Stretch],
    slow: JointFit,
    options: FitOptions,
) -> tuple[JointFit, JointFit] | None:
    # with a lag below 0, towards which the first step without any leads, if it does
    whole, step = with_late_angle(fit_in_rounds(stretches, slow, options), 0.0)
    if all(trial.catch is None for trial in whole.trials):
        return None
    for _ in range(_LATE_ROUNDS):
        lag = max(whole.shared["lag"] + step, -LATEST_S)
        if not lag < 0.0:
            return None
        with warnings.catch_warnings():  # of the recordings, given before
            warnings.simplefilter("ignore", MasrelWarning)
            stretches, _ = _stretches(aligned(movements, lag), options)
            slow = _slow_fit(stretches, options)
        whole, step = with_late_angle(fit_in_rounds(stretches, slow, options), lag)
        if abs(step) < _SETTLED_S:
            break
    return None if "lag" in untimed_terms(whole) else (slow, whole)


def _stretches(
    movements: Sequence[Movement], options: FitOptions
) -> tuple[list[Stretch], float]:
    # all of them, and the median noise at rest
    stretches: list[Stretch] = []
    noise = []
    for movement in movements:
        here, rest_sd = find_stretches(movement, options.slow_below)
        noise += [] if math.isnan(rest_sd) else [rest_sd]
        if not here:
            words = "no extension of 15 degrees or more; not used"
            warn_caller(f"{movement.name}: {words}", RecordingWarning)
        for stretch in here:
            if stretch.name in {other.name for other in stretches}:
                raise RecordingError(f"{stretch.name}: the recording was given twice")
            stretches.append(stretch)
    if not stretches:
        raise RecordingError(
            "recordings: none has an extension of 15 degrees or more; the angle must "
            "increase with extension"
        )
    return stretches, float(np.median(noise)) if noise else math.nan


def _slow_fit(stretches: Sequence[Stretch], options: FitOptions) -> JointFit:
    slow = fit_slow(_slow_trials(stretches, options.slow_below), options)
    _check_slow(slow, stretches, options)
    return slow


def _slow_trials(stretches: Sequence[Stretch], limit: float) -> list[Trial]:
    slow = [slow_trial(stretch) for stretch in stretches if stretch.pace == "slow"]
    used = [trial for trial in slow if trial.pre_catch.time.size]
    for trial in slow:
        if not trial.pre_catch.time.size:
            why = trial.remark or "too short for the filter of slow stretches"
            warn_caller(f"{trial.stretch.name}: {why}; not used", RecordingWarning)
    slowest = min(stretch.peak_speed for stretch in stretches)
    refuse(
        (
            slow and not used,
            f"recordings: b and k need a slow stretch; none of {len(slow)} can be used",
        ),
        (
            not used,
            "recordings: b and k need a slow stretch, one whose speed stays below "
            f"{math.degrees(limit):g} deg/s; the slowest of {len(stretches)} reaches "
            f"{math.degrees(slowest):.3g} deg/s. --slow-below raises the limit",
        ),
        error=RecordingError,
    )
    return used


def _slow_errors(slow: JointFit) -> dict[str, float]:
    # standard errors, of one trial those of its samples, of which the filter leaves one
    # in so many independent
    errors = {name: e.standard_error for name, e in slow.alone.items()}
    names = ("damping", "stiffness")
    is_undetermined = any(math.isnan(slow.alone[name].value) for name in names)
    if len(slow.trials) > 1 or is_undetermined:
        return errors
    (rows,), time = slow.rows(), slow.trials[0].pre_catch.time
    period = float(np.median(np.diff(time))) if time.size > 1 else 1.0
    inverse = np.linalg.pinv(rows.design.T @ rows.design, hermitian=True)
    df = max(time.size / max(SLOW_WINDOW / period, 1.0) - len(inverse) - 1, 1.0)
    sds = np.sqrt(float(rows.target @ rows.target) / df * np.diag(inverse))
    return dict(zip(errors, sds.tolist(), strict=True))


def _check_slow(
    slow: JointFit, stretches: Sequence[Stretch], options: FitOptions
) -> None:
    # b and k are told by their error: what it does to the torque of these stretches
    errors = _slow_errors(slow)
    torque = max(float(np.ptp(t.pre_catch.torque)) for t in slow.trials)
    speed = max(stretch.peak_speed for stretch in stretches)
    travel = max(float(np.ptp(stretch.angle)) for stretch in stretches)
    for name, size in (("damping", speed), ("stiffness", travel)):
        estimate, symbol = slow.alone[name], QUANTITIES[name].symbol
        df = estimate.df if estimate.df > _MIN_DF else _MIN_DF
        whole = 2.0 * errors[name] * float(stdtrit(df, 0.5 + 0.5 * options.level))
        # an error that matters: of the value, and of the torque at the largest speed
        unsure = whole > abs(estimate.value) and whole * size > torque
        if math.isnan(estimate.value) or unsure:
            raise RecordingError(_untold(estimate, errors[name], slow, options))
        if estimate.high < 0.0:
            raise RecordingError(
                f"recordings: the law does not apply: {symbol} is "
                f"{estimate.value:.4g}, below 0 by more than its error (upper limit "
                f"{estimate.high:.4g}); torque must resist extension, and the angle "
                "must increase with it: are both signs right?"
            )
        if estimate.value < 0.0:
            warn_caller(
                f"{symbol} is negative ({estimate.value:.4g}): torque must resist "
                "extension, and the angle must increase with it; are both signs right?",
                RecordingWarning,
            )


def _untold(
    estimate: FittedParameter, error: float, slow: JointFit, options: FitOptions
) -> str:
    symbol = QUANTITIES[estimate.name].symbol
    if not math.isnan(error):
        symbol += f" ({estimate.value:.3g}, standard error {error:.2g})"
    parts = [trial.pre_catch for trial in slow.trials]
    drifts = own_drifts(parts, options.gravity_angle)
    if "drift" not in options.fitted and drifts and drifts.p_value < LEVEL:
        return (
            f"recordings: the slow stretches do not determine {symbol}: each has its "
            f"own drift (p {p_text(drifts.p_value)}); try --drift fitted"
        )
    remedy = "this takes a speed that varies within a stretch"
    if "offset" in options.fitted:
        remedy += (
            ", or constant speeds that differ between stretches and a sensor whose "
            "zero is known (--offset)"
        )
    return (
        f"recordings: the slow stretches cannot distinguish {symbol} from a constant "
        f"torque; {remedy}"
    )


def _result(
    movements: Sequence[Movement],
    slow: JointFit,
    last: JointFit,
    options: FitOptions,
    rest_sd: float,
    untimed: Mapping[str, str],
) -> ElbowFit:
    shared, reasons = last.clustered(), {**_reasons(last, options), **untimed}
    estimates = _all_estimates(shared, last, reasons, options)
    _check_law(estimates)
    law = fitted_law(last)
    levels = [catch_levels(trial, law) for trial in last.trials]
    return ElbowFit(
        estimates=estimates,
        correlation=_correlation(shared, last, estimates),
        steps=last.steps,
        relative_error=_relative_error(slow),
        torque_sd=last.torque_sd,
        lack_of_fit=lack_of_fit(last, rest_sd),
        cross_validation=left_out_errors(last),
        trials=tuple(last.trials),
        levels=tuple(read for read in levels if read is not None),
        fitted_torque=last.laws,
        constants=options.constants,
        arm={**options.terms, "gravity_angle": options.gravity_angle},
        offsets=tuple(values["offset"] for values in last.values),
        drifts=tuple(values["drift"] for values in last.values),
        level=options.level,
        simulated=any(movement.simulated for movement in movements),
        sources={m.name: m.sha256 for m in movements},
        remarks=_remarks(movements, estimates, last),
    )


def _relative_error(slow: JointFit) -> float:
    size = sum(float(np.abs(e.part.measured).sum()) for e in slow.equations)
    far = float(np.abs(np.concatenate(slow.residuals)).sum())
    return far / size if size > 0.0 else math.nan


def _check_law(estimates: Sequence[FittedParameter]) -> None:
    for estimate in estimates:
        name, value = estimate.name, estimate.value
        symbol, most = ALL_QUANTITIES[name].symbol, _MAX_BELOW_0.get(name, math.inf)
        refuse(
            (
                name == "residual_ratio" and estimate.low >= 1.0,
                f"recordings: the law does not apply: Q is {value:.3g}, above 1 by "
                f"more than its error (lower limit {estimate.low:.3g}): the torque "
                "does not fall from a peak to a residual",
            ),
            (
                value + most * (estimate.high - value) < 0.0,
                f"recordings: the law does not apply: {symbol} from all trials is "
                f"{value:.4g}, below 0 by more than its error (upper limit "
                f"{estimate.high:.4g}); are the signs of torque and angle right?",
            ),
            error=RecordingError,
        )


def _reasons(last: JointFit, options: FitOptions) -> dict[str, str]:
    # why the steps do not determine what they do not
    if all(trial.catch is None for trial in last.fast):
        why = (
            "no fast stretch has a catch that can be used"
            if last.fast
            else "there are only slow stretches, which have no catch"
        )
        names = [name for name in QUANTITIES if name not in ALWAYS]
        names += [name for name in options.fitted if name in ("lag", "catch_rise")]
        return dict.fromkeys(names, why)
    return {name: e.reason for name, e in last.alone.items() if e.reason is not None}


def _all_estimates(
    shared: ClusteredFit,
    last: JointFit,
    reasons: Mapping[str, str],
    options: FitOptions,
) -> tuple[FittedParameter, ...]:
    # Where travels are censored, D is that of its step. Least squares hold the spread
    # of travels and know less than they say; and they draw each end towards D, by
    # which that spread would come out too small.
    level, names = options.level, list(last.shared)
    by_name = {e.name: e for e in fitted(names, shared, level, reasons)}
    if _n_censored(last):
        by_name["catch_travel"] = last.alone["catch_travel"]
    optional = {"inertia", *ARM_QUANTITIES} - set(options.fitted) - set(reasons)
    for name in ALL_QUANTITIES:
        if name not in by_name and name not in optional:
            reason = reasons.get(name, UNDETERMINED)
            by_name[name] = FittedParameter(name=name, level=level, reason=reason)
    return tuple(by_name[name] for name in ALL_QUANTITIES if name in by_name)


def _n_censored(last: JointFit) -> int:
    return sum(e.limit is not None for e in last.equations)


def _correlation(
    shared: ClusteredFit, last: JointFit, estimates: Sequence[FittedParameter]
) -> Floats:
    names = list(last.shared)
    places = [names.index(e.name) if e.name in names else -1 for e in estimates]
    sd = np.sqrt(np.diag(shared.covariance))
    whole = np.full((len(sd) + 1, len(sd) + 1), np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        whole[:-1, :-1] = shared.covariance / np.outer(sd, sd)
    return whole[np.ix_(places, places)]


def _remarks(
    movements: Sequence[Movement], estimates: Sequence[FittedParameter], last: JointFit
) -> tuple[str, ...]:
    # first which torque it is, of recordings of masrel's driver
    texts: dict[TorqueSource, str] = {
        "sensor": "measured by the device's sensor; it includes any friction that was "
        "not compensated",
        "model": "commanded by the joint model, not measured",
    }
    n_from = Counter(movement.torque_source for movement in movements)
    catches = [trial.catch for trial in last.trials if trial.catch is not None]
    unended = sum(catch.end is None for catch in catches)
    behind = _n_censored(last)
    unused = sum(trial.catch is None for trial in last.fast)
    remarks = [
        f"The torque of {n_from[source]} of {len(movements)} recordings was {text}"
        for source, text in texts.items()
        if n_from[source]
    ]
    remarks += [
        f"{ALL_QUANTITIES[e.name].symbol}: {e.reason}" for e in estimates if e.reason
    ]
    cautions = (
        (
            behind > 0,
            f"{behind} of {len(catches)} catches do not end within their stretch: D "
            "counts each as longer than was recorded (censored), and assumes that "
            "travels are normally distributed",
        ),
        (
            behind < unended < len(catches),
            f"{unended - behind} of {len(catches)} catches do not end within their "
            "stretch and are left out of D: if travels differ between trials, the "
            "short ones remain, and D is underestimated",
        ),
        (unused > 0, f"{unused} of {len(last.fast)} fast stretches were not used"),
    )
    return (*remarks, *(text for is_so, text in cautions if is_so))


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparedFit:
    """One fit of a comparison.

    Attributes
    ----------
    fitted : tuple of str
        Terms of the arm that are fitted.
    fit : ElbowFit or None
        The fit; None if it was refused.
    reason : str or None
        Why it was refused.
    error : float
        Root mean square error of a trial's torque predicted from the parameters of
        all other trials, N·m.
    worse : float
        Mean over trials of the squared error minus that of the best fit, (N·m)².
    worse_se : float
        Standard error of `worse`, over trials; 0 for the best.
    is_chosen : bool
        Whether this is the first fit within one standard error of the best.
    """

    fitted: tuple[str, ...]
    fit: ElbowFit | None
    reason: str | None
    error: float
    worse: float
    worse_se: float
    is_chosen: bool


def against_best(squares: Floats) -> tuple[Floats, Floats, Floats]:
    """Return mean squares (n_fits,), and what they are above the least, with errors.

    `squares` (n_fits, n) are of what was left out in turn, which is what differs; of
    fits that have none they are ``nan``.
    """
    n_fits, n = squares.shape
    means = squares.mean(axis=1) if n else np.full(n_fits, math.nan)
    more = squares - (
        squares[np.nanargmin(means)] if not np.isnan(means).all() else 0.0
    )
    ses = more.std(axis=1, ddof=1) / math.sqrt(n) if n > 1 else 0.0 * means + math.nan
    return means, more.mean(axis=1) if n else means, ses


def compare_fits(
    recordings: Sequence[Movement | Path | str], **options: Any
) -> tuple[ComparedFit, ...]:
    """Fit with each further term of an arm, and predict each trial from the others.

    Parameters
    ----------
    recordings : sequence of Movement or path
        Slow and fast stretches, as for `fit`.
    **options
        Those of `fit`. What is fitted or fixed there is so in every fit.

    Returns
    -------
    tuple of ComparedFit
        The fit with these options first, then one with each further term of the arm.
        A trial that is left out keeps its own constant, peak, residual and travel;
        its prediction uses the equations linearised at the fit. Only trials that all
        fits use are compared.

    Raises
    ------
    ParameterError
        If an option is outside its range.
    RecordingError
        If the first fit is refused.
    """
    movements = [
        entry if isinstance(entry, Movement) else read_movement(Path(entry))
        for entry in recordings
    ]
    fits: list[tuple[tuple[str, ...], ElbowFit | None, str | None]] = [
        ((), fit(movements, **options), None)
    ]
    tried = [term for term in TERMS if options.get(term, "off") == "off"]
    with warnings.catch_warnings():  # the first fit said them
        warnings.simplefilter("ignore", MasrelWarning)
        for term in tried:
            try:
                result = fit(movements, **{**options, term: "fitted"})
                fits.append(((term,), result, None))
            except MasrelError as error:
                fits.append(((term,), None, str(error)))
    squares = [
        {
            trial.stretch.name: value
            for trial, value in zip(result.trials, result.cross_validation, strict=True)
            if math.isfinite(value)
        }
        if result is not None
        else {}
        for _, result, _ in fits
    ]
    names = sorted(set.intersection(*(set(of_fit) for of_fit in squares if of_fit)))
    rows = [[of_fit.get(name, math.nan) for name in names] for of_fit in squares]
    means, worse, ses = against_best(np.array(rows))
    near = np.flatnonzero(worse <= ses).tolist()  # fits with fewer terms come first
    return tuple(
        ComparedFit(
            fitted=terms,
            fit=result,
            reason=reason,
            error=math.sqrt(means[i]) if means[i] >= 0.0 else math.nan,
            worse=float(worse[i]),
            worse_se=float(ses[i]),
            is_chosen=near[:1] == [i],
        )
        for i, (terms, result, reason) in enumerate(fits)
    )
