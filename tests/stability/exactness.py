"""How far an estimate may be from the exact one, and what is wrong with it if further.

A value is the float nearest to the exact ratio; with weights that are irrational, and
so known to 40 digits, within one unit in the last place. A standard error is within a
relative 1e-12. Only those of Conger's and Light's kappa are summed in floats, item by
item: where the items' influences cancel, their error is relative to what cancels.
"""

import math
from dataclasses import replace
from fractions import Fraction
from typing import Any

import mpmath

from masrel.estimates import Estimate
from tests.stability.cases import OF_RATERS, Case
from tests.stability.reference import units_off
from tests.stability.scenes import Exact, exact

IRRATIONAL = ("radical", "circular")
ERROR = 1e-12  # relative, of a standard error
_ROUNDINGS = 4  # of each item's influence, where they are summed in floats


def units_allowed(weights: str) -> float:
    """Return how many units in the last place a value may be off."""
    return 1.0 if weights in IRRATIONAL else 0.5


def relative(found: float, true: Any) -> float:
    """Return a relative error; infinite for a number that should be 0 and is not."""
    if true == 0:
        return 0.0 if found == 0 else math.inf
    return float(abs(found - mpmath.mpf(true)) / abs(true))


def faults(found: Estimate, true: Exact, weights: str, spread: float = 0) -> list[str]:
    """Say what of an estimate is not as exact as it has to be.

    `spread` is the size of what cancels in the standard error, 0 unless it is summed
    in floats.
    """
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
        allowed = ERROR * true.standard_error + _ROUNDINGS * math.ulp(spread)
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


def cancelling(case: Case, name: str, weights: str, value: Fraction | None) -> float:
    """Return the size of the terms that an item's influence is the difference of.

    With D_o = 1 - p_o they are D_o / D_e = 1 - κ, times what an item's disagreement
    is of the mean one; of n items their root mean square over √n is
    (1 - κ) (1 / √n + SE(p_o) / D_o).
    """
    if name not in OF_RATERS or value is None or value == 1:
        return 0.0
    if name == "light_kappa":
        whole = [(row, times) for row, times in case.rows if None not in row]
        case = replace(case, rows=whole)
    of_p = exact(case, "percent_agreement", weights)
    n = sum(item.times for item in case.items if item.counts)
    if of_p.value is None or of_p.standard_error is None:
        return 0.0
    spread = 1 / math.sqrt(n)
    if of_p.value != 1:
        spread += float(of_p.standard_error) / float(1 - of_p.value)
    return float(1 - value) * spread


def checked(case: Case, name: str, weights: str, found: Estimate) -> list[str]:
    """Hold an estimate to the exact one of a case."""
    true = exact(case, name, weights)
    return faults(found, true, weights, cancelling(case, name, weights, true.value))
