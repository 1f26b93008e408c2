"""Kappa implied by the latent-trait model against closed forms and brute force."""

import math

import numpy as np
import pytest
from scipy import stats

from masrel.intervals.latent._implied import (
    agreement_on_items,
    agreement_on_new_items,
    grade_probabilities,
    replicate,
)
from masrel.intervals.latent._model import Traits


def one(
    rho: float,
    f: float,
    eta: float,
    tau: list[float],
    severity: tuple[float, ...] = (-1.0, 0.0, 0.3),
) -> Traits:
    """Make a single position."""
    rest = 1.0 - rho
    return Traits(
        severity=np.array([severity]),
        bias=np.zeros((1, 1)),
        noise=np.ones((1, 1)),
        thresholds=np.array([tau]),
        item_share=np.array([rho]),
        noise_spread=np.array([eta]),
        bias_variance=np.array([rest * (1 - f)]),
        noise_variance=np.array([rest * f]),
    )


CASES = [
    (0.5, 0.5, 0.3, [-1.0, 0.0, 1.0]),
    (0.9, 0.3, 0.5, [-2.0, -0.5, 0.1, 1.5]),
    (0.1, 0.9, 0.9, [-3.0, 2.0]),
    (0.7, 0.5, 0.5, [-6.0, -0.1, 5.0, 7.0]),
    (0.97, 0.9, 1.0, [0.1]),
    (0.8, 0.4, 1.9, [-1.1, 0.2, 0.4]),
]


@pytest.mark.parametrize("case", CASES)
def test_new_items_agree_with_a_fine_grid(
    case: tuple[float, float, float, list[float]],
) -> None:
    rho, f, eta, tau = case
    w = np.linspace(-8, 8, 801)
    weight = stats.norm.pdf(w) / stats.norm.pdf(w).sum()
    s = np.sqrt((1 - rho) * (1 - f + f * np.exp(2 * eta * w)))
    z = np.linspace(-8.5, 8.5, 1701)
    mass = stats.norm.pdf(z) / stats.norm.pdf(z).sum()
    away = (np.array(tau)[:, None] - math.sqrt(rho) * z)[..., None] / s
    below = stats.norm.cdf(away) @ weight  # (thresholds, z)
    p = np.diff(below, axis=0, prepend=0.0, append=1.0)
    observed, chance = (p**2).sum(axis=0) @ mass, ((p @ mass) ** 2).sum()
    result = agreement_on_new_items(one(*case))
    assert result.observed[0] == pytest.approx(observed, abs=1e-6)
    assert result.kappa[0] == pytest.approx(
        (observed - chance) / (1 - chance), abs=2e-6
    )


@pytest.mark.parametrize("case", CASES)
def test_these_items_agree_with_simulated_raters(
    case: tuple[float, float, float, list[float]],
) -> None:
    rho, f, eta, tau = case
    rng = np.random.default_rng(6)
    n, severity = 200_000, (-1.0, 0.0, 0.3)
    rest = 1 - rho
    drawn = Traits(
        severity=np.tile(severity, (n, 1)),
        bias=math.sqrt(rest * (1 - f)) * rng.normal(size=(n, 2)),
        noise=math.sqrt(rest * f) * np.exp(eta * rng.normal(size=(n, 2))),
        thresholds=np.tile(tau, (n, 1)),
        item_share=np.full(n, rho),
        noise_spread=np.full(n, eta),
        bias_variance=np.full(n, rest * (1 - f)),
        noise_variance=np.full(n, rest * f),
    )
    codes = replicate(drawn, rng)
    result = agreement_on_items(one(*case))
    # 4.5 standard errors: once in 150 000 runs of other seeds
    error = 0.5 / math.sqrt(3 * n)
    equal = float((codes[:, :, 0] == codes[:, :, 1]).mean())
    assert result.observed[0] == pytest.approx(equal, abs=4.5 * error)
    p = grade_probabilities(one(*case))[0]
    for k in range(len(tau) + 1):
        share = float((codes[:, 1] == k).mean())
        assert p[1, k] == pytest.approx(share, abs=4.5 * 0.5 / math.sqrt(2 * n))
