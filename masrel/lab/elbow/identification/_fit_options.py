"""What a fit is asked for, checked once: constants, and what an arm has."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

from masrel.errors import ParameterError
from masrel.lab.elbow.identification._catches import Arm
from masrel.lab.elbow.parameters import ElbowParameters

Term = float | Literal["off", "fitted"]
"""What an arm has: nothing of it, a fixed value in SI units, or what is fitted."""

STARTS = {"lag": (0.004, 0.016), "catch_rise": (0.01, 0.04, 0.08)}
"""Where the search for what takes time begins, s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FitOptions:
    """The options of a fit, as it takes them."""

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
            name: STARTS.get(name, (0.0,))[0] if term == "fitted" else _number(term)
            for name, term in self.terms.items()
            if name != "offset"
        }
        fits = "arm_inertia" in self.fitted
        return replace(
            Arm(gravity_angle=self.gravity_angle, fits_inertia=fits), **values
        )


def _number(term: Term) -> float:
    return 0.0 if isinstance(term, str) else float(term)


def check_options(options: FitOptions, inertia: str) -> None:
    """Refuse options outside their ranges."""
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
    if not 0.0 < options.window < math.inf:
        raise ParameterError(f"window: needs more than 0 s, got {options.window}")
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
