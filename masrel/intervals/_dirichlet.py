"""Drawn posteriors of any coefficient, for any number of raters.

Raters alike: ρ and the shares of the categories are drawn from their posterior in the
Dirichlet-multinomial model, and give the chance of any two ratings of an item.
Patterns: what the raters give an item has a Dirichlet over the patterns that were met
and over a few that the prior adds. It knows raters by their columns and takes weights.
"""

from itertools import permutations

import numpy as np

from masrel.agreement._engine import Floats, recorded_generator
from masrel.estimates import Distribution, Interval
from masrel.intervals._question import WITHOUT_END, IntervalProblem
from masrel.intervals._rho import (
    METHOD,
    Prior,
    RhoPosterior,
    nothing_to_learn,
)
from masrel.intervals.bootstrap import _distinct_features, _Resamples

OF_PATTERNS = "Dirichlet posterior of the patterns of ratings"
"""Of all intervals of patterns."""

_WORTH = 1.5  # items that the prior is worth, as that of a table of two raters

_PRIOR = f"a Dirichlet worth {_WORTH:g} items, half of it on raters who all agree"
_MAX_CATEGORIES = 100  # of which a prior makes pairs
_SHOWN = 30  # points of a density
_SWEEPS = 5  # of Gibbs: given ρ the shares soon forget where they began
_AT_ONCE = 1 << 21  # numbers drawn at once


def alike_interval(
    problem: IntervalProblem,
    prior: Prior,
    *,
    n_draws: int,
    rng: np.random.Generator | int | None,
    one_sided: bool = False,
) -> Interval:
    """Compute the credible interval of a coefficient, raters being alike."""
    generator, seed = recorded_generator(rng)
    rho, shares = _population(problem, prior, n_draws, generator)
    # two ratings of an item are one twice with probability ρ, else drawn anew
    q = problem.coded.n_categories
    pairs = np.indices((q, q)).reshape(2, -1)
    weights = (1.0 - rho) * shares[:, pairs[0]] * shares[:, pairs[1]]
    weights[:, pairs[0] == pairs[1]] += rho * shares
    values = problem.values(WITHOUT_END * (weights @ problem.features(pairs.T)))
    return _interval(problem, values, METHOD, prior.description, one_sided, seed)


def patterns_interval(
    problem: IntervalProblem,
    *,
    n_draws: int,
    rng: np.random.Generator | int | None,
    one_sided: bool = False,
) -> Interval:
    """Compute the credible interval of a coefficient from its patterns of ratings."""
    generator, seed = recorded_generator(rng)
    rows, often = _distinct_features(problem.features(problem.codes), problem.freq)
    added, worth = _prior_patterns(problem)
    rows, shapes = np.concatenate([rows, added]), np.concatenate([often, worth])
    values, size = [], max(1, _AT_ONCE // shapes.size)
    for start in range(0, n_draws, size):
        shape = min(size, n_draws - start), shapes.size
        freq = generator.standard_gamma(shapes, shape) * (WITHOUT_END / problem.n_items)
        values.append(problem.values(freq @ rows))
    drawn = np.concatenate(values)
    return _interval(problem, drawn, OF_PATTERNS, _PRIOR, one_sided, seed)


def no_posterior(problem: IntervalProblem) -> str | None:
    """Return why a coefficient has no posterior, or None."""
    if problem.entry.metric == "ordinal":
        return nothing_to_learn(problem) or "the ordinal metric depends on the ratings"
    if problem.coded.n_categories > _MAX_CATEGORIES:
        return f"there are more than {_MAX_CATEGORIES} categories"
    return nothing_to_learn(problem)


def _population(
    problem: IntervalProblem,
    prior: Prior,
    n_draws: int,
    generator: np.random.Generator,
) -> tuple[Floats, Floats]:
    """Draw ρ, (n_draws, 1), and the shares of the categories, (n_draws, q)."""
    # Given ρ, and with A = (1 - ρ)/ρ and x = A π_k, category k's product Π_j (x +
    # j)^N_kj is a sum of powers of x. Gibbs: how many of its factors give an x is a sum
    # of binomials with probabilities x / (x + j); given these, the shares are
    # Dirichlet [1].
    # [1] Escobar, M. D., West, M. (1995). Bayesian density estimation and inference
    # using mixtures. JASA, 90(430), 577-588.
    # https://doi.org/10.1080/01621459.1995.10476550
    counts = problem.item_counts()
    model = RhoPosterior.of(counts, prior)
    rho = model.draw(n_draws, generator)[:, None]
    powers = np.zeros((counts.shape[1], model.sizes.size), dtype=np.int64)
    powers[counts.any(axis=0)] = model.powers
    always, powers, depth = powers[:, 0], powers[:, 1:], np.arange(1, powers.shape[1])
    t = np.broadcast_to(always, (n_draws, len(always)))  # at least
    for _ in range(_SWEEPS):
        shares = generator.standard_gamma(prior.concentration + t)
        shares /= shares.sum(axis=1, keepdims=True)
        x = np.maximum((1.0 - rho) / rho * shares, np.finfo(float).tiny)[:, :, None]
        t = always + generator.binomial(powers, x / (x + depth)).sum(axis=2)
    return rho, shares


def _prior_patterns(problem: IntervalProblem) -> tuple[Floats, Floats]:
    """Return the features of the patterns of the prior, and what each is worth."""
    # -> (q², n_features), (q²,): half on raters who all give one category, half on one
    # of them who gives another, whichever of them it is
    q, r = problem.coded.n_categories, problem.n_raters
    alike = np.repeat(np.arange(q)[:, None], r, axis=1)
    most, one = np.array(list(permutations(range(q), 2))).T
    codes = np.repeat(alike[most], r, axis=0)  # (q (q - 1) r, r)
    codes[np.arange(len(codes)), np.tile(np.arange(r), most.size)] = np.repeat(one, r)
    of_alike, of_one = (problem.features(rows) for rows in (alike, codes))
    of_one = of_one.reshape(most.size, r, -1).mean(axis=1)
    worth = np.repeat([0.5 * _WORTH / q, 0.5 * _WORTH / most.size], [q, most.size])
    return np.concatenate([of_alike, of_one]), worth


def _interval(
    problem: IntervalProblem,
    values: Floats,
    method: str,
    prior: str,
    one_sided: bool,
    seed: int | None,
) -> Interval:
    drawn = values[np.isfinite(values)]
    tail = (1.0 - problem.level) * (1.0 if one_sided else 0.5)
    draws = _Resamples.of(drawn)
    low, high = (
        (draws.quantile(share), draws.error(share)) for share in (tail, 1.0 - tail)
    )
    if one_sided:
        high = (1.0, 0.0)
    # a density from how far apart quantiles are, between which equally many draws lie
    ends = np.quantile(drawn, np.linspace(0.0, 1.0, _SHOWN + 1))
    return Interval(
        low=low[0],
        high=high[0],
        median=draws.quantile(0.5),
        level=problem.level,
        kind="credible",
        method=f"{method}, {drawn.size} draws{', one-sided' if one_sided else ''}",
        target=problem.target,
        n_resamples=drawn.size,
        n_undefined=values.size - drawn.size,
        monte_carlo_error=(low[1], high[1]),
        seed=seed,
        is_one_sided=one_sided,
        prior=prior,
        distribution=Distribution(
            values=0.5 * (ends[:-1] + ends[1:]),
            weights=1.0 / (_SHOWN * np.maximum(np.diff(ends), np.finfo(float).tiny)),
            continuous=True,
            words=f"posterior of {problem.entry.title}, prior {prior}",
        ),
    )
