"""Quadrature over two raters' table against other integrals."""

import numpy as np
import pytest
from scipy.special import betainc, betaln, expit

from masrel.agreement import COEFFICIENTS
from masrel.intervals._two_raters import (
    CHANCE_AGREEMENT,
    Nodes,
    TablePosterior,
    grid_nodes,
)
from tests.intervals.test_two_raters import IDENTITY


# κ <= 0 is an odds ratio of at most 1: the first rater's two rows have independent
# Beta shares u <= w. Over the logit of w in panels, at priors far below 1, where the
# densities have poles.
@pytest.mark.parametrize(
    "table",
    [[[10, 0], [0, 0]], [[0, 3], [3, 0]], [[5, 1], [0, 4]], [[1, 1], [0, 0]]],
)
@pytest.mark.parametrize("a", [0.25])
def test_the_probability_of_no_agreement_beyond_chance(
    table: list[list[int]], a: float
) -> None:
    prior = np.array(table) + a
    x, weights = np.polynomial.legendre.leggauss(20)
    edges = np.linspace(-40.0 / a, 40.0 / a, 801)
    half = 0.5 * np.diff(edges)[:, None]
    logit = edges[:-1, None] + half * (x + 1.0)
    log = -prior[1, 0] * np.logaddexp(0.0, -logit)
    log -= prior[1, 1] * np.logaddexp(0.0, logit) + betaln(prior[1, 0], prior[1, 1])
    below = np.where(
        logit < 0.0,
        betainc(prior[0, 0], prior[0, 1], expit(logit)),
        1.0 - betainc(prior[0, 1], prior[0, 0], expit(-logit)),
    )
    expected = float(((np.exp(log) * below) @ weights) @ half[:, 0])
    nodes = grid_nodes("margins", IDENTITY, prior, 81)
    result = TablePosterior(
        nodes=nodes,
        disagreeing=prior[0, 1] + prior[1, 0],
        agreeing=prior.trace(),
    )
    assert result.probability(0.0) == pytest.approx(expected, abs=1e-8)


def test_every_coefficient_of_two_raters_has_a_table() -> None:
    of_pairs = {
        name
        for name, entry in COEFFICIENTS.items()
        if entry.formula is not None and entry.shape == "ratings"
    }
    assert set(CHANCE_AGREEMENT) == of_pairs


# Given what pairs agree on and how the others are apart, against every share t of pairs
# apart on a fine grid, where the coefficient is computed from the table it makes.
@pytest.mark.parametrize("value", [-0.6, -0.3, -0.05, 0.0, 0.4, 0.95])
def test_given_the_rest_the_probability_is_that_of_a_grid_of_shares(
    value: float,
) -> None:
    rng = np.random.default_rng(5)
    n, q = 300, 3
    x = rng.dirichlet(np.full(q, 0.3), size=n)
    y = rng.dirichlet(np.full(q * (q - 1), 0.3), size=n)
    v = np.array([[0.0, 0.25, 1.0], [0.25, 0.0, 0.25], [1.0, 0.25, 0.0]])
    nodes = Nodes.of("margins", v, np.full(n, 1.0 / n), x, y)
    result = TablePosterior(nodes=lambda _: nodes, disagreeing=2.5, agreeing=1.5)
    edges = np.linspace(0.0, 1.0, 4001)
    t = 0.5 * (edges[1:] + edges[:-1])
    masses = np.diff(betainc(2.5, 1.5, edges))
    below = twice = 0.0
    for agreed, others in zip(x, y, strict=True):
        cells = np.zeros((q, q))
        cells[~np.eye(q, dtype=bool)] = others
        theta = t[:, None, None] * cells + (1.0 - t)[:, None, None] * np.diag(agreed)
        apart = (theta * v).sum(axis=(1, 2))
        chance = np.einsum("tk,kl,tl->t", theta.sum(axis=2), v, theta.sum(axis=1))
        inside = apart >= (1.0 - value) * chance
        below += float(masses @ inside) / n
        twice += bool(inside.any() and not inside[0] and not inside[-1])
    assert result.probability(value) == pytest.approx(below, abs=2e-4)
    assert twice > 0 or value >= 0.0  # of some tables shares in the middle alone
