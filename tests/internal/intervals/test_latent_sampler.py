"""Hamiltonian proposals and the latent model's chains on laws whose answer is known."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from masrel.intervals import LatentPrior
from masrel.intervals.latent._model import LatentDensity, grade_shares
from masrel.intervals.latent._sampler import (
    Chains,
    quantile_error,
    sample_smooth,
)

Floats = NDArray[np.float64]

SAMPLER = "masrel.intervals.latent._sampler"
COVARIANCE = np.array([[1.0, 0.8, 0.0], [0.8, 1.0, 0.0], [0.0, 0.0, 0.01]])


class Normal:
    """A correlated normal on two scales."""

    bend = np.linalg.inv(COVARIANCE)

    def log_density(self, position: Floats) -> Floats:
        density: Floats = -0.5 * ((position @ self.bend) * position).sum(axis=1)
        return density

    def gradient(self, position: Floats) -> Floats:
        return -position @ self.bend


def coordinates(position: Floats) -> dict[str, Floats]:
    return {"position": position}


def drawn(seed: int) -> Chains:
    rng = np.random.default_rng(seed)
    return sample_smooth(
        Normal(), coordinates, 0.1 * rng.normal(size=(64, 3)),
        generator=rng, n_steps=300, max_steps=4_800,
    )  # fmt: skip


def misses(values: Floats, law: Callable[[float], float]) -> float:
    """How many Monte Carlo errors the worst of five quantiles is off."""
    shares = (0.025, 0.2, 0.5, 0.8, 0.975)
    return max(
        abs(float(np.quantile(values, p)) - law(p)) / quantile_error(values, p)
        for p in shares
    )


def test_quantiles_of_a_normal_are_within_their_errors_and_repeat() -> None:
    result = drawn(1)
    # 4.5 errors, 15 times: once in 10 000 runs of other seeds
    for k, variance in enumerate(np.diag(COVARIANCE)):
        values = result.values["position"][..., k]
        assert misses(values, stats.norm(scale=np.sqrt(variance)).ppf) < 4.5
    assert drawn(1).positions.tobytes() == result.positions.tobytes()


def prior_only(prior: LatentPrior) -> LatentDensity:
    """Four grades, two items, two raters, and no rating."""
    return LatentDensity.of(np.full((2, 2), -1), 4, prior)


PRIOR = LatentPrior(item_share=(2.0, 2.0), noise_fraction=(2.0, 1.5), concentration=2.0)


def test_sampling_without_data_gives_the_prior_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model = prior_only(PRIOR)

    def unknowns(position: Floats) -> dict[str, Floats]:
        traits = model.traits(position.reshape(-1, model.n_dimensions))
        grades = grade_shares(traits.thresholds)
        columns = [
            traits.item_share,
            traits.noise_variance / (traits.bias_variance + traits.noise_variance),
            traits.noise_spread,
            grades[:, 0], grades[:, 2],
            traits.severity[:, 1] / np.sqrt(traits.item_share),
            traits.bias[:, 0] / np.sqrt(traits.bias_variance),
            (np.log(traits.noise[:, 1]) - 0.5 * np.log(traits.noise_variance))
            / traits.noise_spread,
        ]  # fmt: skip
        return {"unknowns": np.column_stack(columns).reshape(*position.shape[:2], -1)}

    rng = np.random.default_rng(3)
    start = model.start() + 0.5 * rng.normal(size=(64, model.n_dimensions))
    monkeypatch.setattr(f"{SAMPLER}.MIN_ESS", 1_000.0)  # a thousand draws tell laws
    monkeypatch.setattr(f"{SAMPLER}.MAX_R_HAT", 1.05)
    result = sample_smooth(
        model, unknowns, start,
        generator=rng, n_steps=200, max_steps=8_000,
    )  # fmt: skip
    laws = [
        stats.beta(2, 2),
        stats.beta(2, 1.5),
        stats.halfnorm(scale=0.5),
        stats.beta(2, 6),
        stats.beta(2, 6),
        stats.norm(),
        stats.norm(),
        stats.norm(),
    ]
    # 4.5 errors, 40 times: once in 3700 runs of other seeds
    for k, law in enumerate(laws):
        assert misses(result.values["unknowns"][..., k], law.ppf) < 4.5
