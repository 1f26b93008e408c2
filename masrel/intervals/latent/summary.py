"""From chains of the latent-trait model to its result."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from masrel.agreement._kernel import Floats
from masrel.estimates import Distribution, Estimate, Interval, Target
from masrel.intervals.latent.density import LatentDensity
from masrel.intervals.latent.fit import LatentFit, fit_latent
from masrel.intervals.latent.kappa import grade_probabilities
from masrel.intervals.latent.predictive import predictive_checks
from masrel.intervals.latent.prior import LatentPrior
from masrel.intervals.latent.ratings import Items, LatentRatings
from masrel.intervals.latent.result import LatentChains, LatentTrait
from masrel.intervals.mcmc import quantile_error
from masrel.intervals.quantity import Quantity

__all__ = ["Question", "summarize"]

_REPLICATES = 4_000
_SHOWN = 2_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """What was asked of the model, checked."""

    ratings: LatentRatings  # the data
    items: Items  # which kappa
    target: Target  # the population it speaks of
    level: float  # level of the intervals
    # n_steps, most_steps: steps of every chain at first, and where it gives up
    n_steps: int
    most_steps: int
    keep_chains: bool  # whether the result holds the draws
    # called with the number of steps just made
    progress: Callable[[int], object] | None = field(compare=False, repr=False)
    seed: int | None  # the seed to be recorded


def summarize(
    question: Question, prior: LatentPrior, seed: int, other: LatentTrait | None
) -> LatentTrait:
    """Sample the model and put its result together."""
    known, generator = question.ratings, np.random.default_rng(seed)
    fit = fit_latent(
        LatentDensity.of(known.codes, len(known.categories), prior),
        question.items,
        generator=generator,
        n_steps=question.n_steps,
        most_steps=question.most_steps,
        progress=question.progress,
    )
    some = fit.draws(_REPLICATES)

    def part(name: str, of: Sequence[str]) -> tuple[Quantity, ...]:
        return _quantities(question, fit, name, of)

    return LatentTrait(
        kappa=_kappa(question, fit, other),
        items=part("severity", known.items),
        raters=part("bias", known.raters),
        noises=part("noise", known.raters),
        thresholds=part("thresholds", _between(known.categories)),
        shares=part("shares", ("items", "raters' biases", "raters' noise")),
        noise_spread=part("noise_spread", ("spread of raters' noises",))[0],
        grades=tuple(map(tuple, grade_probabilities(some).mean(axis=0).tolist())),
        checks=predictive_checks(known.codes, some, known.categories, generator),
        prior=prior,
        other=other,
        r_hat=float(fit.chains.r_hat.max()),
        ess=float(fit.chains.ess.min()),
        n_chains=len(fit.chains.positions),
        n_steps=fit.chains.n_steps,
        seed=question.seed,
        chains=_chains(fit) if question.keep_chains else None,
    )


def _quantities(
    question: Question, fit: LatentFit, name: str, of: Sequence[str]
) -> tuple[Quantity, ...]:
    at = fit.parts[name]
    return tuple(
        Quantity(
            name=whose,
            value=float(np.median(draws)),
            interval=_interval(question, draws),
            r_hat=float(r_hat),
            ess=float(ess),
        )
        for whose, draws, r_hat, ess in zip(
            of,
            fit.chains.values[at],
            fit.chains.r_hat[at],
            fit.chains.ess[at],
            strict=True,
        )
    )


def _interval(question: Question, draws: Floats) -> Interval:
    # of draws, (n_chains, n_kept)
    tail = 0.5 * (1.0 - question.level)
    low, high = np.quantile(draws, (tail, 1.0 - tail)).tolist()
    return Interval(
        low=low,
        high=high,
        level=question.level,
        kind="credible",
        method="ordinal latent-trait model, emcee",
        target=question.target,
        n_resamples=draws.size,
        monte_carlo_error=(
            quantile_error(draws, tail),
            quantile_error(draws, 1.0 - tail),
        ),
        seed=question.seed,
    )


def _kappa(question: Question, fit: LatentFit, other: LatentTrait | None) -> Estimate:
    draws = fit.chains.values[0]
    shown = np.sort(draws.ravel()[:: -(-draws.size // _SHOWN)])
    interval = replace(
        _interval(question, draws),
        notes=_notes(other),
        distribution=Distribution(
            values=shown,
            weights=np.full(shown.size, 1.0 / shown.size),
            continuous=False,
            words=f"posterior draws of kappa, prior {fit.density.prior.words}",
        ),
    )
    n_items, n_raters = question.ratings.codes.shape
    return Estimate(
        coefficient="fleiss_kappa",
        weights="identity",
        value=float(np.median(draws)),
        standard_error=float(draws.std()),
        interval=interval,
        observed=float(np.median(fit.agreement.observed)),
        chance=float(np.median(fit.agreement.chance)),
        n_items=n_items,
        n_raters=n_raters,
        n_categories=len(question.ratings.categories),
    )


def _notes(other: LatentTrait | None) -> tuple[str, ...]:
    if other is None or other.kappa.interval is None:
        return ()
    there = other.kappa.interval
    return (
        f"under another prior {there.low:.3f} to {there.high:.3f}: {other.prior.words}",
    )


def _between(categories: Sequence[object]) -> list[str]:
    return [f"{low} | {high}" for low, high in itertools.pairwise(categories)]


def _chains(fit: LatentFit) -> LatentChains:
    def part(name: str) -> Floats:
        return np.stack(fit.chains.values[fit.parts[name]], axis=-1)

    return LatentChains(
        kappa=fit.chains.values[0],
        severity=part("severity"),
        bias=part("bias"),
        noise=part("noise"),
        thresholds=part("thresholds"),
        shares=part("shares"),
        noise_spread=part("noise_spread"),
    )
