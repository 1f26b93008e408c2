"""From recordings to a joint: what is fitted, what is read, what is used of it.

Trials and the fit of them take turns: each round knows what the one before found. And
which of what an arm may have makes a fit better: cross-validation over trials.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section II.
"""

import math
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from masrel._input import refuse
from masrel.errors import (
    MasrelError,
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
    Law,
    Stretch,
    Trial,
    catch_levels,
    fast_trial,
    find_stretches,
    slow_trial,
)
from masrel.lab.elbow.identification._clusters import (
    UNDETERMINED,
    FittedParameter,
    Step,
    fitted,
)
from masrel.lab.elbow.identification._equations import (
    DetectionLimit,
    Equations,
    JointFit,
    Known,
    Solution,
    fit_together,
    joint_fit,
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
from masrel.lab.elbow.identification._steps import (
    SlowFit,
    detection_limit,
    fit_catch_line,
    fit_catches,
    fit_post_catch,
    fit_slow,
    on_the_line,
)
from masrel.lab.elbow.parameters import STANDARD_MODELS, ElbowParameters

_Floats = NDArray[np.float64]

_WINDOW = 0.06  # of the filter of speeds, s: 20.5 Hz at 1 kHz
# Options of `fit` that are tried in a comparison, each alone.
TERMS = ("gravity", "arm_inertia", "drift", "lag", "rise")

# Two slow trials say little of how they differ, but not nothing of b.
_MIN_DF = 4.0
# So many times its error may each be below 0: a joint may have no inertia at all.
_MAX_BELOW_0 = {"damping": 1.0, "stiffness": 1.0, "inertia": 2.0, "arm_inertia": 2.0}

# What an arm has: nothing of it, a fixed value in SI units, or what is fitted.
Term = float | Literal["off", "fitted"]

# What slow trials tell.
ALWAYS = ("damping", "stiffness", "inertia")

# Of what takes time: where the search for it begins, s.
_STARTS = {"lag": (0.004, 0.016), "catch_rise": (0.01, 0.04, 0.08)}

# In periods of samples: none is told from nothing that is shorter. The search may go
# below, to a quarter of it.
_FLOORS, _BELOW = {"lag": 0.2, "catch_rise": 3.0}, 0.25

# Of catches and fit, where what an arm has moves the catches, or makes them last.
_ROUNDS, _TIMED_ROUNDS = 2, 8


@dataclass(frozen=True, slots=True, kw_only=True)
class ElbowFit:
    """A joint identified from recordings.

    Attributes
    ----------
    estimates : tuple of FittedParameter
        Every parameter, from all trials together: those of the law, in the order of
        the source's equations, and what else of an arm was fitted.
    correlation : ndarray, shape (n_estimates, n_estimates)
        Of the estimates' errors; ``nan`` where one is undefined.
    steps : tuple of Step
        The fits before the last, in their order.
    relative_error : float
        Of slow trials: mean distance of torque from the law of step 1 over mean
        torque, both absolute.
    torque_sd : float
        Standard deviation of torque about the law in all trials, N·m.
    lack_of_fit : LackOfFit
        Whether the law is that of these recordings.
    cross_validation : ndarray, shape (n_trials,)
        Per trial, the mean square distance of its torque from what the other trials'
        parameters give, (N·m)²; ``nan`` where they do not determine one.
    trials : tuple of Trial
        What was used.
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
    correlation: _Floats = field(compare=False, repr=False)
    steps: tuple[Step, ...]
    relative_error: float
    torque_sd: float
    lack_of_fit: LackOfFit
    cross_validation: _Floats = field(compare=False, repr=False)
    trials: tuple[Trial, ...] = field(repr=False)
    fitted_torque: tuple[_Floats, ...] = field(compare=False, repr=False)
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

    def joint(self, *, missing: ElbowParameters | None = None) -> ElbowParameters:
        """Make the joint of the fitted values.

        Parameters
        ----------
        missing : ElbowParameters, optional
            Where to take what these trials do not determine.

        Returns
        -------
        ElbowParameters
            The fitted values, with `constants` for all that was held. The weight and
            the inertia of the arm and the lag of the sensor are no part of a joint.

        Raises
        ------
        ParameterError
            If a parameter is undetermined and `missing` is not given, or a value is
            none that a joint can have.
        """
        of_joint = {each.name for each in fields(ElbowParameters)}
        values: dict[str, Any] = {}
        rise = self.arm["catch_rise"]
        if not isinstance(rise, str):
            values["catch_rise"] = rise
        for estimate in self.estimates:
            if estimate.name not in of_joint:
                continue
            if not math.isnan(estimate.value):
                values[estimate.name] = estimate.value
            elif missing is not None:
                values[estimate.name] = getattr(missing, estimate.name)
            elif estimate.name not in ("inertia", "catch_rise"):
                raise ParameterError(f"{estimate.name}: {estimate.reason}")
        return replace(self.constants, **values)


@dataclass(frozen=True, slots=True, kw_only=True)
class FitOptions:
    """The options of a fit, as it takes them; refuses those outside their ranges."""

    constants: ElbowParameters
    terms: Mapping[str, Term]  # of the arm
    gravity_angle: float
    inertia: str
    slow_below: float
    window: float
    level: float

    def __post_init__(self) -> None:
        held, fits_inertia = self.constants, self.inertia == "fitted"
        refuse(
            (
                not 0.5 < self.level < 1.0,
                f"level: needs more than 0.5 and less than 1, got {self.level}",
            ),
            (
                held.residual_reading != "residual" or held.catch_rise != 0.0,
                "constants: a fit reads Q as section II does and takes the rise of a "
                'catch from its option; needs residual_reading "residual" and '
                f"catch_rise 0, got {held.residual_reading!r} and {held.catch_rise:g}",
            ),
            (
                not 0.0 < self.slow_below < math.inf,
                f"slow_below: needs more than 0, got {self.slow_below}",
            ),
            (
                not 0.0 < self.window < math.inf,
                f"window: needs more than 0 s, got {self.window}",
            ),
            (
                self.inertia not in ("zero", "fitted"),
                f'inertia: needs "zero" or "fitted", got {self.inertia!r}',
            ),
            (
                fits_inertia and held.post_catch == "additive",
                'inertia: with post_catch "additive", m is in every phase but the '
                "catch, and where one ends cannot be told from the jump of m·θ̈; needs "
                '"zero", got "fitted"',
            ),
            *(rule for term in self.terms.items() for rule in _of_term(*term, held)),
            (
                not math.isfinite(self.gravity_angle),
                f"gravity_angle: needs a finite angle, got {self.gravity_angle}",
            ),
        )

    @property
    def fitted(self) -> tuple[str, ...]:
        """Return the names of what is fitted of the arm."""
        return tuple(name for name, term in self.terms.items() if term == "fitted")

    @property
    def offset(self) -> float | None:
        """Return the constant torque of every trial, N·m; None if it is fitted."""
        term = self.terms["offset"]
        return None if term == "fitted" else _number(term)

    def law(self) -> Law:
        """Return what is held of the arm."""
        values: dict[str, Any] = {
            name: _number(term) for name, term in self.terms.items() if name != "offset"
        }
        fits = "arm_inertia" in self.fitted
        return Law(gravity_angle=self.gravity_angle, fits_inertia=fits, **values)


def _number(term: Term) -> float:
    return 0.0 if isinstance(term, str) else float(term)


def _of_term(
    name: str, term: object, held: ElbowParameters
) -> Iterator[tuple[bool, str]]:
    # what an option must not be, in the order in which it is asked
    name = {"catch_rise": "rise"}.get(name, name)
    if isinstance(term, str) and term in ("off", "fitted"):
        return
    is_number = isinstance(term, int | float) and math.isfinite(term)
    yield not is_number, f'{name}: needs "off", "fitted" or a number, got {term!r}'
    value = float(term) if isinstance(term, int | float) else 0.0
    if name in ("arm_inertia", "lag", "rise"):
        yield value < 0.0, f"{name}: needs 0 or more, got {value:g}"
    if name == "rise":
        longest = f"{held.peak_duration:g} s"
        text = f"rise: needs 0 to ΔT_peak, {longest}, got {value:g} s"
        yield value > held.peak_duration, text


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """Trials, what was read off them, steps, and the fit of all together."""

    fast: Sequence[Trial]
    trials: list[Trial]  # slow and fast ones that are used
    law: Law
    limits: list[DetectionLimit | None]
    steps: list[Step]
    solution: Solution

    @property
    def shared(self) -> dict[str, float]:
        """Return the shared parameters by name."""
        names = self.solution.equations[0].known.names
        return dict(zip(names, self.solution.shared.tolist(), strict=True))

    def untimed(self) -> dict[str, str]:
        """Return why a lag or a rise is not fitted: samples tell it from none."""
        floors = {name: n * _period(self.trials) for name, n in _FLOORS.items()}
        return {
            name: f"shorter than {1000.0 * floors[name]:.2g} ms, which these samples "
            "do not tell from nothing: taken as 0"
            for name, value in self.shared.items()
            if name in floors and value <= floors[name]
        }


def _period(trials: Sequence[Trial]) -> float:
    return float(np.median(np.diff(trials[0].pre_catch.time)))


def slow_fit(trials: Sequence[Trial], options: FitOptions) -> SlowFit:
    """Fit what slow trials tell: step 1."""
    more = {
        "inertia": options.inertia == "fitted",
        "gravity": "gravity" in options.fitted,
    }
    known = Known(
        names=("damping", "stiffness", *(name for name, fits in more.items() if fits)),
        constants=options.constants,
        spreads={"torque": 1.0},
        law=options.law(),
        offset=options.offset,
        drifts="drift" in options.fitted,
    )
    # in front of a catch, a lag that is not known yet is none
    return fit_slow(
        trials, replace(known, law=replace(known.law, lag=0.0)), level=options.level
    )


def fit_in_rounds(
    stretches: Mapping[str, Stretch], slow: SlowFit, options: FitOptions
) -> Round:
    """Fit trials in rounds: what an arm has moves catches, and catches tell that."""
    first = replace(options.law(), **slow.values)
    # the sum of squares has a valley for each of several lags and rises
    timed = [name for name in _STARTS if name in options.fitted]
    starts: list[dict[str, Any]] = [
        dict(zip(timed, each, strict=True))
        for each in product(*(_STARTS[name] for name in timed))
    ]
    tries = [
        _round(stretches, slow, replace(first, **each), options) for each in starts
    ]
    made = min(tries, key=lambda each: each.solution.typical)
    n_rounds = _ROUNDS if set(options.fitted) - {"offset"} else 1
    for _ in range((_TIMED_ROUNDS if made.law.takes_time else n_rounds) - 1):
        pairs = list(zip(made.trials, made.solution.values, strict=True))
        shifts = {
            trial.name: (trial.catch.time, at["shift"])
            for trial, at in pairs
            if trial.catch is not None and "shift" in at
        }
        instants = {name: sum(pair) for name, pair in shifts.items()}
        # what the fit says of the law before a catch, and of the arm
        known = {*ALWAYS, *ARM_QUANTITIES}
        found: dict[str, Any] = {n: x for n, x in made.shared.items() if n in known}
        if "drift" in options.fitted:
            found["drifts"] = {trial.name: at["drift"] for trial, at in pairs}
        # no catch moves by more than a sample
        furthest = max((abs(by) for _, by in shifts.values()), default=math.inf)
        is_last = furthest < _period(made.trials)
        made = _round(stretches, slow, replace(made.law, **found), options, instants)
        if is_last:
            break
    return made


def _round(
    stretches: Mapping[str, Stretch],
    slow: SlowFit,
    law: Law,
    options: FitOptions,
    instants: Mapping[str, float] | None = None,
) -> Round:
    constants, level, instants = options.constants, options.level, instants or {}
    fast = [
        fast_trial(stretch, name, constants, law, options.window, instants.get(name))
        for name, stretch in stretches.items()
        if stretch.pace == "fast"
    ]
    caught = [trial for trial in fast if trial.catch is not None]
    trials = [*slow.trials, *caught]
    # steps take what earlier ones found as known
    alone = replace(law, **{k: v for k, v in slow.values.items() if k in ALWAYS})
    read = {
        trial.name: levels
        for trial in caught
        if (levels := catch_levels(trial, alone, constants))
    }
    post = fit_post_catch(list(read.values()), level=level)
    limits = _limits(
        trials, list(read), alone, post["post_catch_stiffness"].value, options
    )
    steps, on_line = [slow.step], {}
    if caught:
        catches = [trial.catch for trial in caught if trial.catch is not None]
        used = [t.catch for t in caught if t.catch is not None and t.name in read]
        behind = [limit for limit in limits if limit is not None]
        steps += [
            fit_catch_line(catches, constants, level=level),
            *fit_catches(used, list(read.values()), behind, level=level),
            post,
        ]
        lies = on_the_line(catches, constants).tolist()
        on_line = {trial.name: on for trial, on in zip(caught, lies, strict=True)}
    start = _start(steps, options, law)
    known = Known(
        names=tuple(name for name, value in start.items() if not math.isnan(value)),
        constants=constants,
        spreads=_spreads(steps),
        law=law,
        offset=options.offset,
        drifts="drift" in options.fitted,
    )
    equations = [
        Equations(t, replace(known, on_line=on_line.get(t.name, False), limit=limit))
        for t, limit in zip(trials, limits, strict=True)
    ]
    lowest = {name: _BELOW * n * _period(trials) for name, n in _FLOORS.items()}
    return Round(
        fast=fast,
        trials=trials,
        law=law,
        limits=limits,
        steps=steps,
        solution=fit_together(equations, start, lowest),
    )


def _limits(
    trials: Sequence[Trial],
    read: Sequence[str],
    law: Law,
    stiffness: float,
    options: FitOptions,
) -> list[DetectionLimit | None]:
    # Of catches that do not end, if those that do tell how much travels differ. With
    # m, or where the pre-catch law goes on after a catch, the torque may climb or not
    # whatever k_post is: what could have been seen is not one angle.
    used = [t.catch for t in trials if t.catch is not None and t.name in read]
    seen = {catch.travel for catch in used if catch.end is not None}
    climbs_alone = options.constants.post_catch == "continuous" and law.inertia == 0.0
    if not climbs_alone or len(seen) < 2:
        return [None] * len(trials)
    return [
        detection_limit(trial, stiffness, options.constants)
        if trial.name in read and trial.catch is not None and trial.catch.end is None
        else None
        for trial in trials
    ]


def _start(steps: Sequence[Step], options: FitOptions, law: Law) -> dict[str, float]:
    start = dict.fromkeys(QUANTITIES, math.nan)
    start |= {e.name: e.value for step in steps for e in step.estimates}
    has_catch = not math.isnan(start["catch_torque_constant"])
    for name in ARM_QUANTITIES:
        if name in options.fitted and (has_catch or name not in _FLOORS):
            start[name] = float(getattr(law, name))
    return start


def _spreads(steps: Sequence[Step]) -> dict[str, float]:
    # of one trial, or of none that differ, any size serves
    sds = {e.name: step.residual_sd for step in steps for e in step.estimates}
    of = {
        "torque": "damping",
        "peak": "catch_torque_constant",
        "residual": "residual_ratio",
        "catch angle": "catch_slope",
        "travel": "catch_travel",
    }
    sizes = {kind: sds.get(name, math.nan) for kind, name in of.items()}
    return {kind: sd if sd > 0.0 else 1.0 for kind, sd in sizes.items()}


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
        inertia=inertia,
        slow_below=held.speed_threshold if slow_below is None else slow_below,
        window=window,
        level=level,
    )
    movements = [
        entry if isinstance(entry, Movement) else read_movement(Path(entry))
        for entry in recordings
    ]
    models = sorted({m.model for m in movements if m.model is not None})
    if len(models) > 1:
        raise RecordingError(
            "recordings: a fit needs presentations of one model, which the .json "
            f"beside each recording names; got some of {', '.join(models)}"
        )
    stretches, rest_sd = _stretches(movements, options)
    trials = _slow_trials(stretches, options.slow_below)
    slow, made, reasons = _fitted(trials, stretches, options)
    for trial in (*slow.trials, *made.fast):
        if trial.remark:
            _warn(f"{trial.name}: {trial.remark}")
    result = _result(movements, slow, made, options, rest_sd, reasons)
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
            stacklevel=2,
        )
    return result


def _stretches(
    movements: Sequence[Movement], options: FitOptions
) -> tuple[dict[str, Stretch], float]:
    # by name, and the median noise at rest
    named: dict[str, Stretch] = {}
    noise = []
    for movement in movements:
        here, rest_sd = find_stretches(
            movement, window=options.window, slow_below=options.slow_below
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
    slow = [
        slow_trial(stretch, name)
        for name, stretch in stretches.items()
        if stretch.pace == "slow"
    ]
    used = [trial for trial in slow if trial.pre_catch.time.size]
    for trial in slow:
        if trial not in used:
            why = trial.remark or "too short for the filter of slow stretches"
            _warn(f"{trial.name}: {why}; not used")
    if slow and not used:
        raise RecordingError(
            f"recordings: b and k need a slow stretch; none of {len(slow)} can be used"
        )
    if not used:
        slowest = min(stretch.peak_speed for stretch in stretches.values())
        raise RecordingError(
            "recordings: b and k need a slow stretch, one whose speed stays below "
            f"{math.degrees(limit):g} deg/s; the slowest of {len(stretches)} reaches "
            f"{math.degrees(slowest):.3g} deg/s. --slow-below raises the limit"
        )
    return used


def _fitted(
    trials: Sequence[Trial], stretches: Mapping[str, Stretch], options: FitOptions
) -> tuple[SlowFit, Round, dict[str, str]]:
    # with why a lag or a rise that was to be fitted is not
    slow = slow_fit(trials, options)
    _check_slow(slow, stretches, options)
    made = fit_in_rounds(stretches, slow, options)
    reasons: dict[str, str] = {}
    while untimed := made.untimed():
        reasons |= untimed
        terms: dict[str, Term] = {**options.terms, **dict.fromkeys(reasons, 0.0)}
        made = fit_in_rounds(stretches, slow, replace(options, terms=terms))
    return slow, made, reasons


def _check_slow(
    slow: SlowFit, stretches: Mapping[str, Stretch], options: FitOptions
) -> None:
    # b and k are told by their error: what it does to the torque of these stretches
    torque = max(float(np.ptp(t.pre_catch.torque)) for t in slow.trials)
    speed = max(stretch.peak_speed for stretch in stretches.values())
    travel = max(float(np.ptp(stretch.angle)) for stretch in stretches.values())
    for name, size in (("damping", speed), ("stiffness", travel)):
        estimate, symbol = slow.step[name], QUANTITIES[name].symbol
        df = estimate.df if estimate.df > _MIN_DF else _MIN_DF
        whole = 2.0 * slow.errors[name] * float(stdtrit(df, 0.5 + 0.5 * options.level))
        # an error that matters: of the value, and of the torque at the largest speed
        unsure = whole > abs(estimate.value) and whole * size > torque
        if math.isnan(estimate.value) or unsure:
            raise RecordingError(_untold(name, estimate.value, slow, options))
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
    movements: Sequence[Movement],
    slow: SlowFit,
    made: Round,
    options: FitOptions,
    rest_sd: float,
    untimed: Mapping[str, str],
) -> ElbowFit:
    joint, values = joint_fit(made.solution), made.solution.values
    reasons = {**_reasons(made, options), **untimed}
    estimates = _all_estimates(joint, made, reasons, options)
    _check_law(estimates)
    terms = {**options.terms, **dict.fromkeys(untimed, 0.0)}
    return ElbowFit(
        estimates=estimates,
        correlation=_correlation(joint, made, estimates),
        steps=tuple(made.steps),
        relative_error=slow.relative_error,
        torque_sd=joint.torque_sd,
        lack_of_fit=lack_of_fit(made.solution, joint.tables, rest_sd),
        cross_validation=joint.cross_validation,
        trials=tuple(made.trials),
        fitted_torque=made.solution.laws,
        constants=options.constants,
        arm={**terms, "gravity_angle": options.gravity_angle},
        offsets=tuple(each["offset"] for each in values),
        drifts=tuple(each["drift"] for each in values),
        level=options.level,
        simulated=any(movement.simulated for movement in movements),
        sources={m.name: m.sha256 for m in movements},
        remarks=_remarks(movements, estimates, made),
    )


def _check_law(estimates: Sequence[FittedParameter]) -> None:
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


def _reasons(made: Round, options: FitOptions) -> dict[str, str]:
    # why the steps do not determine what they do not
    if all(trial.catch is None for trial in made.fast):
        why = "there are only slow stretches, in which nothing catches"
        if made.fast:
            why = "no fast stretch has a catch that can be used"
        names = [name for name in QUANTITIES if name not in ALWAYS]
        names += [name for name in options.fitted if name in ("lag", "catch_rise")]
        return dict.fromkeys(names, why)
    estimates = [e for step in made.steps for e in step.estimates]
    return {e.name: e.reason for e in estimates if e.reason is not None}


def _all_estimates(
    joint: JointFit, made: Round, reasons: Mapping[str, str], options: FitOptions
) -> tuple[FittedParameter, ...]:
    # Where travels are censored, D is that of its step. Least squares hold the spread
    # of travels and know less than they say; and they draw each end towards D, by
    # which that spread would come out too small.
    level, names = options.level, list(made.shared)
    by_name = {e.name: e for e in fitted(names, joint.fit, level, reasons)}
    if any(each is not None for each in made.limits):
        whole = {e.name: e for step in made.steps for e in step.estimates}
        by_name["catch_travel"] = whole["catch_travel"]
    optional = {"inertia", *ARM_QUANTITIES} - set(options.fitted) - set(reasons)
    for name in ALL_QUANTITIES:
        if name not in by_name and name not in optional:
            reason = reasons.get(name, UNDETERMINED)
            by_name[name] = FittedParameter(name=name, level=level, reason=reason)
    return tuple(by_name[name] for name in ALL_QUANTITIES if name in by_name)


def _correlation(
    joint: JointFit, made: Round, estimates: Sequence[FittedParameter]
) -> _Floats:
    names = list(made.shared)
    places = [names.index(e.name) if e.name in names else -1 for e in estimates]
    sd = np.sqrt(np.diag(joint.fit.covariance))
    whole = np.full((len(sd) + 1, len(sd) + 1), np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        whole[:-1, :-1] = joint.fit.covariance / np.outer(sd, sd)
    return whole[np.ix_(places, places)]


def _remarks(
    movements: Sequence[Movement], estimates: Sequence[FittedParameter], made: Round
) -> tuple[str, ...]:
    # first which torque it is, of recordings of masrel's driver
    texts: dict[TorqueSource, str] = {
        "sensor": "measured by the device's sensor: what friction compensation leaves "
        "of the device is in it",
        "model": "what the joint model asked for, not measured",
    }
    n_from = Counter(movement.torque_source for movement in movements)
    catches = [trial.catch for trial in made.trials if trial.catch is not None]
    unended = sum(catch.end is None for catch in catches)
    behind = sum(limit is not None for limit in made.limits)
    unused = sum(trial.catch is None for trial in made.fast)
    remarks = [
        f"Torque of {n_from[source]} of {len(movements)} recordings: {text}"
        for source, text in texts.items()
        if n_from[source]
    ]
    remarks += [
        f"{ALL_QUANTITIES[e.name].symbol}: {e.reason}" for e in estimates if e.reason
    ]
    if behind:
        remarks.append(
            f"{behind} of {len(catches)} catches do not end within their stretch: D "
            "counts each as longer than what could be seen of it (censored), and "
            "takes travels to be normal"
        )
    if behind < unended < len(catches):
        remarks.append(
            f"{unended - behind} of {len(catches)} catches do not end within their "
            "stretch and say nothing of D: if D differs between trials, those with a "
            "short one are left, and D is underestimated"
        )
    if unused:
        remarks.append(f"{unused} of {len(made.fast)} fast stretches are not used")
    return tuple(remarks)


def _warn(message: str) -> None:
    # called by what `fit` calls: the warning points to who called that
    warnings.warn(message, RecordingWarning, stacklevel=4)


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparedFit:
    """One fit of a comparison.

    Attributes
    ----------
    fitted : tuple of str
        What is fitted of the arm.
    fit : ElbowFit or None
        The fit; None if there is none.
    reason : str or None
        Why there is none.
    error : float
        Root mean square distance of a trial's torque from what the parameters of all
        other trials give, N·m.
    worse : float
        Mean over trials of the squared distance less that of the best fit, (N·m)².
    worse_se : float
        Standard error of that, over trials; 0 for the best.
    is_chosen : bool
        Whether no fit with less of an arm is within one standard error of the best.
    """

    fitted: tuple[str, ...]
    fit: ElbowFit | None
    reason: str | None
    error: float
    worse: float
    worse_se: float
    is_chosen: bool


def compare_fits(
    recordings: Sequence[Movement | Path | str], **options: Any
) -> tuple[ComparedFit, ...]:
    """Fit with each thing that an arm may have, and predict each trial from the others.

    Parameters
    ----------
    recordings : sequence of Movement or path
        Slow and fast stretches, as for `fit`.
    **options
        Those of `fit`. What is fitted or fixed there is so in every fit.

    Returns
    -------
    tuple of ComparedFit
        The fit with these options first, then with one thing more of the arm each.
        A trial left out keeps its own constant, peak, residual and travel; what the
        others say of it is reckoned as linear as the equations are at the fit. The
        number of trials that all fits use is what is compared.

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
        warnings.simplefilter("ignore", RecordingWarning)
        warnings.simplefilter("ignore", SmallSampleWarning)
        for term in tried:
            try:
                made = fit(movements, **{**options, term: "fitted"})
                fits.append(((term,), made, None))
            except MasrelError as error:
                fits.append(((term,), None, str(error)))
    squares = [
        {
            trial.name: value
            for trial, value in zip(made.trials, made.cross_validation, strict=True)
            if math.isfinite(value)
        }
        if made is not None
        else {}
        for _, made, _ in fits
    ]
    order = sorted(set.intersection(*(set(each) for each in squares if each)))
    table = np.array([[each.get(n, math.nan) for n in order] for each in squares])
    means = table.mean(axis=1) if order else np.full(len(fits), math.nan)
    best = int(np.nanargmin(means)) if order else 0
    more, ses = table - table[best], np.full(len(fits), math.nan)
    if len(order) > 1:
        ses = more.std(axis=1, ddof=1) / math.sqrt(len(order))
    worse = means - means[best]
    near = np.flatnonzero(worse <= ses).tolist()  # fits with fewer terms come first
    return tuple(
        ComparedFit(
            fitted=terms,
            fit=made,
            reason=reason,
            error=math.sqrt(means[i]) if means[i] >= 0.0 else math.nan,
            worse=float(worse[i]),
            worse_se=float(ses[i]),
            is_chosen=near[:1] == [i],
        )
        for i, (terms, made, reason) in enumerate(fits)
    )
