"""Diagnosis: by the functions whose numbers it puts together, by hand, and refusals."""

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from masrel.agreement import COEFFICIENTS
from masrel.intervals import diagnose, difference, estimate

KINDS = [
    name
    for name, entry in COEFFICIENTS.items()
    if entry.formula
    and entry.weighted
    and entry.shape == "ratings"
    and entry.n_raters[1] is None
]


def drawn(n: int = 40, r: int = 4, seed: int = 2) -> NDArray[np.float64]:
    """Ratings of three categories with gaps; the last rater is careless."""
    rng = np.random.default_rng(seed)
    true = rng.integers(0, 3, n)
    share = np.append(np.full(r - 1, 0.85), 0.3)
    ratings = np.where(
        rng.random((n, r)) < share, true[:, None], rng.integers(0, 3, (n, r))
    ).astype(float)
    ratings[rng.random((n, r)) < 0.1] = np.nan
    return ratings


@pytest.mark.parametrize("name", KINDS)
def test_pairs_are_those_of_the_two_raters_alone(name: str) -> None:
    ratings = drawn()
    found = diagnose(
        ratings,
        coefficient=name,
        target="items",
        categories=[0, 1, 2],
        weights="linear",
    )
    for one, other in itertools.combinations(range(4), 2):
        alone = estimate(
            name,
            ratings[:, [one, other]],
            target="items",
            categories=[0, 1, 2],
            weights="linear",
        )
        assert alone.interval is not None
        place = one, other
        assert found.pair_values[place] == pytest.approx(alone.value, rel=1e-12)
        assert found.pair_low[place] == pytest.approx(alone.interval.low, rel=1e-9)
        assert found.pair_high[place] == pytest.approx(alone.interval.high, rel=1e-9)
        assert found.pair_values[place[::-1]] == found.pair_values[place]
        both = ~np.isnan(ratings[:, [one, other]]).any(axis=1)
        assert found.pair_items[place] == both.sum()
    assert np.isnan(np.diag(found.pair_values)).all()
    pairs = found.pair_values[0, 1:]
    assert found.mean_values[0] == pytest.approx(pairs.mean(), rel=1e-14)


@pytest.mark.parametrize("name", KINDS)
def test_changes_are_differences_without_the_rater(name: str) -> None:
    ratings = drawn()
    ratings[:, 0] = np.nan_to_num(ratings[:, 0])  # every item has a rating of the rest
    ratings[:, 1] = np.nan_to_num(ratings[:, 1])
    found = diagnose(ratings, coefficient=name, target="items", categories=[0, 1, 2])
    for rater in range(4):
        change = difference(
            name,
            np.delete(ratings, rater, axis=1),
            ratings,
            design="dependent",
            categories=[0, 1, 2],
        )
        assert change.interval is not None
        assert found.changes[rater] == pytest.approx(change.value, abs=1e-13)
        error = change.standard_error
        assert found.change_errors[rater] == pytest.approx(error, rel=1e-10)
        assert found.change_low[rater] == pytest.approx(change.interval.low, abs=1e-11)
    assert int(np.argmax(found.changes)) == 3  # who is careless
    assert found.change_low[3] > 0.0
    assert found.estimate.interval is None


def test_categories_and_confusions_by_hand() -> None:
    # a a b: pairs a-a twice, a-b and b-a twice each; b b b: six pairs b-b
    found = diagnose([["a", "a", "b"], ["b", "b", "b"]])
    assert found.category_counts.tolist() == [2, 4]
    assert found.category_values.tolist() == [2 / 4, 6 / 8]
    # Kim said a where the others said a, b; and b where they said b, b
    assert found.confusion[0].tolist() == [[1, 0], [1, 2]]
    assert found.shares[0].tolist() == [[1.0, 0.0], [1 / 3, 2 / 3]]
    # the last said b where the others said a, a, and b, b
    assert found.confusion[2].tolist() == [[0, 2], [0, 2]]


def test_with_a_reference_shares_have_clopper_and_pearsons_interval() -> None:
    ratings = drawn()
    found = diagnose(
        ratings, reference=1, target="items", categories=[0, 1, 2], level=0.9
    )
    assert found.raters == ("0", "2", "3")
    right, rater = ratings[:, 1], ratings[:, 3]
    for of, said in itertools.product(range(3), repeat=2):
        n = int(((right == of) & ~np.isnan(rater)).sum())
        k = int(((right == of) & (rater == said)).sum())
        assert found.confusion[2, of, said] == k
        exact = stats.binomtest(k, n).proportion_ci(0.9, method="exact")
        assert found.share_low[2, of, said] == pytest.approx(exact.low, abs=1e-12)
        assert found.share_high[2, of, said] == pytest.approx(exact.high, abs=1e-12)
    alone = estimate("fleiss_kappa", ratings[:, [3, 1]], target="items", level=0.9)
    assert alone.interval is not None
    assert found.reference_values[2] == pytest.approx(alone.value, rel=1e-12)
    assert found.reference_low[2] == pytest.approx(alone.interval.low, rel=1e-9)
