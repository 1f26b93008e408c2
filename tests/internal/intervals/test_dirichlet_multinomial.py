"""The Dirichlet-multinomial model against betas, integrals, and merged categories."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray
from scipy.special import betaln

from masrel.agreement import code_ratings
from masrel.agreement._rows import item_counts
from masrel.intervals._dirichlet_multinomial import DirichletMultinomial, RhoDensity
from tests.internal.intervals.test_sampled_posterior import (
    TWO,
    brief,  # noqa: F401 - a fixture
    exact_ends,
    misses,
    sampled,
)
from tests.strategies import LABELS, Table, tables

Floats = NDArray[np.float64]

WITH_PAIRS = tables().filter(
    lambda table: any(sum(grade is not None for grade in row) > 1 for row in table)
)


@settings(max_examples=25)
@given(WITH_PAIRS)
def test_unused_categories_are_one_of_the_sum_of_their_priors(table: Table) -> None:
    counts = item_counts(code_ratings(table, LABELS).codes, len(LABELS))
    used = counts.any(axis=0)
    unused = float((~used).sum())
    few = np.column_stack([counts[:, used], np.zeros(len(counts), np.int64)])
    merged = DirichletMultinomial.of_counts(few)
    prior = merged.prior.copy()
    prior[-1] = unused if unused else prior[-1]
    merged = dataclasses.replace(merged, prior=prior)
    whole = DirichletMultinomial.of_counts(counts)
    at = np.array([-3.0, 0.0, 0.5, 4.0])
    if unused:
        assert RhoDensity(whole)(at) == pytest.approx(RhoDensity(merged)(at))
    else:
        assert whole.prior.size == used.sum()


@pytest.mark.usefixtures("brief")
def test_a_missing_part_of_the_jacobian_is_seen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def without(self: DirichletMultinomial, position: Floats) -> Floats:
        rho, rest, pi = self.parts(position)
        density = self.log_likelihood(rho, rest, pi) + np.log(pi) @ self.prior
        return density + np.log(rho)  # and no log(1 - ρ)

    monkeypatch.setattr(DirichletMultinomial, "log_density", without)
    assert max(misses(sampled(TWO, n_steps=600), exact_ends(TWO))) > 10


def test_likelihood_is_the_compound_multinomial() -> None:
    # Two categories: a product of beta-binomials, up to one constant.
    counts = np.array([[2, 1], [0, 3], [3, 0], [2, 1], [0, 3]])
    model = DirichletMultinomial.of_counts(counts)
    rho, share = np.array([0.1, 0.5, 0.9]), np.array([0.2, 0.7, 0.5])
    ours = model.log_likelihood(rho, 1 - rho, np.column_stack([share, 1 - share]))
    a, b = share * (1 - rho) / rho, (1 - share) * (1 - rho) / rho
    theirs = sum(betaln(a + n, b + m) - betaln(a, b) for n, m in counts)
    assert np.ptp(ours - theirs) < 1e-12


def test_unused_categories_are_one_part_of_the_prior() -> None:
    model = DirichletMultinomial.of_counts(np.array([[2, 0, 1, 0], [0, 0, 3, 0]]))
    assert model.prior.tolist() == [1.0, 1.0, 2.0]
    assert model.n_dimensions == 3


def test_the_density_integrates_over_the_log_ratios_to_the_prior() -> None:
    # No data but single ratings in equal shares: the posterior of ρ is its prior.
    # Over position = (logit ρ, log-ratio), ∫ exp(log density) = ∫∫ π^1 (1-π)^1 dρ dπ
    # = B(2, 2) = 1/6 for one rating in each of two categories.
    model = DirichletMultinomial.of_counts(np.array([[1, 0], [0, 1]]))
    grid = np.linspace(-40, 40, 1601)
    position = np.stack(np.meshgrid(grid, grid, indexing="ij"), axis=-1).reshape(-1, 2)
    total = np.exp(model.log_density(position)).sum() * (grid[1] - grid[0]) ** 2
    assert total == pytest.approx(1 / 6, rel=1e-6)


def test_far_out_the_density_is_zero_and_not_nan() -> None:
    model = DirichletMultinomial.of_counts(np.array([[2, 1], [0, 3]]))
    far = np.array([[800.0, 0.0], [-800.0, 0.0], [0.0, 800.0], [0.0, -800.0]])
    assert not np.isnan(model.log_density(far)).any()
