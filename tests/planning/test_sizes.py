"""Sizes: the smallest that reaches an aim, and one sentence where none can."""

import math
from dataclasses import replace
from typing import Any

import pytest
from scipy import stats

from masrel.errors import ParameterError
from masrel.planning import Plan, Study, precision, sample_size, units_needed

KAPPA: dict[str, Any] = {
    "coefficient": "fleiss_kappa",
    "value": 0.5,
    "prevalences": [0.7, 0.3],
    "model": "mixture",
    "target": "items",
}


NORMAL: dict[str, Any] = {
    "coefficient": "icc_1",
    "model": None,
    "prevalences": None,
    "target": "both",
}

BETWEEN: dict[str, Any] = {
    "half_width": None,
    "lower": 0.3,
    "upper": 0.7,
    "power": 0.8,
}


def plan(**options: Any) -> Plan:
    return sample_size(Study(**{**KAPPA, "n_raters": 2, **options}))


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"value": -0.5}, "value"),
        ({"value": "0.5"}, "value"),
        ({"prevalences": [0.7, 0.4]}, "prevalences"),
        ({"prevalences": ["a", "b"]}, "prevalences"),
        ({"prevalences": [1.0, 0.0]}, "prevalences"),
        ({"prevalences": None}, "categories, prevalences"),
        ({"model": "table"}, "prevalences"),
        ({"n_raters": 2, "target": "raters"}, "n_raters"),
        ({"n_raters": None}, "n_items, n_raters"),
        ({"n_items": 10}, "n_items, n_raters"),
        ({"half_width": 0.0}, "half_width"),
        ({"half_width": None}, "half_width"),
        ({"null": 0.4}, "half_width"),
        ({"half_width": None, "null": 0.4}, "null"),
        ({"half_width": None, "null": 0.5, "power": 0.8}, "null"),
        ({"half_width": None, "lower": 0.6}, "lower"),
        ({"half_width": None, "upper": 0.2}, "upper"),
        ({"power": 0.8}, "power"),
        ({"assurance": 80}, "assurance"),
        ({"method": "wald", "assurance": 0.8}, "assurance"),
        ({**BETWEEN, "method": "wald"}, "power"),
        ({**BETWEEN, "method": "goodness-of-fit"}, "power"),
        ({**NORMAL, **BETWEEN, "method": "wald"}, "power"),
        ({"prior": (-1, 2), "method": "goodness-of-fit"}, "prior"),
        ({"coefficient": "kendall_w"}, "coefficient"),
        ({"max_cost": math.nan}, "max_cost"),
        ({**NORMAL, "model": "mixture"}, "model"),
        ({**NORMAL, "target": "items"}, "target"),
        ({**NORMAL, "prevalences": [0.5, 0.5]}, "prevalences"),
        ({**NORMAL, "weights": "linear"}, "weights"),
        ({**NORMAL, "p_missing": 0.1}, "p_missing"),
        # out of reach: all that there can be, and all that the money buys
        ({"half_width": 0.001, "interval": "normal"}, "half_width"),
        ({"half_width": 0.15, "max_cost": 100, "interval": "normal"}, "max_cost"),
    ],
)
def test_what_cannot_be_planned_is_refused_by_its_name(
    options: dict[str, Any], name: str
) -> None:
    with pytest.raises(ParameterError, match=f"^{name}: "):
        plan(**{"half_width": 0.2, "rng": 1, **options})


@pytest.mark.parametrize(
    "prices",
    [
        (5.0, 20.0, 1.0),
        pytest.param((0.0, 0.0, 1.0), marks=pytest.mark.slow),
        pytest.param((1.0, 60.0, 0.0), marks=pytest.mark.slow),
        pytest.param((10.0, 20.0, 1.0), marks=pytest.mark.slow),
    ],
)
def test_the_cheapest_is_that_of_every_number_of_raters(prices: Any) -> None:
    common: dict[str, Any] = {
        **{**KAPPA, "prevalences": [0.5, 0.3, 0.2]},
        **{"half_width": 0.25, "interval": "t", "prices": prices, "rng": 1},
    }
    of_raters = [sample_size(Study(**common, n_raters=n)) for n in range(2, 8)]
    assert sample_size(Study(**common)) == min(of_raters, key=lambda each: each.cost)


def test_a_budget_is_held() -> None:
    common: dict[str, Any] = {**KAPPA, "interval": "t", "prices": (5, 20, 1)}
    bought = sample_size(Study(**common, max_cost=250, rng=1))
    assert bought.cost <= 250
    for max_cost in (250, 50):  # too little for the aim, and for any study
        with pytest.raises(ParameterError, match=r"^max_cost: "):
            sample_size(Study(**common, half_width=0.1, max_cost=max_cost, rng=1))


