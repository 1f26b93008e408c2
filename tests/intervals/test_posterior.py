"""The sampled posterior against the exact one, and a sampler broken on purpose."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import betaln

from masrel.errors import ConvergenceError
from masrel.estimates import Interval
from masrel.intervals import mcmc, posterior
from masrel.intervals.dirichlet.model import DirichletMultinomial
from tests.intervals.data import SCALE, TABLE_V

Floats = NDArray[np.float64]

TWO = [
    ["a", "a", "b"],
    ["b", "b", "b"],
    ["a", "a", "a"],
    ["a", "b", "a"],
    ["b", "b", "b"],
]


def misses(found: Interval, ends: tuple[float, float]) -> list[float]:
    """How many Monte Carlo errors each endpoint is off."""
    assert found.monte_carlo_error is not None
    off = zip((found.low, found.high), ends, found.monte_carlo_error, strict=True)
    return [abs(end - exact) / error for end, exact, error in off]


def sampled(ratings: list[list[str]], **options: object) -> Interval:
    return posterior(
        "fleiss_kappa",
        ratings,
        target="items",
        method="emcee",
        rng=1,
        **options,  # type: ignore[arg-type]
    )


def exact_ends(ratings: list[list[str]], **options: object) -> tuple[float, float]:
    found = posterior("fleiss_kappa", ratings, target="items", **options)  # type: ignore[arg-type]
    return found.low, found.high


@pytest.fixture
def brief(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a tenth of a second of sampling pass as converged."""
    monkeypatch.setattr(mcmc, "LEAST_ESS", 500.0)
    monkeypatch.setattr(mcmc, "LARGEST_R_HAT", 1.5)


@pytest.mark.usefixtures("brief")
def test_two_categories_agree_with_the_exact_posterior() -> None:
    found = sampled(TWO, n_steps=1000)
    # 4.5 errors at either end: once in 70 000 runs of other seeds
    assert max(misses(found, exact_ends(TWO))) < 4.5
    assert found.monte_carlo_error is not None
    assert max(found.monte_carlo_error) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize(
    "prior",
    [{}, {"concentration": 1 / 6}, {"prior": "jeffreys"}],
    ids=["uniform", "a = 1/6", "Jeffreys"],
)
def test_table_v_has_its_exact_ends(prior: dict[str, object]) -> None:
    found = sampled(TABLE_V, categories=SCALE, **prior)
    ends = exact_ends(TABLE_V, categories=SCALE, **prior)
    assert (found.low, found.high) == pytest.approx(ends, abs=3e-3)
    assert max(misses(found, ends)) < 4.5


@pytest.mark.usefixtures("brief")
def test_what_was_drawn_is_said() -> None:
    found = sampled(TWO, n_steps=300)
    assert (found.kind, found.method) == (
        "credible",
        "Dirichlet-multinomial posterior, emcee",
    )
    assert (found.seed, found.unit, found.distribution) == (1, None, None)
    assert found.n_resamples == 4 * 40 * 200  # a third of the steps is burn-in


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


@pytest.mark.usefixtures("brief")
def test_seeds_repeat() -> None:
    one = sampled(TWO, n_steps=300)
    assert sampled(TWO, n_steps=300) == one


def test_no_interval_before_it_has_converged() -> None:
    with pytest.raises(
        ConvergenceError, match=r"after 30 steps.*more steps are needed"
    ):
        sampled(TABLE_V, n_steps=30, most_steps=30)
