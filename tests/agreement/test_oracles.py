"""Every reference data set, against 50-digit values of an independent program."""

import json
import math
import warnings
from pathlib import Path
from typing import Any

import pytest

from masrel.agreement import COEFFICIENTS
from masrel.errors import UndefinedStatisticWarning
from masrel.estimates import Estimate

FILE = Path(__file__).parents[1] / "oracles" / "agreement.json"
DATASETS: list[dict[str, Any]] = json.loads(FILE.read_text(encoding="utf-8"))[
    "datasets"
]
CASES = [
    pytest.param(dataset, name, id=f"{dataset['name']}-{name}")
    for dataset in DATASETS
    for name in dataset["expected"]
]
WITH_ERROR = [
    case
    for case in CASES
    if case.values[0]["expected"][case.values[1]].get("se_delta") is not None
]


def estimate(dataset: dict[str, Any], name: str) -> Estimate:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)
        return COEFFICIENTS[name](dataset["ratings"], categories=dataset["categories"])


@pytest.mark.parametrize(("dataset", "name"), CASES)
def test_estimate_is_the_float_nearest_to_the_exact_value(
    dataset: dict[str, Any], name: str
) -> None:
    exact = dataset["expected"][name]["exact"]
    found = estimate(dataset, name)
    if exact is None:
        assert math.isnan(found.value)
        assert found.reason
    else:
        assert found.reason is None
        # within one unit in the last place of a 50-digit decimal
        assert abs(found.value - float(exact)) <= math.ulp(float(exact))


@pytest.mark.parametrize(("dataset", "name"), WITH_ERROR)
def test_standard_error_is_that_of_the_delta_method(
    dataset: dict[str, Any], name: str
) -> None:
    expected = dataset["expected"][name]["se_delta"]
    found = estimate(dataset, name).standard_error
    assert found == pytest.approx(float(expected), rel=1e-12, abs=1e-15)


def test_the_reference_sets_are_all_there() -> None:
    assert len(DATASETS) == 28
    assert len(WITH_ERROR) == 54
    assert sum("fleiss_kappa" in d["expected"] for d in DATASETS) == 28
