"""How far an estimate may be from the exact one, and what is wrong with it if further.

A value is the float nearest to the exact ratio; with weights that are irrational, and
so known to 40 digits, within one unit in the last place. A standard error is within a
relative 1e-12.
"""

import math
from typing import Any

import mpmath

from masrel.estimates import Estimate
from tests.accuracy.cases import Case
from tests.accuracy.reference import units_off
from tests.accuracy.scenes import Exact, exact

IRRATIONAL = ("radical", "circular")
ERROR = 1e-12  # relative, of a standard error


def units_allowed(weights: str) -> float:
    """Return how many units in the last place a value may be off."""
    return 1.0 if weights in IRRATIONAL else 0.5


def relative(found: float, true: Any) -> float:
    """Return a relative error; infinite for a number that should be 0 and is not."""
    if true == 0:
        return 0.0 if found == 0 else math.inf
    return float(abs(found - mpmath.mpf(true)) / abs(true))


def faults(found: Estimate, true: Exact, weights: str) -> list[str]:
    """Say what of an estimate is not as exact as it has to be."""
    if true.value is None:
        return _faults_of_undefined(found)
    if found.reason is not None or math.isnan(found.value):
        return [f"{float(true.value)} is called undefined: {found.reason}"]
    wrong = []
    if (off := units_off(found.value, true.value)) > units_allowed(weights):
        wrong.append(f"value {found.value!r} is {off:.2f} ulp off")
    error = found.standard_error
    if true.standard_error is None:
        if not math.isnan(error):
            wrong.append(f"a single item has the standard error {error}")
    else:
        allowed = ERROR * true.standard_error
        if not abs(error - true.standard_error) <= allowed:  # also nan
            wrong.append(f"standard error {error!r}, not {true.standard_error}")
    return wrong


def _faults_of_undefined(found: Estimate) -> list[str]:
    wrong = []
    if not (math.isnan(found.value) and math.isnan(found.standard_error)):
        wrong.append(f"0/0 is {found.value} with error {found.standard_error}")
    if not found.reason:
        wrong.append("undefined without a reason")
    return wrong


def checked(case: Case, name: str, weights: str, found: Estimate) -> list[str]:
    """Hold an estimate to the exact one of a case."""
    return faults(found, exact(case, name, weights), weights)
