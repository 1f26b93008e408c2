"""Resamples that are drawn, held to the exact distribution of all of them."""

import dataclasses
import math

import numpy as np
import pytest

from masrel.errors import ParameterError
from masrel.intervals import _resamples, _units, bootstrap
from masrel.intervals._endpoints import AllResamples, DrawnResamples, EndpointRule
from masrel.intervals._problem import pose_problem
from masrel.intervals._resamples import (
    DrawBudget,
    Sampler,
    all_resamples,
    control_of,
    draw_resamples,
    integer_scores,
    sampler_of,
)
from masrel.intervals._units import SamplingUnits, rater_units
from tests.internal.intervals.items import item_units
from tests.intervals.data import dirichlet_multinomial

few = pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")


def made(n: int, r: int, categories: int = 3) -> list[list[int]]:
    rows = dirichlet_multinomial(np.random.default_rng(n + r), n, r, 0.5)
    return [[min(grade, categories - 1) for grade in row] for row in rows]


def units_of(
    table: list[list[int]], coefficient: str = "fleiss_kappa", weights: str = "identity"
) -> SamplingUnits:
    case = pose_problem(
        coefficient,
        table,
        target="items",
        categories=range(3),
        weights=weights,  # type: ignore[arg-type]
        level=0.95,
    )
    return item_units(case)


def distance(
    units: SamplingUnits, sampler: Sampler, n_resamples: int, seed: int = 1
) -> float:
    """The largest distance of the drawn from the exact distribution function."""
    exact = all_resamples(units, None, insist=True)
    assert exact is not None
    values, _ = sampler.draw(n_resamples, np.random.default_rng(seed))
    drawn = np.sort(values[~np.isnan(values)])
    between = 0.5 * (exact.values[1:] + exact.values[:-1])
    seen = np.searchsorted(drawn, between) / drawn.size
    return float(np.abs(seen - exact.cumulative[:-1]).max())


# Dvoretzky, Kiefer, Wolfowitz and Massart: the distance of n draws is above x with a
# probability of at most 2 exp(-2 n x²): with 40 000, above 0.0135 once in a million.
FAR = math.sqrt(math.log(2e6) / (2 * 40_000))


@pytest.mark.parametrize("n", [7, 16, 30, 49, 130])
def test_looked_up_resamples_have_the_exact_distribution(n: int) -> None:
    units = units_of(made(n, 3, categories=3 if n < 10 else 2))
    assert units.lattice is not None
    slopes = _resamples._slopes(units)
    at_once = 3 if n <= 30 else 2  # the last lookup is of fewer, but for 30 and 130
    sampler = _resamples._packed_sampler(units, units.lattice, slopes, at_once)
    assert distance(units, sampler, 40_000) < FAR


@pytest.mark.parametrize("n", [7, 30, 130])
def test_counted_resamples_have_the_exact_distribution(n: int) -> None:
    units = units_of(made(n, 3, categories=3 if n < 10 else 2))
    sampler = sampler_of(units, units.of_counts)
    assert distance(units, sampler, 40_000) < FAR


def test_irrational_weights_are_drawn_in_counts() -> None:
    table = made(9, 4)
    units = units_of(table, weights="radical")
    assert units.lattice is None
    assert distance(units, sampler_of(units, None), 40_000) < FAR


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
    units = rater_units(case)
    assert distance(units, sampler_of(units, None), 40_000) < FAR


def test_the_control_goes_where_resamples_are_undefined() -> None:
    # A control knows the distribution of all resamples, not of the defined ones.
    table = [[0, 0, 0]] * 38 + [[0, 1, 0], [1, 1, 1]]
    found = draw_resamples(
        units_of(table),
        None,
        EndpointRule(kind="percentile", level=0.95, value=0.5),
        DrawBudget(n_resamples=5000, max_resamples=5000),
        np.random.default_rng(1),
    )
    assert found.n_undefined > 0
    assert found.control is None
    assert found.drawn.size == 5000 - found.n_undefined
    whole = sampler_of(units_of(made(60, 3)), None)
    assert whole.control is not None


