"""What holds of the exact posterior for any ratings, and what it tells the reader."""

import dataclasses
import math
import random
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from masrel.agreement import code_ratings
from masrel.agreement._counts import item_counts
from masrel.errors import ConvergenceError, ParameterError, UndefinedStatisticWarning
from masrel.estimates import Interval
from masrel.intervals import posterior
from masrel.intervals.dirichlet.exact import ExactDensity
from masrel.intervals.dirichlet.model import DirichletMultinomial
from masrel.intervals.dirichlet.prior import Prior
from masrel.intervals.dirichlet.rho import ExactPosterior
from masrel.intervals.sinc import sinc_distribution
from tests.intervals.data import SCALE, TABLE_V
from tests.strategies import LABELS, Table, tables

WITH_PAIRS = tables().filter(
    lambda table: any(sum(grade is not None for grade in row) > 1 for row in table)
)


def exact(
    ratings: Sequence[Sequence[str | None]],
    categories: Sequence[str] = LABELS,
    level: float = 0.95,
) -> Interval:
    return posterior(
        "fleiss_kappa", ratings, target="items", categories=categories, level=level
    )


def ends(found: Interval) -> list[float]:
    return [found.low, found.high]


@settings(max_examples=25)
@given(WITH_PAIRS, st.randoms(use_true_random=False))
def test_any_order_of_items_ratings_and_categories_gives_the_same(
    table: Table, order: random.Random
) -> None:
    rows = [order.sample(row, len(row)) for row in order.sample(table, len(table))]
    scale = order.sample(LABELS, len(LABELS))
    assert ends(exact(rows, scale)) == pytest.approx(ends(exact(table)), abs=1e-10)


@settings(max_examples=25)
@given(WITH_PAIRS)
def test_unused_categories_are_one_of_the_sum_of_their_priors(table: Table) -> None:
    counts = item_counts(code_ratings(table, LABELS))
    used = counts.any(axis=0)
    unused = float((~used).sum())
    few = np.column_stack([counts[:, used], np.zeros(len(counts), np.int64)])
    merged = DirichletMultinomial.of_counts(few)
    prior = merged.prior.copy()
    prior[-1] = unused if unused else prior[-1]
    merged = dataclasses.replace(merged, prior=prior)
    whole = DirichletMultinomial.of_counts(counts)
    at = np.array([-3.0, 0.0, 0.5, 4.0])
    if unused:
        assert ExactDensity(whole)(at) == pytest.approx(ExactDensity(merged)(at))
    else:
        assert whole.prior.size == used.sum()


# Both items split, or each agreed: the shares of the categories stay as they were.
@settings(max_examples=25)
@given(tables(n_raters=(2, 2), missing=False), st.permutations(LABELS))
def test_more_agreement_moves_it_up(table: Table, grades: list[str]) -> None:
    x, y = grades[:2]
    apart = exact([*table, [x, y], [y, x]])
    agreed = exact([*table, [x, x], [y, y]])
    assert agreed.low > apart.low
    assert agreed.high > apart.high


@settings(max_examples=25)
@given(WITH_PAIRS)
def test_levels_are_nested(table: Table) -> None:
    inner, outer = exact(table, level=0.5), exact(table, level=0.9)
    assert 0.0 < outer.low < inner.low < inner.high < outer.high < 1.0


@settings(max_examples=25)
@given(WITH_PAIRS)
def test_the_density_integrates_to_one(table: Table) -> None:
    of = exact(table).distribution
    assert of is not None
    assert of.continuous
    assert (np.diff(of.values) > 0.0).all()
    assert (of.weights >= 0.0).all()
    # over the logit, in which the points are equally spaced
    logits = np.log(of.values) - np.log1p(-of.values)
    mass = of.weights * of.values * (1.0 - of.values)
    assert np.trapezoid(mass, logits) == pytest.approx(1.0, abs=1e-4)


def test_the_density_says_its_prior_and_has_the_ends_as_quantiles() -> None:
    found = exact(TABLE_V, SCALE)
    of = found.distribution
    assert of is not None
    assert of.words == "posterior of ρ, prior ρ ~ U(0, 1), π ~ Dirichlet(1, ...)"
    steps = 0.5 * (of.weights[1:] + of.weights[:-1]) * np.diff(of.values)
    below = np.interp(ends(found), of.values, np.append(0.0, steps.cumsum()))
    assert below == pytest.approx([0.025, 0.975], abs=2e-4)


def test_probabilities_rise_and_are_those_of_quantiles() -> None:
    counts = item_counts(code_ratings(TABLE_V, SCALE))
    found = ExactPosterior.of(counts, Prior.of("uniform", 1.0), 0.95).logit
    shares = [1e-6, 0.025, 0.3, 0.5, 0.9, 1.0 - 1e-6]
    points = [found.quantile(share) for share in shares]
    again = [found.probability(point) for point in points]
    assert again == pytest.approx(shares, abs=1e-12)
    grid = [found.probability(point) for point in np.linspace(-20.0, 12.0, 400)]
    assert (np.diff(grid) > -1e-14).all()


