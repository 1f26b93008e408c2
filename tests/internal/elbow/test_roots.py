"""Polynomials and their roots: products of known factors, double roots, endpoints."""

from decimal import Decimal
from math import comb

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.elbow.polynomial import (
    ONE,
    ZERO,
    Polynomial,
    added,
    derivative,
    exactly,
    integral,
    moved,
    product,
    quotient,
    value,
)
from masrel.elbow.roots import cuts, roots

fractions = st.decimals(-3, 3, places=6)


def with_roots(*places: Decimal) -> Polynomial:
    made: Polynomial = (ONE,)
    for place in places:
        made = product(made, (-place, ONE))
    return made


@given(places=st.lists(st.decimals(0, 1, places=9), max_size=6, unique=True))
def test_the_roots_of_a_product_are_those_of_its_factors(places: list[Decimal]) -> None:
    with exactly():
        found = roots(with_roots(*places), ZERO, ONE)
        inside = sorted(place for place in places if 0 < place < 1)
        # of factors 1e-9 apart 1e-50 is magnified by at most (1e9)⁵
        assert found == pytest.approx(inside, abs=Decimal("1e-15"))
        assert len(found) == len(inside)


def test_a_simple_root_is_right_to_40_digits() -> None:
    with exactly():
        (found,) = roots((Decimal(-2), ZERO, ONE), ZERO, Decimal(2))
        assert abs(found * found - 2) < Decimal("1e-45")


@pytest.mark.parametrize("place", ["0.5", "0.3", "0.123456789"])
def test_a_double_root_cuts_once(place: str) -> None:
    with exactly():
        twice = with_roots(Decimal(place), Decimal(place))
        _, found, _ = cuts([twice], ZERO, ONE)
        assert abs(found - Decimal(place)) < Decimal("1e-19")


def test_near_roots_are_told_apart() -> None:
    with exactly():
        near = [Decimal("0.3"), Decimal("0.3") + Decimal("1e-15")]
        found = roots(with_roots(*near), ZERO, ONE)
        assert len(found) == 2
        assert found[1] - found[0] == pytest.approx(
            Decimal("1e-15"), rel=Decimal("1e-9")
        )


def test_roots_at_the_ends_and_outside_are_left_out() -> None:
    with exactly():
        made = with_roots(ZERO, ONE, Decimal(2), Decimal(-1), Decimal("0.25"))
        assert [float(x) for x in roots(made, ZERO, ONE)] == [0.25]


def test_nothing_has_no_roots() -> None:
    with exactly():
        assert roots((ZERO, ZERO, ZERO), ZERO, ONE) == []
        assert roots((ONE,), ZERO, ONE) == []
        assert cuts([(ONE,)], ONE, ONE) == []


def test_cuts_are_in_order_and_no_two_the_same() -> None:
    with exactly():
        one, other = with_roots(Decimal("0.7")), with_roots(Decimal("0.2"))
        found = cuts([one, other, one], ZERO, ONE)
        assert [float(x) for x in found] == [0.0, 0.2, 0.7, 1.0]


@given(p=st.lists(fractions, min_size=1, max_size=6), x=fractions, y=fractions)
def test_polynomials_obey_calculus(p: list[Decimal], x: Decimal, y: Decimal) -> None:
    made = tuple(p)
    tiny = Decimal("1e-40")
    with exactly():
        # p(x) - p(y) = (x - y) q(x); (∫p)' = p; p(x + (y - x)/2) is halfway
        apart = value(made, x) - value(made, y)
        assert abs((x - y) * value(quotient(made, y), x) - apart) < tiny
        assert abs(value(derivative(integral(made)), x) - value(made, x)) < tiny
        half = Decimal("0.5")
        middle = value(moved(made, x, y), half)
        assert abs(middle - value(made, x + (y - x) * half)) < tiny


def test_powers_of_a_sum_are_binomial() -> None:
    power: Polynomial = (ONE,)
    for _ in range(5):
        power = product(power, (ONE, ONE))
    assert [int(c) for c in power] == [comb(5, i) for i in range(6)]
    assert added((ONE,), (ONE, ONE)) == (Decimal(2), ONE)
