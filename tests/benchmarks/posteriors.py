"""The posterior of ρ: quadrature, emcee at several lengths, importance sampling.

Part of ``python -m docs.make.benchmarks.intervals``. The truth is another integral, by
panels of Gauss-Legendre.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from masrel.intervals import posterior
from masrel.intervals._rho import DEFAULT_PRIOR, RhoPosterior
from tests.benchmarks.bootstrap import Codes, Point, Race, counted, made, measured
from tests.benchmarks.sidebyside import Timing, side_by_side
from tests.intervals.gauss_legendre import ByPanels

Floats = NDArray[np.float64]
TAILS = (0.025, 0.975)
ESS = 2000.0
INTERVAL, QUADRATURE = "posterior()", "its quadrature"
STRETCH, EVOLUTION = "emcee, as it comes", "emcee, differential evolution"
# of emcee's default move as many walkers as its pages take; of the other, as many as
# cost next to nothing more, because a step costs emcee more than its walkers do
WALKERS = {STRETCH: 32, EVOLUTION: 80}
STUDIES = ((4, 8, 4), (100, 5, 4), (1000, 5, 4))


def parts(position: Floats) -> tuple[Floats, Floats, Floats]:
    """Return ρ, 1 - ρ and π at unbounded positions."""
    # position (n, n_dimensions) -> ρ and 1 - ρ, both (n,), and π, (n, n_parts)
    rho, rest = expit(position[:, 0]), expit(-position[:, 0])
    ratios = np.column_stack([position[:, 1:], np.zeros(len(position))])
    ratios = np.exp(ratios - ratios.max(axis=1, keepdims=True))
    return rho, rest, ratios / ratios.sum(axis=1, keepdims=True)


def log_likelihood(
    model: RhoPosterior, rho: Floats, rest: Floats, pi: Floats
) -> Floats:
    """Return the log-likelihood, constants left out."""
    # With A = (1 - ρ)/ρ every factor A π_k + j and A + j, times ρ, is (1 - ρ) π_k +
    # j ρ and 1 - ρ + j ρ; numerator and denominator have as many of them.
    # rho, rest (n,), pi (n, n_parts) -> (n,)
    part, depth = np.nonzero(model.powers)
    numerator = rest[:, None] * pi[:, part] + rho[:, None] * depth
    denominator = rest[:, None] + rho[:, None] * np.arange(model.sizes.size)
    log = np.log(numerator) @ model.powers[part, depth]
    return np.asarray(log - np.log(denominator) @ model.sizes)


def log_density(model: RhoPosterior, position: Floats) -> Floats:
    """Return the log posterior density of unbounded positions."""
    # position (n, n_dimensions) -> (n,)
    rho, rest, pi = parts(position)
    with np.errstate(divide="ignore", invalid="ignore"):  # far out a part is 0
        # uniform, times the logit's Jacobian ρ (1 - ρ)
        of_rho = np.log(rho) + np.log(rest)
        # Dirichlet density Π π_k^(a_k - 1), times the log-ratios' Jacobian Π π_k
        of_pi = np.log(pi) @ model.of_shares
        density = log_likelihood(model, rho, rest, pi) + of_rho + of_pi
    return np.where(np.isfinite(density), density, -np.inf)


def chains(
    way: str, model: RhoPosterior, n_steps: int, seed: int
) -> NDArray[np.float64]:
    """ρ by emcee, (n_steps, walkers): vectorized, on collapsed counts."""
    import emcee

    rng = np.random.default_rng(seed)
    start = rng.normal(scale=1.5, size=(WALKERS[way], model.of_shares.size))
    legacy = np.random.RandomState(seed).get_state()
    moves = None
    if way == EVOLUTION:
        moves = [(emcee.moves.DEMove(), 0.9), (emcee.moves.DEMove(gamma0=1.0), 0.1)]
    sampler = emcee.EnsembleSampler(
        *start.shape, partial(log_density, model), moves=moves, vectorize=True
    )
    sampler.run_mcmc(emcee.State(start, random_state=legacy), n_steps)
    logit = sampler.get_chain()[..., 0]
    return np.asarray(1.0 / (1.0 + np.exp(-logit)))


def emcee_ends(
    way: str, model: RhoPosterior, n_steps: int, seed: int
) -> tuple[float, ...]:
    """The ends, the first third of the chains left out."""
    kept = chains(way, model, n_steps, seed)[n_steps // 3 :]
    return tuple(np.quantile(kept, TAILS).tolist())


def steps_for(way: str, model: RhoPosterior) -> int:
    """How many steps ESS takes by the autocorrelation time, and half of it first."""
    from emcee.autocorr import integrated_time

    long = chains(way, model, 9000, 1)[3000:]
    (tau,) = integrated_time(long[..., None], quiet=True)
    return math.ceil(1.5 * ESS * float(tau) / WALKERS[way])


def importance_ends(model: RhoPosterior, size: int, seed: int) -> tuple[float, ...]:
    """The ends, by scrambled Sobol points of a multivariate t with five degrees."""
    from scipy.optimize import minimize
    from scipy.special import gammaincinv, ndtri
    from scipy.stats import qmc

    d, df = model.of_shares.size, 5.0

    def minus(position: NDArray[np.float64]) -> float:
        return -float(log_density(model, position[None])[0])

    found = minimize(minus, np.zeros(d), method="BFGS")
    root = np.linalg.cholesky(_inverse_hessian(model, found.x))
    # A t is a normal over the root of a chi-square: one more dimension.
    points = qmc.Sobol(d + 1, rng=seed).random(size).clip(1e-15, 1.0 - 1e-15)
    normal = ndtri(points[:, :d])
    chi = 2.0 * gammaincinv(0.5 * df, points[:, d])
    spread = normal * np.sqrt(df / chi)[:, None]
    log_t = -0.5 * (df + d) * np.log1p((spread**2).sum(axis=1) / df)
    position = found.x + spread @ root.T
    log = log_density(model, position) - log_t
    weights = np.exp(log - log.max())
    order = np.argsort(position[:, 0])
    upto = np.cumsum(weights[order])
    ends = np.interp(
        TAILS, (upto - 0.5 * weights[order]) / upto[-1], position[order, 0]
    )
    return tuple((1.0 / (1.0 + np.exp(-ends))).tolist())


def _inverse_hessian(
    model: RhoPosterior, mode: NDArray[np.float64], step: float = 1e-3
) -> NDArray[np.float64]:
    # central differences of the log-density, all at once
    d = mode.size
    unit = step * np.eye(d)
    at = [mode + a * unit[i] + b * unit[j] for i in range(d) for j in range(d)
          for a in (1, -1) for b in (1, -1)]  # fmt: skip
    value = log_density(model, np.array(at)).reshape(d, d, 2, 2)
    hessian = (value[..., 0, 0] - value[..., 0, 1] - value[..., 1, 0]
               + value[..., 1, 1]) / (4 * step**2)  # fmt: skip
    return np.asarray(np.linalg.inv(-hessian))


@dataclass(frozen=True, slots=True, kw_only=True)
class Posterior:
    """One study: errors against seconds; times turn by turn, errors beside them."""

    race: Race
    times: dict[str, Timing]
    errors: dict[str, float]
    n_steps: dict[str, int]


def posteriors(quick: bool) -> list[Posterior]:
    """All of it for three sizes."""
    return [_study(*shape, quick=quick) for shape in STUDIES[: 1 if quick else None]]


def _study(n: int, r: int, q: int, *, quick: bool) -> Posterior:
    codes = made(n, r, q)
    counts = counted(codes, q)
    model = RhoPosterior.of(counts, DEFAULT_PRIOR)
    panels = ByPanels(counts.tolist())
    truth = (panels.quantile(TAILS[0]), panels.quantile(TAILS[1]))
    points = _points(codes, q, model, truth, quick)
    n_steps = {way: steps_for(way, model) for way in WALKERS}
    works: dict[str, Callable[[], object]] = {
        INTERVAL: partial(
            posterior, "fleiss_kappa", codes, target="items", categories=range(q)
        ),
        QUADRATURE: lambda: RhoPosterior.of(counts, DEFAULT_PRIOR),
    }
    errors = {INTERVAL: points[0].error}
    for way, size in n_steps.items():
        works[way] = partial(emcee_ends, way, model, size, 1)
        work = partial(emcee_ends, way, model, size)
        errors[way] = measured(way, size, 4 if quick else 16, work, truth).error
    times = side_by_side(works, turns=3 if quick else 11, clock=time.process_time)
    print(n, n_steps, {k: (t.median, t.spread) for k, t in times.items()}, flush=True)
    name = f"{n:,} × {r}, {q} categories"
    return Posterior(
        race=Race(name=name, points=points, floor=None),
        times=times,
        errors=errors,
        n_steps=n_steps,
    )


def _points(
    codes: Codes,
    q: int,
    model: RhoPosterior,
    truth: tuple[float, float],
    quick: bool,
) -> list[Point]:
    def exact(_: int) -> tuple[float, float]:
        found = posterior("fleiss_kappa", codes, target="items", categories=range(q))
        return found.low, found.high

    points = [measured("exact", 0, 5, exact, truth)]
    for size in (150, 500) if quick else (150, 500, 1500, 5000, 15_000):
        seeds = 12 if size <= 1500 else 4
        for way in WALKERS:
            work = partial(emcee_ends, way, model, size)
            points.append(measured(way, size, seeds, work, truth))
    for power in (10, 13) if quick else (10, 12, 14, 16):
        work = partial(importance_ends, model, 1 << power)
        points.append(measured("importance sampling", 1 << power, 12, work, truth))
    return points
