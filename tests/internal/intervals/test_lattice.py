"""Sums of features over all resamples, and the lattice they lie on."""

import itertools
import math
from collections import Counter
from fractions import Fraction

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from masrel.intervals._lattice import (
    Lattice,
    box,
    lattice_of,
    sums_of_scores,
    sums_of_steps,
)
from masrel.intervals._problem import pose_problem
from masrel.intervals._resamples import compositions
from masrel.intervals._units import SamplingUnits
from tests.internal.intervals.items import item_units
from tests.intervals.data import dirichlet_multinomial


def units_of(
    n: int, r: int, *, coefficient: str = "fleiss_kappa", weights: str = "identity"
) -> SamplingUnits:
    table = dirichlet_multinomial(np.random.default_rng(n), n, r, 0.4)
    return item_units(
        pose_problem(
            coefficient,
            table,
            target="items",
            categories=range(3),
            weights=weights,  # type: ignore[arg-type]
            level=0.95,
        )
    )


def sums_one_by_one(
    lattice: Lattice, shares: np.ndarray, n: int
) -> tuple[np.ndarray, np.ndarray]:
    """All sums and their probabilities, by adding one draw at a time."""
    weights = {(0,) * lattice.steps.shape[1]: 1.0}
    for _ in range(n):
        grown: Counter[tuple[int, ...]] = Counter()
        for (before, weight), (step, share) in itertools.product(
            weights.items(), zip(lattice.steps.tolist(), shares, strict=True)
        ):
            after = tuple(a + b for a, b in zip(before, step, strict=True))
            grown[after] += weight * share
        weights = dict(grown)
    return np.array(list(weights)), np.array(list(weights.values()))


def law(sums: tuple[np.ndarray, np.ndarray]) -> dict[tuple[int, ...], float]:
    steps, found = sums
    kept = dict(zip(map(tuple, steps.tolist()), found.tolist(), strict=True))
    assert len(kept) == len(steps)  # every sum once
    return kept


def apart(
    one: dict[tuple[int, ...], float], two: dict[tuple[int, ...], float]
) -> float:
    return sum(abs(one.get(key, 0.0) - two.get(key, 0.0)) for key in one.keys() | two)


@pytest.mark.parametrize(
    ("n", "r", "coefficient", "weights"),
    [
        (9, 3, "fleiss_kappa", "identity"),
        (9, 4, "gwet_ac", "quadratic"),
        (8, 5, "krippendorff_alpha", "linear"),
        (12, 2, "cohen_kappa", "identity"),
        (7, 3, "conger_kappa", "identity"),
    ],
)
def test_three_ways_to_the_same_probabilities(
    n: int, r: int, coefficient: str, weights: str
) -> None:
    units = units_of(n, r, coefficient=coefficient, weights=weights)
    lattice = units.lattice
    assert lattice is not None
    counts, weight = compositions(units.n, units.shares)
    one_by_one: Counter[tuple[int, ...]] = Counter()
    for sums, w in zip((counts @ lattice.steps).tolist(), weight, strict=True):
        one_by_one[tuple(sums)] += w
    merged = law(sums_one_by_one(lattice, units.shares, units.n))
    transformed = law(sums_of_steps(lattice.steps, units.shares, units.n))
    assert merged.keys() == one_by_one.keys()
    # merged: only products and sums of what is above 0
    for key, w in one_by_one.items():
        assert merged[key] == pytest.approx(w, rel=1e-12)
    assert apart(transformed, merged) < 1e-12
    assert transformed.keys() <= merged.keys()


def test_sums_are_those_of_the_features() -> None:
    units = units_of(10, 4, weights="linear")
    assert units.lattice is not None
    assert units.rows is not None
    counts, _ = compositions(units.n, units.shares)
    sums = units.lattice.sums(counts @ units.lattice.steps, units.n)
    np.testing.assert_allclose(sums, counts @ units.rows, atol=1e-13)


def test_two_draws_by_hand() -> None:
    # a coin that shows 0 in one of four: 1/16, 6/16, 9/16
    rows = np.array([[0.0], [0.5]])
    shares = np.array([0.25, 0.75])
    lattice = lattice_of(rows, shares, 2)
    assert lattice is not None
    assert lattice.steps.tolist() == [[0], [1]]
    assert lattice.denominators.tolist() == [2.0]
    for states in (
        sums_of_steps(lattice.steps, shares, 2),
        sums_one_by_one(lattice, shares, 2),
    ):
        found = law(states)
        assert found == pytest.approx({(0,): 1 / 16, (1,): 6 / 16, (2,): 9 / 16})


def test_probabilities_are_those_of_fractions() -> None:
    rows, shares = [(0, 0), (1, 2), (3, 1)], [Fraction(1, 7), Fraction(2, 7)]
    shares.append(1 - sum(shares))
    exact: Counter[tuple[int, int]] = Counter()
    for drawn in itertools.product(range(3), repeat=6):
        weight = Fraction(1)
        for i in drawn:
            weight *= shares[i]
        key = (sum(rows[i][0] for i in drawn), sum(rows[i][1] for i in drawn))
        exact[key] += weight  # type: ignore[assignment]
    floats = np.array([float(s) for s in shares])
    lattice = lattice_of(np.array(rows, dtype=float), floats, 6)
    assert lattice is not None
    for states in (
        sums_of_steps(lattice.steps, floats, 6),
        sums_one_by_one(lattice, floats, 6),
    ):
        assert states is not None
        steps, found = states
        sums = lattice.sums(steps, 6)
        for (a, b), p in zip(sums.tolist(), found.tolist(), strict=True):
            assert p == pytest.approx(float(exact[round(a), round(b)]), rel=1e-9)


