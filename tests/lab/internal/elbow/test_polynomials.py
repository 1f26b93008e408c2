"""Places of polynomials: products of known factors, touching roots, ties."""

from math import isnan, prod

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.lab.elbow._polynomials import (
    first_above,
    largest,
    product,
    split_at_roots,
    value,
)

places = st.lists(
    st.integers(1, 99).map(lambda k: k / 100), min_size=1, max_size=5, unique=True
)


def with_roots(*roots: float, scale: float = 1.0) -> list[float]:
    p = [scale]
    for root in roots:
        p = product(p, [-root, 1.0])
    return p


@given(roots=places)
def test_a_product_is_cut_at_the_roots_of_its_factors(roots: list[float]) -> None:
    cuts = split_at_roots(with_roots(*roots), 1.0)
    # five factors a hundredth apart magnify rounding 1e8 times at most
    assert cuts == pytest.approx([0.0, *sorted(roots), 1.0], abs=1e-7)


@given(roots=places, low=st.floats(0.0, 0.9))
def test_the_first_place_above_0_is_a_root_or_the_beginning(
    roots: list[float], low: float
) -> None:
    p = with_roots(*roots, scale=-1.0)
    x = first_above(p, low, 1.0)
    grid = np.linspace(low, 1.0, 4001)[1:-1]
    signs = [-prod(at - root for root in roots) for at in grid.tolist()]
    above = [at for at, sign in zip(grid.tolist(), signs, strict=True) if sign > 1e-9]
    if above:
        assert x <= above[0] + 1e-6
    if not isnan(x):
        assert value(p, min(x + 1e-5, 1.0)) > -1e-9


@given(
    rows=st.lists(st.lists(places, min_size=1, max_size=4), min_size=1, max_size=5),
    low=st.floats(0.0, 0.9),
)
def test_a_row_of_columns_is_what_its_numbers_are(
    rows: list[list[list[float]]], low: float
) -> None:
    several = [with_roots(*(roots + [2.0] * 5)[:5]) for (roots, *_) in rows]
    columns = [np.array(c) for c in zip(*several, strict=True)]
    n = len(several)
    places_of_rows = first_above(columns, low, np.ones(n), among=np.ones(n, bool))
    alone = [first_above(p, low, 1.0) for p in several]
    # five factors a hundredth apart magnify rounding 1e8 times at most
    assert places_of_rows == pytest.approx(alone, abs=1e-7, nan_ok=True)
    tops = largest(columns, np.ones(n))
    assert tops == pytest.approx([largest(p, 1.0) for p in several], abs=1e-13)


def test_between_cuts_where_0_is_touched_there_is_nothing_but_rounding() -> None:
    touching = with_roots(0.3, 0.3)
    for place in split_at_roots(touching, 1.0)[1:-1]:
        assert value(touching, place) == pytest.approx(0.0, abs=1e-14)
    x = first_above([-c for c in touching], 0.0, 1.0)
    assert isnan(x) or value(touching, x) == pytest.approx(0.0, abs=1e-14)


def test_a_place_nearer_to_the_end_than_a_tie_is_none() -> None:
    assert isnan(first_above([-1.0 + 1e-14, 1.0], 0.0, 1.0))
    assert first_above([-1.0 + 1e-12, 1.0], 0.0, 1.0) == pytest.approx(1.0)
    cubic = with_roots(1.0 - 1e-15, 3.0, 4.0)
    assert isnan(first_above(cubic, 0.0, 1.0))
