"""The interval of ρ in the Dirichlet-multinomial model, integrated or sampled."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._counts import item_counts
from masrel.estimates import Interval
from masrel.intervals._problem import IntervalProblem
from masrel.intervals._seeds import recorded_generator
from masrel.intervals.dirichlet.model import DirichletMultinomial
from masrel.intervals.dirichlet.prior import Prior
from masrel.intervals.dirichlet.rho import ExactPosterior, prior_notes

__all__ = ["rho_interval"]


def rho_interval(
    problem: IntervalProblem,
    prior: Prior,
    *,
    sampled: bool,
    n_steps: int,
    most_steps: int,
    rng: np.random.Generator | int | None,
) -> Interval:
    """Compute the central credible interval of ρ."""
    method = f"Dirichlet-multinomial posterior, {'emcee' if sampled else 'exact'}"
    counts = item_counts(problem.coded)
    reason = _nothing_to_learn(counts)
    if reason is not None:
        undefined = problem.undefined(reason, method=method, unit=None)
        return dataclasses.replace(undefined, kind="credible")
    if sampled:
        found = _sampled(problem, counts, prior, method, n_steps, most_steps, rng)
    else:
        found = _integrated(problem, counts, prior, method)
    notes = prior_notes(counts, prior, problem.level, found.low, found.high)
    return dataclasses.replace(found, notes=notes)


def _nothing_to_learn(counts: NDArray[np.int64]) -> str | None:
    # shape of counts: (n_items, n_categories)
    if not (counts.sum(axis=1) >= 2).any():
        return "no item has ratings of two raters"
    if counts.shape[1] < 2:
        return "one category is declared"
    return None


def _integrated(
    problem: IntervalProblem, counts: NDArray[np.int64], prior: Prior, method: str
) -> Interval:
    found = ExactPosterior.of(counts, prior, problem.level)
    return Interval(
        low=found.low,
        high=found.high,
        level=problem.level,
        kind="credible",
        method=method,
        target=problem.target,
        distribution=found.distribution(f"posterior of ρ, prior {prior.words}"),
    )


def _sampled(
    problem: IntervalProblem,
    counts: NDArray[np.int64],
    prior: Prior,
    method: str,
    n_steps: int,
    most_steps: int,
    rng: np.random.Generator | int | None,
) -> Interval:
    # Imported here: the quadrature loads no sampler.
    from masrel.intervals.mcmc import sample

    generator, seed = recorded_generator(rng)
    model = DirichletMultinomial.of_counts(
        counts, concentration=prior.concentration, shape=prior.shape
    )
    draws = sample(
        model.log_density,
        model.n_dimensions,
        lambda position: model.parts(position)[0],
        generator=generator,
        n_steps=n_steps,
        most_steps=most_steps,
    )
    tail = 0.5 * (1.0 - problem.level)
    return Interval(
        low=draws.quantile(tail),
        high=draws.quantile(1.0 - tail),
        level=problem.level,
        kind="credible",
        method=method,
        target=problem.target,
        n_resamples=int(draws.values.size),
        monte_carlo_error=(
            draws.quantile_error(tail),
            draws.quantile_error(1.0 - tail),
        ),
        seed=seed,
    )