def test_studies_are_counted_as_they_are_drawn_and_a_seed_is_recorded() -> None:
    common = {**KAPPA, "prevalences": [0.4, 0.3, 0.3], "interval": "t"}
    common |= {"n_items": 20, "n_raters": 4}
    seen: list[tuple[int, int]] = []
    first = precision(Study(**common), progress=lambda *counts: seen.append(counts))
    assert seen[-1] == (first.n_studies, first.n_studies)
    assert precision(Study(**common, rng=first.seed)) == first
    assert first.monte_carlo_error == first.errors["expected_half_width"] > 0.0


@pytest.mark.parametrize(
    ("value", "n_raters", "n_items"),
    [
        # Bonett (2002), eq. 3: 8 z² (1 - ρ)² (1 + (k - 1) ρ)² / (k (k - 1) w²) + 1, to
        # which 5 ρ is added for two raters and ρ of at least 0.7
        (0.69, 2, 107),  # 8 z² 0.31² 1.69² / 0.08 + 1 = 106.4
        (0.70, 2, 105),  # 8 z² 0.30² 1.70² / 0.08 + 1 + 3.5 = 104.4
        (0.70, 3, 68),  # 8 z² 0.30² 2.40² / 0.24 + 1 = 67.4
    ],
)
def test_items_for_the_width_of_an_icc_by_hand(
    value: float, n_raters: int, n_items: int
) -> None:
    options = {**NORMAL, "value": value, "n_raters": n_raters, "half_width": 0.1}
    assert plan(**options, method="wald").n_items == n_items


def test_a_chance_that_goes_up_and_down_holds_from_the_size_on() -> None:
    aim: dict[str, Any] = {"value": 0.8, "null": 0.4, "interval": "normal"}
    options = {**KAPPA, **aim, "coefficient": "scott_pi"}
    options |= {"prevalences": [0.5, 0.5], "method": "exact", "n_raters": 2}
    n = sample_size(Study(**options, power=0.7)).n_items
    power = {
        size: precision(Study(**options, n_items=size)).power for size in range(18, 26)
    }
    assert power[18] > 0.7  # a smaller one has it, too
    assert power[n - 1] < 0.7
    assert all(power[size] >= 0.7 for size in range(n, 26))


@pytest.mark.parametrize(
    "aim",
    [
        # the guess knows no t, no cut at the ends of the scale and no assurance
        *(
            {"half_width": half, "interval": "t"}
            for half in (0.4, 0.3, 0.25, 0.2, 0.16)
        ),
        {"half_width": 0.3, "lower": None, "upper": None, "interval": "normal"},
        {"half_width": None, "upper": 0.9, "interval": "t"},
        {"half_width": 0.25, "assurance": 0.05, "interval": "t", "method": "exact"},
        {"half_width": 0.25, "assurance": 0.95, "interval": "t", "method": "exact"},
    ],
)
def test_one_item_fewer_does_not_reach_the_aim(aim: dict[str, Any]) -> None:
    study = Study(**{**KAPPA, "n_raters": 2, **aim})
    n = sample_size(study).n_items
    assert precision(replace(study, n_items=n)).reaches_aim
    assert not precision(replace(study, n_items=n - 1)).reaches_aim


@pytest.mark.parametrize(
    ("coefficient", "n_ratings"), [("scott_pi", 40), ("stratified_kappa", 80)]
)
def test_every_rating_costs_its_price(coefficient: str, n_ratings: int) -> None:
    # 20 items, 2 raters, who rate each of them twice for agreement with themselves
    options = {**KAPPA, "coefficient": coefficient, "prevalences": [0.5, 0.5]}
    found = precision(
        Study(**options, n_items=20, n_raters=2, method="wald", prices=(1, 2, 3))
    )
    assert found.cost == 20 + 2 * 2 + 3 * n_ratings


def test_sizes_far_from_the_aim_are_told_by_few_studies() -> None:
    raters = {**KAPPA, "model": "latent", "target": "raters", "interval": "t", "rng": 0}
    study = Study(**raters, n_items=30, half_width=0.15)
    found = sample_size(study)
    whole = sample_size(replace(study, n_studies=found.n_studies))  # by as many each
    numbers = ("n_raters", "expected_half_width", "n_studies")
    assert [getattr(found, of) for of in numbers] == [
        getattr(whole, of) for of in numbers
    ]
    few = precision(replace(study, half_width=None, n_raters=4, n_studies=700))
    assert few.n_studies == 700


@pytest.mark.parametrize(("half", "level"), [(0.5, 0.95), (3.0, 0.8), (0.031, 0.99)])
def test_the_least_number_that_is_enough(half: float, level: float) -> None:
    def half_of(n: int) -> float:
        return float(stats.t.interval(level, n - 1, scale=math.sqrt(20 / n))[1])

    n = units_needed(1.0, 20, half_width=half, level=level)
    assert half_of(n) <= half < half_of(n - 1)
