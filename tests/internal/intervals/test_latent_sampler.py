"""Hamiltonian proposals and the latent model's chains on laws whose answer is known."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import special, stats

from masrel.errors import ConvergenceError
from masrel.intervals import LatentPrior
from masrel.intervals._mcmc import Walkers, quantile_error
from masrel.intervals.latent._coordinates import grade_shares
from masrel.intervals.latent._density import LatentDensity
from masrel.intervals.latent._implied import agreement_on_items
from masrel.intervals.latent._sampler import (
    JOURNEY,
    LONGEST,
    SHORTEST,
    Chains,
    SmoothDensity,
    fit_latent,
    hamiltonian_proposal,
    sample_smooth,
)

Floats = NDArray[np.float64]

COVARIANCE = np.array([[1.0, 0.8, 0.0], [0.8, 1.0, 0.0], [0.0, 0.0, 0.01]])


class Normal:
    """A correlated normal on two scales."""

    bend = np.linalg.inv(COVARIANCE)

    def log_density(self, position: Floats) -> Floats:
        density: Floats = -0.5 * ((position @ self.bend) * position).sum(axis=1)
        return density

    def gradient(self, position: Floats) -> Floats:
        return -position @ self.bend


def coordinates(position: Floats) -> list[Floats]:
    return list(np.moveaxis(position, 2, 0))


def drawn(density: SmoothDensity, seed: int = 1, d: int = 3) -> Chains:
    rng = np.random.default_rng(seed)
    return sample_smooth(
        density, coordinates, 0.1 * rng.normal(size=(64, d)), np.eye(d),
        generator=rng, n_steps=300, max_steps=4_800,
    )  # fmt: skip


def misses(values: Floats, law: Callable[[float], float]) -> float:
    """How many Monte Carlo errors the worst of five quantiles is off."""
    shares = (0.025, 0.2, 0.5, 0.8, 0.975)
    return max(
        abs(float(np.quantile(values, p)) - law(p)) / quantile_error(values, p)
        for p in shares
    )


def test_quantiles_of_a_normal_are_within_their_errors() -> None:
    result = drawn(Normal())
    # 4.5 errors, 15 times: once in 10 000 runs of other seeds
    for values, variance in zip(result.values, np.diag(COVARIANCE), strict=True):
        assert misses(values, stats.norm(scale=np.sqrt(variance)).ppf) < 4.5
    assert (result.r_hat < 1.01).all()
    assert (result.ess >= 4000).all()


def test_a_leapfrog_back_leads_home_and_keeps_volume() -> None:
    density, step = Normal(), 0.3

    class Fixed:
        """Random numbers that are handed in."""

        def __init__(self, momentum: Floats) -> None:
            self.momentum = momentum

        def standard_normal(self, _: object) -> Floats:
            return self.momentum

        def uniform(self, size: tuple[int, int]) -> Floats:
            return np.full(size, 0.3)

    def moved(x: Floats, p: Floats) -> tuple[Floats, Floats]:
        # the way from (x, p), whose end's momentum shows by going on backwards
        propose = hamiltonian_proposal(density.gradient, np.eye(3), step)
        return propose(x[None], Fixed(p[None]))  # type: ignore[arg-type]

    x, p = np.array([0.3, -0.2, 0.05]), np.array([0.5, 1.0, -0.7])
    length, leaps = 1.15 * step * 0.27 ** (0.3**1.5), 7
    end, momentum = x.copy(), p.copy()
    for _ in range(leaps):  # Neal's eqs. 5.18 to 5.20, one by one
        momentum = momentum + 0.5 * length * density.gradient(end[None])[0]
        end = end + length * momentum
        momentum = momentum + 0.5 * length * density.gradient(end[None])[0]
    there, factor = moved(x, p)
    assert there[0] == pytest.approx(end)
    assert factor[0] == pytest.approx(0.5 * (p @ p) - 0.5 * (momentum @ momentum))
    back, factor_back = moved(end, -momentum)
    assert back[0] == pytest.approx(x)
    assert factor_back[0] == pytest.approx(-factor[0])


def law_is_missed(proposal: object) -> bool:
    """Compare long chains of a unit normal in 3 dimensions with the law."""
    rng = np.random.default_rng(8)
    unit = stats.norm

    def log_density(position: Floats) -> Floats:
        density: Floats = -0.5 * (position**2).sum(axis=1)
        return density

    walkers = Walkers(log_density, proposal, rng.normal(size=(64, 3)), rng)  # type: ignore[arg-type]
    values = walkers.run(1500)[:, 200:, 0]
    return misses(np.ascontiguousarray(values), unit.ppf) > 4.5


def test_a_proposal_whose_factor_is_left_out_or_turned_is_caught() -> None:
    honest = hamiltonian_proposal(lambda x: -x, np.eye(3), 1.1)

    def without(x: Floats, random: np.random.RandomState) -> tuple[Floats, Floats]:
        return honest(x, random)[0], np.zeros(len(x))

    def turned(x: Floats, random: np.random.RandomState) -> tuple[Floats, Floats]:
        position, factor = honest(x, random)
        return position, -factor

    assert not law_is_missed(honest)
    assert law_is_missed(without)
    assert law_is_missed(turned)


def test_wrong_slopes_cost_steps_and_not_the_law() -> None:
    # The accept step corrects whatever path a proposal took.
    assert not law_is_missed(hamiltonian_proposal(lambda x: -0.8 * x, np.eye(3), 0.4))


def prior_only(prior: LatentPrior) -> LatentDensity:
    """Four grades, two items, two raters, and no rating."""
    return LatentDensity.of(np.full((2, 2), -1), 4, prior)


PRIOR = LatentPrior(item_share=(2.0, 2.0), noise_fraction=(2.0, 1.5), concentration=2.0)


def laws(density: SmoothDensity) -> dict[str, float]:
    """Sample without data; how far each unknown is from its prior, in errors."""
    model = prior_only(PRIOR)

    def unknowns(position: Floats) -> list[Floats]:
        traits = model.traits(position.reshape(-1, model.n_dimensions))
        grades = grade_shares(traits.thresholds)
        columns = [
            traits.item_share, traits.noise_fraction, traits.noise_spread,
            grades[:, 0], grades[:, 2],
            traits.severity[:, 1] / np.sqrt(traits.item_share),
            traits.bias[:, 0] / np.sqrt(traits.bias_variance),
            (np.log(traits.noise[:, 1]) - 0.5 * np.log(traits.noise_variance))
            / traits.noise_spread,
        ]  # fmt: skip
        return [column.reshape(position.shape[:2]) for column in columns]

    rng = np.random.default_rng(3)
    start = model.start() + 0.5 * rng.normal(size=(64, model.n_dimensions))
    with pytest.MonkeyPatch.context() as patch:  # a thousand draws tell laws apart
        patch.setattr("masrel.intervals.latent._sampler.MIN_ESS", 1_000.0)
        patch.setattr("masrel.intervals.latent._sampler.MAX_R_HAT", 1.05)
        result = sample_smooth(
            density, unknowns, start, np.eye(model.n_dimensions),
            generator=rng, n_steps=200, max_steps=8_000,
        )  # fmt: skip
    priors = {
        "ρ": stats.beta(2, 2),
        "f": stats.beta(2, 1.5),
        "η": stats.halfnorm(scale=0.5),
        "share of the first grade": stats.beta(2, 6),
        "share of the third grade": stats.beta(2, 6),
        "severity": stats.norm(),
        "bias": stats.norm(),
        "noise": stats.norm(),
    }
    return {
        name: misses(values, law.ppf)
        for (name, law), values in zip(priors.items(), result.values, strict=True)
    }


def test_sampling_without_data_gives_the_prior_back() -> None:
    # 4.5 errors, 40 times: once in 3700 runs of other seeds
    assert max(laws(prior_only(PRIOR)).values()) < 4.5


class Without:
    """The density without a part of its Jacobian, and the slopes of what is left."""

    def __init__(self, first: int, last: int, part: Callable[[Floats], Floats]) -> None:
        self.honest = prior_only(PRIOR)
        self.columns = slice(first, last)
        self.part = part

    def log_density(self, position: Floats) -> Floats:
        jacobian = self.part(position[:, self.columns]).sum(axis=1)
        density: Floats = self.honest.log_density(position) - jacobian
        return density

    def gradient(self, position: Floats) -> Floats:
        x, slope = position[:, self.columns], self.honest.gradient(position)
        slope[:, self.columns] -= (self.part(x + 1e-5) - self.part(x - 1e-5)) / 2e-5
        return slope


def of_logit(x: Floats) -> Floats:
    jacobian: Floats = -np.logaddexp(0.0, -x) - np.logaddexp(0.0, x)
    return jacobian


def of_distances(x: Floats) -> Floats:
    return x


@pytest.mark.parametrize(
    ("broken", "unknown"),
    [
        (Without(6, 7, of_logit), "ρ"),
        pytest.param(
            Without(10, 12, of_distances),
            "share of the third grade",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_missing_jacobian_is_caught(broken: Without, unknown: str) -> None:
    assert laws(broken)[unknown] > 10


def importance_quantiles(
    codes: NDArray[np.int64], n: int, shares: tuple[float, ...]
) -> tuple[list[float], list[float]]:
    """Draw from the prior in natural unknowns and weigh by the likelihood."""
    rng, m = np.random.default_rng(21), 150_000
    n_items, n_raters = codes.shape
    rest, f = rng.beta(1 / 3, 1, m).clip(1e-200), rng.beta(2, 2, m)
    rho = 1 - rest
    eta = np.abs(rng.normal(0, 0.5, m))
    bias_variance, noise_variance = rest * (1 - f), rest * f
    theta = np.sqrt(rho)[:, None] * rng.normal(size=(m, n_items))
    b = np.sqrt(bias_variance)[:, None] * rng.normal(size=(m, n_raters))
    sigma = np.exp(eta[:, None] * rng.normal(size=(m, n_raters)))
    sigma *= np.sqrt(noise_variance)[:, None]
    below = rng.dirichlet(np.ones(n), m).cumsum(axis=1)[:, :-1].clip(0, 1)
    tau = special.ndtri(below)
    ends = np.hstack([np.full((m, 1), -np.inf), tau, np.full((m, 1), np.inf)])
    weight = np.ones(m)
    with np.errstate(invalid="ignore", divide="ignore"):  # far out σ is 0
        for i, r in np.ndindex(codes.shape):
            away = (ends - (theta[:, i] + b[:, r])[:, None]) / sigma[:, [r]]
            cell = special.ndtr(away)
            weight *= np.nan_to_num(cell[:, codes[i, r] + 1] - cell[:, codes[i, r]])
    traits = prior_only(LatentPrior()).traits(np.zeros((1, 12)))
    made = type(traits)(
        severity=theta, bias=b, noise=sigma, thresholds=tau, item_share=rho,
        noise_fraction=f, noise_spread=eta, bias_variance=bias_variance,
        noise_variance=noise_variance,
    )  # fmt: skip
    kappa = agreement_on_items(made).kappa

    def quantiles(values: Floats) -> list[float]:
        order = np.argsort(values)
        cumulative = weight[order].cumsum() / weight.sum()
        return np.interp(shares, cumulative, values[order]).tolist()

    return quantiles(kappa), quantiles(b[:, 0])


def test_chains_agree_with_weighted_draws_of_the_prior(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Chains good enough for this: in the tails worth 1 000 draws.
    monkeypatch.setattr("masrel.intervals.latent._sampler.MIN_ESS", 1_000)
    monkeypatch.setattr("masrel.intervals.latent._sampler.MAX_R_HAT", 1.05)
    codes = np.array([[0, 0, 1], [2, 2, 2]])
    shares = (0.025, 0.5, 0.975)
    kappa, bias = importance_quantiles(codes, 3, shares)
    fit = fit_latent(
        LatentDensity.of(codes, 3, LatentPrior()), "fixed",
        generator=np.random.default_rng(2), n_steps=250, max_steps=16_000,
        progress=None,
    )  # fmt: skip
    # Weighted draws are worth some 1 700 (errors of at most .008 and .025), the chains
    # as many: tolerances are three to four joint errors.
    assert np.quantile(fit.chains.values[0], shares) == pytest.approx(kappa, abs=0.03)
    at = fit.parts["bias"].start
    assert np.quantile(fit.chains.values[at], shares) == pytest.approx(bias, abs=0.08)


def test_walkers_repeat_byte_by_byte() -> None:
    one, two = drawn(Normal(), seed=4), drawn(Normal(), seed=4)
    assert one.positions.tobytes() == two.positions.tobytes()
    assert one.positions.tobytes() != drawn(Normal(), seed=5).positions.tobytes()


def test_far_modes_are_not_called_converged() -> None:
    class Two(Normal):
        def log_density(self, position: Floats) -> Floats:
            x = position[:, 0]
            far: Floats = np.logaddexp(-0.5 * (x - 60) ** 2, -0.5 * (x + 60) ** 2)
            return far

        def gradient(self, position: Floats) -> Floats:
            return np.sign(position) * 60 - position

    rng = np.random.default_rng(1)
    start = 60.0 * rng.choice([-1.0, 1.0], size=(64, 1)) + rng.normal(size=(64, 1))
    with pytest.raises(ConvergenceError, match=r"R-hat.*more steps are needed"):
        sample_smooth(
            Two(), coordinates, start, np.eye(1),
            generator=rng, n_steps=100, max_steps=200,
        )  # fmt: skip


def test_progress_counts_every_step_and_few_positions_are_kept() -> None:
    steps: list[int] = []

    def strange(position: Floats) -> list[Floats]:
        # never converged: each chain has a value of its own
        return [np.arange(len(position))[:, None] + 0.01 * position[:, :, 0]]

    rng = np.random.default_rng(1)
    with pytest.raises(ConvergenceError):
        sample_smooth(
            Normal(), strange, rng.normal(size=(8, 3)), np.eye(3),
            generator=rng, n_steps=500, max_steps=4000, progress=steps.append,
        )  # fmt: skip
    assert sum(steps) == 180 + 4000


def test_a_journey_is_a_quarter_of_an_orbit_on_average() -> None:
    u = (np.arange(1000) + 0.5) / 1000
    lengths = JOURNEY * LONGEST * SHORTEST ** (u**1.5)
    assert lengths.mean() == pytest.approx(np.pi / 2, abs=0.2)
