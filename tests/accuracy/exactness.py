"""How far an estimate may be from the exact one, and what is wrong with it if further.

A value is within 1e-14 of the exact ratio, relative to its size or to 1: it is 1 less a
ratio of sums that are rounded. A standard error is within 1e-12 of itself and 0.001;
where it is 0, it is 0. Where 1 - p_e < 1e-6, by which both are divided, it is 1e-8.
"""

import math
from typing import Any

import mpmath

from masrel.estimates import Estimate
from tests.accuracy.cases import Case
from tests.accuracy.scenes import Exact, exact

VALUE = 1e-14  # of a value, or of 1 where it is smaller
ERROR = 1e-12  # of a standard error and 0.001
NEAR_1 = 1e-8  # of both where 1 - p_e < 1e-6


def relative(found: float, true: Any) -> float:
    """Return a relative error; infinite for a number that should be 0 and is not."""
    if true == 0:
        return 0.0 if found == 0 else math.inf
    return float(abs(found - mpmath.mpf(true)) / abs(true))


def faults(found: Estimate, true: Exact) -> list[str]:
    """Say what of an estimate is not as exact as it has to be."""
    if true.value is None:
        return _faults_of_undefined(found)
    if found.reason is not None or math.isnan(found.value):
        return [f"{float(true.value)} is called undefined: {found.reason}"]
    wrong = []
    off = abs(found.value - mpmath.mpf(true.value))
    is_near_1 = 0.0 <= 1.0 - found.chance < 1e-6
    if off > (NEAR_1 if is_near_1 else VALUE) * max(abs(true.value), 1):
        wrong.append(f"value {found.value!r} is {float(off):.2g} off")
    error = found.standard_error
    if true.standard_error is None:
        if not math.isnan(error):
            wrong.append(f"a single item has the standard error {error}")
    else:
        share = NEAR_1 if is_near_1 else ERROR
        least = 1e-3 if true.standard_error else 0.0
        allowed = share * (true.standard_error + least)
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
    return faults(found, exact(case, name, weights))
