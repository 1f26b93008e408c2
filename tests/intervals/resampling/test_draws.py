"""Resamples that are drawn, held to the exact distribution of all of them."""

import dataclasses
import importlib
import math
import tracemalloc

import numpy as np
import pytest

from masrel.errors import ConvergenceError, ParameterError
from masrel.intervals import bootstrap
from masrel.intervals._problem import pose_problem
from masrel.intervals.resampling.control import control_of, whole_scores
from masrel.intervals.resampling.drawn import Drawn
from masrel.intervals.resampling.draws import Effort, draw_resamples
from masrel.intervals.resampling.endpoints import Rule
from masrel.intervals.resampling.enumerated import Enumerated, quantile_of
from masrel.intervals.resampling.exact import enumerate_resamples
from masrel.intervals.resampling.pool import Pool, item_pool, rater_pool
from masrel.intervals.resampling.samplers import Sampler, sampler_of
from tests.intervals.data import dirichlet_multinomial

few = pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")


def made(n: int, r: int, categories: int = 3) -> list[list[int]]:
    rows = dirichlet_multinomial(np.random.default_rng(n + r), n, r, 0.5)
    return [[min(grade, categories - 1) for grade in row] for row in rows]


def pool_of(
    table: list[list[int]], coefficient: str = "fleiss_kappa", weights: str = "identity"
) -> Pool:
    case = pose_problem(
        coefficient,
        table,
        target="items",
        categories=range(3),
        weights=weights,  # type: ignore[arg-type]
        level=0.95,
    )
    return item_pool(case)


def distance(pool: Pool, sampler: Sampler, n_resamples: int, seed: int = 1) -> float:
    """The largest distance of the drawn from the exact distribution function."""
    exact = enumerate_resamples(pool, None, insist=True)
    assert exact is not None
    source = exact.source
    assert isinstance(source, Enumerated)
    values, _ = sampler.batches(n_resamples, np.random.default_rng(seed))
    drawn = np.sort(values[~np.isnan(values)])
    between = 0.5 * (source.values[1:] + source.values[:-1])
    seen = np.searchsorted(drawn, between) / drawn.size
    return float(np.abs(seen - source.upto[:-1]).max())


# Dvoretzky, Kiefer, Wolfowitz and Massart: the distance of n draws is above x with a
# probability of at most 2 exp(-2 n x²): with 40 000, above 0.0135 once in a million.
FAR = math.sqrt(math.log(2e6) / (2 * 40_000))


@pytest.mark.parametrize("n", [7, 16, 30, 49, 130])
def test_looked_up_resamples_have_the_exact_distribution(n: int) -> None:
    pool = pool_of(made(n, 3, categories=3 if n < 10 else 2))
    module = importlib.import_module("masrel.intervals.resampling.samplers")
    assert pool.lattice is not None
    slopes = module._slopes(pool)
    at_once = 3 if n <= 30 else 2  # the last lookup is of fewer, but for 30 and 130
    sampler = module._packed(pool, pool.lattice, slopes, at_once)
    assert distance(pool, sampler, 40_000) < FAR


@pytest.mark.parametrize("n", [7, 30, 130])
def test_counted_resamples_have_the_exact_distribution(n: int) -> None:
    pool = pool_of(made(n, 3, categories=3 if n < 10 else 2))
    sampler = sampler_of(pool, pool.of_counts)
    assert distance(pool, sampler, 40_000) < FAR


def test_irrational_weights_are_drawn_in_counts() -> None:
    table = made(9, 4)
    pool = pool_of(table, weights="radical")
    assert pool.lattice is None
    assert distance(pool, sampler_of(pool, None), 40_000) < FAR


@few
def test_raters_are_drawn_with_the_exact_distribution() -> None:
    case = pose_problem(
        "fleiss_kappa",
        made(12, 6),
        target="raters",
        categories=range(3),
        weights="identity",
        level=0.95,
    )
    pool = rater_pool(case)
    assert distance(pool, sampler_of(pool, None), 40_000) < FAR


@few
@pytest.mark.parametrize("kind", ["percentile", "basic", "bca", "studentized"])
@pytest.mark.parametrize(("n", "r", "categories"), [(10, 6, 3), (60, 3, 2)])
def test_errors_are_as_large_as_they_say(
    kind: str, n: int, r: int, categories: int
) -> None:
    options = {"target": "items", "kind": kind, "categories": range(3)}
    table = made(n, r, categories)
    exact = bootstrap("fleiss_kappa", table, **options)  # type: ignore[arg-type]
    assert exact.monte_carlo_error is None
    off = []
    for seed in range(30):
        found = bootstrap(
            "fleiss_kappa",
            table,
            exact=False,
            rng=seed,
            n_resamples=4000,
            **options,  # type: ignore[arg-type]
        )
        assert found.monte_carlo_error is not None
        for end in ("low", "high"):
            error = found.monte_carlo_error[end == "high"]
            if getattr(exact, end) not in (-1.0, 1.0):  # not cut
                off.append((getattr(found, end) - getattr(exact, end)) / error)
    # Root mean square of 30 or 60 standard normal numbers: outside once in 100 000 for
    # 30; the errors themselves are known to a quarter.
    assert 0.5 < math.sqrt(np.mean(np.square(off))) < 1.6


