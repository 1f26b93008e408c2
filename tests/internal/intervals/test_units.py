"""Slopes and standard errors of resamples: the delta method, and inner bootstraps."""

import numpy as np
import pytest

from masrel.agreement import COEFFICIENTS
from masrel.intervals._problem import IntervalProblem, pose_problem
from masrel.intervals._units import SamplingUnits, rater_units
from tests.internal.intervals.items import item_units
from tests.intervals.data import dirichlet_multinomial

KERNELS = [name for name, entry in COEFFICIENTS.items() if entry.kernel is not None]
POOLED = [
    name
    for name in KERNELS
    if COEFFICIENTS[name].kernel.rater_sums is not None  # type: ignore[union-attr]
    and COEFFICIENTS[name].n_raters[1] is None
]


def ratings_of(name: str, n: int) -> list[list[object]]:
    entry = COEFFICIENTS[name]
    raters = 2 if entry.n_raters[1] == 2 else 4
    table = dirichlet_multinomial(np.random.default_rng(3), n, raters, 0.5)
    if entry.shape == "pairs":  # two raters, each twice
        return [[row[:2] for row in table], [row[2:] for row in table]]
    return [list(row) for row in table]


def problem_of(name: str, n: int = 25, weights: str = "identity") -> IntervalProblem:
    return pose_problem(
        name,
        ratings_of(name, n),
        target="items",
        categories=range(3),
        weights=weights,  # type: ignore[arg-type]
        level=0.95,
    )


def by_differences(units: SamplingUnits, counts: np.ndarray, step: float) -> np.ndarray:  # type: ignore[type-arg]
    """Slopes by four-point differences, member by member."""
    found = []
    for one in np.eye(counts.size):
        near, far = (
            units.of_counts(counts + d * step * one)
            - units.of_counts(counts - d * step * one)
            for d in (1, 2)
        )
        found.append((8 * near - far) / (12 * step))
    return np.array(found)


@pytest.mark.parametrize("weights", ["identity", "quadratic"])
@pytest.mark.parametrize("name", KERNELS)
def test_slopes_are_those_of_differences(name: str, weights: str) -> None:
    units = item_units(problem_of(name, weights=weights))
    counts = units.freq + np.arange(units.freq.size) % 3.0
    (slopes,) = units.influence(counts[None])
    expected = by_differences(units, counts, 1e-2)
    # The same but for one number: along the mean row alone they say nothing.
    off = slopes - expected
    assert np.ptp(off) < 1e-8 * np.abs(expected).max()


@pytest.mark.parametrize("name", POOLED)
def test_slopes_of_raters_are_those_of_differences(name: str) -> None:
    units = rater_units(problem_of(name))
    counts = np.array([1.0, 2.0, 0.0, 1.0])
    (slopes,) = units.influence(counts[None])
    np.testing.assert_allclose(
        slopes, by_differences(units, counts, 1e-3), rtol=1e-7, atol=1e-9
    )


@pytest.mark.parametrize("weights", ["identity", "linear"])
@pytest.mark.parametrize("name", KERNELS)
def test_the_error_of_the_estimate_is_that_of_the_delta_method(
    name: str, weights: str
) -> None:
    problem = problem_of(name, weights=weights)
    units = item_units(problem)
    (error,) = units.standard_errors(units.freq[None].astype(float))
    entry = COEFFICIENTS[name]
    estimate = entry(ratings_of(name, 25), categories=range(3), weights=weights)
    # The coefficient's own formula, in integers, divides by n - 1. That of alpha
    # squares influences whose mean is not 0 but of the order of one rating in all.
    n = problem.n_items
    near = 1e-3 if name == "krippendorff_alpha" else 1e-10
    assert error == pytest.approx(
        estimate.standard_error * np.sqrt((n - 1) / n), rel=near
    )


def test_the_error_of_a_mean_is_that_of_its_bootstrap() -> None:
    # Percent agreement of complete ratings is a mean: its bootstrap's standard error
    # is the root of the sum of squared deviations over n, for every resample.
    problem = problem_of("percent_agreement", n=12)
    units = item_units(problem)
    counts = np.random.default_rng(1).multinomial(12, units.shares, size=50)
    errors = units.standard_errors(counts.astype(float))
    for times, error in zip(counts, errors, strict=True):
        agreeing = 1.0 - np.repeat(units.rows[:, 0], times)  # type: ignore[index]
        assert error == pytest.approx(agreeing.std() / np.sqrt(12), abs=1e-14)


