"""From recordings to a joint: what is fitted, what is read, what is used of it.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section II.
"""

import math
import warnings
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from masrel.elbow.identification._catches import (
    Arm,
    Catch,
    CatchLevels,
    PreCatchLaw,
    Trial,
    catch_levels,
    fast_trial,
    slow_trial,
)
from masrel.elbow.identification._drifts import own_drifts
from masrel.elbow.identification._equations import Equations, Known, Spreads
from masrel.elbow.identification._joint_fit import (
    JointFit,
    Solution,
    fit_together,
    joint_fit,
)
from masrel.elbow.identification._lack_of_fit import LEVEL, p_text
from masrel.elbow.identification._quantities import (
    ALL_QUANTITIES,
    ARM_QUANTITIES,
    QUANTITIES,
)
from masrel.elbow.identification._reading import (
    Movement,
    TorqueSource,
    even_samples,
    read_movement,
)
from masrel.elbow.identification._results import (
    UNDETERMINED,
    ElbowFit,
    FittedParameter,
    Step,
    fitted,
)
from masrel.elbow.identification._steps import (
    SlowFit,
    can_be_censored,
    fit_catch_line,
    fit_catch_torque,
    fit_catch_travel,
    fit_post_catch,
    fit_slow,
    on_the_line,
)
from masrel.elbow.identification._stretches import (
    Stretch,
    check_velocity,
    find_stretches,
)
from masrel.elbow.identification._travels import DetectionLimit, detection_limit
from masrel.elbow.parameters import STANDARD_MODELS, ElbowParameters
from masrel.errors import (
    ParameterError,
    RecordingError,
    RecordingWarning,
    SmallSampleWarning,
)

_Floats = NDArray[np.float64]

Term = float | Literal["off", "fitted"]
"""What an arm has: nothing of it, a fixed value in SI units, or what is fitted."""

_WINDOW = 0.06  # of the filter of speeds, s: 20.5 Hz at 1 kHz
# Two slow trials say little of how they differ, but not nothing of b.
_MIN_DF = 4.0

# Of catches and fit, where what an arm has moves the catches, or makes them last.
_ROUNDS, _TIMED_ROUNDS = 2, 8

# Where the search for what takes time begins, s, and its floor in periods of samples.
_STARTS = {"lag": (0.004, 0.016), "catch_rise": (0.01, 0.04, 0.08)}
_FLOORS = {"lag": 0.2, "catch_rise": 3.0}
_ALWAYS = ("damping", "stiffness", "inertia")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Options:
    constants: ElbowParameters
    terms: Mapping[str, Term]  # of the arm
    gravity_angle: float
    with_inertia: bool
    slow_below: float
    window: float
    level: float

    @property
    def fitted(self) -> tuple[str, ...]:
        """Return the names of what is fitted of the arm."""
        return tuple(name for name, term in self.terms.items() if term == "fitted")

    @property
    def offset(self) -> float | None:
        """Return the constant torque of every trial, N·m; None if it is fitted."""
        term = self.terms["offset"]
        return None if term == "fitted" else _number(term)

    def arm(self) -> Arm:
        """Return the arm as the first round knows it."""
        values: dict[str, Any] = {
            name: _STARTS.get(name, (0.0,))[0] if term == "fitted" else _number(term)
            for name, term in self.terms.items()
            if name != "offset"
        }
        fits = "arm_inertia" in self.fitted
        return replace(
            Arm(gravity_angle=self.gravity_angle, fits_inertia=fits), **values
        )