def test_the_error_of_bca_has_that_of_its_bias_in_it() -> None:
    # Without the error of the bias that of the low end would be 0.7 of the spread
    # between seeds.
    table = made(29, 8)
    found = [
        bootstrap(
            "fleiss_kappa",
            table,
            target="items",
            categories=range(3),
            kind="bca",
            exact=False,
            n_resamples=1000,
            rng=seed,
        )
        for seed in range(200)
    ]
    for end, of in (("low", 0), ("high", 1)):
        spread = np.std([getattr(f, end) for f in found], ddof=1)
        said = np.mean([f.monte_carlo_error[of] for f in found])  # type: ignore[index]
        # the sd of 200 values is within 22 % of its own but once in 100 000 runs
        assert 0.8 < said / spread < 1.25


def test_the_control_goes_where_resamples_are_undefined() -> None:
    # A control knows the distribution of all resamples, not of the defined ones.
    table = [[0, 0, 0]] * 38 + [[0, 1, 0], [1, 1, 1]]
    found = draw_resamples(
        sampler_of(pool_of(table), None),
        Rule(kind="percentile", level=0.95, value=0.5),
        Effort(n_resamples=5000, most_resamples=5000),
        np.random.default_rng(1),
    )
    assert found.n_undefined > 0
    assert isinstance(found.source, Drawn)
    assert found.source.control is None
    assert found.source.values.size == 5000 - found.n_undefined
    whole = sampler_of(pool_of(made(60, 3)), None)
    assert whole.control is not None


def test_different_rows_that_meet_in_their_key_stay_different() -> None:
    module = importlib.import_module("masrel.intervals.resampling.pool")
    rows = np.array([[1.0, 0.0], [0.0, 0.7390851332151607]] * 1500)
    key = rows[:, 0] * 0.7390851332151607 + rows[:, 1]
    assert np.ptp(key) == 0.0
    found, kind = module._distinct(rows)
    assert len(found) == 2
    np.testing.assert_array_equal(found[kind], rows)
    many = np.random.default_rng(1).integers(0, 3, (5000, 4)) / 7
    found, kind = module._distinct(many)
    assert len(found) == 81
    np.testing.assert_array_equal(found[kind], many)


def test_a_control_makes_the_error_smaller_and_no_bias() -> None:
    table = made(300, 3, categories=2)
    pool = pool_of(table)
    (value,) = pool.of_counts(pool.times[None].astype(float))
    exact = enumerate_resamples(pool, None, insist=True)
    assert exact is not None
    sampler = sampler_of(pool, None)
    assert sampler.control is not None
    with_control, plain = [], []
    for seed in range(60):
        values, scores = sampler.batches(2000, np.random.default_rng(seed))
        drawn = Drawn(
            values=values,
            ordered=np.sort(values),
            control=sampler.control,
            scores=scores,
        )
        bare = dataclasses.replace(drawn, control=None, scores=None)
        with_control.append([drawn.quantile(0.025), drawn.share_below(value)])
        plain.append([bare.quantile(0.025), bare.share_below(value)])
    truth = [exact.source.quantile(0.025), exact.source.share_below(value)]
    one, other = np.array(with_control) - truth, np.array(plain) - truth
    # 10 and 20 times less variance in 80 other runs; a third of the true ratio of two
    # variances of 60 values is seen once in 50 000.
    assert (other.var(axis=0) > [10 / 3, 20 / 3] * one.var(axis=0)).all()
    # the mean of 60 is within 4.5 of its standard errors but once in 150 000
    bound = 4.5 * one.std(axis=0, ddof=1) / math.sqrt(60)
    assert (np.abs(one.mean(axis=0)) < bound).all()


def test_the_control_is_known_exactly() -> None:
    scores, shares = np.array([-3, 0, 5, 40]), np.array([0.5, 0.25, 0.2, 0.05])
    control = control_of(scores, shares, 3)
    sums = np.add.outer(np.add.outer(scores, scores), scores).ravel()
    weights = np.multiply.outer(np.multiply.outer(shares, shares), shares).ravel()
    for cut in (-9, -4, 0, 7, 34, 120):
        at = cut - control.least
        assert control.upto[at] == pytest.approx(weights[sums <= cut].sum(), abs=1e-12)
    cut, share = control.cut(0.5)
    assert share == pytest.approx(weights[sums <= cut].sum(), abs=1e-12)
    assert control.cut(-1.0)[0] == control.least
    assert control.cut(2.0)[1] == pytest.approx(1.0)


