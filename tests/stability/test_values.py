"""Values and standard errors against exact ones, where floating point loses digits."""

import math
from fractions import Fraction

import pytest

from masrel.estimates import Estimate
from tests.stability.cases import CASES, METRICS, Case
from tests.stability.reference import units_off
from tests.stability.scenes import Exact, estimate, exact, prepared

VALUE_ULP = 1.0  # nominal; the nearest float is within 0.5
WEIGHTED_ULP = 4.0
ERROR = 1e-12  # relative


def faults(found: Estimate, true: Exact, ulp: float) -> list[str]:
    """Say what of an estimate is not as exact as it has to be."""
    if true.value is None:
        wrong = []
        if not (math.isnan(found.value) and math.isnan(found.standard_error)):
            wrong.append(f"0/0 has the value {found.value}")
        if not found.reason:
            wrong.append("undefined without a reason")
        return wrong
    if found.reason is not None or math.isnan(found.value):
        return [f"{float(true.value)} is called undefined: {found.reason}"]
    wrong = []
    if (off := units_off(found.value, true.value)) > ulp:
        wrong.append(f"value {found.value!r} is {off:.1f} ulp off")
    if true.standard_error is None:
        if not math.isnan(found.standard_error):
            wrong.append(f"one item has the standard error {found.standard_error}")
    elif not relative(found.standard_error, true.standard_error) <= ERROR:
        wrong.append(
            f"standard error {found.standard_error!r}, not {true.standard_error}"
        )
    return wrong


def relative(found: float, true: object) -> float:
    """Return the relative error; of a true 0, whether it is one."""
    if true == 0:
        return 0.0 if found == 0 else math.inf
    return float(abs(found - true) / true)  # type: ignore[operator]


def checked(case: Case, name: str, weights: str) -> list[str]:
    ulp = VALUE_ULP if weights in ("identity", "nominal") else WEIGHTED_ULP
    found = estimate(case, name, weights, prepared(case))
    return faults(found, exact(case, name, weights), ulp)


def parts(case: Case) -> list[tuple[str, str]]:
    return [
        (name, weights)
        for weights in case.weights
        for name in case.coefficients
        if weights not in METRICS or name == "krippendorff_alpha"
    ]


@pytest.mark.parametrize(
    ("case", "name", "weights"),
    [
        pytest.param(
            case,
            name,
            weights,
            id=f"{case.name}-{name}-{weights}",
            marks=[pytest.mark.slow] if case.slow else [],
        )
        for case in CASES
        for name, weights in parts(case)
    ],
)
def test_estimates_of_hard_tables_are_exact(
    case: Case, name: str, weights: str
) -> None:
    assert checked(case, name, weights) == []


def test_fractions_of_the_reference_are_not_floats() -> None:
    case = CASES[0]
    assert isinstance(exact(case, "fleiss_kappa", "identity").value, Fraction)
