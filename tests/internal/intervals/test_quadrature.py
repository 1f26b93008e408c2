"""Quadrature on the line against distributions of known quantiles and moments."""

import numpy as np
import pytest
from scipy.special import betainc, logit

from masrel.agreement import code_ratings
from masrel.agreement._codes import item_counts
from masrel.errors import ConvergenceError
from masrel.intervals._quadrature import beta_nodes, line_distribution
from masrel.intervals._rho import DEFAULT_PRIOR, RhoPosterior
from tests.intervals.data import SCALE, TABLE_V


def test_probabilities_rise_and_are_those_of_quantiles() -> None:
    counts = item_counts(code_ratings(TABLE_V, SCALE).codes, len(SCALE))
    posterior = RhoPosterior.of(counts, DEFAULT_PRIOR, 0.95)
    shares = [1e-6, 0.025, 0.3, 0.5, 0.9, 1.0 - 1e-6]
    points = [logit(posterior.quantile(share)) for share in shares]
    again = [posterior.logit.at(point)[0] for point in points]
    assert again == pytest.approx(shares, abs=1e-12)
    grid = [posterior.logit.at(point)[0] for point in np.linspace(-20.0, 12.0, 400)]
    assert (np.diff(grid) > -1e-14).all()


# The normal's tails are known to scipy; its quantiles are solved for here.
@pytest.mark.parametrize("spread", [0.01, 1.0, 30.0])
def test_the_quadrature_finds_the_quantiles_of_a_normal(spread: float) -> None:
    _, result = line_distribution(
        lambda x: -0.5 * ((x - 3.0) / spread) ** 2,
        3.0 - 11.0 * spread,
        3.0 + 13.0 * spread,
        (0.025, 0.5, 0.999),
    )
    expected = np.array([-1.959963984540054, 0.0, 3.090232306167813])
    assert (np.array(result) - 3.0) / spread == pytest.approx(expected, abs=1e-11)


def test_a_density_that_is_cut_off_or_jumps_is_refused() -> None:
    with pytest.raises(ConvergenceError, match="reaches beyond"):
        line_distribution(lambda x: -0.5 * x**2, -6.0, 9.0, (0.5,))
    with pytest.raises(ConvergenceError, match="not settled"):
        line_distribution(
            lambda x: np.where(x > 0.123, -np.abs(x), -50.0), -9.0, 50.0, (0.3,)
        )


@pytest.mark.parametrize("a", [0.01, 0.5, 3.0, 1e6])
@pytest.mark.parametrize("b", [0.01, 1.0, 2e5])
def test_nodes_of_a_beta_have_its_moments(a: float, b: float) -> None:
    x, weights = beta_nodes(a, b, 0.0625)
    total = a + b
    assert weights.sum() == pytest.approx(1.0, abs=1e-14)
    assert x.sum(axis=1) == pytest.approx(np.ones(len(x)))
    mean = a / total
    variance = a * b / (total**2 * (total + 1.0))
    assert weights @ x[:, 0] == pytest.approx(mean, rel=1e-12)
    assert weights @ (x[:, 0] - mean) ** 2 == pytest.approx(variance, rel=1e-10)


@pytest.mark.parametrize(("a", "b"), [(0.25, 0.25), (5.0, 0.5), (400.0, 300.0)])
@pytest.mark.parametrize("least", [1e-6, 0.2, 0.45])
def test_nodes_of_a_part_of_a_beta_have_its_probability_and_mean(
    a: float, b: float, least: float
) -> None:
    x, weights = beta_nodes(a, b, 0.125, least)
    assert x.min() >= least
    assert weights.sum() == pytest.approx(
        betainc(a, b, 1.0 - least) - betainc(a, b, least), rel=1e-9
    )
    # x times its density is that of a Beta(a + 1, b), times a / (a + b)
    upper = betainc(a + 1.0, b, 1.0 - least) - betainc(a + 1.0, b, least)
    assert weights @ x[:, 0] == pytest.approx(a / (a + b) * upper, rel=1e-9)
