"""Every reference data set, against 50-digit values and other programs' output."""

import math
import warnings
from decimal import Decimal

import numpy as np
import pytest

from masrel.agreement import (
    bhapkar,
    bowker,
    category_kappa,
    contingency_table,
    fleiss_null,
    icc,
    icc_f_test,
    kendall_w,
    kendall_w_test,
    light_kappa,
    mcnemar,
    p_value,
    robinson_a,
    stuart_maxwell,
)
from masrel.errors import UndefinedStatisticWarning
from tests.agreement.oracles import Dataset, by_dataset, datasets, estimate, values
from tests.agreement.test_undefined import assert_undefined

EXACT = (
    "percent_agreement",
    "cohen_kappa",
    "conger_kappa",
    "fleiss_kappa",
    "gwet_ac",
    "brennan_prediger",
    "krippendorff_alpha",
    "krippendorff_alpha_metric",
)
pytestmark = pytest.mark.filterwarnings(
    "ignore::masrel.errors.UndefinedStatisticWarning"
)


@by_dataset(*EXACT, field="exact")
def test_estimate_is_the_exact_value_but_for_rounding(
    dataset: Dataset, key: str
) -> None:
    exact = dataset["expected"][key]["exact"]
    found = estimate(dataset, key)
    if "rater_without_ratings" in dataset["name"] and "conger" in key:
        # irrCAC has none; here a rater without any rating is no rater
        two = {**dataset, "ratings": [row[:2] for row in dataset["ratings"]]}
        assert found == estimate(two, key)
    elif exact is None:
        assert math.isnan(found.value)
        assert found.reason
    else:
        assert found.reason is None
        scale = max(abs(float(exact)), 1.0)  # 1 - D_o/D_e: what rounds is the ratio
        assert abs(found.value - float(exact)) <= 1e-14 * scale


@by_dataset(*EXACT, field="se_delta")
def test_standard_error_is_that_of_the_delta_method(dataset: Dataset, key: str) -> None:
    expected, found = dataset["expected"][key]["se_delta"], estimate(dataset, key)
    error = float(expected)
    if "krippendorff" in key and found.n_items > 1:
        # With n - 1 in alpha, of n ratings, the mean of the influences is not 0: it is
        # -(1 - α)/(n - 1), which the reference leaves in. A sample variance does not.
        sizes = [sum(x is not None for x in row) for row in dataset["ratings"]]
        n = sum(size for size in sizes if size > 1)
        mean = (1 - Decimal(dataset["expected"][key]["exact"])) / (n - 1)
        square = Decimal(expected) ** 2 - mean**2 / (found.n_items - 1)
        is_spread = square > Decimal("1e-14") * mean**2  # as many digits are stored
        error = math.sqrt(square) if is_spread else 0.0
    # Where it is 0 the reference has its rounding, up to 1e-15.
    assert found.standard_error == pytest.approx(error, rel=1e-12, abs=1e-15)


@by_dataset("fleiss_kappa", "gwet_ac", "conger_kappa", field="p")
def test_p_value_is_two_sided_as_printed_where_the_errors_agree(
    dataset: Dataset, key: str
) -> None:
    expected, found = dataset["expected"][key], estimate(dataset, key)
    if "caution" in expected or found.reason is not None or expected["p"] is None:
        return
    if found.standard_error == 0.0:  # printed as 0, or as NaN
        assert_undefined(lambda: p_value(found))
        return
    p = p_value(found)
    assert 0.0 <= p <= 1.0
    if found.standard_error == pytest.approx(expected["se"], rel=1e-9):
        # The reference has an absolute accuracy of some 1e-16.
        assert p == pytest.approx(expected["p"], rel=1e-7, abs=1e-13)


@by_dataset("icc", field="estimate")
def test_icc_with_interval_and_f_test(dataset: Dataset, key: str) -> None:
    form = key.partition("/")[2]
    expected = dataset["expected"][key]
    psych = dataset["expected"].get(f"{key}@psych", {})
    whole = values(dataset)
    whole = whole[~np.isnan(whole).any(axis=1)]  # irr leaves out items with a gap
    found = icc(whole, form=form, interval="F")  # type: ignore[arg-type]
    test = icc_f_test(values(dataset), form=form)  # type: ignore[arg-type]
    if expected["estimate"] is None:
        assert found.reason
        return
    assert found.value == pytest.approx(expected["estimate"], rel=1e-9, abs=1e-12)
    # irr's interval of ICC(A,k) takes wrong degrees of freedom; psych's does not.
    low, high = (psych if form == "ICC(A,k)" else expected).get("ci") or (None, None)
    if low is not None:
        assert found.interval is not None
        assert found.interval.low == pytest.approx(low, rel=1e-8, abs=1e-9)
        assert found.interval.high == pytest.approx(high, rel=1e-8, abs=1e-9)
    if expected.get("F") is not None and math.isfinite(test.statistic):
        assert test.statistic == pytest.approx(expected["F"], rel=1e-9, abs=1e-12)
        p = psych.get("p", test.p_value)  # irr's is of other degrees of freedom
        assert test.p_value == pytest.approx(p, rel=1e-8, abs=1e-14)


