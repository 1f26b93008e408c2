"""Trials and the fit of them, in turn: each round knows what the one before found.

In: stretches, and what a fit is asked for. Out: the last round.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Literal

import numpy as np

from masrel.errors import ParameterError
from masrel.lab.elbow.identification._catches import (
    Law,
    Trial,
    catch_levels,
    fast_trial,
)
from masrel.lab.elbow.identification._equations import (
    DetectionLimit,
    Equations,
    Known,
    Solution,
    fit_together,
)
from masrel.lab.elbow.identification._model_file import ARM_QUANTITIES, QUANTITIES
from masrel.lab.elbow.identification._results import Step
from masrel.lab.elbow.identification._steps import (
    SlowFit,
    can_be_censored,
    detection_limit,
    fit_catch_line,
    fit_catches,
    fit_post_catch,
    fit_slow,
    on_the_line,
    travels_seen,
)
from masrel.lab.elbow.identification._stretches import Stretch
from masrel.lab.elbow.parameters import ElbowParameters

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
        needs = [
            (
                0.5 < self.level < 1.0,
                f"level: needs more than 0.5 and less than 1, got {self.level}",
            ),
            (
                held.residual_reading == "residual" and held.catch_rise == 0.0,
                "constants: a fit reads Q as section II does and takes the rise of a "
                'catch from its option; needs residual_reading "residual" and '
                f"catch_rise 0, got {held.residual_reading!r} and {held.catch_rise:g}",
            ),
            (
                0.0 < self.slow_below < math.inf,
                f"slow_below: needs more than 0, got {self.slow_below}",
            ),
            (
                0.0 < self.window < math.inf,
                f"window: needs more than 0 s, got {self.window}",
            ),
            (
                self.inertia in ("zero", "fitted"),
                f'inertia: needs "zero" or "fitted", got {self.inertia!r}',
            ),
            (
                not (fits_inertia and held.post_catch == "additive"),
                'inertia: with post_catch "additive", m is in every phase but the '
                "catch, and where one ends cannot be told from the jump of m·θ̈; needs "
                '"zero", got "fitted"',
            ),
            *(need for term in self.terms.items() for need in _of_term(*term, held)),
            (
                math.isfinite(self.gravity_angle),
                f"gravity_angle: needs a finite angle, got {self.gravity_angle}",
            ),
        ]
        for is_met, need in needs:
            if not is_met:
                raise ParameterError(need)

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
    # what an option must be, in the order in which it is asked
    name = {"catch_rise": "rise"}.get(name, name)
    if isinstance(term, str) and term in ("off", "fitted"):
        return
    is_number = isinstance(term, int | float) and math.isfinite(term)
    yield is_number, f'{name}: needs "off", "fitted" or a number, got {term!r}'
    value = float(term) if isinstance(term, int | float) else 0.0
    if name in ("arm_inertia", "lag", "rise"):
        yield value >= 0.0, f"{name}: needs 0 or more, got {value:g}"
    if name == "rise":
        longest = f"{held.peak_duration:g} s"
        text = f"rise: needs 0 to ΔT_peak, {longest}, got {value:g} s"
        yield value <= held.peak_duration, text


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """Trials, what was read off them, steps, and the fit of all together."""

    fast: Sequence[Trial]
    trials: list[Trial]  # slow and fast ones that are used
    law: Law
    limits: list[DetectionLimit | None]
    steps: list[Step]
    equations: list[Equations]
    solution: Solution

    def shared(self) -> dict[str, float]:
        """Return the shared parameters by name."""
        names = self.equations[0].known.names
        return dict(zip(names, self.solution.shared.tolist(), strict=True))

    def untimed(self) -> dict[str, str]:
        """Return why a lag or a rise is not fitted: samples tell it from none."""
        floors = {name: n * _period(self.trials) for name, n in _FLOORS.items()}
        return {
            name: f"shorter than {1000.0 * floors[name]:.2g} ms, which these samples "
            "do not tell from nothing: taken as 0"
            for name, value in self.shared().items()
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
        values = made.solution.values(made.equations)
        shifts = {
            trial.name: (trial.catch.time, at["shift"])
            for trial, at in zip(made.trials, values, strict=True)
            if trial.catch is not None and "shift" in at
        }
        instants = {name: sum(pair) for name, pair in shifts.items()}
        # no catch moves by more than a sample
        furthest = max((abs(by) for _, by in shifts.values()), default=math.inf)
        period = _period(made.trials)
        made = _round(stretches, slow, _next(made, options), options, instants)
        if furthest < period:
            break
    return made


def _next(made: Round, options: FitOptions) -> Law:
    # what the fit says of the law before a catch, and of the arm
    values = made.solution.values(made.equations)
    drifts = {t.name: at["drift"] for t, at in zip(made.trials, values, strict=True)}
    known = {*ALWAYS, *ARM_QUANTITIES}
    found: dict[str, Any] = {n: x for n, x in made.shared().items() if n in known}
    found["drifts"] = drifts if "drift" in options.fitted else {}
    return replace(made.law, **found)


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
        equations=equations,
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
    climbs_alone = options.constants.post_catch == "continuous" and law.inertia == 0.0
    if not climbs_alone or not can_be_censored(travels_seen(used)):
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
