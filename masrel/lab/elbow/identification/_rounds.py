"""Trials and the fit of them take turns: each round knows what the one before found.

In: stretches and the options of a fit. Out: trials with their catches, the steps of the
source, and the fit of all trials together.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, section II.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Literal

import numpy as np

from masrel._input import refuse
from masrel.lab.elbow._model_file import ARM_QUANTITIES, QUANTITIES
from masrel.lab.elbow.identification._catches import (
    Law,
    Stretch,
    Trial,
    fast_trial,
)
from masrel.lab.elbow.identification._clusters import Step, fitted
from masrel.lab.elbow.identification._equations import (
    DetectionLimit,
    Equations,
    JointFit,
    fit_together,
)
from masrel.lab.elbow.identification._steps import fit_catches
from masrel.lab.elbow.parameters import ElbowParameters

# What an arm has: nothing of it, a fixed value in SI units, or what is fitted.
Term = float | Literal["off", "fitted"]

# What slow trials tell.
ALWAYS = ("damping", "stiffness", "inertia")

# Of what takes time: where the search for it begins, s.
LATEST_S = 0.05  # that an angle may be beside its torque
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
                "constants: a fit reads Q as in section II and takes the rise of a "
                'catch from its own option; needs residual_reading "residual" and '
                f"catch_rise 0, got {held.residual_reading!r} and {held.catch_rise:g}",
            ),
            (
                not 0.0 < self.slow_below < math.inf,
                f"slow_below: needs more than 0, got {self.slow_below}",
            ),
            (
                self.inertia not in ("zero", "fitted"),
                f'inertia: needs "zero" or "fitted", got {self.inertia!r}',
            ),
            (
                fits_inertia and held.post_catch == "additive",
                'inertia: with post_catch "additive", m acts in every phase except the '
                "catch, so the end of a catch cannot be distinguished from the jump of "
                'm·θ̈; needs "zero", got "fitted"',
            ),
            *(
                rule
                for name, term in self.terms.items()
                for rule in _rules(name, term, held.peak_duration)
            ),
            (
                not math.isfinite(self.gravity_angle),
                f"gravity_angle: needs a finite angle, got {self.gravity_angle}",
            ),
        )

    @property
    def fitted(self) -> tuple[str, ...]:
        """Return the names of what is fitted of the arm."""
        return tuple(name for name, term in self.terms.items() if term == "fitted")

    def without(self, terms: Iterable[str]) -> "FitOptions":
        """Return the options with none of these terms of the arm."""
        return replace(self, terms={**self.terms, **dict.fromkeys(terms, 0.0)})

    @property
    def law(self) -> Law:
        """Return what is held of the arm."""
        held: dict[str, Any] = {
            name: 0.0 if isinstance(term, str) else float(term)
            for name, term in self.terms.items()
        }
        held["lag"] = max(held["lag"], 0.0)  # below, the recordings are put right
        return Law(
            constants=self.constants,
            fitted=self.fitted,
            gravity_angle=self.gravity_angle,
            **held,
        )


def _rules(name: str, term: object, longest: float) -> list[tuple[bool, str]]:
    # what a term must not be, in the order in which it is asked
    shown = {"catch_rise": "rise"}.get(name, name)
    is_word = isinstance(term, str) and term in ("off", "fitted")
    is_number = isinstance(term, int | float) and math.isfinite(term)
    value = float(term) if isinstance(term, int | float) else 0.0
    is_size = name in ("arm_inertia", "lag", "catch_rise")
    least = -LATEST_S if name == "lag" else 0.0
    return [
        (
            not is_word and not is_number,
            f'{shown}: needs "off", "fitted" or a number, got {term!r}',
        ),
        (is_size and value < least, f"{shown}: needs {least:g} or more, got {value:g}"),
        (
            name == "catch_rise" and value > longest,
            f"{shown}: needs 0 to ΔT_peak, {longest:g} s, got {value:g} s",
        ),
    ]


def _period(trials: Sequence[Trial]) -> float:
    return float(np.median(np.diff(trials[0].pre_catch.time)))


def fit_slow(trials: Sequence[Trial], options: FitOptions) -> JointFit:
    """Fit b, k, and of m and weight what is fitted, to slow trials: step 1.

    Each trial has a constant of its own, -k·θ_rest of (1) and the sensor's zero, unless
    the offset is fixed.
    """
    is_fitted = {
        "damping": True,
        "stiffness": True,
        "inertia": options.inertia == "fitted",
        "gravity": "gravity" in options.fitted,
    }
    names = tuple(name for name, fits in is_fitted.items() if fits)
    # in front of a catch, a lag that is not known yet is none
    law = replace(options.law, lag=0.0)
    equations = [Equations(trial, names, {"torque": 1.0}, law) for trial in trials]
    joint = fit_together(equations, dict.fromkeys(names, 0.0), {})
    step = Step(
        name="slow trials: b, k of (1)",
        estimates=fitted(names, joint.clustered(), options.level),
        residual_sd=math.sqrt(float((np.concatenate(joint.residuals) ** 2).mean())),
    )
    return replace(joint, steps=(step,))


def fit_in_rounds(
    stretches: Sequence[Stretch], slow: JointFit, options: FitOptions
) -> JointFit:
    """Fit trials in rounds: what an arm has moves catches, and catches tell that."""
    values: dict[str, Any] = {name: e.value for name, e in slow.alone.items()}
    first = replace(options.law, **values)
    # the sum of squares has a valley for each of several lags and rises
    timed = [name for name in _STARTS if name in options.fitted]
    starts: list[dict[str, Any]] = [
        dict(zip(timed, times, strict=True))
        for times in product(*(_STARTS[name] for name in timed))
    ]
    tries = [
        _round(stretches, slow, replace(first, **start), options, {})
        for start in starts
    ]
    last = min(tries, key=lambda joint: joint.typical)
    n_rounds = _ROUNDS if set(options.fitted) - {"offset"} else 1
    for _ in range((_TIMED_ROUNDS if timed or first.takes_time else n_rounds) - 1):
        shifts = [
            (trial.stretch.name, trial.catch.time, values["shift"])
            for trial, values in zip(last.trials, last.values, strict=True)
            if trial.catch is not None and "shift" in values
        ]
        instants = {name: time + by for name, time, by in shifts}
        # no catch moves by more than a sample
        furthest = max((abs(by) for _, _, by in shifts), default=math.inf)
        is_last = furthest < _period(last.trials)
        last = _round(stretches, slow, fitted_law(last), options, instants)
        if is_last:
            break
    return last


def fitted_law(joint: JointFit) -> Law:
    """Return what a fit says of the law before a catch, and of the arm."""
    held, known = joint.equations[0].held, {*ALWAYS, *ARM_QUANTITIES}
    values: dict[str, Any] = {n: x for n, x in joint.shared.items() if n in known}
    if "drift" in held.fitted:
        pairs = zip(joint.trials, joint.values, strict=True)
        values["drifts"] = {trial.stretch.name: own["drift"] for trial, own in pairs}
    return replace(held, **values)


def untimed_terms(joint: JointFit) -> dict[str, str]:
    """Return why a lag or a rise is not fitted: samples cannot show it."""
    floors = {name: n * _period(joint.trials) for name, n in _FLOORS.items()}
    return {
        name: f"shorter than {1000.0 * floors[name]:.2g} ms, which these samples "
        "cannot distinguish from 0; taken as 0"
        for name, value in joint.shared.items()
        if name in floors and abs(value) <= floors[name]
    }


def _round(
    stretches: Sequence[Stretch],
    slow: JointFit,
    law: Law,
    options: FitOptions,
    instants: Mapping[str, float],
) -> JointFit:
    fast = tuple(
        fast_trial(stretch, law, instants.get(stretch.name))
        for stretch in stretches
        if stretch.pace == "fast"
    )
    caught = [trial for trial in fast if trial.catch is not None]
    trials, steps = [*slow.trials, *caught], list(slow.steps)
    lines: dict[str, bool] = {}
    limits: dict[str, DetectionLimit] = {}
    if caught:
        # steps take what earlier ones found as known
        known: dict[str, Any] = {
            name: e.value for name, e in slow.alone.items() if name in ALWAYS
        }
        more, lines, limits = fit_catches(caught, replace(law, **known), options.level)
        steps += more
    start = _start(steps, law)
    names = tuple(name for name, value in start.items() if not math.isnan(value))
    spreads = _spreads(steps)
    equations = [
        Equations(
            trial,
            names,
            spreads,
            law,
            on_line=lines.get(trial.stretch.name, False),
            limit=limits.get(trial.stretch.name),
        )
        for trial in trials
    ]
    lowest = {name: _BELOW * n * _period(trials) for name, n in _FLOORS.items()}
    joint = fit_together(equations, start, lowest)
    return replace(joint, steps=tuple(steps), fast=fast)


def _start(steps: Sequence[Step], law: Law) -> dict[str, float]:
    start = dict.fromkeys(QUANTITIES, math.nan)
    start |= {e.name: e.value for step in steps for e in step.estimates}
    has_catch = not math.isnan(start["catch_torque_constant"])
    return start | {
        name: float(getattr(law, name))
        for name in ARM_QUANTITIES
        if name in law.fitted and (has_catch or name not in _FLOORS)
    }


def _spreads(steps: Sequence[Step]) -> dict[str, float]:
    # of one trial, or of none that differ, any size serves
    sds = {e.name: step.residual_sd for step in steps for e in step.estimates}
    kinds = {
        "torque": "damping",
        "peak": "catch_torque_constant",
        "residual": "residual_ratio",
        "catch angle": "catch_slope",
        "travel": "catch_travel",
    }
    sizes = {kind: sds.get(name, math.nan) for kind, name in kinds.items()}
    return {kind: sd if sd > 0.0 else 1.0 for kind, sd in sizes.items()}
