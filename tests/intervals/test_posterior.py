"""The sampled posterior against quadrature, and a sampler broken on purpose."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import betaln

from masrel.errors import (
    ConvergenceError,
    ParameterError,
    UndefinedStatisticWarning,
)
from masrel.estimates import Interval
from masrel.intervals import posterior
from masrel.intervals.dirichlet import DirichletMultinomial
from tests.intervals.data import SCALE, TABLE_V

Floats = NDArray[np.float64]

TWO = [
    ["a", "a", "b"],
    ["b", "b", "b"],
    ["a", "a", "a"],
    ["a", "b", "a"],
    ["b", "b", "b"],
]


def quadrature_ends() -> tuple[float, float]:
    """Integrate the posterior of `TWO` on a grid: beta-binomial, ρ and π uniform."""
    n_a = np.array([2, 0, 3, 2, 0])
    x, w = np.polynomial.legendre.leggauss(400)
    rho, share = 0.5 * (x + 1.0), 0.5 * (x + 1.0)
    mass = (1.0 - rho) / rho
    a, b = mass[:, None] * share, mass[:, None] * (1.0 - share)
    log = sum(betaln(a + n, b + 3 - n) - betaln(a, b) for n in n_a)
    density = np.exp(log - log.max()) @ w * w
    cumulative = np.cumsum(density) / density.sum()
    low, high = np.interp(
        [0.025, 0.975], cumulative - 0.5 * density / density.sum(), rho
    )
    return float(low), float(high)


def misses(found: Interval, ends: tuple[float, float]) -> list[float]:
    """How many Monte Carlo errors each endpoint is off."""
    assert found.monte_carlo_error is not None
    off = zip((found.low, found.high), ends, found.monte_carlo_error, strict=True)
    return [abs(end - exact) / error for end, exact, error in off]


def test_two_categories_agree_with_quadrature() -> None:
    found = posterior("fleiss_kappa", TWO, target="items", method="emcee", rng=1)
    # 4.5 errors at either end: once in 70 000 runs of other seeds
    assert max(misses(found, quadrature_ends())) < 4.5
    assert found.monte_carlo_error is not None
    assert max(found.monte_carlo_error) < 0.005


def test_table_v_on_the_whole_scale_has_its_exact_ends() -> None:
    # Ends of the exact posterior, by quadrature of its polynomial form.
    found = posterior(
        "fleiss_kappa",
        TABLE_V,
        target="items",
        categories=SCALE,
        method="emcee",
        rng=1,
    )
    assert max(misses(found, (0.36964, 0.87373))) < 4.5
    assert (found.kind, found.method) == (
        "credible",
        "Dirichlet-multinomial posterior, emcee",
    )
    assert (found.seed, found.unit) == (1, None)
    assert found.n_resamples is not None


def test_a_missing_part_of_the_jacobian_is_seen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def without(self: DirichletMultinomial, position: Floats) -> Floats:
        rho, rest, pi = self.parts(position)
        density = self.log_likelihood(rho, rest, pi) + np.log(pi) @ self.prior
        return density + np.log(rho)  # and no log(1 - ρ)

    monkeypatch.setattr(DirichletMultinomial, "log_density", without)
    found = posterior("fleiss_kappa", TWO, target="items", method="emcee", rng=1)
    assert max(misses(found, quadrature_ends())) > 10


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


def test_seeds_repeat() -> None:
    one = posterior("fleiss_kappa", TWO, target="items", method="emcee", rng=3)
    two = posterior("fleiss_kappa", TWO, target="items", method="emcee", rng=3)
    assert two == one


def test_no_interval_before_it_has_converged() -> None:
    with pytest.raises(
        ConvergenceError, match=r"after 30 steps.*more steps are needed"
    ):
        posterior(
            "fleiss_kappa",
            TABLE_V,
            target="items",
            method="emcee",
            n_steps=30,
            most_steps=30,
        )


@pytest.mark.parametrize(
    ("ratings", "reason"),
    [
        ([["a", None], [None, "b"]], "two raters"),
        ([["a", "a"], ["a", "a"]], "one category is declared"),
    ],
)
def test_where_the_prior_alone_would_speak_it_is_undefined(
    ratings: list[list[str | None]], reason: str
) -> None:
    with pytest.warns(UndefinedStatisticWarning):
        found = posterior("fleiss_kappa", ratings, target="items", rng=1)
    assert math.isnan(found.low)
    assert reason in (found.reason or "")


@pytest.mark.parametrize(
    ("coefficient", "target", "said"),
    [
        ("cohen_kappa", "items", "speaks of fleiss_kappa"),
        ("fleiss_kappa", "raters", 'got "raters"'),
        ("fleiss_kappa", "both", 'got "both"'),
    ],
)
def test_what_the_model_does_not_answer_is_refused(
    coefficient: str, target: str, said: str
) -> None:
    with pytest.raises(ParameterError, match=said):
        posterior(coefficient, [["a", "b"], ["a", "a"]], target=target)  # type: ignore[arg-type]
