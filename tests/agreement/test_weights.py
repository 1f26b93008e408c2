"""Weights by hand on uneven scales, and what is true of every one of them."""

from fractions import Fraction
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.agreement import (
    COEFFICIENTS,
    WeightName,
    declared_weights,
)
from masrel.errors import UndefinedStatisticWarning
from masrel.intervals import jackknife

NAMES = get_args(WeightName)
UNEVEN = [1, 2, 4]  # range 3; differences 1, 2, 3


def agreement(name: object, scale: list[float] | list[str]) -> list[list[float]]:
    """Return w = 1 - v."""
    made = declared_weights(name, scale)  # type: ignore[arg-type]
    return made.as_floats().tolist()  # type: ignore[no-any-return]


# v above the diagonal of UNEVEN: of 1 and 2, of 1 and 4, of 2 and 4
@pytest.mark.parametrize(
    ("name", "by_hand"),
    [
        ("linear", (Fraction(1, 3), Fraction(1), Fraction(2, 3))),
        ("quadratic", (Fraction(1, 9), Fraction(1), Fraction(4, 9))),
        # ranks 1, 2, 3: C(2, 2) = 1 and C(3, 2) = 3 of C(3, 2) = 3
        ("ordinal", (Fraction(1, 3), Fraction(1), Fraction(1, 3))),
        # (1/3)², (3/5)², (2/6)² over 9/25: 25/81, 1, 25/81
        ("ratio", (Fraction(25, 81), Fraction(1), Fraction(25, 81))),
        # sin² of π/4, 3π/4, 2π/4: 1/2, 1/2, 1: R + 1 = 4
        ("circular", (Fraction(1, 2), Fraction(1, 2), Fraction(1))),
        # 1/((3 - 2)(8 - 3)) = 1/5, 9/((5 - 2)(8 - 5)) = 1, 4/((6 - 2)(8 - 6)) = 1/2
        ("bipolar", (Fraction(1, 5), Fraction(1), Fraction(1, 2))),
    ],
)
def test_weights_of_an_uneven_scale_by_hand(
    name: str, by_hand: tuple[Fraction, ...]
) -> None:
    a, b, c = by_hand
    by_hand = np.array([[0, a, b], [a, 0, c], [b, c, 0]], dtype=float)
    found = np.asarray(declared_weights(name, UNEVEN).v)  # type: ignore[arg-type]
    assert found == pytest.approx(by_hand, rel=1e-15)


def test_scale_of_the_declared_order_and_not_of_the_values() -> None:
    # numbers weigh by value in whatever order they are declared
    assert agreement("linear", [4, 1, 2]) == pytest.approx(
        np.array([[1, 0, 1 / 3], [0, 1, 2 / 3], [1 / 3, 2 / 3, 1]])
    )


values = st.lists(
    st.one_of(st.integers(-50, 50), st.floats(-50, 50, width=32)),
    min_size=2,
    max_size=6,
    unique=True,
)


@given(values, st.sampled_from(NAMES))
def test_every_weight_is_symmetric_zero_on_the_diagonal_and_at_most_one(
    scale: list[float], name: str
) -> None:
    made = declared_weights(name, scale)  # type: ignore[arg-type]
    if made.reason is not None:
        assert name == "ratio"
        return
    v = 1.0 - made.as_floats()
    assert (v == v.T).all()
    assert (np.diagonal(v) == 0).all()
    # bipolar and ratio weights of numbers of both signs aside, v lies within [0, 1]
    assert v.max() == 1.0
    if name != "bipolar":
        assert v.min() >= 0.0


@pytest.mark.parametrize("name", ["identity", "linear", "quadratic", "ordinal"])
@pytest.mark.parametrize("coefficient", ["cohen_kappa", "conger_kappa", "gwet_ac"])
def test_a_matrix_of_the_caller_is_the_named_weights(
    name: WeightName, coefficient: str
) -> None:
    ratings = [[1, 2], [2, 2], [4, 4], [4, 1], [2, 1], [1, 1], [9, 9]]
    scale = [1, 2, 4, 9]  # of range 8: linear and quadratic weights are exact floats
    entry = COEFFICIENTS[coefficient]
    named = entry(ratings, categories=scale, weights=name)
    given_ = entry(ratings, categories=scale, weights=agreement(name, scale))
    assert given_.weights == "custom"
    assert given_.value == pytest.approx(named.value, rel=1e-14)
    assert given_.standard_error == pytest.approx(named.standard_error, rel=1e-12)


@pytest.mark.parametrize(
    ("elsewhere", "here"),
    [
        ("unweighted", "identity"),
        ("nominal", "identity"),
        (None, "identity"),
        ("equal", "linear"),
        ("squared", "quadratic"),
    ],
)
def test_names_of_other_packages_are_taken(elsewhere: str | None, here: str) -> None:
    ratings = [[1, 2], [2, 2], [4, 4], [4, 1], [2, 1], [1, 1]] * 2
    for name in ("cohen_kappa", "fleiss_kappa", "conger_kappa", "krippendorff_alpha"):
        known = COEFFICIENTS[name](ratings, weights=elsewhere)
        assert known == COEFFICIENTS[name](ratings, weights=here)
        assert known.weights == here
        of_other = jackknife(name, ratings, target="items", weights=elsewhere)
        assert of_other == jackknife(name, ratings, target="items", weights=here)


@pytest.mark.parametrize(
    "name", ["fleiss_kappa", "cohen_kappa", "conger_kappa", "light_kappa"]
)
def test_weights_to_which_all_ratings_are_alike_are_the_reason(name: str) -> None:
    alike = (
        "0/0: chance agreement is 1, because the weights treat all ratings as the same"
    )
    with pytest.warns(UndefinedStatisticWarning, match="because the weights"):
        ones = COEFFICIENTS[name]([[1, 2], [2, 2], [2, 1]], weights=np.ones((2, 2)))
    assert ones.reason == alike
    # of three categories the first two are alike, and the third is not used
    some = [[1, 1, 0], [1, 1, 0], [0, 0, 1]]
    with pytest.warns(UndefinedStatisticWarning, match="because the weights"):
        result = COEFFICIENTS[name](
            [[1, 2], [2, 2]], categories=[1, 2, 3], weights=some
        )
    assert result.reason == alike
