"""Diagnosis: by the functions whose numbers it puts together, by hand, and refusals."""

import itertools
import warnings

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from masrel.agreement import COEFFICIENTS, specific_agreement
from masrel.errors import SmallSampleWarning
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


@pytest.mark.parametrize("n_grades", [12, 60, 200])
def test_many_raters_of_many_grades_have_the_pairs_of_the_two_alone(
    n_grades: int,
) -> None:
    ratings = np.random.default_rng(6).integers(0, n_grades, (40, 30)).astype(float)
    ratings[:, 1] = np.where(ratings[:, 2] % 2, ratings[:, 0], ratings[:, 1])
    scale = list(map(float, range(n_grades)))
    found = diagnose(ratings, categories=scale)
    alone = estimate("fleiss_kappa", ratings[:, :2], target="items", categories=scale)
    assert found.pair_values[0, 1] == pytest.approx(alone.value, rel=1e-12)
    assert found.pair_items[0, 1] == 40


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


@pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")
def test_a_change_that_is_the_same_whatever_is_left_out_has_no_interval() -> None:
    # A and B agree throughout and C never agrees with them: without C kappa is 1,
    # whichever item is left out, and with C every item is as good as any other, but
    # for rounding.
    ratings = [[0, 0, 2], [1, 1, 0], [1, 1, 0], [1, 1, 2], [2, 2, 0], [2, 2, 0]]
    found = diagnose(ratings, target="items")
    assert found.changes[2] == 1.0
    assert found.change_errors[2] == 0.0
    assert np.isnan([found.change_low[2], found.change_high[2]]).all()
    assert found.change_low[0] < found.change_high[0] < 0.0


def test_categories_of_two_raters_have_their_specific_agreement() -> None:
    ratings = drawn(r=2)
    ratings = ratings[~np.isnan(ratings).any(axis=1)]
    table = np.zeros((3, 3), dtype=np.int64)
    np.add.at(table, tuple(ratings.astype(int).T), 1)
    found = diagnose(ratings, categories=[0, 1, 2])
    assert tuple(found.category_values) == specific_agreement(table)
    assert np.isnan(found.changes).all()  # one rater alone has none


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


def test_a_reference_is_left_out_of_all_else() -> None:
    ratings = drawn()
    names = ["Kim", "Gold", "Lee", "Ann"]
    with_it = diagnose(ratings, reference="Gold", raters=names, categories=[0, 1, 2])
    without = diagnose(ratings[:, [0, 2, 3]], categories=[0, 1, 2])
    assert with_it.estimate == without.estimate
    assert with_it.raters == ("Kim", "Lee", "Ann")
    for name in ("pair_values", "without_values", "category_values", "mean_values"):
        assert getattr(with_it, name) == pytest.approx(
            getattr(without, name), nan_ok=True, rel=1e-14
        )


@pytest.mark.parametrize(("n_pairs", "is_small"), [(9, True), (10, False)])
def test_few_items_with_a_pair_are_warned_of(n_pairs: int, is_small: bool) -> None:
    single = [[0.0, np.nan, np.nan, np.nan]] * 20
    table = [*np.nan_to_num(drawn(n_pairs)).tolist(), *single]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = diagnose(table, target="items", categories=[0, 1, 2])
    said = [w for w in caught if issubclass(w.category, SmallSampleWarning)]
    assert (len(said), len(found.notes)) == (is_small, is_small)


def test_a_rater_without_ratings_changes_nothing() -> None:
    ratings = drawn(r=3)
    empty = np.column_stack([ratings, np.full(len(ratings), np.nan)])
    with_it, without = (
        diagnose(table, target="items", categories=[0, 1, 2])
        for table in (empty, ratings)
    )
    assert with_it.changes[:3] == pytest.approx(without.changes, rel=1e-12)
    assert np.isnan(with_it.pair_values[3]).all()
    assert np.isnan(with_it.changes[3])
    assert with_it.confusion[:3].tolist() == without.confusion.tolist()