def _number(term: Term) -> float:
    return 0.0 if isinstance(term, str) else float(term)


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
        Length of the window of the filter that gives speed and acceleration, s.
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
        not tell b from k, or what comes out cannot be the law: b or k below 0 or Q of 1
        or more, by more than their error.

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
    options = _Options(
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
    _check_options(options, inertia)
    movements = [
        entry if isinstance(entry, Movement) else read_movement(Path(entry))
        for entry in recordings
    ]
    _check_models(movements)
    stretches, rest_sd = _stretches(movements, options)
    slow = _slow_trials(stretches, options.slow_below)
    result = _rounds(_Material(movements, stretches, slow, rest_sd), options)
    _warn_of_lone(result)
    return result


@dataclass(frozen=True, slots=True)
class _Material:
    movements: Sequence[Movement]
    stretches: Mapping[str, Stretch]
    slow: Sequence[Trial]
    rest_sd: float


@dataclass(frozen=True, slots=True, kw_only=True)
class _Fitted:
    # one round: trials, what was read off them, steps and the last fit
    fast: Sequence[Trial]
    trials: list[Trial]  # slow and fast ones that are used
    arm: Arm
    limits: list[DetectionLimit | None]
    steps: list[Step]
    equations: list[Equations]
    solution: Solution


def _check_options(options: _Options, inertia: str) -> None:
    held = options.constants
    if not 0.5 < options.level < 1.0:
        raise ParameterError(
            f"level: needs more than 0.5 and less than 1, got {options.level}"
        )
    if held.residual_reading != "residual" or held.catch_rise != 0.0:
        raise ParameterError(
            "constants: a fit reads Q as section II does and takes the rise of a catch "
            'from its option; needs residual_reading "residual" and catch_rise 0, got '
            f"{held.residual_reading!r} and {held.catch_rise:g}"
        )
    if not 0.0 < options.slow_below < math.inf:
        raise ParameterError(f"slow_below: needs more than 0, got {options.slow_below}")
    if inertia not in ("zero", "fitted"):
        raise ParameterError(f'inertia: needs "zero" or "fitted", got {inertia!r}')
    if inertia == "fitted" and held.post_catch == "additive":
        raise ParameterError(
            'inertia: with post_catch "additive", m is in every phase but the catch, '
            "and where one ends cannot be told from the jump of m·θ̈; needs "
            '"zero", got "fitted"'
        )
    for name, term in options.terms.items():
        _check_term({"catch_rise": "rise"}.get(name, name), term, held)
    if not math.isfinite(options.gravity_angle):
        raise ParameterError(
            f"gravity_angle: needs a finite angle, got {options.gravity_angle}"
        )


def _check_term(name: str, term: object, held: ElbowParameters) -> None:
    if isinstance(term, str):
        if term not in ("off", "fitted"):
            raise ParameterError(
                f'{name}: needs "off", "fitted" or a number, got {term!r}'
            )
        return
    if not isinstance(term, int | float) or not math.isfinite(term):
        raise ParameterError(f'{name}: needs "off", "fitted" or a number, got {term!r}')
    if name in ("arm_inertia", "lag", "rise") and term < 0.0:
        raise ParameterError(f"{name}: needs 0 or more, got {term:g}")
    if name == "rise" and term > held.peak_duration:
        raise ParameterError(
            f"rise: needs 0 to ΔT_peak, {held.peak_duration:g} s, got {term:g} s"
        )


def _stretches(
    movements: Sequence[Movement], options: _Options
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
        raise RecordingError("recordings: none has an extension of 15 degrees or more")
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


def _rounds(
    material: _Material,
    options: _Options,
    reasons: Mapping[str, str] | None = None,
) -> ElbowFit:
    # What an arm has moves catches, and catches tell what an arm has: both in turn.
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
    law, arm = slow.law, replace(arm, gravity=slow.gravity)
    tries = [
        _round(material, slow, law, each, options) for each in _starts(options, arm)
    ]
    made = min(tries, key=lambda each: each.solution.typical)
    n_rounds = _ROUNDS if set(options.fitted) - {"offset"} else 1
    for _ in range((_TIMED_ROUNDS if made.arm.takes_time else n_rounds) - 1):
        law, arm = _next(law, made)
        instants = _instants(made)
        settled = instants and _is_settled(made)
        made = _round(material, slow, law, arm, options, instants)
        if settled:
            break
    none = _no_time(made)
    if none and not reasons:
        terms: dict[str, Term] = dict(options.terms)
        terms.update(dict.fromkeys(none, 0.0))
        return _rounds(material, replace(options, terms=terms), none)
    _warn_of_parts([*slow.trials, *made.fast])
    return _result(material, slow, made, options, reasons or {})


def _starts(options: _Options, arm: Arm) -> list[Arm]:
    # the sum of squares has a valley for each of several lags and rises
    timed = [name for name in _STARTS if name in options.fitted]
    starts: list[dict[str, Any]] = [
        dict(zip(timed, each, strict=True))
        for each in product(*(_STARTS[name] for name in timed))
    ]
    return [replace(arm, **each) for each in starts]


def _round(
    material: _Material,
    slow: SlowFit,
    law: PreCatchLaw,
    arm: Arm,
    options: _Options,
    instants: Mapping[str, float] | None = None,
) -> _Fitted:
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
        for name, stretch in material.stretches.items()
        if stretch.pace == "fast"
    ]
    return _fit_trials(slow, fast, arm, options)


def _is_settled(made: _Fitted) -> bool:
    # no catch moves by more than a sample
    period = _floor("catch_rise", made.equations) / _FLOORS["catch_rise"]
    return all(abs(local.get("shift", 0.0)) < period for local in _local(made))


def _no_time(made: _Fitted) -> dict[str, str]:
    # why a lag or a rise is not fitted: the samples do not tell it from none
    names = made.equations[0].known.names
    values = dict(zip(names, made.solution.shared.tolist(), strict=True))
    floors = {n: _floor(n, made.equations) for n in _STARTS if n in values}
    return {
        name: f"shorter than {1000.0 * floor:.2g} ms, which these samples do not tell "
        "from nothing: taken as 0"
        for name, floor in floors.items()
        if values[name] <= 1.001 * floor
    }


def _check_slow(
    slow: SlowFit, stretches: Mapping[str, Stretch], options: _Options
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
        if estimate.high < 0.0:
            symbol = QUANTITIES[name].symbol
            raise RecordingError(
                f"recordings: this is not the law: {symbol} is {estimate.value:.4g}, "
                f"below 0 by more than its error (to {estimate.high:.4g}); torque must "
                "resist extension, and the angle grow with it: are both signs right?"
            )
        if estimate.value < 0.0:
            _warn(
                f"{name} is negative ({estimate.value:.4g}): torque must resist "
                "extension, and the angle grow with it; are both signs right?"
            )


def _untold(name: str, value: float, slow: SlowFit, options: _Options) -> str:
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


def _fit_trials(
    slow: SlowFit,
    fast: Sequence[Trial],
    arm: Arm,
    options: _Options,
) -> _Fitted:
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
    floors = {name: _floor(name, equations) for name in _STARTS if name in start}
    return _Fitted(
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


def _start(steps: Sequence[Step], options: _Options, arm: Arm) -> dict[str, float]:
    start = dict.fromkeys(QUANTITIES, math.nan)
    start |= {e.name: e.value for step in steps for e in step.estimates}
    has_catch = not math.isnan(start["catch_torque_constant"])
    for name in ARM_QUANTITIES:
        needs_catch = name in ("lag", "catch_rise")
        if name in options.fitted and (has_catch or not needs_catch):
            start[name] = float(getattr(arm, name))
    return start


def _local(made: _Fitted) -> list[dict[str, float]]:
    # each trial's own parameters, by name
    return [
        dict(zip(e.local, values.tolist(), strict=True))
        for e, values in zip(made.equations, made.solution.local, strict=True)
    ]


def _next(law: PreCatchLaw, made: _Fitted) -> tuple[PreCatchLaw, Arm]:
    # what the fit says of the law before a catch, and of the arm
    names = made.equations[0].known.names
    values = dict(zip(names, made.solution.shared.tolist(), strict=True))
    drifts = {
        trial.name: local["drift"]
        for trial, local in zip(made.trials, _local(made), strict=True)
        if "drift" in local
    }
    of_arm: dict[str, Any] = {n: values[n] for n in ARM_QUANTITIES if n in values}
    of_law = {n: values[n] for n in _ALWAYS if n in values}
    return replace(law, **of_law), replace(made.arm, **of_arm, drifts=drifts)


def _instants(made: _Fitted) -> dict[str, float]:
    # where the fit has each catch begin
    return {
        trial.name: trial.catch.time + local["shift"]
        for trial, local in zip(made.trials, _local(made), strict=True)
        if trial.catch is not None and "shift" in local
    }


def _limits(
    trials: Sequence[Trial],
    read: Sequence[CatchLevels | None],
    slow: SlowFit,
    stiffness: float,
    options: _Options,
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


def _result(
    material: _Material,
    slow: SlowFit,
    made: _Fitted,
    options: _Options,
    no_time: Mapping[str, str],
) -> ElbowFit:
    joint, steps = (
        joint_fit(made.equations, made.solution, material.rest_sd),
        made.steps,
    )
    reasons = {**_reasons(steps, made.fast, options), **no_time}
    estimates = _all_estimates(joint, made, reasons, options)
    _check_ratio(estimates)
    local = _local(made)
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
        if estimate.name in ("damping", "stiffness") and estimate.high < 0.0:
            symbol = QUANTITIES[estimate.name].symbol
            raise RecordingError(
                f"recordings: this is not the law: {symbol} of all trials is "
                f"{estimate.value:.4g}, below 0 by more than its error (to "
                f"{estimate.high:.4g})"
            )


def _reasons(
    steps: Sequence[Step], fast: Sequence[Trial], options: _Options
) -> dict[str, str]:
    # why the steps do not determine what they do not
    if all(trial.catch is None for trial in fast):
        why = "there are only slow stretches, in which nothing catches"
        if fast:
            why = "no fast stretch has a catch that can be used"
        names = [name for name in QUANTITIES if name not in _ALWAYS]
        names += [name for name in options.fitted if name in ("lag", "catch_rise")]
        return dict.fromkeys(names, why)
    return {
        estimate.name: estimate.reason
        for step in steps
        for estimate in step.estimates
        if estimate.reason is not None
    }


def _all_estimates(
    joint: JointFit, made: _Fitted, reasons: Mapping[str, str], options: _Options
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
    said: dict[TorqueSource, str] = {
        "sensor": "measured by the device's sensor: what friction compensation leaves "
        "of the device is in it",
        "model": "what the joint model asked for, not measured",
    }
    n_from = Counter(movement.torque_source for movement in movements)
    return tuple(
        f"Torque of {n_from[source]} of {len(movements)} recordings: {text}"
        for source, text in said.items()
        if n_from[source]
    )


def _remarks(estimates: Sequence[FittedParameter], made: _Fitted) -> tuple[str, ...]:
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
        estimate.name
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
