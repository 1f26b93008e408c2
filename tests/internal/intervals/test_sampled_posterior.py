"""The sampled posterior against the exact one, and a sampler broken on purpose."""

import numpy as np
import pytest
from numpy.typing import NDArray

from masrel.errors import ConvergenceError
from masrel.estimates import Interval
from masrel.intervals import _mcmc, posterior
from tests.intervals.data import SCALE, TABLE_V

Floats = NDArray[np.float64]

TWO = [
    ["a", "a", "b"],
    ["b", "b", "b"],
    ["a", "a", "a"],
    ["a", "b", "a"],
    ["b", "b", "b"],
]


def misses(result: Interval, ends: tuple[float, float]) -> list[float]:
    """How many Monte Carlo errors each endpoint is off."""
    assert result.monte_carlo_error is not None
    off = zip((result.low, result.high), ends, result.monte_carlo_error, strict=True)
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
    result = posterior("fleiss_kappa", ratings, target="items", **options)  # type: ignore[arg-type]
    return result.low, result.high


@pytest.fixture
def brief(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a tenth of a second of sampling pass as converged."""
    monkeypatch.setattr(_mcmc, "MIN_ESS", 500.0)
    monkeypatch.setattr(_mcmc, "MAX_R_HAT", 1.5)


@pytest.mark.usefixtures("brief")
def test_two_categories_agree_with_the_exact_posterior() -> None:
    result = sampled(TWO, n_steps=1000)
    # 4.5 errors at either end: once in 70 000 runs of other seeds
    assert max(misses(result, exact_ends(TWO))) < 4.5
    assert result.monte_carlo_error is not None
    assert max(result.monte_carlo_error) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize(
    "prior",
    [{}, {"concentration": 1 / 6}, {"prior": "jeffreys"}],
    ids=["uniform", "a = 1/6", "Jeffreys"],
)
def test_table_v_has_its_exact_ends(prior: dict[str, object]) -> None:
    result = sampled(TABLE_V, categories=SCALE, **prior)
    ends = exact_ends(TABLE_V, categories=SCALE, **prior)
    assert (result.low, result.high) == pytest.approx(ends, abs=3e-3)
    assert max(misses(result, ends)) < 4.5


@pytest.mark.usefixtures("brief")
def test_what_was_drawn_is_said() -> None:
    result = sampled(TWO, n_steps=300)
    assert (result.kind, result.method) == (
        "credible",
        "Dirichlet-multinomial posterior, emcee",
    )
    assert (result.seed, result.unit, result.distribution) == (1, None, None)
    assert result.n_resamples == 4 * 40 * 200  # a third of the steps is burn-in


@pytest.mark.usefixtures("brief")
def test_seeds_repeat() -> None:
    one = sampled(TWO, n_steps=300)
    assert sampled(TWO, n_steps=300) == one


def test_no_interval_before_it_has_converged() -> None:
    with pytest.raises(
        ConvergenceError, match=r"after 30 steps.*more steps are needed"
    ):
        sampled(TABLE_V, n_steps=30, max_steps=30)