def test_different_rows_that_meet_in_their_key_stay_different() -> None:
    rows = np.array([[1.0, 0.0], [0.0, 0.7390851332151607]] * 1500)
    key = rows[:, 0] * 0.7390851332151607 + rows[:, 1]
    assert np.ptp(key) == 0.0
    found, kind = _units._distinct_of_many(rows)
    assert len(found) == 2
    np.testing.assert_array_equal(found[kind], rows)
    many = np.random.default_rng(1).integers(0, 3, (5000, 4)) / 7
    found, kind = _units._distinct_of_many(many)
    assert len(found) == 81
    np.testing.assert_array_equal(found[kind], many)


def test_a_control_makes_the_error_smaller_and_no_bias() -> None:
    table = made(300, 3, categories=2)
    units = units_of(table)
    (value,) = units.of_counts(units.freq[None].astype(float))
    exact = all_resamples(units, None, insist=True)
    assert exact is not None
    sampler = sampler_of(units, None)
    assert sampler.control is not None
    with_control, plain = [], []
    for seed in range(60):
        values, scores = sampler.draw(2000, np.random.default_rng(seed))
        drawn = DrawnResamples(
            drawn=values,
            values=np.sort(values),
            control=sampler.control,
            scores=scores,
        )
        bare = dataclasses.replace(drawn, control=None, scores=None)
        with_control.append([drawn.quantile(0.025), drawn.share_below(value)])
        plain.append([bare.quantile(0.025), bare.share_below(value)])
    truth = [exact.quantile(0.025), exact.share_below(value)]
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
        assert control.cumulative[at] == pytest.approx(
            weights[sums <= cut].sum(), abs=1e-12
        )
    cut, share = control.cut(0.5)
    assert share == pytest.approx(weights[sums <= cut].sum(), abs=1e-12)
    assert control.cut(-1.0)[0] == control.least
    assert control.cut(2.0)[1] == pytest.approx(1.0)


def test_scores_are_fine_and_few() -> None:
    slopes = np.random.default_rng(1).normal(size=50)
    for n in (30, 10_000, 10**8):
        scores = integer_scores(slopes, float(slopes.std()), n)
        assert np.corrcoef(scores, slopes)[0, 1] > (0.999 if n < 10**8 else 0.5)
        assert 17 * scores.std() * math.sqrt(n) < 1.2 * 2**18


