"""What holds of the exact posterior for any ratings, and what it tells the reader."""

import math
import random
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from masrel.errors import ConvergenceError, ParameterError, UndefinedStatisticWarning
from masrel.estimates import Interval
from masrel.intervals import posterior
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


def ends(result: Interval) -> list[float]:
    return [result.low, result.high]


@settings(max_examples=25)
@given(WITH_PAIRS, st.randoms(use_true_random=False))
def test_any_order_of_items_ratings_and_categories_gives_the_same(
    table: Table, order: random.Random
) -> None:
    rows = [order.sample(row, len(row)) for row in order.sample(table, len(table))]
    scale = order.sample(LABELS, len(LABELS))
    assert ends(exact(rows, scale)) == pytest.approx(ends(exact(table)), abs=1e-10)


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


@pytest.mark.parametrize(
    ("ratings", "reason"),
    [
        ([["a", None], [None, "b"]], "no item has ratings of two raters"),
        ([["a", "a"], ["a", "a"]], "one category is declared"),
    ],
)
def test_where_the_prior_alone_would_speak_it_is_undefined(
    ratings: list[list[str | None]], reason: str
) -> None:
    with pytest.warns(UndefinedStatisticWarning, match=reason):
        result = posterior("fleiss_kappa", ratings, target="items")
    assert math.isnan(result.low)
    assert math.isnan(result.high)
    assert (result.reason, result.kind) == (reason, "credible")


@pytest.mark.parametrize(
    "options",
    [
        {"level": 1.0},
        {"prior": "flat"},
        {"concentration": 0.0},
        {"concentration": math.inf},
        {"n_draws": 99},
        {"weights": "linear", "model": "dirichlet-multinomial"},
        {"target": "raters"},
        {"coefficient": "kendall_w"},
    ],
)
def test_what_the_model_does_not_answer_is_refused(options: dict[str, object]) -> None:
    asked = {"coefficient": "fleiss_kappa", "target": "items", **options}
    with pytest.raises(ParameterError):
        posterior(ratings=[["a", "b"], ["a", "a"]], **asked)  # type: ignore[arg-type]


def test_more_ratings_than_can_be_multiplied_out_are_refused() -> None:
    ratings = np.broadcast_to([0, 1, 0, 0], (250_001, 4))
    with pytest.raises(ConvergenceError):
        posterior("fleiss_kappa", ratings, target="items", categories=[0, 1])