def test_scores_are_fine_and_few() -> None:
    slopes = np.random.default_rng(1).normal(size=50)
    for n in (30, 10_000, 10**8):
        scores = whole_scores(slopes, float(slopes.std()), n)
        assert np.corrcoef(scores, slopes)[0, 1] > (0.999 if n < 10**8 else 0.5)
        assert 17 * scores.std() * math.sqrt(n) < 1.2 * 2**18


def test_what_is_drawn_does_not_depend_on_batches(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    module = importlib.import_module("masrel.intervals.resampling.samplers")
    packed, counted = pool_of(made(37, 5)), pool_of(made(37, 5), weights="radical")
    for pool in (packed, counted):
        whole = sampler_of(pool, None).batches(1000, np.random.default_rng(2))
        with monkeypatch.context() as patch:
            patch.setattr(module, "_CHUNK", 700)
            cut = sampler_of(pool, None).batches(1000, np.random.default_rng(2))
        for one, other in zip(whole, cut, strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-14)


def test_a_tolerance_draws_until_it_is_met() -> None:
    table = made(60, 5)
    options = {"target": "items", "categories": range(3), "exact": False, "rng": 4}
    loose = bootstrap("gwet_ac", table, n_resamples=1000, **options)  # type: ignore[arg-type]
    assert loose.monte_carlo_error is not None
    tolerance = min(loose.monte_carlo_error) / 3
    found = bootstrap(
        "gwet_ac",
        table,
        n_resamples=1000,
        tolerance=tolerance,
        **options,  # type: ignore[arg-type]
    )
    assert found.monte_carlo_error is not None
    assert max(found.monte_carlo_error) <= tolerance
    assert found.n_resamples is not None
    assert 4000 < found.n_resamples < 100_000
    again = bootstrap(
        "gwet_ac",
        table,
        n_resamples=1000,
        tolerance=tolerance,
        **options,  # type: ignore[arg-type]
    )
    assert again == found
    met = bootstrap("gwet_ac", table, n_resamples=1000, tolerance=1.0, **options)  # type: ignore[arg-type]
    assert met == loose


def test_a_tolerance_that_takes_too_long_says_how_long() -> None:
    table = made(60, 5)
    with pytest.raises(ConvergenceError, match=r"takes about \S+ more, and most_resam"):
        bootstrap(
            "gwet_ac",
            table,
            target="items",
            tolerance=1e-6,
            most_resamples=50_000,
            rng=1,
        )


def test_an_exact_interval_meets_any_tolerance() -> None:
    found = bootstrap("gwet_ac", made(20, 3, 2), target="items", tolerance=1e-12)
    assert found.monte_carlo_error is None


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"tolerance": 0.0}, "tolerance: needs a number above 0"),
        ({"tolerance": math.nan}, "tolerance: needs a number above 0"),
        ({"n_resamples": 500, "most_resamples": 400}, "needs at least the 500"),
        ({"exact": "yes"}, "exact: needs"),
        ({"exact": 1}, "exact: needs"),
    ],
)
def test_wrong_options_are_named(options: dict[str, object], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        bootstrap("gwet_ac", made(20, 3), target="items", **options)  # type: ignore[arg-type]


def test_memory_does_not_grow_with_items_times_resamples() -> None:
    table = np.random.default_rng(1).integers(0, 5, (100_000, 5), dtype=np.int8)
    options = {"target": "items", "categories": range(5), "n_resamples": 2000}
    bootstrap("fleiss_kappa", table[:1000], rng=1, **options)  # type: ignore[arg-type]
    tracemalloc.start()
    try:
        bootstrap("fleiss_kappa", table, rng=1, **options)  # type: ignore[arg-type]
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    # the drawn items alone would be 200 million numbers
    assert peak < 30e6


def test_quantiles_of_drawn_values_are_in_the_middle_of_a_tie() -> None:
    values = np.array([4.0, 1.0, 2.0, 8.0])
    drawn = Drawn(values=values, ordered=np.sort(values))
    assert [drawn.quantile(at) for at in (0.2, 0.25, 0.3, 0.5, 1.0)] == [
        1.0, 1.5, 2.0, 3.0, 8.0,
    ]  # fmt: skip
    assert drawn.share_below(2.0) == 0.375
    upto = np.array([0.25, 0.5, 0.75, 1.0])
    for at in np.linspace(0.01, 0.99, 99):
        assert drawn.quantile(at) == quantile_of(np.sort(values), upto, at)


def test_equal_values_are_put_together_but_for_rounding() -> None:
    third = 1.0 / 3.0
    found = Enumerated.of(
        np.array([0.5, third, np.nextafter(third, 1.0), math.inf, math.inf, -math.inf]),
        np.array([1.0, 1.0, 2.0, 2.0, 1.0, 3.0]),
    )
    assert found.values.tolist() == [-math.inf, third, 0.5, math.inf]
    assert found.weights.tolist() == pytest.approx([0.3, 0.3, 0.1, 0.3])
    assert found.share_below(third) == pytest.approx(0.45)
    assert found.share_below(0.4) == pytest.approx(0.6)
    assert found.share_below(-2.0) == pytest.approx(0.3)
