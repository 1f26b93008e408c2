"""Polynomials and quadrature against integers and known laws; of retests, too."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import integrate, special
from scipy.special import betainc

from masrel.intervals._quadrature import (
    LineDistribution,
    beta_nodes,
    log_convolve,
    where_it_matters,
)
from masrel.intervals._rho import DEFAULT_PRIOR
from masrel.intervals.self_agreement import _Posterior, _RaterPairs


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


Floats = NDArray[np.float64]
Table = NDArray[np.int64]


SHARES = (0.025, 0.5, 0.975)


SMALL = [
    np.array([[3, 1, 0], [0, 4, 0], [0, 0, 2]]),
    np.array([[2, 0, 0], [1, 3, 0], [0, 2, 2]]),
    np.array([[4, 0, 0], [0, 4, 0], [0, 0, 2]]),
]


def textbook_likelihood(table: Table, kappa: float) -> float:
    """Integrate Π P(k, l)^n_kl over π ~ Dirichlet(1, 1, 1) by brute force."""

    def of_shares(y: float, x: float) -> float:
        pi = np.array([x, y * (1 - x), (1 - y) * (1 - x)])
        cell = kappa * np.diag(pi) + (1 - kappa) * np.outer(pi, pi)
        return float(np.prod(cell**table)) * 2 * (1 - x)  # Dirichlet density 2

    value, _ = integrate.dblquad(of_shares, 0, 1, 0, 1, epsabs=0, epsrel=1e-10)
    return float(value)


@pytest.mark.parametrize("table", SMALL[:2])
def test_shares_integrate_out_as_by_brute_force(table: Table) -> None:
    pairs = _RaterPairs.of(table, 1.0)
    j = np.arange(pairs.agree + 1)
    for kappa in (0.05, 0.6, 0.98):
        powers = (pairs.agree - j) * np.log(kappa) + (pairs.differ + j) * np.log1p(
            -kappa
        )
        ours = math.exp(special.logsumexp(pairs.log_weights + powers))
        assert ours == pytest.approx(textbook_likelihood(table, kappa), rel=1e-8)


def weighted_draws(
    tables: list[Table], rng: np.random.Generator, n: int
) -> tuple[Floats, Floats]:
    """Draw every unknown, m, g, each κ, each π; nothing is integrated out.

    m and g come from their prior, κ and π from a Beta and a Dirichlet near what the
    pairs say; the weights put that right.

    Returns
    -------
    m, spread and each κ (n, 2 + n_raters), and weights (n,) that sum to 1
    """
    m, g = rng.random(n), rng.random(n) / 3
    alpha, beta = m * (1 / g - 1), (1 - m) * (1 / g - 1)
    columns, log_weights = [m, np.sqrt(g * m * (1 - m))], np.zeros(n)
    for table in tables:
        agree, differ = 0.6 * np.trace(table), 0.8 * (table.sum() - np.trace(table))
        kappa = rng.beta(alpha + agree, beta + differ)
        log_weights += special.betaln(alpha + agree, beta + differ)
        log_weights -= special.betaln(alpha, beta)
        log_weights -= special.xlogy(agree, kappa) + special.xlog1py(differ, -kappa)
        near = 1 + 0.7 * (table.sum(axis=0) + table.sum(axis=1))
        pi = rng.dirichlet(near, n)
        log_weights -= special.xlogy(near - 1, pi).sum(axis=1)  # prior: all ones
        cell = (1 - kappa)[:, None, None] * pi[:, :, None] * pi[:, None, :]
        at = np.arange(3)
        cell[:, at, at] += kappa[:, None] * pi
        log_weights += special.xlogy(table, cell).sum(axis=(1, 2))
        columns.append(kappa)
    # κ of 1 to rounding, where unequal pairs have no chance: -inf + inf
    log_weights[np.isnan(log_weights)] = -np.inf
    weights = np.exp(log_weights - log_weights.max())
    return np.column_stack(columns), weights / weights.sum()


def test_quadrature_agrees_with_draws_of_every_unknown() -> None:
    # Of m, the spread and each κ, the weight of draws below each quantile is its
    # share, within 4 standard errors: 15 times, so that one of 1 000 other seeds
    # fails. A hundredth more of any median, or of m's low end, is 5 errors or more.
    exact = _Posterior.of(SMALL, DEFAULT_PRIOR)
    draws, weights = weighted_draws(SMALL, np.random.default_rng(5), 500_000)
    quantiles = [exact.quantiles(SHARES), exact.sd_quantiles(SHARES)]
    quantiles += [exact.rater_quantiles(at, SHARES) for at in range(len(SMALL))]
    for column, of_one in zip(draws.T, quantiles, strict=True):
        for share, quantile in zip(SHARES, of_one, strict=True):
            beyond = (column < quantile) - share
            error = np.sqrt(((weights * beyond) ** 2).sum())
            assert abs(weights @ beyond) < 4 * error
            assert error < 0.06 * min(share, 1 - share)
