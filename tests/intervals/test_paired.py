"""What carries nothing changes nothing, and counts are the ratings they count."""

import warnings
from collections.abc import Callable

import numpy as np
import pytest

from masrel.agreement import COEFFICIENTS, count_table
from masrel.errors import MasrelWarning
from masrel.estimates import Estimate, Interval, Target
from masrel.intervals import (
    analytic,
    bootstrap,
    estimate,
    jackknife,
    posterior,
)
from tests.intervals.data import SCALE, TABLE_V, dirichlet_multinomial

pytestmark = pytest.mark.filterwarnings("ignore::masrel.errors.MasrelWarning")

Table = list[list[str | None]]

FULL: Table = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"], ["a", "a"]]
SINGLES: Table = [["a", None]] * 15 + [[None, "b"]] * 10
PAIRS_ONLY = ["krippendorff_alpha", "cohen_kappa", "scott_pi"]
WITH_KERNEL = [
    name
    for name, entry in COEFFICIENTS.items()
    if entry.formula is not None and not entry.has_interval
]
OF_ANY_RATERS = [
    name
    for name in WITH_KERNEL
    if COEFFICIENTS[name].shape == "ratings" and COEFFICIENTS[name].n_raters[1] is None
]

METHODS: dict[str, Callable[..., object]] = {
    "analytic": analytic,
    "jackknife": jackknife,
    "bootstrap": lambda *args, **options: bootstrap(*args, rng=1, **options),
    "posterior": lambda *args, **options: posterior(*args, rng=1, **options),
    "auto": lambda *args, **options: estimate(*args, **options).interval,
    "clusters": lambda name, ratings, **options: bootstrap(
        name, ratings, clusters=[i // 2 for i in range(len(ratings))], **options
    ),
}


def quiet(method: Callable[..., object], *args: object, **options: object) -> object:
    """What a method finds, or why it refuses."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MasrelWarning)
        try:
            found = method(*args, **options)
        except ValueError as error:
            return str(error)
    # nan is no nan's equal
    return repr(found) if isinstance(found, Interval) else found


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", PAIRS_ONLY)
def test_single_ratings_change_no_bit_where_only_pairs_count(
    name: str, method: str
) -> None:
    options = {"target": "items", "categories": ["a", "b"]}
    alone = quiet(METHODS[method], name, FULL, **options)
    # at the end, so that the clusters of the others stay
    assert quiet(METHODS[method], name, FULL + SINGLES, **options) == alone


def holed(table: Table) -> list[Table]:
    """The same ratings beside items, raters, and both that have none."""
    bare: Table = [[*row, None, None, None] for row in table]
    empty: Table = [[None] * len(table[0])] * 3
    return [table + empty, bare, [*bare, [None] * len(bare[0])]]


@pytest.mark.parametrize("target", ["items", "raters", "both"])
@pytest.mark.parametrize("name", OF_ANY_RATERS)
def test_items_and_raters_without_ratings_change_nothing(
    name: str, target: Target
) -> None:
    options = {"target": target, "categories": SCALE}
    for method in ("jackknife", "auto", "analytic"):
        alone = quiet(METHODS[method], name, TABLE_V, **options)
        for table in holed(TABLE_V):  # type: ignore[arg-type]
            assert quiet(METHODS[method], name, table, **options) == alone


# "both": no surer than either.


def random_sets(seed: int, n_sets: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    made = []
    while len(made) < n_sets:
        n, r = int(rng.integers(3, 40)), int(rng.integers(3, 9))
        table = np.array(dirichlet_multinomial(rng, n, r, float(rng.uniform(0.1, 0.9))))
        table = table.astype(float)
        if rng.random() < 0.3:
            table[rng.random(table.shape) < 0.2] = np.nan
        if rng.random() < 0.3:  # a rater unlike the others
            table[:, 0] = np.minimum(table[:, 0] + 1, np.nanmax(table))
        made.append(table)
    return made


@pytest.mark.parametrize("name", OF_ANY_RATERS)
def test_the_interval_for_both_holds_those_for_either(name: str) -> None:
    for table in random_sets(7, 12):
        scale = sorted(set(table[~np.isnan(table)].tolist()))
        both, items, raters = (
            estimate(name, table, target=of, categories=scale).interval  # type: ignore[arg-type]
            for of in ("both", "items", "raters")
        )
        assert both is not None
        assert items is not None
        assert raters is not None
        if both.reason is None:
            assert both.low <= min(items.low, raters.low) + 1e-12
            assert both.high >= max(items.high, raters.high) - 1e-12
        else:  # what has no answer for one of them has none for both
            assert both.reason in (items.reason, raters.reason)


TABLE = [[20, 5], [10, 15]]
PAIRS = [[1, 1]] * 20 + [[1, 2]] * 5 + [[2, 1]] * 10 + [[2, 2]] * 15
NAMED = ["cohen_kappa", "scott_pi", "conger_kappa", "light_kappa"]
UNNAMED = [
    "percent_agreement",
    "fleiss_kappa",
    "brennan_prediger",
    "gwet_ac",
    "krippendorff_alpha",
]


@pytest.mark.parametrize(
    "method", ["auto", "analytic", "jackknife", "bootstrap", "posterior"]
)
@pytest.mark.parametrize("name", [*NAMED, *UNNAMED])
def test_a_table_of_two_raters_is_their_ratings(name: str, method: str) -> None:
    of_table, of_pairs = (
        estimate(name, ratings, target="items", method=method, rng=1, **scale)  # type: ignore[arg-type]
        for ratings, scale in (
            (count_table(TABLE), {}),
            (PAIRS, {"categories": [1, 2]}),
        )
    )
    assert of_table.interval is not None
    assert of_pairs.interval is not None
    assert of_table.interval.method == of_pairs.interval.method
    assert numbers(of_table) == pytest.approx(numbers(of_pairs), rel=1e-12)


def numbers(of: Estimate) -> list[float]:
    """Return what an estimate says in numbers; sums may be in another order."""
    assert of.interval is not None
    return [
        *(of.value, of.standard_error, of.observed, of.chance),
        *(of.n_items, of.n_items_paired, of.n_raters),
        *(of.interval.low, of.interval.high),
    ]
