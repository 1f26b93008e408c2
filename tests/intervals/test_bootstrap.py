"""Bootstrap intervals against complete enumeration and another program."""

import itertools
import math
from collections import Counter

import numpy as np
import pytest
import scipy.stats

from masrel.agreement import fleiss_kappa, percent_agreement
from masrel.errors import (
    ParameterError,
    SmallSampleWarning,
    UndefinedStatisticWarning,
)
from masrel.intervals import bootstrap
from tests.intervals.data import SCALE, TABLE_V, dirichlet_multinomial

few = pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")


def enumerated(table: list[list[str]]) -> tuple[list[float], list[int], int]:
    """Return the values, weights and undefined weight of all n^n item resamples."""
    n = len(table)
    weights: Counter[float] = Counter()
    undefined = 0
    for drawn in itertools.combinations_with_replacement(range(n), n):
        times = Counter(drawn)
        ways = math.factorial(n)
        for count in times.values():
            ways //= math.factorial(count)
        resample = [table[i] for i in drawn]
        if len({g for row in resample for g in row if g is not None}) == 1:
            undefined += ways
        else:
            weights[fleiss_kappa(resample).value] += ways
    values = sorted(weights)
    return values, [weights[v] for v in values], undefined


@few
def test_item_resamples_follow_the_law_of_all_35() -> None:
    values, weights, undefined = enumerated(TABLE_V)
    assert (sum(weights) + undefined, undefined) == (4**4, 1)  # HM3 alone four times
    cumulative = np.cumsum(weights) / sum(weights)
    found = bootstrap(
        "fleiss_kappa",
        TABLE_V,
        target="items",
        exact=False,
        n_resamples=200_000,
        rng=11,
    )
    # The value whose cumulative share passes the tail is the quantile, except where a
    # share is so near the tail that 40 000 draws may fall on either side of it.
    for end, tail in ((found.low, 0.025), (found.high, 0.975)):
        at = int(np.searchsorted(cumulative, tail))
        assert abs(cumulative[at] - tail) > 5 * math.sqrt(0.025 * 0.975 / 200_000)
        assert end == pytest.approx(values[at], abs=1e-12)
    # 1 of 256: 781 expected, sd 28; beyond 4 sd once in 16 000 runs of other seeds.
    assert abs(found.n_undefined - 200_000 / 256) < 112


@few
def test_a_rater_is_never_paired_with_a_copy_of_itself() -> None:
    # Three raters, all 27 resamples by hand: raters taken (a, b, c); a pair of places
    # with the same rater is left out of the agreement.
    table = [["1", "1", "2"], ["2", "2", "2"], ["1", "2", "1"], ["2", "2", "1"]]
    values = []
    for taken in itertools.product(range(3), repeat=3):
        pairs = [
            (i, j)
            for i, j in itertools.permutations(range(3), 2)
            if taken[i] != taken[j]
        ]
        if not pairs:
            continue  # one rater three times: 3 of 27
        shares = [
            sum(row[taken[i]] == row[taken[j]] for i, j in pairs) / len(pairs)
            for row in table
        ]
        values.append(sum(shares) / len(shares))
    assert len(values) == 24
    found = bootstrap(
        "percent_agreement",
        table,
        target="raters",
        exact=False,
        n_resamples=20_000,
        rng=2,
    )
    # Of 24, 6 are of three different raters, agreeing .5, and 6 each of two raters:
    # .75, .5, .25. A quarter each is at either end, so the quantiles are the ends.
    assert found.low == pytest.approx(min(values), abs=1e-12)
    assert found.high == pytest.approx(max(values), abs=1e-12)
    # 1/9 undefined: 2222, sd 44; beyond 4 sd once in 16 000 runs of other seeds
    assert abs(found.n_undefined - 20_000 / 9) < 178


def test_percentile_basic_and_bca_agree_with_scipy() -> None:
    table = np.array(dirichlet_multinomial(np.random.default_rng(4), 40, 4, 0.5))
    counts = np.stack([(table == k).sum(axis=1) for k in range(3)], axis=1)

    def kappa(items: np.ndarray, axis: int) -> np.ndarray:  # type: ignore[type-arg]
        # Fleiss (1971), items along the last axis
        assert axis == -1
        taken = counts[items]
        observed = ((taken * (taken - 1)).sum(axis=-1) / 12).mean(axis=-1)
        shares = taken.sum(axis=-2) / (4 * items.shape[-1])
        chance = (shares**2).sum(axis=-1)
        return np.asarray((observed - chance) / (1 - chance))

    for kind in ("percentile", "basic", "bca"):
        theirs = scipy.stats.bootstrap(
            (np.arange(40),), kappa, vectorized=True, n_resamples=20_000, batch=2000,
            method={"bca": "BCa"}.get(kind, kind), rng=np.random.default_rng(7),
        ).confidence_interval  # fmt: skip
        ours = bootstrap(
            "fleiss_kappa", table, target="items", kind=kind, rng=7,  # type: ignore[arg-type]
            n_resamples=100_000, exact=False,
        )  # fmt: skip
        # Theirs draws a fifth, without a control: 4 to 6 times our error. 4.5 of those
        # for both ends of three kinds: less than once in 20 000 runs of other seeds.
        assert ours.monte_carlo_error is not None
        for end, other, error in zip(
            (ours.low, ours.high), theirs, ours.monte_carlo_error, strict=True
        ):
            assert error < 0.001
            assert abs(end - other) < 4.5 * 6 * error