@pytest.mark.parametrize("n", [1, 7, 400, 30_000])
@pytest.mark.parametrize("share", [0.5, 0.003])
def test_a_box_around_the_mean_loses_less_than_it_says(n: int, share: float) -> None:
    scores, shares = np.array([0, 1]), np.array([1.0 - share, share])
    least, found = sums_of_scores(scores, shares, n)
    at = np.arange(least, least + found.size)
    expected = scipy.stats.binom.pmf(at, n, share)
    assert np.abs(found - expected).sum() < 1e-11  # scipy's own digits at large n
    side = int(box(scores[:, None], shares, n)[0])
    assert side <= n + 1
    if n == 30_000 and share == 0.5:
        assert side < 1_500  # 17 standard deviations rather than 30 001
    lost = scipy.stats.binom.cdf(at[0] - 1, n, share)
    lost += scipy.stats.binom.sf(at[-1], n, share)
    assert lost < 1e-12


def test_a_large_study_fits_into_a_small_box() -> None:
    # two categories, three raters: 0, 1, 2 or 3 of them, and whether they all agree
    table = np.random.default_rng(2).integers(0, 2, (1000, 3)).tolist()
    case = pose_problem(
        "fleiss_kappa",
        table,
        target="items",
        categories=range(2),
        weights="identity",
        level=0.95,
    )
    units = item_units(case)
    assert units.lattice is not None
    steps, found = sums_of_steps(units.lattice.steps, units.shares, units.n)
    assert found.sum() == pytest.approx(1.0, abs=1e-12)
    assert len(steps) < 300_000 < math.comb(1003, 3)
    sums = units.lattice.sums(steps, units.n)
    mean = found @ sums
    np.testing.assert_allclose(mean, units.freq @ units.rows, rtol=1e-11)
    covariance = (sums - mean).T @ ((sums - mean) * found[:, None])
    rows = units.rows - units.shares @ units.rows  # type: ignore[operator]
    one = 1000 * rows.T @ (rows * units.shares[:, None])
    np.testing.assert_allclose(covariance, one, atol=1e-8)


@given(
    st.lists(
        st.lists(st.integers(-6, 6), min_size=3, max_size=3), min_size=1, max_size=8
    ),
    st.integers(1, 12),
)
def test_a_lattice_holds_its_rows_with_no_gap(
    numerators: list[list[int]], over: int
) -> None:
    rows = np.unique(np.array(numerators) / over, axis=0)
    shares = np.full(len(rows), 1.0 / len(rows))
    lattice = lattice_of(rows, shares, 5)
    assert lattice is not None
    assert lattice.steps.min(initial=0) >= 0
    np.testing.assert_allclose(lattice.sums(lattice.steps, 1), rows, atol=1e-12)
    # every integer point is a sum of differences of rows: the determinants of all
    # choices of differences have 1 as their greatest common divisor
    differences = lattice.steps - lattice.steps[0]
    d = differences.shape[1]
    if d:
        assert d == np.linalg.matrix_rank(rows - rows[0])
        minors = [
            round(np.linalg.det(differences[list(which)]))
            for which in itertools.combinations(range(len(rows)), d)
        ]
        assert np.gcd.reduce(minors) == 1


def test_irrational_features_and_many_dimensions_have_no_lattice() -> None:
    assert lattice_of(np.array([[0.0], [np.sqrt(0.5)]]), np.full(2, 0.5), 4) is None
    assert lattice_of(np.eye(20), np.full(20, 0.05), 4) is None
    assert lattice_of(np.array([[0.0], [2.0**50]]), np.full(2, 0.5), 40) is None


def test_resamples_are_counted_each_once() -> None:
    shares = np.array([0.5, 0.3, 0.2])
    counts, weights = compositions(6, shares)
    assert len({tuple(row) for row in counts.tolist()}) == 28
    assert (counts.sum(axis=1) == 6).all()
    expected = scipy.stats.multinomial.pmf(counts, 6, shares)
    np.testing.assert_allclose(weights, expected, rtol=1e-12)


def test_a_single_kind_of_item_has_one_resample() -> None:
    counts, weights = compositions(5, np.ones(1))
    assert counts.tolist() == [[5]]
    assert weights.tolist() == [1.0]
    lattice = lattice_of(np.ones((1, 3)), np.ones(1), 5)
    assert lattice is not None
    steps, found = sums_of_steps(lattice.steps, np.ones(1), 5)
    assert steps.shape == (1, 0)
    assert found.tolist() == [1.0]


def test_many_draws_neither_over_nor_underflow() -> None:
    counts, weights = compositions(100_000, np.array([0.5, 0.5]))
    assert weights.sum() == pytest.approx(1.0, abs=1e-9)
    middle = scipy.stats.binom.pmf(50_000, 100_000, 0.5)
    assert weights[counts[:, 0] == 50_000][0] == pytest.approx(middle, rel=1e-9)
