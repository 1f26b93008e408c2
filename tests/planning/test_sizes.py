"""Sizes: the smallest that reaches an aim, and one sentence where none can."""

import math
from typing import Any

import pytest

from masrel.errors import ParameterError
from masrel.planning import LatentModel, Plan, Study, precision, sample_size

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
    ("options", "words"),
    [
        ({"value": 1.2}, "value: needs [-1, 1], got 1.2"),
        ({"value": -0.5}, "value: Fleiss' κ under mixture lies between 0.000"),
        ({"value": None}, "value: needs the true coefficient"),
        ({"prevalences": [0.7, 0.4]}, "prevalences: needs numbers of at least 0 with"),
        ({"prevalences": ["a", "b"]}, "prevalences: needs numbers"),
        ({"prevalences": None}, "categories, prevalences: need one of both"),
        ({"categories": 3}, "prevalences: needs one of each of 3 categories"),
        ({"n_raters": 0}, "n_raters: needs a whole number above 0, got 0"),
        ({"n_raters": 1}, "n_raters: Fleiss' κ for other items needs 2 or more"),
        ({"n_raters": 2, "target": "raters"}, "n_raters: Fleiss' κ for other raters"),
        ({"n_raters": None}, "n_items, n_raters: needs exactly one"),
        ({"n_items": 10}, "n_items, n_raters: needs exactly one"),
        ({"half_width": 1.5}, "half_width: needs (0, 1], since the scale"),
        ({"half_width": 0.0}, "half_width: needs (0, 1]"),
        ({"half_width": None}, "half_width: needs an aim"),
        ({"null": 0.4}, "half_width: needs to be alone"),
        ({"half_width": None, "null": 0.4}, "null: needs power"),
        ({"half_width": None, "null": 0.5, "power": 0.8}, "null: needs another"),
        ({"half_width": None, "lower": 0.6}, "lower: needs to lie below value"),
        ({"half_width": None, "upper": 0.2}, "upper: needs to lie above value"),
        ({"power": 0.8}, "power: needs null, lower or upper"),
        ({"assurance": 80}, "assurance: needs (0, 1), got 80"),
        ({"model": None}, "model: needs one of mixture"),
        ({"model": "beta"}, "got 'beta'"),
        ({"model": "table"}, "prevalences: a table needs the joint"),
        ({"target": "all"}, "target: needs one of items, raters, both"),
        ({"method": "guess"}, "method: needs one of auto, wald"),
        ({"method": "wald", "assurance": 0.8}, "assurance: method wald has no formula"),
        ({**BETWEEN, "method": "wald"}, "power: method wald has no formula"),
        (
            {**BETWEEN, "method": "goodness-of-fit"},
            "power: method goodness-of-fit has no formula",
        ),
        ({**NORMAL, **BETWEEN, "method": "wald"}, "power: method wald has no formula"),
        ({"interval": "normal", "target": "both"}, "interval: "),
        ({"sides": 3}, "sides: needs one of 1, 2"),
        ({"level": 95}, "level: needs (0, 1), got 95"),
        ({"p_missing": 1.0}, "p_missing: needs [0, 1)"),
        ({"prices": (-1, 0, 0)}, "prices: needs three of at least 0"),
        ({"coefficient": "kendall_w"}, "coefficient: Kendall's W cannot be planned"),
        ({"coefficient": "kappa"}, "coefficient: needs"),
        ({**NORMAL, "model": "mixture"}, "model: ICC(1) takes none"),
        ({**NORMAL, "target": "items"}, "target: the interval of ICC(1)"),
        ({"rng": -1}, "rng: needs a seed of at least 0"),
        ({"categories": 0, "prevalences": None}, "categories: needs at least 2, got 0"),
        ({"prevalences": [1.0, 0.0]}, "needs two categories that occur"),
        ({"rater_share": 0.5}, "rater_share: is of icc_a1 alone"),
        ({"prices": (0, math.nan, 1)}, "prices: needs three of at least 0"),
        ({"max_cost": math.nan}, "max_cost: needs a number above 0, got nan"),
        ({"max_cost": -5}, "max_cost: needs a number above 0, got -5"),
        ({"value": "0.5"}, "value: needs a number, got '0.5'"),
        ({"half_width": "0.2"}, "half_width: needs a number, got '0.2'"),
        ({"p_missing": None}, "p_missing: needs a number, got None"),
        ({**NORMAL, "prevalences": [0.5, 0.5]}, "prevalences: ICC(1) takes none"),
        ({**NORMAL, "weights": "linear"}, "weights: ICC(1) takes none"),
        ({**NORMAL, "p_missing": 0.1}, "p_missing: ICC(1) takes none"),
    ],
)
def test_bad_input_is_one_sentence(options: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError) as error:
        plan(**{"half_width": 0.2, **options})
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_a_prior_is_of_the_method_that_uses_it() -> None:
    common: dict[str, Any] = {**KAPPA, "n_items": 30, "n_raters": 2, "null": 0.3}
    with pytest.raises(ParameterError, match="prior: needs two numbers above 0"):
        precision(Study(**common, prior=(-1, 2), method="goodness-of-fit"))
    with pytest.raises(ParameterError, match='prior: is of method "goodness-of-fit"'):
        precision(Study(**common, prior=(1, 2)))