def test_errors_of_resamples_are_those_of_a_double_loop() -> None:
    # 80 items: the delta method and an inner bootstrap differ by their order 1 / n. An
    # inner error of 2000 resamples is known to 1.6 %; over 30 outer ones the mean ratio
    # to 0.3 %, so 2 % off is 6 of its standard errors.
    problem = problem_of("fleiss_kappa", n=80)
    units = item_units(problem)
    rng = np.random.default_rng(8)
    outer = rng.multinomial(80, units.shares, size=30)
    inner = [
        units.of_counts(rng.multinomial(80, times / 80, size=2000).astype(float)).std()
        for times in outer
    ]
    ratio = units.standard_errors(outer.astype(float)) / np.array(inner)
    assert 0.97 < ratio.mean() < 1.02
    assert ratio.std() < 0.06


def test_a_resample_without_spread_is_infinitely_far_off() -> None:
    table = [[0, 0, 0]] * 3 + [[1, 1, 1]] * 3 + [[0, 1, 1], [0, 0, 1]]
    units = item_units(
        pose_problem(
            "fleiss_kappa",
            table,
            target="items",
            categories=None,
            weights="identity",
            level=0.95,
        )
    )
    rows = units.rows
    assert rows is not None
    agreeing = rows[:, 0] == 0.0
    counts = np.zeros((2, len(rows)))
    counts[0, agreeing] = 4.0  # both categories, no disagreement: kappa is 1
    counts[1, np.flatnonzero(agreeing)[0]] = 8.0  # one category: undefined
    (value,) = units.of_counts(units.freq[None].astype(float))
    (error,) = units.standard_errors(units.freq[None].astype(float))
    far, undefined = units.studentized(counts, float(value), float(error))
    assert far == np.inf
    assert np.isnan(undefined)
    (itself,) = units.studentized(
        units.freq[None].astype(float), float(value), float(error)
    )
    assert itself == 0.0


def test_a_rater_without_a_pair_leaves_the_slopes_of_the_others_alone() -> None:
    # One more item of the second rater would count in full; the items drawn have none.
    first = [["a", "a"], ["b", "b"], ["a", "b"], ["b", "b"], ["b", "a"]]
    second = [["a", "b"], ["b", "b"], [None, None], [None, None], [None, None]]
    units = item_units(
        pose_problem(
            "stratified_kappa",
            [first, second],
            target="items",
            categories=("a", "b"),
            weights="identity",
            level=0.95,
        )
    )
    of_second = units.rows[:, 7] > 0.0  # type: ignore[index]
    assert of_second.sum() == 2
    drawn = ~of_second
    counts = np.zeros((1, 5))
    counts[0, drawn] = 2.0, 2.0, 1.0
    expected = by_differences(units, counts[0], 1e-3)[drawn]
    (slopes,) = units.influence(counts)
    np.testing.assert_allclose(slopes[drawn], expected, rtol=1e-8, atol=1e-10)
    times = counts[0, drawn]
    (error,) = units.standard_errors(counts)
    off = expected - times @ expected / units.n
    assert np.ptp(off) > 0.1
    assert error == pytest.approx(np.sqrt(times @ off**2), rel=1e-7)


def test_raters_who_are_not_drawn_are_not_asked_after() -> None:
    # The last item is rated by the third rater alone: were he drawn, it would count.
    table = [[0, 0, 0], [1, 1, 0], [2, 2, 2], [0, 1, 0], [None, None, 2]]
    units = rater_units(
        pose_problem(
            "fleiss_kappa",
            table,
            target="raters",
            categories=range(3),
            weights="identity",
            level=0.95,
        )
    )
    counts = np.array([[1.0, 2.0, 0.0]])
    (slopes,) = units.influence(counts)
    assert np.isnan(slopes[2])
    (error,) = units.standard_errors(counts)
    mean = counts[0, :2] @ slopes[:2] / 3
    assert error == pytest.approx(
        np.sqrt(counts[0, :2] @ (slopes[:2] - mean) ** 2), rel=1e-12
    )


def test_acceleration_is_a_sixth_of_the_skewness_of_values_left_out() -> None:
    problem = problem_of("gwet_ac", n=14)
    features = problem.features(problem.coded)
    left = problem.values(features.sum(axis=0) - features)
    deviation = left.mean() - left
    expected = (deviation**3).sum() / (6 * (deviation**2).sum() ** 1.5)
    assert item_units(problem).acceleration() == pytest.approx(expected, rel=1e-10)


def test_acceleration_of_raters_leaves_out_raters() -> None:
    table = np.array(dirichlet_multinomial(np.random.default_rng(5), 20, 5, 0.5))
    problem = pose_problem(
        "fleiss_kappa",
        table,
        target="raters",
        categories=range(3),
        weights="identity",
        level=0.95,
    )
    fleiss = COEFFICIENTS["fleiss_kappa"]
    left = np.array(
        [
            fleiss(np.delete(table, rater, axis=1), categories=range(3)).value
            for rater in range(5)
        ]
    )
    deviation = left.mean() - left
    expected = (deviation**3).sum() / (6 * (deviation**2).sum() ** 1.5)
    assert rater_units(problem).acceleration() == pytest.approx(expected, rel=1e-9)
