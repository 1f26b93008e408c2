"""Delta-method intervals, ours and as other programs print them."""

import json
import math
import warnings
from pathlib import Path
from typing import Any

import pytest
from scipy.stats import t

from masrel.agreement import fleiss_kappa
from masrel.errors import (
    MasrelWarning,
    UndefinedStatisticWarning,
)
from masrel.estimates import Interval
from masrel.intervals import analytic
from tests.agreement.oracles import datasets
from tests.intervals.data import TABLE_V

few = pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")


@few
def test_logit_interval_by_hand() -> None:
    # x = (kappa + 1)/2; logit x ± t · SE / (2 x (1 - x)); back by 2/(1 + e^-y) - 1.
    estimate = fleiss_kappa(TABLE_V)
    x = (estimate.value + 1) / 2
    half = 3.18244630528371 * estimate.standard_error / (2 * x * (1 - x))
    centre = math.log(x / (1 - x))
    found = analytic("fleiss_kappa", TABLE_V, target="items", distribution="logit")
    low, high = (2 / (1 + math.exp(-y)) - 1 for y in (centre - half, centre + half))
    assert (found.low, found.high) == pytest.approx((low, high), rel=1e-12)
    assert -1 < found.low < estimate.value < found.high < 1
    assert found.notes == (
        "4 items: with fewer than 10 the true coverage may be below "
        "the level of the interval",
    )


def test_no_spread_gives_no_interval_and_a_reason() -> None:
    perfect = [["a", "a"], ["b", "b"]] * 10
    with pytest.warns(UndefinedStatisticWarning, match="standard error is 0"):
        found = analytic("fleiss_kappa", perfect, target="items")
    assert math.isnan(found.low)
    assert math.isnan(found.high)
    assert "does not mean" in (found.reason or "")


FILE = Path(__file__).parents[1] / "oracles" / "published_errors.json"
PUBLISHED: dict[str, dict[str, Any]] = json.loads(FILE.read_text("utf-8"))["errors"]
DATA = {dataset["name"]: dataset for dataset in datasets()}
PAIRS = [["a", "a"]] * 20 + [["a", "b"]] * 5 + [["b", "a"]] * 10 + [["b", "b"]] * 15


def quiet(*args: Any, **options: Any) -> Interval:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MasrelWarning)
        return analytic(*args, **options)


def half(interval: Interval) -> float:
    return 0.5 * (interval.high - interval.low)


@pytest.mark.parametrize("name", PUBLISHED)
def test_intervals_are_those_that_packages_print(name: str) -> None:
    dataset = DATA[name]
    for key, printed in PUBLISHED[name].items():
        coefficient, _, rest = key.partition("/")
        weights, _, variant = rest.partition("@")
        ours = quiet(
            coefficient,
            dataset["ratings"],
            target="items",
            categories=dataset.get("categories"),
            weights="identity" if weights == "unweighted" else weights,
            convention="over_n" if coefficient == "cohen_kappa" else "irrcac",
            distribution="normal" if variant in ("vcd", "psych") else "t",
        )
        low, high = printed["ci"]
        if low is None:  # one usable item, of which irrCAC has an error and no ends
            continue
        ends = (max(low, -1.0), min(high, 1.0))
        assert (ours.low, ours.high) == pytest.approx(ends, abs=1e-9), key


def test_spss_prints_the_error_of_the_hypothesis_that_fleiss_kappa_is_0() -> None:
    # p = (13/20, 7/20) of ten items: SE0 = √(2 [(Σpq)² - Σpq(q - p)]/20)/Σpq
    ratings = [["a", "a"]] * 5 + [["b", "b"]] * 2 + [["a", "b"]] * 3
    pq = 13 * 7 / 400
    by_hand = math.sqrt(2 * ((2 * pq) ** 2 - 0.0) / 20) / (2 * pq)
    options: dict[str, Any] = {"convention": "spss", "distribution": "normal"}
    interval = quiet("fleiss_kappa", ratings, target="items", **options)
    assert half(interval) / 1.959964 == pytest.approx(by_hand, rel=1e-6)
    of_two = quiet("cohen_kappa", PAIRS, target="items", **options)
    same = quiet(
        "cohen_kappa", PAIRS, target="items", **options | {"convention": "over_n"}
    )
    assert (of_two.low, of_two.high) == (same.low, same.high)


IRRCAC = {"target": "items", "convention": "irrcac", "distribution": "normal"}


UNITS = [
    (1, 1, None, 1), (2, 2, 3, 2), (3, 3, 3, 3), (3, 3, 3, 3), (2, 2, 2, 2),
    (1, 2, 3, 4), (4, 4, 4, 4), (1, 1, 2, 1), (2, 2, 2, 2), (None, 5, 5, 5),
    (None, None, 1, 1), (None, None, 3, None),
]  # fmt: skip


SINGLE = [["a", "a", "a"], ["a", "a", "b"], ["a", None, None]]


LONE = [["a", "a"], ["a", "b"], ["b", "b"], ["b", None]]


@pytest.mark.parametrize(
    ("name", "ratings", "error"),
    [
        # by hand, u_i + (2/3)(s_i n/n' - 1): 1/2 + 1/3, -1/2 + 1/3, 0 - 2/3
        ("percent_agreement", SINGLE, math.sqrt(7 / 36)),
        # ours are 10, -14, 6, -2 ninths; 1/9 more with a pair, 1/3 less without
        ("conger_kappa", LONE, math.sqrt((121 + 169 + 49 + 25) / 81 / 12)),
        # as R prints them of Krippendorff's units
        ("percent_agreement", UNITS, 0.12561),
        ("gwet_ac", UNITS, 0.14295),
        ("fleiss_kappa", UNITS, 0.15302),
    ],
)
def test_irrcac_counts_a_single_rating_as_disagreement(
    name: str, ratings: list, error: float
) -> None:
    found = half(quiet(name, ratings, **IRRCAC, level=0.2)) / 0.253347
    assert found == pytest.approx(error, rel=1e-4)
    by_t = half(quiet(name, ratings, **{**IRRCAC, "distribution": "t"}, level=0.2))
    # which counts such an item, too
    assert by_t / t.ppf(0.6, len(ratings) - 1) == pytest.approx(error, rel=1e-4)