def test_an_aim_out_of_reach_says_the_best_that_can_be_had() -> None:
    with pytest.raises(ParameterError, match="more than 100000 items; the best"):
        plan(half_width=0.001, interval="normal", rng=1)
    with pytest.raises(ParameterError, match=r"cost 308; 100 pays for 50 items, which"):
        plan(half_width=0.15, max_cost=100, interval="normal")


@pytest.mark.slow
def test_so_many_raters_as_are_looked_at_may_be_too_few() -> None:
    with pytest.raises(ParameterError, match=r"than 60 raters; the best .* half-width"):
        sample_size(Study(**KAPPA, n_items=5, half_width=0.05, interval="t", rng=1))


def test_a_budget_alone_buys_what_it_can() -> None:
    bought = plan(max_cost=101, prices=(0, 1, 1), interval="normal")
    assert (bought.n_items, bought.cost) == (49, 100)


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


def test_a_budget_is_held_and_the_best_is_named() -> None:
    common: dict[str, Any] = {**KAPPA, "interval": "t", "prices": (5, 20, 1)}
    bought = sample_size(Study(**common, max_cost=250, rng=1))
    assert bought.cost <= 250
    words = f"is {bought.n_items} items and {bought.n_raters} raters, which cost"
    with pytest.raises(ParameterError, match=words):
        sample_size(Study(**common, half_width=0.1, max_cost=250, rng=1))
    with pytest.raises(ParameterError, match="max_cost: needs at least 54"):
        sample_size(Study(**common, half_width=0.1, max_cost=50, rng=1))


def test_of_two_named_raters_the_cheapest_has_two() -> None:
    cheapest = sample_size(
        Study(
            **{**KAPPA, "coefficient": "cohen_kappa"},
            half_width=0.3,
            interval="normal",
            prices=(5, 20, 1),
        )
    )
    alone = sample_size(
        Study(
            **{**KAPPA, "coefficient": "cohen_kappa"},
            half_width=0.3,
            interval="normal",
            n_raters=2,
        )
    )
    assert (cheapest.n_items, cheapest.n_raters) == (alone.n_items, 2)


def test_studies_that_are_drawn_are_counted_as_they_come() -> None:
    seen: list[tuple[int, int]] = []
    plan = precision(
        Study(
            **{**KAPPA, "prevalences": [0.4, 0.3, 0.3]},
            n_items=30,
            n_raters=4,
            interval="t",
            half_width=0.15,
            rng=1,
        ),
        progress=lambda *counts: seen.append(counts),
    )
    assert seen[-1] == (plan.n_studies, plan.n_studies)
    assert [drawn for drawn, _ in seen] == sorted({drawn for drawn, _ in seen})


