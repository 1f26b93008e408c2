"""Polynomials and quadrature against integers, and distributions that are known."""

import math

import numpy as np
import pytest
from scipy.special import betainc

from masrel.intervals._quadrature import (
    LineDistribution,
    beta_nodes,
    log_convolve,
    where_it_matters,
)


def stirling(n: int) -> list[int]:
    """Coefficients of x (x + 1) ... (x + n - 1), from power 0."""
    row = [1]
    for j in range(n):
        row = [
            j * same + below for same, below in zip([*row, 0], [0, *row], strict=True)
        ]
    return row


@pytest.mark.parametrize(("n", "m"), [(5, 2), (40, 40), (300, 120)])
def test_a_product_has_every_digit_of_its_integers(n: int, m: int) -> None:
    # times t!, as moments are, which no float holds
    of_n, of_m = (
        [math.factorial(t) * c for t, c in enumerate(stirling(k)) if t] for k in (n, m)
    )
    packed = [sum(c << (1 << 15) * t for t, c in enumerate(of)) for of in (of_n, of_m)]
    product, mask = packed[0] * packed[1], (1 << (1 << 15)) - 1
    exact = [
        math.log(product >> (1 << 15) * t & mask)
        for t in range(len(of_n) + len(of_m) - 1)
    ]
    logs = (np.array([math.log(c) for c in of]) for of in (of_n, of_m))
    assert log_convolve(*logs) == pytest.approx(exact, rel=1e-13, abs=1e-12)


# The normal's quantiles are known; here they are found.
@pytest.mark.parametrize("spread", [0.01, 1.0, 30.0])
def test_the_quadrature_finds_the_quantiles_of_a_normal(spread: float) -> None:
    low, high = where_it_matters(
        lambda x: -0.5 * ((x - 3.0) / spread) ** 2, -500.0, 600.0
    )
    points = np.linspace(low, high, 257)
    masses = np.exp(-0.5 * ((points - 3.0) / spread) ** 2)
    normal = LineDistribution(points=points, masses=masses / masses.sum())
    found = np.array(normal.quantiles((0.025, 0.5, 0.999)))
    expected = [-1.959963984540054, 0.0, 3.090232306167813]
    assert (found - 3.0) / spread == pytest.approx(expected, abs=1e-9)
    assert normal.density(np.array([3.0])) * spread == pytest.approx(0.3989422804)


@pytest.mark.parametrize("a", [0.25, 3.0, 1e6])
@pytest.mark.parametrize("b", [0.25, 1.0, 2e5])
@pytest.mark.parametrize("least", [0.0, 1e-6, 0.1])
def test_nodes_of_a_beta_have_its_probability_and_moments(
    a: float, b: float, least: float
) -> None:
    x, weights = beta_nodes(a, b, 65, least)
    assert x.min() >= least
    # x^k times its density is that of a Beta(a + k, b), times its moment
    moment = 1.0
    for k in range(3):
        inside = betainc(a + k, b, 1.0 - least) - betainc(a + k, b, least)
        assert weights @ x[:, 0] ** k == pytest.approx(moment * inside, abs=1e-9)
        moment *= (a + k) / (a + b + k)