def test_basic_is_the_mirror_of_percentile() -> None:
    table = dirichlet_multinomial(np.random.default_rng(4), 40, 4, 0.5)
    plain = bootstrap("fleiss_kappa", table, target="items", rng=1)
    mirror = bootstrap("fleiss_kappa", table, target="items", rng=1, kind="basic")
    value = fleiss_kappa(table).value
    assert mirror.low == pytest.approx(2 * value - plain.high, abs=1e-12)
    assert mirror.high == pytest.approx(2 * value - plain.low, abs=1e-12)
    assert mirror.monte_carlo_error == plain.monte_carlo_error[::-1]  # type: ignore[index]


def test_monte_carlo_error_is_the_spread_between_seeds() -> None:
    table = dirichlet_multinomial(np.random.default_rng(4), 60, 5, 0.5)
    found = [
        bootstrap("fleiss_kappa", table, target="items", n_resamples=2000, rng=seed)
        for seed in range(60)
    ]
    spread = np.std([f.low for f in found], ddof=1)
    said = np.mean([f.monte_carlo_error[0] for f in found])  # type: ignore[index]
    # The sd of 60 values is within 35 % of its own: beyond once in 10 000 such runs.
    assert 0.65 < spread / said < 1.35


def test_seeds_repeat_and_are_recorded() -> None:
    table = dirichlet_multinomial(np.random.default_rng(4), 40, 4, 0.5)
    one = bootstrap("fleiss_kappa", table, target="items", rng=5)
    assert bootstrap("fleiss_kappa", table, target="items", rng=5) == one
    assert bootstrap("fleiss_kappa", table, target="items", rng=6) != one
    fresh = bootstrap("fleiss_kappa", table, target="items")
    assert fresh.seed is not None
    assert bootstrap("fleiss_kappa", table, target="items", rng=fresh.seed) == fresh
    given = bootstrap(
        "fleiss_kappa", table, target="items", rng=np.random.default_rng(5)
    )
    assert (given.low, given.high, given.seed) == (one.low, one.high, None)


@few
def test_perfect_agreement_has_no_spread_and_says_so() -> None:
    with pytest.warns(UndefinedStatisticWarning, match="no spread"):
        found = bootstrap(
            "fleiss_kappa", [["a", "a"], ["b", "b"]] * 3, target="items", rng=0
        )
    assert math.isnan(found.low)
    with pytest.warns(UndefinedStatisticWarning, match="itself is undefined"):
        bootstrap("fleiss_kappa", [["a", "a"]] * 3, target="items", rng=0)


def test_few_items_and_raters_are_warned_of() -> None:
    with pytest.warns(SmallSampleWarning, match="4 items: below 16"):
        bootstrap("fleiss_kappa", TABLE_V, target="items", rng=0)
    table = dirichlet_multinomial(np.random.default_rng(4), 20, 3, 0.5)
    with pytest.warns(SmallSampleWarning, match="3 raters: below 5"):
        bootstrap("fleiss_kappa", table, target="raters", rng=0)


@pytest.mark.parametrize(
    ("coefficient", "options", "said"),
    [
        (
            "fleiss_kappa",
            {"target": "items", "n_resamples": 99},
            "at least 100, got 99",
        ),
        ("fleiss_kappa", {"target": "items", "kind": "BCa"}, "kind: needs one of"),
        ("fleiss_kappa", {"target": "items", "rng": -1}, "rng: needs"),
        ("fleiss_kappa", {"target": "items", "rng": 1.5}, "got 1.5"),
        ("fleiss_kappa", {"target": "items", "rng": True}, "got True"),
    ],
)
@few
def test_a_wrong_option_is_named(
    coefficient: str, options: dict[str, object], said: str
) -> None:
    with pytest.raises(ParameterError, match=said):
        bootstrap(coefficient, TABLE_V, categories=SCALE, **options)  # type: ignore[arg-type]


def test_two_raters_are_never_resampled() -> None:
    table = [["a", "a"], ["b", "b"], ["a", "b"]] * 10
    with pytest.raises(ParameterError, match="copy of itself"):
        bootstrap("cohen_kappa", table, target="raters", rng=0)


@few
def test_missing_ratings_are_resampled_with_their_items() -> None:
    rows: list[list[str | None]] = [list(row) for row in TABLE_V]
    rows[0][0] = rows[2][5] = None
    values, _, _ = enumerated(rows)  # type: ignore[arg-type]
    found = bootstrap(percent_agreement, rows, target="items")
    assert found.low < percent_agreement(rows).value < found.high
    kappa = bootstrap(fleiss_kappa, rows, target="items")
    assert any(kappa.low == pytest.approx(v, abs=1e-12) for v in values)
