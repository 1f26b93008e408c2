"""Differences of two and of several coefficients: by hand, by loops, by multiagree."""

import json
import math
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from masrel.agreement import (
    COEFFICIENTS,
    cohen_kappa,
    count_table,
)
from masrel.errors import ParameterError
from masrel.estimates import Estimate
from masrel.intervals import (
    analytic,
    difference,
    difference_test,
    differences,
    donner_test,
    equality_test,
    estimate,
)
from tests.intervals.data import dirichlet_multinomial

Design = Literal["dependent", "independent"]

CATEGORIES = range(3)


def two(n: int) -> tuple[list[list[int]], list[list[int]]]:
    rng = np.random.default_rng(6)
    first = dirichlet_multinomial(rng, n, 4, 0.6)
    # The second raters see what the first saw, but one in three at random.
    grades = np.array(first)
    again = np.where(rng.random(grades.shape) < 0.7, grades, rng.integers(0, 3, (n, 4)))
    return first, again.tolist()


def shares(table: list[list[int]]) -> list[float]:
    """Agreement of each item: how many pairs of its raters agree."""
    k = len(table[0])
    return [sum(row.count(g) - 1 for g in row) / (k * (k - 1)) for row in table]


def test_of_percent_agreement_of_other_items_it_is_welchs_t_test() -> None:
    first, second = two(40)
    second = second[:15]
    other = stats.ttest_ind(shares(first), shares(second), equal_var=False)
    found = difference(
        "percent_agreement", first, second, design="independent", level=0.9
    )
    assert found.value / found.standard_error == pytest.approx(other.statistic)
    interval = other.confidence_interval(0.9)
    assert found.interval is not None
    assert (found.interval.low, found.interval.high) == pytest.approx(
        (interval.low, interval.high), rel=1e-9
    )


@pytest.mark.parametrize("design", ["dependent", "independent"])
@pytest.mark.parametrize("weights", ["identity", "quadratic"])
@pytest.mark.parametrize(
    "name",
    [
        "conger_kappa",
        "gwet_ac",
        "brennan_prediger",
        "krippendorff_alpha",
        "light_kappa",
    ],
)
def test_every_coefficient_is_left_out_of_item_by_item(
    name: str, weights: str, design: Design
) -> None:
    first, second = two(14)
    if design == "independent":
        second = second[:11]

    def value(table: list[list[int]]) -> float:
        found = COEFFICIENTS[name](table, categories=CATEGORIES, weights=weights)  # type: ignore[arg-type]
        return found.value

    def without(table: list[list[int]]) -> list[float]:
        return [value(table[:i] + table[i + 1 :]) for i in range(len(table))]

    def jackknifed(left: list[float]) -> float:
        n, mean = len(left), sum(left) / len(left)
        return (n - 1) / n * sum((x - mean) ** 2 for x in left)

    one, other = without(first), without(second)
    if design == "dependent":
        variance = jackknifed([x - y for x, y in zip(one, other, strict=True)])
    else:
        variance = jackknifed(one) + jackknifed(other)
    found = difference(
        name,
        first,
        second,
        design=design,
        categories=CATEGORIES,
        weights=weights,  # type: ignore[arg-type]
    )
    assert found.value == pytest.approx(value(first) - value(second), abs=1e-14)
    assert found.standard_error == pytest.approx(math.sqrt(variance), rel=1e-9)
    assert found.coefficient == f"difference of {name}"
    assert found.weights == weights


FILE = Path(__file__).parents[1] / "oracles" / "several_kappas.json"
SETTINGS = json.loads(FILE.read_text(encoding="utf-8"))["settings"]
CLUSTERED = SETTINGS["dependent_kappas_clustered-01"]["data"]