def test_what_is_drawn_does_not_depend_on_batches(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    packed, counted = units_of(made(37, 5)), units_of(made(37, 5), weights="radical")
    raters = rater_units(
        pose_problem(
            "fleiss_kappa",
            made(12, 6),
            target="raters",
            categories=range(3),
            weights="identity",
            level=0.95,
        )
    )
    for units in (packed, counted, raters):
        whole = sampler_of(units, None).draw(1000, np.random.default_rng(2))
        with monkeypatch.context() as patch:
            patch.setattr(_resamples, "_CHUNK", 700)
            cut = sampler_of(units, None).draw(1000, np.random.default_rng(2))
        for one, other in zip(whole, cut, strict=True):
            if one is None:  # few raters have no control
                assert other is None
            else:
                np.testing.assert_allclose(one, other, rtol=1e-14)


def test_quantiles_of_drawn_values_are_in_the_middle_of_a_tie() -> None:
    values = np.array([4.0, 1.0, 2.0, 8.0])
    drawn = DrawnResamples(drawn=values, values=np.sort(values))
    assert [drawn.quantile(at) for at in (0.2, 0.25, 0.3, 0.5, 1.0)] == [
        1.0, 1.5, 2.0, 3.0, 8.0,
    ]  # fmt: skip
    assert drawn.share_below(2.0) == 0.375
    exact = AllResamples.of(values, np.ones(4))
    for at in np.linspace(0.01, 0.99, 99):
        assert drawn.quantile(at) == exact.quantile(at)


def test_equal_values_are_put_together_but_for_rounding() -> None:
    third = 1.0 / 3.0
    found = AllResamples.of(
        np.array([0.5, third, np.nextafter(third, 1.0), math.inf, math.inf, -math.inf]),
        np.array([1.0, 1.0, 2.0, 2.0, 1.0, 3.0]),
    )
    assert found.values.tolist() == [-math.inf, third, 0.5, math.inf]
    assert found.weights.tolist() == pytest.approx([0.3, 0.3, 0.1, 0.3])
    assert found.share_below(third) == pytest.approx(0.45)
    assert found.share_below(0.4) == pytest.approx(0.6)
    assert found.share_below(-2.0) == pytest.approx(0.3)


@few
@pytest.mark.parametrize("kind", ["percentile", "bca"])
def test_merging_changes_nothing(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    # 11 440 resamples, fewer sums: by the transform, and each by itself
    table = dirichlet_multinomial(np.random.default_rng(5), 9, 4, 0.3)
    found = []
    for few in (0, 10**9):
        monkeypatch.setattr(_resamples, "_FEW", few)
        found.append(
            bootstrap(
                "fleiss_kappa",
                table,
                target="items",
                categories=range(3),
                kind=kind,  # type: ignore[arg-type]
                exact=True,
            )
        )
    merged, alone = found
    assert merged.distribution is not None
    assert alone.distribution is not None
    assert "sums of resamples" in merged.distribution.words
    assert "sums" not in alone.distribution.words
    assert merged.low == pytest.approx(alone.low, abs=1e-13)
    assert merged.high == pytest.approx(alone.high, abs=1e-13)
    assert merged.n_undefined == alone.n_undefined
    np.testing.assert_allclose(
        merged.distribution.values, alone.distribution.values, atol=1e-12
    )
    np.testing.assert_allclose(
        merged.distribution.weights, alone.distribution.weights, atol=1e-13
    )


@few
def test_too_many_sums_are_drawn_or_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    table = dirichlet_multinomial(np.random.default_rng(5), 9, 4, 0.3)
    monkeypatch.setattr(_resamples, "_MAX_ALL", 3000)
    monkeypatch.setattr(_resamples, "_MAX_INSISTED", 3000)
    options = {"target": "items", "categories": range(3)}
    for size in (10**9, 0):  # too many of them, and in too large a box
        monkeypatch.setattr(_resamples, "_MAX_BOX", size)
        with pytest.raises(ParameterError, match="more than 3000 different sums"):
            bootstrap("fleiss_kappa", table, exact=True, **options)  # type: ignore[arg-type]
        drawn = bootstrap("fleiss_kappa", table, rng=1, **options)  # type: ignore[arg-type]
        assert drawn.n_resamples == 10_000


@few
def test_sums_in_too_large_a_box_are_taken_one_by_one() -> None:
    # 646 646 resamples of 12 items, whose sums lie in a box of 21 million places
    rng = np.random.default_rng(1)
    shares = rng.dirichlet(np.ones(5), 12).cumsum(axis=1)
    table = (rng.random((12, 3, 1)) > shares[:, None, :-1]).sum(axis=2)
    options = {"target": "items", "categories": range(5)}
    found = bootstrap("fleiss_kappa", table, exact=True, **options)  # type: ignore[arg-type]
    assert found.distribution is not None
    assert found.distribution.words.endswith("646646 resamples")
    drawn = bootstrap("fleiss_kappa", table, rng=1, **options)  # type: ignore[arg-type]
    assert drawn.monte_carlo_error is not None
    # 4.5 of its errors: once in 75 000 runs of other seeds for each end
    for end, other, error in zip(
        (drawn.low, drawn.high),
        (found.low, found.high),
        drawn.monte_carlo_error,
        strict=True,
    ):
        assert abs(end - other) < 4.5 * error