@by_dataset("kendall_w", field="estimate")
def test_kendalls_w_and_its_test(dataset: Dataset, key: str) -> None:
    expected, ties = dataset["expected"][key], key.endswith("tie_corrected")
    found = kendall_w(values(dataset), ties=ties)
    if expected["estimate"] is None:
        assert found.reason
        return
    assert found.value == pytest.approx(expected["estimate"], rel=1e-13)
    test = kendall_w_test(values(dataset), ties=ties)
    assert test.statistic == pytest.approx(expected["chisq"], rel=1e-12)
    assert test.p_value == pytest.approx(expected["p"], rel=1e-9)


@by_dataset("robinson_a", field="estimate")
def test_robinsons_a(dataset: Dataset, key: str) -> None:
    expected = dataset["expected"][key]["estimate"]
    found = robinson_a(values(dataset))
    if expected is None:
        assert found.reason
    else:
        assert found.value == pytest.approx(expected, rel=1e-12, abs=1e-14)


@by_dataset("light_kappa", field="estimate")
def test_lights_kappa(dataset: Dataset, key: str) -> None:
    expected = dataset["expected"][key]["estimate"]
    found = light_kappa(dataset["ratings"], categories=dataset["categories"])
    if expected is None:
        assert found.reason
    else:
        assert found.value == pytest.approx(expected, rel=1e-12, abs=1e-14)


@by_dataset("mcnemar", "bowker_symmetry", "stuart_maxwell", "bhapkar", field="estimate")
def test_symmetry_and_margins(dataset: Dataset, key: str) -> None:
    name, _, kind = key.partition("/")
    if name == "bowker_symmetry" and kind != "empty_pairs_dropped":
        return  # counts pairs between which nothing changed as degrees of freedom
    expected = dataset["expected"][key]
    table = contingency_table(dataset["ratings"], categories=dataset["categories"])
    if name == "mcnemar":
        found = mcnemar(table, kind=kind)  # type: ignore[arg-type]
    else:
        tests = {"bowker_symmetry": bowker, "stuart_maxwell": stuart_maxwell}
        found = tests.get(name, bhapkar)(table)
    if found.reason is not None or "p" not in expected:
        assert found.reason or kind == "exact"
        assert expected["estimate"] in (None, 0)  # nothing changed
        return
    assert found.p_value == pytest.approx(expected["p"], rel=1e-9)
    if kind != "exact":
        assert found.statistic == pytest.approx(expected["estimate"], rel=1e-9)
        assert found.df == (expected.get("df", 1),)


@by_dataset("fleiss_kappa_category", field="estimate")
def test_kappa_of_each_category(dataset: Dataset, key: str) -> None:
    expected = dataset["expected"][key]
    label = key.partition("/")[2]
    category = next(c for c in dataset["categories"] if str(c) == label)
    rows = [row for row in dataset["ratings"] if None not in row]  # as irr does
    if expected["estimate"] is None or not rows:
        return
    found = category_kappa(rows, category, categories=dataset["categories"])
    assert found.value == pytest.approx(expected["estimate"], rel=1e-9, abs=1e-12)
    test = fleiss_null(rows, category=category, categories=dataset["categories"])
    assert test.statistic == pytest.approx(expected["z"], rel=1e-9, abs=1e-12)


@by_dataset("fleiss_null", field="z")
def test_fleiss_test_of_no_agreement(dataset: Dataset, key: str) -> None:
    expected = dataset["expected"][key]
    found = fleiss_null(dataset["ratings"], categories=dataset["categories"])
    assert found.statistic == pytest.approx(expected["z"], rel=1e-9, abs=1e-12)
    assert found.p_value == pytest.approx(expected["p"], rel=1e-7, abs=1e-15)
    assert found.n_items == expected["n_used"]


def test_the_reference_sets_are_all_there() -> None:
    inside = datasets()[:30]
    keys = [key for dataset in inside for key in dataset["expected"]]
    assert len(keys) == 1928
    assert sum(key.startswith("fleiss_kappa/") for key in keys) == 224
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)
        assert sum(estimate(d, "fleiss_kappa/unweighted").reason is None
                   for d in inside if "categories" in d) == 24  # fmt: skip