def agrees(
    name: str, sets: list[Any], reference: dict[str, Any], **options: Any
) -> None:
    """Compare with multiagree, whose errors are the delta method's.

    Values, and the errors of each coefficient by itself, are the same; the jackknife's
    of several come within 5 %, and never fall 1 % short of them.
    """
    found = differences(name, sets, simultaneous="scheffe", **options)
    values = [estimate.value for estimate in found.estimates]
    assert values == pytest.approx(reference["kappa"], rel=1e-8, abs=1e-10)
    quantile = stats.t.ppf(0.975, reference["n_clusters"] - 1)
    for ratings, error in zip(sets, reference["se"], strict=True):
        alone = analytic(name, ratings, target="items", **options)
        half = 0.5 * (alone.high - alone.low)
        assert half == pytest.approx(quantile * error, rel=1e-8)
    ratios = found.standard_errors / reference["se"]
    assert ratios.min() > 0.99
    assert ratios.max() < 1.05
    hotelling = reference["hotelling"]
    assert found.correlation == pytest.approx(
        np.array(reference["correlation"]), abs=0.02
    )
    assert found.equality.statistic == pytest.approx(hotelling["F"], rel=0.1)
    assert found.equality.df == tuple(hotelling["df"])
    assert found.n_units == reference["n_clusters"]


def of_multiagree(setting: str) -> tuple[str, list[Any], dict[str, Any]]:
    """Coefficient, sets of ratings and options of one of its results."""
    data = SETTINGS[setting]["data"]
    if isinstance(data, str):
        data = CLUSTERED
    options: dict[str, Any] = {"clusters": data["cluster"]}
    if "fleiss" in setting:
        counts = np.array(data["counts"])
        sets = [
            np.array([np.repeat([0, 1, 2], row) for row in part])
            for part in (counts[:, :3], counts[:, 3:])
        ]
        return "fleiss_kappa", sets, options | {"categories": [0, 1, 2]}
    if "conger" in setting:
        cut = np.cumsum(data["raters_per_group"])[:-1]
        sets = np.split(np.array(data["ratings"]), cut, axis=1)
        return "conger_kappa", sets, options | {"categories": [0, 1]}
    options |= {"categories": [1, 2, 3], "weights": SETTINGS[setting]["weights"]}
    ratings = np.array(data["ratings"])
    return "cohen_kappa", [ratings[:, [k, k + 1]] for k in (0, 2, 4)], options


@pytest.mark.parametrize(
    "setting", [name for name in SETTINGS if name.startswith("dependent_")]
)
def test_several_of_clusters_are_those_of_multiagree(setting: str) -> None:
    name, of_sets, options = of_multiagree(setting)
    agrees(name, of_sets, SETTINGS[setting]["reference"], **options)


def sets(seed: int, n: int, g: int) -> list[NDArray[np.int64]]:
    """Ratings of two raters each, of the same items, in g sets."""
    rng = np.random.default_rng(seed)
    true = rng.integers(0, 3, n)
    made = []
    for k in range(g):
        seen = np.where(
            rng.random((n, 2)) < 0.5 + 0.1 * k,
            true[:, None],
            rng.integers(0, 3, (n, 2)),
        )
        made.append(seen)
    return made


@pytest.mark.parametrize(
    "name",
    [
        name
        for name, e in COEFFICIENTS.items()
        if e.formula and e.shape == "ratings" and e.weighted
    ],
)
def test_differences_of_two_are_their_difference_to_the_last_digit(name: str) -> None:
    one, other = (table.astype(float) for table in sets(3, 40, 2))
    one[4, 1] = other[5, 0] = np.nan
    options: dict[str, Any] = {"categories": [0, 1, 2], "weights": "linear"}
    several = differences(name, [one, other], **options)
    alone = difference(name, one, other, design="dependent", **options)
    test = difference_test(name, one, other, design="dependent", **options)
    assert alone.interval is not None
    assert (alone.value, alone.standard_error, alone.interval.low) == (
        several.values[0, 1],
        several.errors[0, 1],
        several.low[0, 1],
    )
    assert (alone.interval.high, test.p_value) == (
        several.high[0, 1],
        several.p_values[0, 1],
    )


@pytest.mark.parametrize(("g", "near"), [(3, 1e-8), (4, 1e-3), (7, 1e-3)])
def test_max_t_of_independent_means_is_tukeys_range(g: int, near: float) -> None:
    # g coefficients of items of their own, all in one table with gaps: independent and
    # with the same error, so that the largest t is a studentized range over √2
    one = sets(11, 12, 1)[0].astype(float)
    tables = []
    for k in range(g):
        table = np.full((12 * g, 2), np.nan)
        table[12 * k : 12 * (k + 1)] = one
        tables.append(table)
    found = differences("cohen_kappa", tables, categories=[0, 1, 2])
    # as many degrees as the fewest items of a set leave
    expected = stats.studentized_range.ppf(0.95, g, 11) / np.sqrt(2.0)
    assert found.quantile == pytest.approx(expected, rel=near)