# The normal's tails are known to scipy; its quantiles are solved for here.
@pytest.mark.parametrize("spread", [0.01, 1.0, 30.0])
def test_the_quadrature_finds_the_quantiles_of_a_normal(spread: float) -> None:
    _, found = sinc_distribution(
        lambda x: -0.5 * ((x - 3.0) / spread) ** 2,
        3.0 - 11.0 * spread,
        3.0 + 13.0 * spread,
        (0.025, 0.5, 0.999),
    )
    expected = np.array([-1.959963984540054, 0.0, 3.090232306167813])
    assert (np.array(found) - 3.0) / spread == pytest.approx(expected, abs=1e-11)


def test_a_density_that_is_cut_off_or_jumps_is_refused() -> None:
    with pytest.raises(ConvergenceError, match="reaches beyond"):
        sinc_distribution(lambda x: -0.5 * x**2, -6.0, 9.0, (0.5,))
    with pytest.raises(ConvergenceError, match="not settled"):
        sinc_distribution(
            lambda x: np.where(x > 0.123, -np.abs(x), -50.0), -9.0, 50.0, (0.3,)
        )


@pytest.mark.parametrize(
    ("ratings", "what"),
    [
        ([["a"] * 3] * 12, "all ratings are in one category"),
        ([["a"] * 3, ["b"] * 3] * 6, "agreement is perfect in these data"),
        ([["a", "b", "b"], ["b"] * 3], "2 items are few"),
    ],
)
def test_where_the_prior_weighs_another_stands_beside(
    ratings: list[list[str]], what: str
) -> None:
    found = exact(ratings, ["a", "b", "c"])
    (note,) = found.notes
    mine = f"{found.low:.3f} to {found.high:.3f} with ρ ~ U(0, 1), π ~ Dirichlet(1, ..."
    assert note.startswith(f"{what}, so the prior weighs: {mine}")
    others = [
        posterior(
            "fleiss_kappa",
            ratings,
            target="items",
            categories=["a", "b", "c"],
            **options,
        )  # type: ignore[arg-type]
        for options in ({"prior": "jeffreys"}, {"concentration": 1 / 3})
    ]
    moves = [
        max(abs(other.low - found.low), abs(other.high - found.high))
        for other in others
    ]
    other = others[int(np.argmax(moves))]
    assert f"but {other.low:.3f} to {other.high:.3f} with " in note


def test_the_note_names_the_prior_that_was_asked_for() -> None:
    found = posterior(
        "fleiss_kappa",
        TABLE_V,
        target="items",
        categories=SCALE,
        prior="jeffreys",
        concentration=1 / 6,
    )
    assert "with ρ ~ Beta(1/2, 1/2), π ~ Dirichlet(0.167, ...), but" in found.notes[0]


def test_enough_items_need_no_note() -> None:
    assert exact([["a", "a"], ["a", "b"], ["b", "b"]] * 4, ["a", "b"]).notes == ()


@pytest.mark.parametrize("name", ["scott_pi", "krippendorff_alpha"])
def test_coefficients_of_the_same_value_in_the_population_have_it(name: str) -> None:
    ratings = [["a", "a"], ["a", "b"], ["b", "b"]] * 4
    found = posterior(name, ratings, target="items")
    assert found == posterior("fleiss_kappa", ratings, target="items")


@pytest.mark.parametrize("method", ["exact", "emcee"])
@pytest.mark.parametrize(
    ("ratings", "reason"),
    [
        ([["a", None], [None, "b"]], "no item has ratings of two raters"),
        ([["a", "a"], ["a", "a"]], "one category is declared"),
    ],
)
def test_where_the_prior_alone_would_speak_it_is_undefined(
    ratings: list[list[str | None]], reason: str, method: str
) -> None:
    with pytest.warns(UndefinedStatisticWarning, match=reason):
        found = posterior("fleiss_kappa", ratings, target="items", method=method)  # type: ignore[arg-type]
    assert math.isnan(found.low)
    assert math.isnan(found.high)
    assert (found.reason, found.kind) == (reason, "credible")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"level": 0.0}, r"level: needs \(0, 1\), got 0"),
        ({"level": 1.0}, r"level: needs \(0, 1\), got 1"),
        ({"level": math.nan}, r"level: needs \(0, 1\), got nan"),
        ({"prior": "flat"}, "prior: needs one of uniform, jeffreys, got 'flat'"),
        ({"method": "gibbs"}, "method: needs one of exact, emcee, got 'gibbs'"),
        ({"concentration": 0.0}, "concentration: needs a positive number, got 0.0"),
        ({"concentration": math.inf}, "concentration: needs a positive number"),
        ({"weights": "linear", "model": "dirichlet-multinomial"}, "of unweighted"),
        ({"weights": "linear", "method": "emcee"}, "and no sampler"),
        ({"target": "raters"}, 'so "items"; for other raters use the jackknife'),
        ({"target": "both"}, 'got "both"'),
        (
            {"coefficient": "cohen_kappa", "model": "dirichlet-multinomial"},
            "two raters .* got cohen_kappa",
        ),
        ({"coefficient": "gwet_ac", "method": "emcee"}, "and no sampler"),
        ({"coefficient": "kendall_w"}, "coefficient"),
    ],
)
def test_what_the_model_does_not_answer_is_refused(
    options: dict[str, object], said: str
) -> None:
    asked = {
        "coefficient": "fleiss_kappa",
        "target": "items",
        "categories": ["a", "b"],
        **options,
    }
    with pytest.raises(ParameterError, match=said):
        posterior(ratings=[["a", "b"], ["a", "a"]], **asked)  # type: ignore[arg-type]
