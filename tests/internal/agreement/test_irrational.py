"""Square roots and sines as fractions: against 60 digits of another library."""

from fractions import Fraction

import mpmath
import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.agreement._weights import _sine_squared, _square_root

ULP = Fraction(1, 10**40)  # the last of 40 decimals

shares = st.fractions(0, 1, max_denominator=10**6)


def as_fraction(value: mpmath.mpf) -> Fraction:
    return Fraction(str(mpmath.nstr(value, 60, min_fixed=-100, max_fixed=100)))


@given(shares)
def test_a_root_is_rounded_down_to_forty_decimals(value: Fraction) -> None:
    root = _square_root(value)
    assert root**2 <= value < (root + ULP) ** 2


@given(st.integers(0, 10**9), st.integers(1, 12))
def test_roots_of_squares_of_decimals_are_exact(whole: int, decimals: int) -> None:
    root = Fraction(whole, 10**decimals)
    assert _square_root(root**2) == root


@given(shares)
def test_sines_are_right_to_forty_decimals(turns: Fraction) -> None:
    with mpmath.workdps(70):
        x = mpmath.mpf(turns.numerator) / turns.denominator
        peer = as_fraction(mpmath.sin(mpmath.pi * x) ** 2)
    assert abs(_sine_squared(turns) - peer) <= ULP


@pytest.mark.parametrize(
    ("turns", "value"),
    [
        # sin² of 0, 30°, 45°, 60°, 90°, 120°, 135°, 150°, 180°
        (Fraction(0), Fraction(0)),
        (Fraction(1, 6), Fraction(1, 4)),
        (Fraction(1, 4), Fraction(1, 2)),
        (Fraction(1, 3), Fraction(3, 4)),
        (Fraction(1, 2), Fraction(1)),
        (Fraction(2, 3), Fraction(3, 4)),
        (Fraction(3, 4), Fraction(1, 2)),
        (Fraction(5, 6), Fraction(1, 4)),
        (Fraction(1), Fraction(0)),
    ],
)
def test_rational_sines_are_exact(turns: Fraction, value: Fraction) -> None:
    assert _sine_squared(turns) == value


@given(shares)
def test_equal_arcs_have_equal_sines(turns: Fraction) -> None:
    assert _sine_squared(turns) == _sine_squared(1 - turns)


@given(st.fractions(0, Fraction(1, 2), max_denominator=10**6))
def test_sine_and_cosine_sum_to_one(turns: Fraction) -> None:
    # sin² x + sin² (π/2 - x) = 1; each of the two is rounded
    total = _sine_squared(turns) + _sine_squared(Fraction(1, 2) - turns)
    assert abs(total - 1) <= ULP


def test_roots_of_zero_and_one() -> None:
    assert _square_root(Fraction(0)) == 0
    assert _square_root(Fraction(1)) == 1