@pytest.mark.slow
@pytest.mark.parametrize("weights", ["identity", "quadratic"])
def test_more_raters_can_stand_for_items(weights: str) -> None:
    common = {**KAPPA, "prevalences": [0.4, 0.3, 0.3], "weights": weights}
    more = sample_size(
        Study(**common, n_items=40, half_width=0.19, interval="t", rng=1)
    )
    fewer = precision(
        Study(**common, n_items=40, n_raters=more.n_raters - 1, interval="t", rng=1)
    )
    assert more.expected_half_width <= 0.19 < fewer.expected_half_width


def test_power_against_a_null_value_grows_with_items_and_is_the_level_at_it() -> None:
    common = {**KAPPA, "n_raters": 2, "null": 0.3, "sides": 1, "interval": "normal"}
    powers = [precision(Study(**common, n_items=n)).power for n in (30, 60, 120)]
    assert powers == sorted(powers)
    size = precision(Study(**{**common, "value": 0.300001}, n_items=120)).power
    assert size == pytest.approx(0.05, abs=0.02)


@pytest.mark.slow
def test_non_inferiority_and_equivalence_are_ends_of_the_interval() -> None:
    common: dict[str, Any] = {"interval": "normal", "power": 0.8}
    superior = plan(**common, null=0.3, sides=1)
    assert plan(**common, lower=0.3, sides=1).n_items == superior.n_items
    assert plan(**common, lower=0.3, upper=0.7).n_items > superior.n_items


def test_the_same_seed_gives_the_same_plan_and_one_is_recorded() -> None:
    common = {
        **KAPPA,
        "n_items": 20,
        "n_raters": 4,
        "prevalences": [0.4, 0.3, 0.3],
        "interval": "t",
    }
    first = precision(Study(**common))
    assert first.seed is not None
    assert precision(Study(**common, rng=first.seed)) == first
    assert first.method == "simulation"
    assert first.monte_carlo_error == first.errors["expected_half_width"] > 0.0


def test_a_latent_model_has_its_own_value_and_its_items() -> None:
    model = LatentModel(thresholds=(0.0,), noise_sd=0.5, positions=(-1.0, 0.0, 1.0))
    common = {**KAPPA, "model": model, "prevalences": None, "n_raters": 4, "rng": 1}
    with pytest.raises(ParameterError, match="positions of 3 items, got 5"):
        precision(Study(**{**common, "value": None}, n_items=5))
    with pytest.raises(ParameterError, match="value: the model has"):
        precision(Study(**common, n_items=3))
    with pytest.raises(ParameterError, match="noise_sd above 0"):
        LatentModel(thresholds=(0.0,), noise_sd=0.0)


def test_the_exact_interval_of_an_icc_covers_as_it_says() -> None:
    plan = precision(Study("icc_c1", value=0.7, n_items=20, n_raters=4, target="items"))
    assert (plan.method, plan.coverage) == ("exact", pytest.approx(0.95))
    simulated = precision(
        Study(
            "icc_a1",
            value=0.7,
            n_items=20,
            n_raters=4,
            target="both",
            rater_share=0.0,
            rng=1,
        )
    )
    assert simulated.coverage == pytest.approx(0.95, abs=0.03)


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
    ("coefficient", "n_ratings"), [("scott_pi", 40), ("stratified_kappa", 80)]
)
def test_every_rating_costs_its_price(coefficient: str, n_ratings: int) -> None:
    # 20 items, 2 raters, who rate each of them twice for agreement with themselves
    options = {**KAPPA, "coefficient": coefficient, "prevalences": [0.5, 0.5]}
    found = precision(
        Study(**options, n_items=20, n_raters=2, method="wald", prices=(1, 2, 3))
    )
    assert found.cost == 20 + 2 * 2 + 3 * n_ratings
