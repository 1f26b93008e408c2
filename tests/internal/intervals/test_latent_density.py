"""The latent-trait density against a textbook in scalars."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from masrel.intervals import LatentPrior
from masrel.intervals.latent._model import LatentDensity, grade_shares

Floats = NDArray[np.float64]
PRIORS = [LatentPrior(), LatentPrior.other()]

RATINGS = np.array([[0, 1, 0], [2, 2, 3], [4, 3, -1], [2, -1, -1]])


def natural(x: Floats, like: LatentDensity) -> Floats:
    """Turn coordinates into θ, b, log σ_r, ρ, f, η and grades' shares, one by one."""
    n_items, n_raters = like.codes.shape
    items, b, w = np.split(x[: n_items + 2 * n_raters], [n_items, n_items + n_raters])
    a, c, e, anchor, *gaps = x[n_items + 2 * n_raters :].tolist()
    rho, f = 1 / (1 + math.exp(-a)), 1 / (1 + math.exp(-c))
    eta = 0.2 * math.log(1 + math.exp(e))
    unit = math.sqrt(1 - rho)

    def away(y: float, slope: float) -> float:
        # of an item with one grade, beyond the threshold next to it
        return math.sqrt(rho) * math.log(1 + math.exp(y)) + unit * slope * y

    tau = [anchor]
    for gap in gaps[: like.middle][::-1]:
        tau.insert(0, tau[0] - unit * math.exp(gap))
    for gap in gaps[like.middle :]:
        tau.append(tau[-1] + unit * math.exp(gap))
    theta = [
        sum(share * t for share, t in zip(weights, tau, strict=True))
        + (side * away(value, slope) if side else unit * value)
        if is_placed
        else math.sqrt(rho) * value
        for value, is_placed, side, slope, weights in zip(
            items,
            like.placed,
            like.beyond,
            like.inside,
            like.threshold_weights,
            strict=True,
        )
    ]
    below = stats.norm.cdf([-np.inf, *tau, np.inf])
    log_noise = 0.5 * math.log((1 - rho) * f)
    return np.array(
        [
            *theta,
            *(unit * math.sqrt(1 - f) * b),
            *(log_noise + eta * w),
            rho,
            f,
            eta,
            *np.diff(below)[:-1],
        ]
    )


def textbook(x: Floats, codes: NDArray[np.int64], n: int, prior: LatentPrior) -> float:
    """Log-density in natural unknowns, and the Jacobian by differences."""
    n_items, n_raters = codes.shape
    like = LatentDensity.of(codes, n, prior)
    unknowns = natural(x, like)
    theta, b, log_sigma = np.split(
        unknowns[: n_items + 2 * n_raters], [n_items, n_items + n_raters]
    )
    rho, f, eta, *shares = unknowns[n_items + 2 * n_raters :].tolist()
    tau = stats.norm.ppf(np.cumsum(shares))
    tau = [-np.inf, *tau.tolist(), np.inf]
    total = 0.0
    for i in range(n_items):
        for r in range(n_raters):
            if codes[i, r] >= 0:
                law = stats.norm(theta[i] + b[r], math.exp(log_sigma[r]))
                low, high = tau[codes[i, r]], tau[codes[i, r] + 1]
                if low > law.mean():  # from the other side, for its digits
                    total += math.log(law.sf(low) - law.sf(high))
                else:
                    total += math.log(law.cdf(high) - law.cdf(low))
    total += stats.norm(0, math.sqrt(rho)).logpdf(theta).sum()
    total += stats.norm(0, math.sqrt((1 - rho) * (1 - f))).logpdf(b).sum()
    total += stats.norm(0.5 * math.log((1 - rho) * f), eta).logpdf(log_sigma).sum()
    total += stats.beta(*prior.item_share).logpdf(rho)
    total += stats.beta(*prior.noise_fraction).logpdf(f)
    total += stats.halfnorm(scale=prior.noise_spread).logpdf(eta)
    grades = np.array([*shares, 1 - sum(shares)])
    total += stats.dirichlet(np.full(n, prior.concentration)).logpdf(grades)
    slopes = [
        (natural(x + h, like) - natural(x - h, like)) / 2e-6
        for h in 1e-6 * np.eye(x.size)
    ]
    return float(total + np.linalg.slogdet(np.array(slopes))[1])


def positions(density: LatentDensity, n: int) -> Floats:
    rng = np.random.default_rng(4)
    scatter: Floats = 0.5 * rng.normal(size=(n, density.n_dimensions))
    return density.start() + scatter


@pytest.mark.parametrize("prior", PRIORS)
@pytest.mark.parametrize("n_categories", [3, 5, 6])
def test_density_is_the_textbook_one(prior: LatentPrior, n_categories: int) -> None:
    codes = np.minimum(RATINGS, n_categories - 1)  # of 3, items have only the last
    density = LatentDensity.of(codes, n_categories, prior)
    x = positions(density, 8)
    theirs = [textbook(row, codes, n_categories, prior) for row in x]
    off = density.log_density(x) - theirs
    assert np.ptp(off) < 1e-6  # one constant; the numerical Jacobian is that good


@pytest.mark.parametrize("prior", PRIORS)
@pytest.mark.parametrize("n_categories", [2, 3, 6])
def test_slopes_are_those_of_the_density(prior: LatentPrior, n_categories: int) -> None:
    codes = np.minimum(RATINGS, n_categories - 1)
    density = LatentDensity.of(codes, n_categories, prior)
    x = positions(density, 10)
    for k, h in enumerate(1e-5 * np.eye(density.n_dimensions)):
        numerical = (density.log_density(x + h) - density.log_density(x - h)) / 2e-5
        assert density.gradient(x)[:, k] == pytest.approx(numerical, rel=1e-6, abs=1e-6)


def test_far_out_the_density_is_zero_and_not_nan() -> None:
    density = LatentDensity.of(RATINGS, 5, LatentPrior())
    far = np.vstack([s * 800.0 * np.eye(density.n_dimensions) for s in (1, -1)])
    assert not np.isnan(density.log_density(far)).any()
    assert np.isfinite(density.gradient(far)).all()


def test_shares_of_far_grades_keep_their_digits() -> None:
    result = grade_shares(np.array([[-9.0, 0.0, 9.0, 9.5]]))[0]
    exact = [
        stats.norm.cdf(-9),
        0.5,
        0.5,
        stats.norm.sf(9) - stats.norm.sf(9.5),
        stats.norm.sf(9.5),
    ]
    assert result == pytest.approx(exact, rel=1e-12)