def over_n(table: list[list[int]]) -> Estimate:
    """Cohen's kappa with the error of Fleiss, Cohen and Everitt over n."""
    estimate = cohen_kappa(count_table(table))
    n = estimate.n_items
    return replace(
        estimate, standard_error=estimate.standard_error * np.sqrt((n - 1) / n)
    )


@pytest.mark.parametrize("place", ["01", "02", "03"])
def test_independent_kappas_are_compared_as_by_donner_and_by_fleiss(
    place: str,
) -> None:
    setting = SETTINGS[f"equal_independent_kappas-{place}"]
    tables, reference = setting["data"]["tables"], setting["reference"]
    donner = donner_test([count_table(table) for table in tables])
    fleiss = equality_test([over_n(table) for table in tables])
    for found, name in (
        (donner, "donner_eliasziw_klar"),
        (fleiss, "fleiss_weighted_cohen"),
    ):
        expected = reference[name]
        assert found.statistic == pytest.approx(expected["chi_square"], rel=1e-8)
        assert found.p_value == pytest.approx(expected["p_value"], rel=1e-8)
        assert found.df == (expected["df"],)
        assert found.n_items == int(np.sum(tables))


def clustered(
    n_clusters: int, seed: int, r: int = 2, strength: float = 1.0
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Ratings of items in clusters of one to four, alike in how well raters agree."""
    rng = np.random.default_rng(seed)
    sizes = rng.integers(1, 5, n_clusters)
    clusters = np.repeat(np.arange(n_clusters), sizes)
    true = rng.integers(0, 3, len(clusters))
    easy = 1.0 / (1.0 + np.exp(-0.8 - strength * rng.normal(size=n_clusters)))
    same = rng.random((len(clusters), r)) < easy[clusters, None]
    ratings = np.where(same, true[:, None], rng.integers(0, 3, (len(clusters), r)))
    return ratings.astype(float), clusters


def test_independent_clusters_add_their_variances() -> None:
    (first, of_first), (second, of_second) = clustered(12, 11), clustered(16, 13)
    labels = [f"a{c}" for c in of_first], [f"b{c}" for c in of_second]
    kappa = COEFFICIENTS["fleiss_kappa"]
    options: dict[str, Any] = {"design": "independent", "categories": [0, 1, 2]}
    asked = ("fleiss_kappa", first, second)
    found = difference(*asked, clusters=labels, **options)
    variance, df = 0.0, 0.0
    for ratings, codes in ((first, of_first), (second, of_second)):
        n = int(codes.max()) + 1
        without = [
            kappa(ratings[codes != c], categories=[0, 1, 2]).value for c in range(n)
        ]
        part = (n - 1) / n * float(((without - np.mean(without)) ** 2).sum())
        variance, df = variance + part, df + part**2 / (n - 1)
    assert found.standard_error == pytest.approx(math.sqrt(variance), rel=1e-9)
    test = difference_test(*asked, clusters=labels, **options)
    assert test.df[0] == pytest.approx(variance**2 / df, rel=1e-9)
    for wrong, why in (
        ((labels[0], ["a1", *labels[1][1:]]), "different clusters, got 'a1' in both"),
        (labels[0], "a pair of sequences"),
    ):
        with pytest.raises(ParameterError, match=why):
            difference(*asked, clusters=wrong, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(("n_outside", "is_rare"), [(4, True), (30, False)])
def test_rare_categories_in_clusters_are_warned_of(
    n_outside: int, is_rare: bool
) -> None:
    # of so few the item jackknife gives way to a posterior
    ratings = np.zeros((90, 3))
    outside = np.arange(n_outside) * 3
    ratings[outside, 0] = ratings[outside[1:], 1] = 1.0
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        interval = estimate(
            "fleiss_kappa", ratings, target="items", clusters=np.arange(90) // 6
        ).interval
    assert interval is not None
    notes = [str(warning.message) for warning in caught]
    assert notes == list(interval.notes[1:])
    expected = "4 items with a rating outside the commonest category: with fewer than"
    assert [note.startswith(expected) for note in notes] == [True] * is_rare
