"""What a package says of one number, and how far that is off the exact one."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mpmath

from docs.make.accuracy.peers import Answer, ask, offers_errors
from tests.accuracy.cases import Case
from tests.accuracy.exactness import relative
from tests.accuracy.reference import units_off
from tests.accuracy.scenes import estimate, exact, prepared

QUANTITIES = ("value", "standard error")


@dataclass(frozen=True, slots=True, kw_only=True)
class Number:
    """How far a number is off the exact one.

    Of an exact 0 there are no units and no relative error: `absolute` is the number
    found in its place.
    """

    case: Case
    coefficient: str
    weights: str
    what: str  # of the QUANTITIES
    package: str
    exact: Any  # None where it is 0/0
    has_reason: bool  # masrel's nan
    units: float = math.nan
    relative: float = math.nan
    absolute: float | None = None
    note: str = ""

    @property
    def is_offered(self) -> bool:
        return self.note != "not offered"

    @property
    def is_unasked(self) -> bool:
        return self.note.startswith("no answer")

    @property
    def counts(self) -> bool:
        """Whether there is an exact number, and this is by the same formula."""
        is_comparable = self.is_offered and self.note != "other formula"
        return is_comparable and self.exact is not None


def compared(
    case: Case, coefficient: str, weights: str, packages: Sequence[str]
) -> list[Number]:
    """Ask masrel and every package, and hold them to the exact coefficient."""
    with mpmath.workdps(50):
        true = exact(case, coefficient, weights)
        ours = estimate(coefficient, weights, prepared(case))
        answers = {"masrel": Answer(ours.value, ours.standard_error)}
        answers |= {p: ask(p, case, coefficient, weights) for p in packages}
        numbers = []
        for what in QUANTITIES:
            right = true.value if what == "value" else true.standard_error
            for package, answer in answers.items():
                if what == "value":
                    found = _of_value(answer, right)
                elif package == "masrel" or offers_errors(package, coefficient):
                    found = _of_error(answer, right, case)
                else:
                    found = {"note": "not offered"}
                number = Number(
                    case=case,
                    coefficient=coefficient,
                    weights=weights,
                    what=what,
                    package=package,
                    exact=right,
                    has_reason=bool(ours.reason),
                    **found,
                )
                numbers.append(number)
        return numbers


def _of_value(answer: Answer, true: Any) -> dict[str, Any]:
    return {"note": answer.note} if answer.note else _off(answer.value, true)


def _of_error(answer: Answer, true: Any, case: Case) -> dict[str, Any]:
    if answer.note:
        return {"note": answer.note.split(":")[0]}  # the value says of what kind
    if answer.other_error and answer.standard_error is not None:
        return {"note": "other formula"}
    if answer.over_n and true is not None:
        n = sum(item.times for item in case.items if item.pairs)
        true = true * mpmath.sqrt(mpmath.mpf(n - 1) / n)
    return _off(answer.standard_error, true)


def _off(number: float | None, true: Any) -> dict[str, Any]:
    # of a number that is None where it is not offered, from one that is where it is 0/0
    if number is None:
        return {"note": "not offered"}
    if true is None or math.isnan(number):
        return {"note": "nan" if math.isnan(number) else f"gives {number:.3g}"}
    if true == 0:
        return {"absolute": abs(number)}
    if isinstance(true, mpmath.mpf):
        units = float(abs(number - true)) / math.ulp(float(true))
    else:
        units = units_off(number, true)
        true = mpmath.mpf(true.numerator) / true.denominator
    return {"units": units, "relative": relative(number, true)}
