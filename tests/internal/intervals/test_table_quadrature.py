"""Quadrature over two raters' table: by other integrals, and by drawing it."""

from functools import partial

import numpy as np
import pytest
from scipy.special import betainc, betaln, expit

from masrel.agreement import COEFFICIENTS
from masrel.intervals._table_quadrature import (
    CHANCE_AGREEMENT,
    Nodes,
    TablePosterior,
    grid_nodes,
    table_quantiles,
)
from masrel.intervals._two_raters import TablePrior
from tests.intervals.test_two_raters import (
    IDENTITY,
    TABLE,
    TAILS,
    by_default,
    ends,
    table_posterior,
)


# κ <= 0 is an odds ratio of at most 1: the first rater's two rows have independent
# Beta shares u <= w. Over the logit of w in panels, at priors far below 1, where the
# densities have poles.
@pytest.mark.parametrize(
    "table",
    [[[10, 0], [0, 0]], [[0, 3], [3, 0]], [[5, 1], [0, 4]], [[1, 1], [0, 0]]],
)
@pytest.mark.parametrize("a", [0.25, 0.05])
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
    result = TablePosterior(
        nodes=partial(grid_nodes, "margins", IDENTITY, prior, 0.0625),
        shown=partial(grid_nodes, "margins", IDENTITY, prior, 0.5),
        disagreeing=prior[0, 1] + prior[1, 0],
        agreeing=prior.trace(),
    )
    assert result.probability(0.0) == pytest.approx(
        expected, abs=1e-7 if a < 0.1 else 1e-10
    )


@pytest.mark.parametrize("q", [2, 3, 6])
def test_the_default_prior_is_worth_one_item_and_a_half(q: int) -> None:
    prior = TablePrior.by_default(q)
    assert prior.cells == pytest.approx(by_default(q), rel=1e-15)
    assert prior.cells.sum() == pytest.approx(1.5, rel=1e-15)
    assert prior.cells.trace() == pytest.approx(0.75, rel=1e-15)
    assert np.array_equal(TablePrior.of(1.0 / q, q).other().cells, prior.cells)
    assert np.array_equal(prior.other().cells, np.full((q, q), 1.0 / q))


# Of three categories two count as one: κ is that of two categories, and the Dirichlet
# of their table the sum over cells that fall together.
def test_draws_agree_with_the_quadrature_of_categories_that_count_as_one() -> None:
    weights = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 1.0, 1.0]])
    result = table_posterior("cohen_kappa", TABLE, weights=weights, concentration=0.5)
    prior = np.array(TABLE) + 0.5
    merged = np.add.reduceat(np.add.reduceat(prior, [0, 1], axis=0), [0, 1], axis=1)
    _, exact = table_quantiles(
        "margins",
        IDENTITY,
        merged,
        TAILS,
        start=0.5,
    )
    assert result.monte_carlo_error is not None
    for end, expected, error in zip(
        ends(result), exact, result.monte_carlo_error, strict=True
    ):
        assert abs(end - expected) < 4.5 * error
        assert error < 3e-3


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
    result = TablePosterior(
        nodes=lambda _: nodes, shown=lambda _: nodes, disagreeing=2.5, agreeing=1.5
    )
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


@pytest.mark.parametrize(
    "table", [[[0, 3], [3, 0]], [[1, 0], [0, 0]], [[2, 2], [2, 2]]]
)
@pytest.mark.parametrize("value", [-0.7, -0.1, -1e-6, 0.3])
def test_halving_the_step_settles_on_both_sides_of_zero(
    table: list[list[int]], value: float
) -> None:
    prior = np.array(table) + 0.25
    one, two = (
        TablePosterior(
            nodes=partial(grid_nodes, "margins", IDENTITY, prior, step),
            shown=partial(grid_nodes, "margins", IDENTITY, prior, step),
            disagreeing=prior[0, 1] + prior[1, 0],
            agreeing=prior.trace(),
        ).probability(value)
        for step in (0.125, 0.0625)
    )
    assert one == pytest.approx(two, abs=1e-6 if abs(value) < 1e-3 else 2e-8)
