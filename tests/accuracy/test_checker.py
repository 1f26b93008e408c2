"""The checker finds what floats lose, and what is undefined on one side only."""

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest

from masrel.estimates import Estimate
from tests.accuracy.cases import CASES, Case
from tests.accuracy.exactness import checked, faults, relative
from tests.accuracy.scenes import Exact, estimate, exact, prepared


def the(name: str) -> Case:
    return next(case for case in CASES if case.name == name)


def found_in(case: Case, name: str) -> Estimate:
    return estimate(name, "identity", prepared(case))


def cohen_in_floats(table: Sequence[Sequence[int]]) -> tuple[float, float]:
    """Kappa and its error (Fleiss, Cohen and Everitt 1969) as a textbook has them."""
    n, q = sum(map(sum, table)), range(len(table))
    p = [[cell / n for cell in row] for row in table]
    first = [sum(p[k]) for k in q]
    second = [sum(row[k] for row in p) for k in q]
    observed = sum(p[k][k] for k in q)
    chance = sum(first[k] * second[k] for k in q)
    kappa = (observed - chance) / (1 - chance)
    on = sum(p[k][k] * (1 - (first[k] + second[k]) * (1 - kappa)) ** 2 for k in q)
    off = (1 - kappa) ** 2 * sum(
        p[k][m] * (second[k] + first[m]) ** 2 for k in q for m in q if k != m
    )
    variance = on + off - (kappa - chance * (1 - kappa)) ** 2
    return kappa, math.sqrt(max(variance, 0) / (n - 1)) / (1 - chance)


def test_the_textbook_in_floats_is_right_where_nothing_cancels() -> None:
    # 20, 5 / 10, 15: κ = 0.4. What the cases above find out is not another formula.
    case = the("50 items × 2 raters")
    value, error = cohen_in_floats([[20, 5], [10, 15]])
    true = exact(case, "cohen_kappa", "identity")
    assert value == pytest.approx(0.4, rel=1e-15)
    assert relative(error, true.standard_error) < 1e-14


@pytest.mark.parametrize("off", [-2e-14, 2e-14])
def test_a_value_beyond_the_bound_is_found_out(off: float) -> None:
    case = the("4 items × 8 raters (HESS, Table V)")
    found = found_in(case, "fleiss_kappa")
    wrong = replace(found, value=found.value + off)
    assert checked(case, "fleiss_kappa", "identity", found) == []
    assert checked(case, "fleiss_kappa", "identity", wrong) != []


@pytest.mark.parametrize("factor", [1 - 2e-12, 1 + 2e-12, 0.0, math.nan])
def test_an_error_beyond_the_bound_is_found_out(factor: float) -> None:
    case = the("200 items × 5 raters")
    for name in case.coefficients:
        found = found_in(case, name)
        wrong = replace(found, standard_error=found.standard_error * factor)
        assert checked(case, name, "identity", wrong) != []


def test_undefined_on_one_side_only_is_found_out() -> None:
    defined, undefined = the("one item"), the("one category used of three")
    alpha = found_in(undefined, "krippendorff_alpha")
    assert checked(undefined, "krippendorff_alpha", "identity", alpha) == []
    one = exact(defined, "fleiss_kappa", "identity")
    assert faults(alpha, one) != []
    for wrong in (
        replace(alpha, value=1.0, standard_error=0.0, reason=None),
        replace(alpha, reason=None),
        replace(alpha, standard_error=0.0),
    ):
        assert checked(undefined, "krippendorff_alpha", "identity", wrong) != []


def test_an_error_of_one_item_is_found_out() -> None:
    case = the("one item")
    found = found_in(case, "fleiss_kappa")
    assert checked(case, "fleiss_kappa", "identity", found) == []
    wrong = replace(found, standard_error=0.0)
    assert checked(case, "fleiss_kappa", "identity", wrong) != []


def test_a_small_number_in_place_of_zero_is_found_out() -> None:
    case = the("exactly 0, three raters' ratings")
    found = found_in(case, "fleiss_kappa")
    true = exact(case, "fleiss_kappa", "identity")
    assert true.value == 0
    assert faults(replace(found, value=2e-14), true) != []
    nothing = Exact(true.value, 0)
    assert faults(replace(found, standard_error=1e-15), nothing) != []
